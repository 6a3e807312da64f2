//! Reads the log of a run: the values of every number, by event, field, supervision and seed.

use serde_json::Value;
use std::collections::BTreeMap;

/// The keys that describe the subject of a line.
const KEYS: [&str; 4] = ["event", "supervision", "seed", "step"];

/// The trainings in the order of the log: supervision and seed.
pub(crate) type Training = (String, u64);

/// Values by number of the update.
pub(crate) type Series = Vec<(f64, f64)>;

/// Every number of the log that was recorded more than once for at least one training.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LogSeries {
    /// By event and field, in the order of their first lines in the log.
    pub(crate) fields: Vec<((String, String), BTreeMap<Training, Series>)>,
}

impl LogSeries {
    /// Reads lines of JSON with `event`, `supervision`, `seed` and `step`. Other lines are skipped.
    pub(crate) fn read(log: &str) -> Self {
        let mut found = Self::default();
        let lines = log
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok());
        for line in lines {
            found.add(&line);
        }
        // A number that was recorded once per training, such as its duration, has no curve.
        found
            .fields
            .retain(|(_, trainings)| trainings.values().any(|series| series.len() > 1));
        found
    }

    fn add(&mut self, line: &Value) {
        let (Some(object), Some(event), Some(step)) = (
            line.as_object(),
            line["event"].as_str(),
            line["step"].as_f64(),
        ) else {
            return;
        };
        let training = (
            line["supervision"].as_str().unwrap_or_default().to_owned(),
            line["seed"].as_u64().unwrap_or_default(),
        );
        for (field, value) in object
            .iter()
            .filter(|(field, _)| !KEYS.contains(&field.as_str()))
        {
            let Some(value) = value.as_f64() else {
                continue;
            };
            let series = self
                .field(event, field)
                .entry(training.clone())
                .or_default();
            // A resumed run has logged some updates twice. Then the later line counts.
            while series.last().is_some_and(|&(former, _)| former >= step) {
                series.pop();
            }
            series.push((step, value));
        }
    }

    fn field(&mut self, event: &str, field: &str) -> &mut BTreeMap<Training, Series> {
        let is_it = |((own_event, own_field), _): &((String, String), _)| {
            own_event == event && own_field == field
        };
        let idx = self.fields.iter().position(is_it).unwrap_or_else(|| {
            self.fields
                .push(((event.to_owned(), field.to_owned()), BTreeMap::new()));
            self.fields.len() - 1
        });
        &mut self.fields[idx].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_becomes_a_series_and_a_resumed_log_counts_each_update_once() {
        let log = "{\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":1,\"loss\":3.0,\"note\":\"x\"}\n\
                   {\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":2,\"loss\":2.0}\n\
                   {\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":2,\"loss\":2.5,\"of_a_later_version\":1}\n\
                   {\"event\":\"end\",\"supervision\":\"a\",\"seed\":0,\"step\":2,\"seconds\":9}\nnot json\n";
        let found = LogSeries::read(log);
        let names: Vec<&str> = found
            .fields
            .iter()
            .map(|((_, field), _)| field.as_str())
            .collect();
        assert_eq!(names, ["loss"]);
        assert_eq!(
            found.fields[0].1[&("a".to_owned(), 0)],
            [(1.0, 3.0), (2.0, 2.5)]
        );
        assert_eq!(LogSeries::read("[1]\n3\n"), LogSeries::default());
    }
}

//! Reads the name of a metric in a config, and checks it against the list of metrics.

use partprobe_eval::{METRICS, Metric};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A metric that a config names. Configs write `gtc-miou` for the metric `gtc_miou`. Both are accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MetricName(Metric);

impl MetricName {
    /// The metric of the list.
    #[must_use]
    pub(crate) fn metric(self) -> Metric {
        self.0
    }
}

fn in_config(metric: &Metric) -> String {
    metric.name.replace('_', "-")
}

impl<'de> Deserialize<'de> for MetricName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let unknown = || {
            let known: Vec<String> = METRICS
                .iter()
                .map(|metric| format!("`{}`", in_config(metric)))
                .collect();
            de::Error::custom(format!(
                "unknown variant `{name}`, expected one of {}",
                known.join(", ")
            ))
        };

        Metric::named(&name.replace('-', "_"))
            .map(Self)
            .ok_or_else(unknown)
    }
}

impl Serialize for MetricName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&in_config(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_of_the_list_can_be_named() {
        for metric in METRICS {
            let text = serde_json::to_string(&MetricName(*metric)).unwrap();
            assert!(!text.contains('_'), "{text}");
            for spelled in [text, serde_json::to_string(metric).unwrap()] {
                let read: MetricName = serde_json::from_str(&spelled).unwrap();
                assert_eq!(read.metric(), *metric);
            }
        }
        let error = serde_json::from_str::<MetricName>("\"iou\"").unwrap_err();
        assert!(
            error.to_string().contains("`iou`, expected one of `miou`"),
            "{error}"
        );
    }
}

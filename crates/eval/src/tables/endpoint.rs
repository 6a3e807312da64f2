//! Names one number of the tables that decides a comparison.

use crate::metric::Metric;
use crate::metrics::METRICS;
use std::fmt;

/// A number by which two supervisions are compared: a metric under a reference and a clusterer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// The label source that clusters are scored against.
    pub reference: String,
    /// The clusterer, or `None` for the first one of the run.
    pub clusterer: Option<String>,
    /// The metric.
    pub metric: Metric,
}

/// The text does not name an endpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// It has another form.
    #[error(
        "`{0}` is not an endpoint; write `reference.metric` or `reference@clusterer.metric`, for example `step-parts.miou`"
    )]
    Form(String),
    /// There is no such metric.
    #[error(
        "`{text}` ends with `{metric}`, which is not a metric; the metrics are {}",
        Metric::known_names()
    )]
    Metric {
        /// The text.
        text: String,
        /// The metric in it.
        metric: String,
    },
}

impl Endpoint {
    /// Reads `reference.metric` or `reference@clusterer.metric`.
    ///
    /// # Errors
    /// If it has another form, or the metric does not exist.
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let form = || EndpointError::Form(text.to_owned());
        let (target, metric) = text.trim().rsplit_once('.').ok_or_else(form)?;
        let (reference, clusterer) = match target.split_once('@') {
            Some((reference, clusterer)) => (reference, Some(clusterer)),
            None => (target, None),
        };
        if reference.is_empty() || clusterer.is_some_and(str::is_empty) {
            return Err(form());
        }
        let known = METRICS.iter().find(|known| known.name == metric);
        Ok(Self {
            reference: reference.to_owned(),
            clusterer: clusterer.map(str::to_owned),
            metric: *known.ok_or_else(|| EndpointError::Metric {
                text: text.to_owned(),
                metric: metric.to_owned(),
            })?,
        })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reference)?;
        if let Some(clusterer) = &self.clusterer {
            write!(f, "@{clusterer}")?;
        }
        write!(f, ".{}", self.metric.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_a_reference_a_clusterer_and_a_metric() {
        for text in [
            "step-parts.miou",
            "labels.v2.accuracy",
            "a@mean-shift+k-means.miou",
        ] {
            assert_eq!(Endpoint::parse(text).unwrap().to_string(), text);
        }
        for (text, expected) in [
            ("miou", "is not an endpoint"),
            (".miou", "is not an endpoint"),
            ("a@.miou", "is not an endpoint"),
            ("a.iou", "ends with `iou`, which is not a metric"),
        ] {
            let error = Endpoint::parse(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}

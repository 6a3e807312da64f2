//! The metrics, one file each, and the list that score files, tables and `[expect]` follow.
//!
//! To add a metric, write one file with a constant [`Metric`], and add the constant to [`METRICS`].

mod accuracy;
mod gtc_accuracy;
mod gtc_miou;
mod miou;

pub use accuracy::ACCURACY;
pub use gtc_accuracy::GTC_ACCURACY;
pub use gtc_miou::GTC_MIOU;
pub use miou::MIOU;

use crate::metric::Metric;

/// Every metric, in the order of table columns and of the numbers in a line of `scores.jsonl`.
pub const METRICS: &[Metric] = &[MIOU, ACCURACY, GTC_ACCURACY, GTC_MIOU];

//! Gives the false alarms that real trainings have shown. `just study false-alarms` measures them.

use anyhow::{Context, Result};
use partprobe_eval::FalseAlarms;

const MEASURED: &str = include_str!("../verbs/verdict/false_alarms.json");

/// The false alarms of trainings that differ only in their seeds.
///
/// # Errors
/// If the file that is built in has another form.
pub(crate) fn measured_false_alarms() -> Result<FalseAlarms> {
    serde_json::from_str(MEASURED).context("the false alarms that are built in")
}

/// A sentence about the rate at which a difference is found if there is none.
pub(crate) fn error_rate(measured: &FalseAlarms) -> String {
    let FalseAlarms {
        n_seeds,
        n_verdicts,
        n_false_verdicts,
        n_pairs,
        n_false_pairs,
        ..
    } = measured;
    format!(
        "How often is a difference found if there is none? Between {n_seeds} trainings that differ only in their seeds, \
         {n_false_pairs} of {n_pairs} tests of two single trainings found one, and so did {n_false_verdicts} of {n_verdicts} verdicts \
         (docs/studies/false-alarms.md)."
    )
}

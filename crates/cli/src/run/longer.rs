//! Says whether a training may be made longer: two configs go in, and a refusal with its reason comes out.
//!
//! A longer training gives the bytes of one that had its length from the beginning. This holds only if the schedule gives
//! all former updates the same learning rate.

use super::training_job::train_settings;
use crate::config::{Config, Difference, listed};
use crate::usage::UsageError;
use anyhow::{Result, ensure};

/// Whether a key says how long a training is, or how its learning rate changes.
pub(super) fn is_of_length(key: &str) -> bool {
    key == "train.steps" || key.starts_with("optim.schedule.")
}

/// Refuses a new length or schedule that would have changed an update of the former one.
///
/// # Errors
/// If it would; the message names the keys, the update, and what to do.
pub(super) fn ensure_longer(
    stored: &Config,
    config: &Config,
    differing: &[Difference],
) -> Result<()> {
    let (before, after) = (&stored.train, &config.train);
    ensure!(
        before.epochs == 0 && before.steps <= after.steps,
        UsageError(format!(
            "{}; a training can only be made longer, and only by train.steps",
            listed(differing)
        ))
    );
    let (old, new) = (train_settings(stored, 0, 0), train_settings(config, 0, 0));
    if let Some(step) = old.first_other_rate(&new, before.steps) {
        return Err(UsageError(format!(
            "{}; this schedule would have given update {} another learning rate, because it spans all of train.steps. Only \
             `constant` and `trapezoid` can be made longer. Train again from these weights with --init, in another --out",
            listed(differing),
            step + 1
        ))
        .into());
    }
    Ok(())
}

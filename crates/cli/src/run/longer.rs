//! Checks whether a training may be made longer: two configs go in, and possibly a refusal with its reason comes out.
//!
//! A longer training must give the same bytes as a training that had this length from the beginning. This is only so if the
//! schedule gives all previous updates the same learning rate.

use super::training_job::train_settings;
use crate::config::{Config, Difference, Keep, listed};
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_net::ScheduleConfig;

/// Whether a key sets the length of a training or the schedule of its learning rate.
pub(super) fn is_of_length(key: &str) -> bool {
    key == "train.steps" || key.starts_with("optim.schedule.")
}

/// Refuses a new length or schedule that would have changed a previous update.
///
/// # Errors
/// If this is so. The message names the keys and the update, and gives advice.
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
    // The end of a training is validated in any case, and its checkpoint may then be the best one.
    let ends_at_a_validation = before.valid_every_epochs == 0
        && before.valid_every > 0
        && before.steps.is_multiple_of(before.valid_every);
    ensure!(
        before.keep == Keep::Last || ends_at_a_validation || before.steps == after.steps,
        UsageError(format!(
            "{}; with train.keep = \"best\", a training can be made longer only if it ended at a multiple of train.valid_every, \
             because a longer one would not have validated update {}. Train again from these weights with --init, in another --out",
            listed(differing),
            before.steps
        ))
    );
    let (old, new) = (train_settings(stored, 0, 0), train_settings(config, 0, 0));
    if let Some(step) = old.first_other_rate(&new, before.steps) {
        let advice = match &new.optim.schedule {
            ScheduleConfig::Trapezoid { cooldown_steps, .. } if *cooldown_steps > 0 => format!(
                "the cool-down begins before the former end: optim.schedule.cooldown_steps can be at most {}, the number of new updates",
                after.steps - before.steps
            ),
            _ => "a longer training must give all former updates the same learning rate, as `constant` and `trapezoid` do. Train \
                  again from these weights with --init, in another --out"
                .to_owned(),
        };
        return Err(UsageError(format!(
            "{}; this schedule would have given update {} another learning rate: {advice}",
            listed(differing),
            step + 1
        ))
        .into());
    }
    Ok(())
}

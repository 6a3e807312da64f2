//! Divides a budget of time: computes the number of updates of each training, so that all trainings and their scores fit into it.

use crate::run::RunFolder;
use anyhow::{Context, Result};
use partprobe_eval::LOOK_LIMITS;
use serde_json::Value;
use std::time::{Duration, Instant};

/// The smallest number of updates. With fewer updates, the backbones of all sources are similar.
const FEWEST_UPDATES: usize = 200;

/// The largest number of updates. With more updates, scores hardly increase.
const MOST_UPDATES: usize = 20_000;

/// A verdict may take this much longer than its budget, as a fraction of the budget, before it stops without the last seeds.
const TOLERANCE: f64 = 0.25;

/// A budget of time, and the time at which the verdict began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    pub(super) begun: Instant,
    pub(super) total: Duration,
}

impl Budget {
    /// The time that is left.
    pub(super) fn left(self) -> Duration {
        self.total.saturating_sub(self.begun.elapsed())
    }

    /// Whether a further seed would end too long after the budget. The speed was measured only once, and the machine may be slower
    /// now.
    pub(super) fn is_too_short_for(self, time_per_seed: Duration) -> bool {
        exceeds(self.begun.elapsed() + time_per_seed, self.total)
    }
}

fn exceeds(end: Duration, total: Duration) -> bool {
    end.as_secs_f64() > (1.0 + TOLERANCE) * total.as_secs_f64()
}

/// The times of a short training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Speed {
    /// Seconds per update.
    pub(super) update: f64,
    /// Seconds per training that do not depend on the number of updates: validation and scores.
    pub(super) fixed: f64,
}

impl Speed {
    /// Reads the last training of a run's log. `scoring` is the time of scoring one backbone.
    ///
    /// # Errors
    /// If the log has no training.
    pub(super) fn of_log(folder: &RunFolder, scoring: Duration) -> Result<Self> {
        let log = folder.read_text("log.jsonl")?;
        let end = log
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok())
            .rfind(|line| line["event"] == "end")
            .context("the log of the short training has no end")?;
        let number = |key: &str| end[key].as_f64().unwrap_or(0.0);
        Ok(Self {
            update: number("seconds") / number("step").max(1.0),
            fixed: number("validation_seconds") + scoring.as_secs_f64(),
        })
    }

    /// The number of updates of each training such that all trainings fit into the remaining time, rounded down to two digits.
    ///
    /// # Errors
    /// The shortest sufficient time, if the remaining time is shorter.
    pub(super) fn updates_within(self, left: Duration) -> Result<usize, Duration> {
        let n_trainings = (2 * LOOK_LIMITS.len()) as f64;
        let per_training = left.as_secs_f64() / n_trainings - self.fixed;
        let updates = (per_training / self.update).max(0.0) as usize;
        if updates < FEWEST_UPDATES {
            let least = n_trainings * (FEWEST_UPDATES as f64 * self.update + self.fixed);
            return Err(Duration::from_secs_f64(least));
        }
        Ok(two_digits(updates.min(MOST_UPDATES)))
    }
}

/// Rounds down to two leading digits, so that small differences in speed give the same trainings.
fn two_digits(n: usize) -> usize {
    let mut unit = 1;
    while n / unit >= 100 {
        unit *= 10;
    }
    n / unit * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_trainings_and_scores_fit_into_the_budget() {
        let speed = Speed {
            update: 0.1,
            fixed: 10.0,
        };
        let within = |minutes: u64| speed.updates_within(Duration::from_secs(60 * minutes));
        // There are 600 seconds per training, minus 10, for updates of 0.1 seconds.
        assert_eq!(within(60), Ok(5900));
        assert_eq!(within(6), Ok(500));
        assert_eq!(within(2), Err(Duration::from_secs(180)));
        assert_eq!(within(600), Ok(20_000));
    }

    #[test]
    fn a_seed_may_end_a_little_after_the_budget() {
        let minutes = |n: u64| Duration::from_secs(60 * n);
        for (end, is_too_late) in [(59, false), (74, false), (76, true)] {
            assert_eq!(exceeds(minutes(end), minutes(60)), is_too_late, "{end}");
        }
    }

    #[test]
    fn numbers_keep_two_digits() {
        let found = [0, 7, 99, 100, 999, 1234, 20_000].map(two_digits);
        assert_eq!(found, [0, 7, 99, 100, 990, 1200, 20_000]);
    }
}

//! Describes a verdict in sentences.

use crate::counted::counted;
use partprobe_eval::{Look, Needed, Verdict};
use std::time::Duration;

/// The settings and the result of a comparison.
pub(super) struct Finding<'a> {
    pub(super) mine: &'a str,
    pub(super) against: &'a str,
    pub(super) references: &'a [String],
    pub(super) n_updates: usize,
    pub(super) look: &'a Look,
    /// The time that one seed of both sources took.
    pub(super) time_per_seed: Duration,
}

impl Finding<'_> {
    /// The verdict, the difference with its interval, and the endpoint.
    pub(super) fn sentence(&self) -> String {
        let Self { mine, against, .. } = self;
        let verdict = match self.look.verdict {
            Verdict::Better => format!("better: `{mine}` trains better backbones than `{against}`"),
            Verdict::Worse => format!("worse: `{mine}` trains worse backbones than `{against}`"),
            Verdict::CannotTell => format!(
                "cannot tell whether `{mine}` trains better or worse backbones than `{against}`; {}",
                self.needed()
            ),
        };
        format!("{verdict}.\n{}", self.evidence())
    }

    fn evidence(&self) -> String {
        let Look {
            number,
            difference,
            limit,
            n_shapes,
            n_groups,
            ..
        } = self.look;
        let interval = difference.interval.map_or_else(String::new, |interval| {
            format!(
                " [{:+.3}, {:+.3}] (95 % interval)",
                interval.low, interval.high
            )
        });
        let referees = match self.references {
            [one] => format!("`{one}` as the referee"),
            several => format!(
                "the mean over the referees {}",
                several
                    .iter()
                    .map(|name| format!("`{name}`"))
                    .collect::<Vec<_>>()
                    .join(" and ")
            ),
        };
        let seeds = if *number == 1 { "seed" } else { "seeds" };
        format!(
            "Δ mIoU {:+.3}{interval}, p = {:.4} (look {number} decides below {limit:.4}): k-means with the true number of parts, \
             {referees}, {n_shapes} held-out shapes in {n_groups} groups of related shapes, {number} {seeds} of {} updates each.",
            difference.mean,
            difference.p.unwrap_or(1.0),
            self.n_updates
        )
    }

    fn needed(&self) -> String {
        match self.look.needed() {
            Needed::Seeds(n) => {
                let minutes = self.time_per_seed.as_secs_f64() * n as f64 / 60.0;
                let time = if minutes < 60.0 {
                    counted(minutes.ceil() as usize, "minute", "minutes")
                } else {
                    format!("{:.1} hours", minutes / 60.0)
                };
                format!("this takes {n} seeds of each source, about {time} on this machine")
            }
            Needed::Shapes(n) => format!(
                "this takes about {n} held-out shapes, and more seeds on these {} are not enough",
                self.look.n_shapes
            ),
        }
    }
}

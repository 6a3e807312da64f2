//! Defines the table `[tokens]`: the number of tokens of a shape, and the points that share a token.

use super::{ConfigError, ensure};
use partprobe_carrier::{Rng, unit_interval};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The points that share a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Voxels {
    /// The points of one cell whose normals have the same dominant axis.
    NormalKeyed,
    /// All points of one cell, as in PTv3. The two sides of a thin plate then share tokens.
    Plain,
}

/// The approximate number of tokens of a shape in training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(untagged, expecting = "a number, or two numbers [least, most]")]
pub enum TrainTokens {
    /// The same number in every update.
    Fixed(usize),
    /// A number between these two, drawn for each shape and update. Its logarithm is uniform, so fine and coarse resolutions are
    /// equally frequent.
    Range([usize; 2]),
}

impl TrainTokens {
    /// The number for one shape in one update. A fixed number does not use `rng`.
    #[must_use]
    pub fn drawn(self, rng: &mut Rng) -> usize {
        match self {
            Self::Fixed(n) => n,
            Self::Range([least, most]) => between(least, most, unit_interval(rng)),
        }
    }

    /// The number, or the geometric mean of a range.
    #[must_use]
    pub fn middle(self) -> usize {
        match self {
            Self::Fixed(n) => n,
            Self::Range([least, most]) => between(least, most, 0.5),
        }
    }

    fn least_and_most(self) -> [usize; 2] {
        match self {
            Self::Fixed(n) => [n, n],
            Self::Range(range) => range,
        }
    }
}

/// `least · (most / least)^fraction`, rounded.
fn between(least: usize, most: usize, fraction: f64) -> usize {
    let ratio = most as f64 / least as f64;
    (least as f64 * ratio.powf(fraction)).round() as usize
}

impl From<usize> for TrainTokens {
    fn from(n: usize) -> Self {
        Self::Fixed(n)
    }
}

impl fmt::Display for TrainTokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(n) => write!(f, "{n}"),
            Self::Range([least, most]) => write!(f, "{least} to {most}"),
        }
    }
}

/// The number of tokens of a shape.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TokenConfig {
    /// The approximate number of tokens of a shape in training.
    pub train_tokens: TrainTokens,
    /// The approximate number of tokens of a shape at test time.
    pub test_tokens: usize,
    /// The number of poses in which a shape is embedded at test time. The embeddings of a token are concatenated.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub test_poses: usize,
    /// The points that share a token.
    pub voxels: Voxels,
}

fn one() -> usize {
    1
}

fn is_one(n: &usize) -> bool {
    *n == 1
}

impl Default for TokenConfig {
    /// 512 tokens in training and 1024 in tests, with voxels that separate the two sides of a wall.
    fn default() -> Self {
        Self {
            train_tokens: TrainTokens::Fixed(512),
            test_tokens: 1024,
            test_poses: 1,
            voxels: Voxels::NormalKeyed,
        }
    }
}

impl TokenConfig {
    /// Refuses token counts that are too small.
    ///
    /// # Errors
    /// If a count is below 8.
    pub fn check(&self) -> Result<(), ConfigError> {
        let [least, most] = self.train_tokens.least_and_most();
        ensure(least >= 8, "tokens.train_tokens", "must be at least 8")?;
        ensure(
            least <= most,
            "tokens.train_tokens",
            "must name the smaller number first",
        )?;
        ensure(
            self.test_tokens >= 8,
            "tokens.test_tokens",
            "must be at least 8",
        )?;
        ensure(
            (1..=24).contains(&self.test_poses),
            "tokens.test_poses",
            "must be from 1 to 24",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::keyed_rng;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_drawn_number_lies_in_its_range(least in 8usize..2000, more in 0usize..2000, seed: u64) {
            let range = TrainTokens::Range([least, least + more]);
            let n = range.drawn(&mut keyed_rng(seed, &["tokens"]));
            prop_assert!((least..=least + more).contains(&n));
            prop_assert!((least..=least + more).contains(&range.middle()));
        }
    }

    #[test]
    fn both_halves_of_the_logarithm_are_equally_frequent() {
        let range = TrainTokens::Range([100, 1600]);
        let rng = &mut keyed_rng(0, &["tokens"]);
        let n_below = (0..1000).filter(|_| range.drawn(rng) < 400).count();
        assert!((450..550).contains(&n_below), "{n_below}");
        assert_eq!(range.middle(), 400);
    }

    #[test]
    fn a_number_and_a_range_are_read_and_anything_else_is_refused() {
        let read = |json: &str| serde_json::from_str::<TrainTokens>(json);
        assert_eq!(read("512").unwrap(), TrainTokens::Fixed(512));
        assert_eq!(
            read("[384, 1536]").unwrap(),
            TrainTokens::Range([384, 1536])
        );
        let refusal = read("\"many\"").unwrap_err().to_string();
        assert!(refusal.contains("two numbers [least, most]"), "{refusal}");

        let key = |train_tokens| {
            let config = TokenConfig {
                train_tokens,
                ..TokenConfig::default()
            };
            config.check().err().map(|error| error.key)
        };
        assert_eq!(key(TrainTokens::Range([384, 1536])), None);
        assert_eq!(
            key(TrainTokens::Range([900, 384])),
            Some("tokens.train_tokens")
        );
        assert_eq!(
            key(TrainTokens::Range([4, 384])),
            Some("tokens.train_tokens")
        );
    }
}

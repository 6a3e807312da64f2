//! Defines the table `[tokens]`: how many tokens a shape is cut into, and which points share one.

use super::{ConfigError, ensure};
use serde::{Deserialize, Serialize};

/// Which points share a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Voxels {
    /// Those of one cell whose normals have one dominant axis.
    NormalKeyed,
    /// All of one cell, as in PTv3: the two sides of a thin plate share tokens.
    Plain,
}

/// How many tokens a shape is cut into.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TokenConfig {
    /// About so many tokens a shape in training.
    pub train_tokens: usize,
    /// About so many tokens a shape at test time.
    pub test_tokens: usize,
    /// Which points share a token.
    pub voxels: Voxels,
}

impl Default for TokenConfig {
    /// 512 tokens in training and 1024 in tests, with voxels that tell the two sides of a wall apart.
    fn default() -> Self {
        Self {
            train_tokens: 512,
            test_tokens: 1024,
            voxels: Voxels::NormalKeyed,
        }
    }
}

impl TokenConfig {
    /// Refuses token counts with which nothing can be told apart.
    ///
    /// # Errors
    /// If a count is below 8.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure(
            self.train_tokens >= 8,
            "tokens.train_tokens",
            "must be at least 8",
        )?;
        ensure(
            self.test_tokens >= 8,
            "tokens.test_tokens",
            "must be at least 8",
        )
    }
}

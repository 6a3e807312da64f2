//! Defines a share of a batch, for one of several machines.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::str::FromStr;

/// The share `index` of `of`, counted from 1. A file belongs to exactly one share, which depends only on its id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
pub(crate) struct Shard {
    /// The number of the share, counted from 1.
    pub(crate) index: u32,
    /// The number of shares.
    pub(crate) of: u32,
}

impl Shard {
    /// Whether the file with this id belongs to the share.
    #[must_use]
    pub(crate) fn holds(self, id: &str) -> bool {
        let hash = Sha256::digest(id);
        let start = hash
            .iter()
            .take(8)
            .fold(0u64, |value, &byte| value << 8 | u64::from(byte));
        start % u64::from(self.of) == u64::from(self.index - 1)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((index, of)) if 1 <= index && index <= of => Ok(Self { index, of }),
            _ => Err("a shard is i/n with 1 ≤ i ≤ n, for example 1/4".to_owned()),
        }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_id_belongs_to_one_share() {
        for id in ["a", "b", "steps__part7", ""] {
            let holding = (1..=5)
                .filter(|&index| Shard { index, of: 5 }.holds(id))
                .count();
            assert_eq!(holding, 1, "{id}");
        }
    }

    #[test]
    fn only_shares_that_exist_are_read() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, of: 3 }));
        for text in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}

//! Shapes by their number of parts.

use serde::{Deserialize, Serialize};

/// The bins in which scores are reported; the paper's are the middle three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum KBin {
    /// One part: every clustering is right, so it says nothing.
    #[serde(rename = "1")]
    One,
    /// 2 to 4 parts.
    #[serde(rename = "2-4")]
    Few,
    /// 5 to 9 parts.
    #[serde(rename = "5-9")]
    Some,
    /// 10 to 19 parts.
    #[serde(rename = "10-19")]
    Many,
    /// 20 parts and more.
    #[serde(rename = "20+")]
    Most,
}

impl KBin {
    /// Every bin, by rising number of parts.
    pub const ALL: [Self; 5] = [Self::One, Self::Few, Self::Some, Self::Many, Self::Most];

    /// The bin of a shape with this many parts.
    #[must_use]
    pub fn of(k: usize) -> Self {
        match k {
            0 | 1 => Self::One,
            2..=4 => Self::Few,
            5..=9 => Self::Some,
            10..=19 => Self::Many,
            _ => Self::Most,
        }
    }

    /// Whether the bin is one of the paper's, whose shapes make the mean over all.
    #[must_use]
    pub fn is_in_mean(self) -> bool {
        !matches!(self, Self::One | Self::Most)
    }

    /// The name in tables, for example `2-4`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "1",
            Self::Few => "2-4",
            Self::Some => "5-9",
            Self::Many => "10-19",
            Self::Most => "20+",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_end_where_the_papers_do() {
        let names = [1, 2, 4, 5, 9, 10, 19, 20, 500].map(|k| KBin::of(k).name());
        assert_eq!(
            names,
            [
                "1", "2-4", "2-4", "5-9", "5-9", "10-19", "10-19", "20+", "20+"
            ]
        );
        assert_eq!(
            KBin::ALL.map(KBin::is_in_mean),
            [false, true, true, true, false]
        );
        for bin in KBin::ALL {
            assert_eq!(
                serde_json::to_string(&bin).unwrap(),
                format!("\"{}\"", bin.name())
            );
        }
    }
}

//! Puts shapes into bins by their number K of reference parts.

use serde::{Deserialize, Serialize};

/// The bins in which scores are reported. The paper has the middle three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum KBin {
    /// 1 part. Every clustering of such a shape is correct, so its score carries no information.
    #[serde(rename = "1")]
    K1,
    /// 2 to 4 parts.
    #[serde(rename = "2-4")]
    K2To4,
    /// 5 to 9 parts.
    #[serde(rename = "5-9")]
    K5To9,
    /// 10 to 19 parts.
    #[serde(rename = "10-19")]
    K10To19,
    /// 20 or more parts.
    #[serde(rename = "20+")]
    K20Plus,
}

impl KBin {
    /// All bins, in the order of their numbers of parts.
    pub const ALL: [Self; 5] = [
        Self::K1,
        Self::K2To4,
        Self::K5To9,
        Self::K10To19,
        Self::K20Plus,
    ];

    /// The approximate fractions of the paper's test shapes in each of its bins. The paper does not print it: it follows from the
    /// means of its bins and of all shapes, and these are rounded.
    pub const PAPER_MIX: [(Self, f64); 3] =
        [(Self::K2To4, 0.4), (Self::K5To9, 0.3), (Self::K10To19, 0.3)];

    /// The bin of a shape with this many parts.
    #[must_use]
    pub fn of(k: usize) -> Self {
        match k {
            0 | 1 => Self::K1,
            2..=4 => Self::K2To4,
            5..=9 => Self::K5To9,
            10..=19 => Self::K10To19,
            _ => Self::K20Plus,
        }
    }

    /// Whether the bin is one of the paper's. Means over all shapes are over the shapes of these bins.
    #[must_use]
    pub fn is_in_mean(self) -> bool {
        !matches!(self, Self::K1 | Self::K20Plus)
    }

    /// The name in tables, for example `2-4`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::K1 => "1",
            Self::K2To4 => "2-4",
            Self::K5To9 => "5-9",
            Self::K10To19 => "10-19",
            Self::K20Plus => "20+",
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

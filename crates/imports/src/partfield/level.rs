//! Chooses the level of a hierarchy of clusters.

use crate::import::{ImportError, JoinProblem};

/// A rule for the level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    /// The highest level.
    Max,
    /// The level with as many clusters as the shape has STEP parts, or the nearest existing level.
    Match,
    /// The level that agrees best with the STEP parts. This is optimistic, because the choice uses the reference.
    Best,
    /// This level.
    Exactly(u32),
}

impl Level {
    /// Reads the key `k`.
    pub(super) fn of(text: &str) -> Result<Self, ImportError> {
        match (text, text.parse::<u32>()) {
            ("max", _) => Ok(Self::Max),
            ("match", _) => Ok(Self::Match),
            ("best", _) => Ok(Self::Best),
            (_, Ok(level)) if level > 0 => Ok(Self::Exactly(level)),
            _ => Err(ImportError::Value {
                key: "k",
                value: text.to_owned(),
                expected: "max, match, best, or a whole number from 1".to_owned(),
            }),
        }
    }

    /// The levels that are considered, among the existing levels in ascending order: all of them for [`Best`](Self::Best), and
    /// otherwise one.
    pub(super) fn candidates(
        self,
        levels: &[u32],
        n_parts: usize,
    ) -> Result<Vec<u32>, JoinProblem> {
        let (Some(&lowest), Some(&highest)) = (levels.first(), levels.last()) else {
            return Err(JoinProblem::NoLabels);
        };
        let wanted = match self {
            Self::Best => return Ok(levels.to_vec()),
            Self::Max => highest,
            Self::Match => u32::try_from(n_parts)
                .unwrap_or(highest)
                .clamp(lowest, highest),
            Self::Exactly(level) => level,
        };
        if levels.contains(&wanted) {
            return Ok(vec![wanted]);
        }
        Err(JoinProblem::Refused(format!(
            "level {wanted} is missing; there are levels {lowest} to {highest}"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_chosen_by_rule() {
        let levels = [2, 3, 4, 19];
        for (text, n_parts, expected) in [
            ("max", 3, Some(19)),
            ("match", 3, Some(3)),
            ("match", 1, Some(2)),
            ("match", 40, Some(19)),
            ("match", 7, None),
            ("4", 9, Some(4)),
            ("5", 9, None),
        ] {
            let chosen = Level::of(text).unwrap().candidates(&levels, n_parts);
            let expected = expected.map(|level| vec![level]);
            assert_eq!(chosen.ok(), expected, "{text} {n_parts}");
        }
        assert_eq!(Level::Best.candidates(&levels, 3), Ok(levels.to_vec()));
        assert!(Level::of("0").is_err() && Level::of("best of all").is_err());
        assert_eq!(Level::Max.candidates(&[], 3), Err(JoinProblem::NoLabels));
    }
}

//! Holds the labels that one source gives to the faces of a shape.
//!
//! A carrier stores its layers by the names of their sources. Nothing here decides which face has which label.

use crate::labels::IGNORE;
use crate::partition::Partition;

/// The layer of the STEP-Parts after small ones were absorbed. Every carrier with a B-Rep has it.
pub const STEP_PARTS: &str = "step-parts";

/// The layer of the STEP-Parts before small ones were absorbed. Every carrier with a B-Rep has it.
pub const STEP_PARTS_RAW: &str = "step-parts-raw";

/// The layer of the labels that came with a mesh or a point cloud. Every carrier without a B-Rep has it.
pub const GIVEN: &str = "given";

/// The label of each face of a shape by one label source.
///
/// Labels are counted from 0. A face without a label has [`IGNORE`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelLayer {
    of_face: Vec<i32>,
}

impl LabelLayer {
    /// The label of each face, in the order of the faces.
    #[must_use]
    pub fn of_face(&self) -> &[i32] {
        &self.of_face
    }

    /// One more than the highest label, or 0 if no face has a label.
    #[must_use]
    pub fn n_labels(&self) -> usize {
        let highest = self.of_face.iter().max().copied().unwrap_or(IGNORE);
        usize::try_from(highest).map_or(0, |highest| highest + 1)
    }
}

impl From<Vec<i32>> for LabelLayer {
    fn from(of_face: Vec<i32>) -> Self {
        Self { of_face }
    }
}

impl FromIterator<i32> for LabelLayer {
    fn from_iter<L: IntoIterator<Item = i32>>(labels: L) -> Self {
        Self {
            of_face: labels.into_iter().collect(),
        }
    }
}

impl From<&Partition> for LabelLayer {
    fn from(partition: &Partition) -> Self {
        partition.parts().iter().map(|&part| part as i32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(labels: &[i32], n_labels: usize) {
        assert_eq!(LabelLayer::from(labels.to_vec()).n_labels(), n_labels);
    }

    #[test]
    fn labels_are_counted_without_those_that_are_missing() {
        check(&[], 0);
        check(&[IGNORE], 0);
        check(&[0, IGNORE, 2, 2], 3);
        let partition = Partition::from_keys(&["b", "a", "b"]);
        assert_eq!(LabelLayer::from(&partition).of_face(), [0, 1, 0]);
    }
}

//! Holds the labels of the triangles of a carrier, numbered without gaps.

/// The label of triangles and points that a reference does not label. A prediction never contains it.
pub const IGNORE: i32 = -1;

/// One label per triangle of a carrier.
///
/// Invariant: the labels are 0..n_labels, each used at least once, or [`IGNORE`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Labels {
    of_triangle: Vec<i32>,
    n_labels: u32,
}

impl Labels {
    /// Renumbers arbitrary non-negative labels to 0..n in the order of their values. Negative labels become [`IGNORE`].
    #[must_use]
    pub fn compacted(raw: &[i32]) -> Self {
        let mut values: Vec<i32> = raw.iter().copied().filter(|&label| label >= 0).collect();
        values.sort_unstable();
        values.dedup();
        let rank = |label: &i32| {
            values
                .binary_search(label)
                .map_or(IGNORE, |rank| rank as i32)
        };
        Self {
            of_triangle: raw.iter().map(rank).collect(),
            n_labels: values.len() as u32,
        }
    }

    /// Gives each triangle the label of its source face.
    #[must_use]
    pub fn from_faces(tri_face: &[u32], label_of_face: &[i32]) -> Self {
        let raw: Vec<i32> = tri_face
            .iter()
            .map(|&face| label_of_face[face as usize])
            .collect();
        Self::compacted(&raw)
    }

    /// The label of each triangle.
    #[must_use]
    pub fn of_triangle(&self) -> &[i32] {
        &self.of_triangle
    }

    /// The number of different labels, without [`IGNORE`].
    #[must_use]
    pub fn n_labels(&self) -> u32 {
        self.n_labels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compaction_keeps_the_order_of_values() {
        let labels = Labels::compacted(&[29, 312, -1, 29, 30]);
        assert_eq!(labels.of_triangle(), [0, 2, -1, 0, 1]);
        assert_eq!(labels.n_labels(), 3);
    }
}

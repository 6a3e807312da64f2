//! The trait that every label source implements, and what a source gives.

use carrier::{Carrier, Labels, PointSample};

/// A rule that labels the surface of a carrier.
pub trait LabelSource {
    /// The name in configs, scores and folders, for example `normal-kmeans-20`.
    fn name(&self) -> &str;

    /// Labels the whole surface; `seed` matters to sources that draw random numbers only.
    ///
    /// # Errors
    /// If the source cannot label this carrier.
    fn labels(&self, carrier: &Carrier, seed: u64) -> Result<SourceLabels, SourceError>;
}

/// The labels that a source gives to the surface of one carrier.
///
/// Every source so far is constant on each triangle of the plain carrier: rules on faces are, and so are clusters of
/// triangle normals, because refinement leaves a triangle's normal, area and neighbours' borders alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLabels {
    of_plain: Labels,
}

impl SourceLabels {
    /// Labels that are constant on each triangle of the carrier.
    #[must_use]
    pub fn on_plain(of_plain: Labels) -> Self {
        Self { of_plain }
    }

    /// How many different labels the surface has.
    #[must_use]
    pub fn n_labels(&self) -> u32 {
        self.of_plain.n_labels()
    }

    /// The label of each triangle of the carrier.
    #[must_use]
    pub fn of_triangles(&self) -> &Labels {
        &self.of_plain
    }

    /// The label of each point of a sample that was drawn from the same carrier.
    ///
    /// # Errors
    /// If a point names a triangle that the carrier does not have.
    pub fn label_of_points(&self, sample: &PointSample) -> Result<Vec<i32>, SourceError> {
        let labels = self.of_plain.of_triangle();
        let label = |&triangle: &u32| {
            let found = labels.get(triangle as usize).copied();
            found.ok_or(SourceError::OtherCarrier { triangle, n_triangles: labels.len() })
        };
        sample.triangles.iter().map(label).collect()
    }
}

/// Why a source, or a label, cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// No source has this name.
    #[error("`{name}` is not a label source; the known ones are {known}")]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// The number at the end of the name is missing or out of range.
    #[error("`{name}` does not end with a possible number; put a whole number from {min} to {max} at its end")]
    Number {
        /// The name that was asked for.
        name: String,
        /// The lowest number that the source accepts.
        min: u32,
        /// The highest number that the source accepts.
        max: u32,
    },
    /// The source needs something that its context does not have.
    #[error("the source `{source_name}` needs the parameter `{parameter}`; set it")]
    Parameter {
        /// The name of the source.
        source_name: String,
        /// The parameter that is missing.
        parameter: String,
    },
    /// The source has nothing to say of this shape.
    #[error("shape `{shape}`: {reason}")]
    Unfit {
        /// The id of the shape.
        shape: String,
        /// Why, and which source fits better.
        reason: String,
    },
    /// The sample was drawn from another carrier.
    #[error(
        "the sample names triangle {triangle}, but the labels are those of {n_triangles} triangles; sample the same carrier"
    )]
    OtherCarrier {
        /// The triangle that a point names.
        triangle: u32,
        /// How many triangles the labels are for.
        n_triangles: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_has_the_label_of_its_triangle() {
        let labels = SourceLabels::on_plain(Labels::compacted(&[5, -1, 7]));
        let sample = |triangles: &[u32]| PointSample { triangles: triangles.to_vec(), ..PointSample::default() };
        assert_eq!(labels.n_labels(), 2);
        assert_eq!(labels.label_of_points(&sample(&[2, 0, 1, 2])), Ok(vec![1, 0, -1, 1]));
        let error = SourceError::OtherCarrier { triangle: 3, n_triangles: 3 };
        assert_eq!(labels.label_of_points(&sample(&[0, 3])), Err(error));
    }
}

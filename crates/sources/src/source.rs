//! Defines [`LabelSource`], which every label source implements, and [`SourceLabels`], its result.

use partprobe_carrier::{
    Carrier, GIVEN, LabelLayer, Labels, Mesh, Partition, Point, PointSample, STEP_PARTS, ShapeKind,
    centroid,
};
use std::fmt::Debug;
use std::sync::Arc;

/// A rule that labels the surface of a carrier.
pub trait LabelSource {
    /// The name in configs, scores and folders, for example `normal-kmeans-20`.
    fn name(&self) -> &str;

    /// Labels the whole surface, or all points of a cloud. Only sources that draw random numbers use `seed`.
    ///
    /// # Errors
    /// If the source cannot label this carrier.
    fn labels(&self, carrier: &Carrier, seed: u64) -> Result<SourceLabels, SourceError>;

    /// Whether every face has one label, so that a carrier can store the labels as a layer.
    ///
    /// A source that answers `true` returns labels whose [`SourceLabels::of_faces`] is not `None`.
    fn labels_faces(&self) -> bool {
        false
    }
}

/// A rule that may cut through a triangle: it labels each point of the surface by its position.
pub trait PointRule: Debug + Send + Sync {
    /// The label of a point in millimeters that lies on this triangle of the carrier. A negative number means that it has no
    /// label.
    fn label(&self, triangle: u32, point: Point) -> i32;
}

/// The labels that a source gives to the surface of one carrier.
///
/// The labels of most sources are constant on each triangle of the plain carrier. This holds for rules on faces. It also holds
/// for clusters of triangle normals, because refinement does not change a triangle's normal, area or borders.
#[derive(Clone, Debug)]
pub struct SourceLabels {
    of_plain: Labels,
    of_faces: Option<LabelLayer>,
    of_points: Option<Arc<dyn PointRule>>,
    origin: Option<Origin>,
    class_of_face: Option<Arc<[Option<String>]>>,
}

/// The origin of labels that were not made by a rule of this crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// SHA-256 of the labels that were imported for this shape, in hexadecimal. It tells whether a label file has changed.
    pub content_hash: String,
    /// How the labels were joined to the carrier, in one line, with the counts of items that did not match.
    pub join: String,
}

impl SourceLabels {
    /// Labels that are constant on each triangle of the carrier.
    #[must_use]
    pub fn on_plain(of_plain: Labels) -> Self {
        Self {
            of_plain,
            of_faces: None,
            of_points: None,
            origin: None,
            class_of_face: None,
        }
    }

    /// Labels that are constant on each face of the carrier, one label per face.
    ///
    /// Faces and triangles are numbered without gaps, each in the order of the given labels. Negative labels become
    /// [`IGNORE`](partprobe_carrier::IGNORE).
    #[must_use]
    pub fn on_faces(mesh: &Mesh, label_of_face: &[i32]) -> Self {
        let of_faces = Labels::compacted(label_of_face);
        Self {
            of_plain: Labels::from_faces(&mesh.tri_face, label_of_face),
            of_faces: Some(of_faces.of_triangle().to_vec().into()),
            of_points: None,
            origin: None,
            class_of_face: None,
        }
    }

    /// The parts of the faces as labels.
    #[must_use]
    pub fn on_partition(mesh: &Mesh, parts: &Partition) -> Self {
        Self::on_faces(mesh, LabelLayer::from(parts).of_face())
    }

    /// One label per region of triangles. Regions are numbered in the order of their lowest triangles.
    #[must_use]
    pub(crate) fn of_regions(region_of_triangle: &[u32]) -> Self {
        let regions = Partition::from_keys(region_of_triangle);
        let raw: Vec<i32> = regions
            .parts()
            .iter()
            .map(|&region| region as i32)
            .collect();
        Self::on_plain(Labels::compacted(&raw))
    }

    /// Labels that depend on the position. A triangle as a whole takes the label of its centroid.
    ///
    /// Points have the numbers of the rule. The labels of the triangles are numbered without gaps.
    #[must_use]
    pub fn on_points(mesh: &Mesh, rule: Arc<dyn PointRule>) -> Self {
        let at_centroid =
            |triangle: u32| rule.label(triangle, centroid(mesh.corners(triangle as usize)));
        let raw: Vec<i32> = (0..).take(mesh.triangles.len()).map(at_centroid).collect();
        Self {
            of_plain: Labels::compacted(&raw),
            of_faces: None,
            of_points: Some(rule),
            origin: None,
            class_of_face: None,
        }
    }

    /// The same labels with a note about their origin.
    #[must_use]
    pub fn with_origin(mut self, origin: Origin) -> Self {
        self.origin = Some(origin);
        self
    }

    /// The same labels with the class of each face. The name of a class has the same meaning in all shapes.
    #[must_use]
    pub fn with_classes(mut self, class_of_face: Vec<Option<String>>) -> Self {
        self.class_of_face = Some(class_of_face.into());
        self
    }

    /// The class of each face, or `None` if the labels have a meaning only within their shape.
    #[must_use]
    pub fn classes(&self) -> Option<&[Option<String>]> {
        self.class_of_face.as_deref()
    }

    /// The origin of the labels, or `None` if a rule made them from the carrier alone.
    #[must_use]
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// The rule that labels points by their positions, or `None` if labels are constant on triangles.
    #[must_use]
    pub(crate) fn point_rule(&self) -> Option<&Arc<dyn PointRule>> {
        self.of_points.as_ref()
    }

    /// How many different labels the triangles have.
    #[must_use]
    pub fn n_labels(&self) -> u32 {
        self.of_plain.n_labels()
    }

    /// The label of each triangle of the carrier.
    #[must_use]
    pub fn of_triangles(&self) -> &Labels {
        &self.of_plain
    }

    /// The label of each face, or `None` if the labels are not constant on faces by construction.
    #[must_use]
    pub fn of_faces(&self) -> Option<&LabelLayer> {
        self.of_faces.as_ref()
    }

    /// The label of each point of a sample that was drawn from the same carrier.
    ///
    /// # Errors
    /// If a point names a triangle that the carrier does not have.
    pub fn label_of_points(&self, sample: &PointSample) -> Result<Vec<i32>, SourceError> {
        let labels = self.of_plain.of_triangle();
        let of_triangle = |&triangle: &u32| {
            let found = labels.get(triangle as usize).copied();
            found.ok_or(SourceError::OtherCarrier {
                triangle,
                n_triangles: labels.len(),
            })
        };
        let constant = sample
            .triangles
            .iter()
            .map(of_triangle)
            .collect::<Result<Vec<i32>, SourceError>>()?;
        let Some(rule) = &self.of_points else {
            return Ok(constant);
        };

        let points = sample.triangles.iter().zip(&sample.points);
        Ok(points
            .map(|(&triangle, point)| rule.label(triangle, point.map(f64::from)))
            .collect())
    }
}

/// The reason why a source or its labels are not available.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// No source has this name.
    #[error("`{name}` is not a label source; the known ones are {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// The number at the end of the name is missing or out of range.
    #[error(
        "`{name}` does not end with a possible number; put a whole number from {min} to {max} at its end"
    )]
    Number {
        /// The requested name.
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
    /// A layer of a carrier was requested, but the source does not label whole faces.
    #[error(
        "the labels of `{source_name}` are not constant on faces, so that a carrier cannot store them as a layer; \
         use `sample --source {source_name}`"
    )]
    NotOnFaces {
        /// The name of the source.
        source_name: String,
    },
    /// The source needs data that the shape does not have.
    #[error(
        "the source `{source_name}` needs {}, and this shape is {found}; use a source that does not, for example `{}`",
        needed(*needs),
        fallback(*found)
    )]
    Kind {
        /// The name of the source.
        source_name: String,
        /// The kind of shape that it needs.
        needs: ShapeKind,
        /// The kind of the shape.
        found: ShapeKind,
    },
    /// The source cannot give this shape useful labels.
    #[error("{reason}")]
    Unfit {
        /// The reason, and a source that fits better.
        reason: String,
    },
    /// The sample was drawn from another carrier.
    #[error(
        "the sample names triangle {triangle}, but the labels are those of {n_triangles} triangles; sample the same carrier"
    )]
    OtherCarrier {
        /// The triangle that a point names.
        triangle: u32,
        /// The number of labeled triangles.
        n_triangles: usize,
    },
}

fn needed(kind: ShapeKind) -> &'static str {
    match kind {
        ShapeKind::Brep => "a B-Rep",
        ShapeKind::Mesh => "a surface of triangles",
        ShapeKind::Cloud => "points",
    }
}

fn fallback(kind: ShapeKind) -> &'static str {
    match kind {
        ShapeKind::Brep => STEP_PARTS,
        ShapeKind::Mesh | ShapeKind::Cloud => GIVEN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_has_the_label_of_its_triangle() {
        let labels = SourceLabels::on_plain(Labels::compacted(&[5, -1, 7]));
        let sample = |triangles: &[u32]| PointSample {
            triangles: triangles.to_vec(),
            ..PointSample::default()
        };
        assert_eq!(labels.n_labels(), 2);
        assert_eq!(
            labels.label_of_points(&sample(&[2, 0, 1, 2])),
            Ok(vec![1, 0, -1, 1])
        );
        let error = SourceError::OtherCarrier {
            triangle: 3,
            n_triangles: 3,
        };
        assert_eq!(labels.label_of_points(&sample(&[0, 3])), Err(error));
    }
}

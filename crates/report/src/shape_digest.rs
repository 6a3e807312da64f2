//! Reduces a test shape to the data that the page shows: its parts, the losses of each prediction, and 5 000 of its points.

use crate::matched::{Loss, MatchedPrediction};
use crate::packed_points::{Frame, KeptPoints, disc_radius, kept_indices, octahedral};
use partprobe_carrier::FaceType;
use std::collections::{BTreeMap, BTreeSet};

/// A test shape of a run: its points, their labels by each reference, and the predicted clusters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportShape {
    /// The id of the shape.
    pub id: String,
    /// Positions in millimeters.
    pub points: Vec<[f32; 3]>,
    /// The unit normal of each point.
    pub normals: Vec<[f32; 3]>,
    /// The references in the order of the config, each with the label of each point; negative labels are ignored.
    pub references: Vec<(String, Vec<i32>)>,
    /// The predictions. Those of the main rows come first.
    pub predictions: Vec<Prediction>,
    /// The faces of the points, if they are known.
    pub faces: Option<ShapeFaces>,
}

/// The predicted cluster of each point by one row of the tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Prediction {
    /// The label source on which the backbone was trained, or the name of the row.
    pub supervision: String,
    /// The seed.
    pub seed: u64,
    /// The reference whose number of parts was the requested number of clusters.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// The cluster of each point.
    pub clusters: Vec<i32>,
}

/// The data of the faces of a shape that a report uses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShapeFaces {
    /// The face of each point, as an index in the two lists.
    pub of_point: Vec<u32>,
    /// The primitive type of each face.
    pub types: Vec<FaceType>,
    /// The `#` number of each face in its STEP file.
    pub step_ids: Vec<u64>,
}

/// The data of a shape that a page shows. It is much smaller than the shape itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDigest {
    pub(crate) id: String,
    /// The diagonal of the bounding box, in millimeters.
    pub(crate) diagonal_mm: f64,
    /// The radius at which discs around the kept points cover the surface, as a fraction of the largest extent.
    pub(crate) disc_radius: f64,
    pub(crate) references: Vec<ReferenceDigest>,
    pub(crate) predictions: Vec<PredictionDigest>,
    pub(crate) points: KeptPoints,
    /// The primitive type and the `#` number of each face that has a kept point.
    pub(crate) faces: Vec<(FaceType, u64)>,
}

/// The parts of a shape by one reference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReferenceDigest {
    pub(crate) source: String,
    pub(crate) parts: Vec<PartDigest>,
    /// The part of each kept point, as an index in `parts`. It is `u16::MAX` if the point has none.
    pub(crate) part_of_point: Vec<u16>,
}

/// One part of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PartDigest {
    pub(crate) label: i32,
    /// The fraction of the labeled points that are in the part.
    pub(crate) size: f64,
    /// The face type of most of its points, if faces are known.
    pub(crate) face_type: Option<FaceType>,
    pub(crate) n_faces: usize,
}

/// One prediction for a shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PredictionDigest {
    pub(crate) supervision: String,
    pub(crate) seed: u64,
    /// The index of the reference.
    pub(crate) reference: usize,
    pub(crate) clusterer: String,
    pub(crate) miou: f64,
    pub(crate) iou: Vec<f64>,
    pub(crate) loss: Vec<Loss>,
    /// For each part, the number of its points in the cluster of each part, and last the number of its points in clusters without
    /// a part.
    pub(crate) moved: Vec<Vec<u32>>,
    /// The same as [`MatchedPrediction::part_of_point`], for the kept points.
    pub(crate) part_of_point: Vec<u16>,
}

impl ShapeDigest {
    /// Reduces a shape. Labels and faces that do not have an entry per point are left out.
    #[must_use]
    pub fn of(shape: &ReportShape) -> Self {
        let n = shape.points.len().min(shape.normals.len());
        let frame = Frame::of(&shape.points[..n]);
        let (kept, spread_radius) = kept_indices(&shape.points[..n], &shape.normals[..n], &frame);
        let faces = shape
            .faces
            .as_ref()
            .filter(|faces| faces.of_point.len() == n);

        let references: Vec<(&str, &[i32])> = shape
            .references
            .iter()
            .filter(|(_, labels)| labels.len() == n)
            .map(|(source, labels)| (source.as_str(), labels.as_slice()))
            .collect();
        let predictions = shape.predictions.iter().filter_map(|prediction| {
            let reference = references
                .iter()
                .position(|(source, _)| *source == prediction.reference)?;
            prediction_digest(prediction, (reference, references[reference].1), &kept)
        });
        let (face_of_point, face_list) = kept_faces(faces, &kept);
        let positions: Vec<[u16; 3]> = kept
            .iter()
            .map(|&idx| frame.quantized(shape.points[idx]))
            .collect();
        Self {
            id: shape.id.clone(),
            diagonal_mm: frame.diagonal,
            disc_radius: spread_radius.unwrap_or_else(|| disc_radius(&positions)),
            predictions: predictions.collect(),
            references: references
                .iter()
                .map(|(source, labels)| reference_digest(source, labels, faces, &kept))
                .collect(),
            points: KeptPoints {
                positions,
                normals: kept
                    .iter()
                    .map(|&idx| octahedral(shape.normals[idx]))
                    .collect(),
                faces: face_of_point,
            },
            faces: face_list,
        }
    }
}

fn reference_digest(
    source: &str,
    labels: &[i32],
    faces: Option<&ShapeFaces>,
    kept: &[usize],
) -> ReferenceDigest {
    let mut points_of_label: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    for (point, &label) in labels.iter().enumerate().filter(|(_, label)| **label >= 0) {
        points_of_label.entry(label).or_default().push(point);
    }
    let n_labeled: usize = points_of_label.values().map(Vec::len).sum();
    let part = |(&label, points): (&i32, &Vec<usize>)| {
        let (face_type, n_faces) = faces.map_or((None, 0), |faces| main_type(faces, points));
        PartDigest {
            label,
            size: points.len() as f64 / n_labeled as f64,
            face_type,
            n_faces,
        }
    };
    let index: BTreeMap<i32, u16> = points_of_label.keys().copied().zip(0..).collect();
    let of_kept = |&point: &usize| index.get(&labels[point]).copied().unwrap_or(u16::MAX);
    ReferenceDigest {
        source: source.to_owned(),
        parts: points_of_label.iter().map(part).collect(),
        part_of_point: kept.iter().map(of_kept).collect(),
    }
}

/// The face type of most of the points, and the number of their faces.
fn main_type(faces: &ShapeFaces, points: &[usize]) -> (Option<FaceType>, usize) {
    let mut counts: BTreeMap<FaceType, usize> = BTreeMap::new();
    let mut distinct = BTreeSet::new();
    for &point in points {
        let face = faces.of_point[point];
        distinct.insert(face);
        if let Some(face_type) = faces.types.get(face as usize) {
            *counts.entry(*face_type).or_default() += 1;
        }
    }
    let most = counts
        .into_iter()
        .max_by_key(|&(face_type, n)| (n, std::cmp::Reverse(face_type)));
    (most.map(|(face_type, _)| face_type), distinct.len())
}

fn prediction_digest(
    prediction: &Prediction,
    (reference, labels): (usize, &[i32]),
    kept: &[usize],
) -> Option<PredictionDigest> {
    let matched = MatchedPrediction::of(&prediction.clusters, labels)?;
    let narrow = |&point: &usize| u16::try_from(matched.part_of_point[point]).unwrap_or(u16::MAX);
    Some(PredictionDigest {
        supervision: prediction.supervision.clone(),
        seed: prediction.seed,
        reference,
        clusterer: prediction.clusterer.clone(),
        miou: matched.miou(),
        moved: moved_points(&matched, labels),
        part_of_point: kept.iter().map(narrow).collect(),
        iou: matched.iou,
        loss: matched.loss,
    })
}

fn moved_points(matched: &MatchedPrediction, labels: &[i32]) -> Vec<Vec<u32>> {
    let distinct: BTreeSet<i32> = labels.iter().copied().filter(|&label| label >= 0).collect();
    let index: BTreeMap<i32, usize> = distinct.into_iter().zip(0..).collect();
    let n_parts = index.len();
    let mut moved = vec![vec![0; n_parts + 1]; n_parts];
    for (label, &to) in labels.iter().zip(&matched.part_of_point) {
        if let Some(&part) = index.get(label) {
            moved[part][n_parts.min(to as usize)] += 1;
        }
    }
    moved
}

/// The faces that have a kept point, and their indices.
fn kept_faces(faces: Option<&ShapeFaces>, kept: &[usize]) -> (Vec<u16>, Vec<(FaceType, u64)>) {
    let Some(faces) = faces else {
        return (Vec::new(), Vec::new());
    };
    let present: BTreeSet<u32> = kept.iter().map(|&point| faces.of_point[point]).collect();
    let index: BTreeMap<u32, u16> = present.iter().copied().zip(0..).collect();
    let facts = |&face: &u32| {
        let face = face as usize;
        (
            faces.types.get(face).copied().unwrap_or(FaceType::Other),
            faces.step_ids.get(face).copied().unwrap_or(0),
        )
    };
    let of_point = |&point: &usize| {
        index
            .get(&faces.of_point[point])
            .copied()
            .unwrap_or(u16::MAX)
    };
    (
        kept.iter().map(of_point).collect(),
        present.iter().map(facts).collect(),
    )
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::packed_points::N_POINTS;

    /// A plate of two parts, each on its own face, and a prediction that merges them and one that does not.
    pub(crate) fn plate(n: usize) -> ReportShape {
        let points: Vec<[f32; 3]> = (0..n)
            .map(|idx| [(idx % 50) as f32, (idx / 50) as f32, 0.0])
            .collect();
        let sides: Vec<i32> = points
            .iter()
            .map(|point| i32::from(point[0] >= 20.0))
            .collect();
        let prediction = |supervision: &str, clusters: Vec<i32>| Prediction {
            supervision: supervision.to_owned(),
            reference: "sides".to_owned(),
            clusterer: "k-means".to_owned(),
            clusters,
            seed: 0,
        };
        ReportShape {
            id: "plate".to_owned(),
            normals: vec![[0.0, 0.0, 1.0]; n],
            predictions: vec![
                prediction("good", sides.iter().map(|side| 7 - side).collect()),
                prediction("bad", vec![0; n]),
            ],
            faces: Some(ShapeFaces {
                of_point: sides.iter().map(|&side| 4 + side as u32).collect(),
                types: [
                    vec![FaceType::Torus; 4],
                    vec![FaceType::Plane, FaceType::Cylinder],
                ]
                .concat(),
                step_ids: vec![10, 20, 30, 40, 50, 60],
            }),
            references: vec![("sides".to_owned(), sides)],
            points,
        }
    }

    #[test]
    fn a_shape_is_reduced_to_its_parts_and_to_some_of_its_points() {
        let digest = ShapeDigest::of(&plate(20_000));
        assert_eq!(digest.points.positions.len(), N_POINTS);
        assert_eq!(
            digest.faces,
            [(FaceType::Plane, 50), (FaceType::Cylinder, 60)]
        );
        let parts = &digest.references[0].parts;
        assert_eq!(
            parts.iter().map(|part| part.size).collect::<Vec<_>>(),
            [0.4, 0.6]
        );
        assert_eq!(parts[1].face_type, Some(FaceType::Cylinder));
        let [good, bad] = &digest.predictions[..] else {
            panic!("two predictions")
        };
        assert_eq!((good.miou, bad.miou), (1.0, 0.3));
        assert_eq!(good.part_of_point, digest.references[0].part_of_point);
        assert_eq!(bad.moved, [[0, 8000, 0], [0, 12_000, 0]]);
        assert_eq!(bad.loss, [Loss::MergedInto(1), Loss::TakesIn(0)]);
    }

    #[test]
    fn lists_that_do_not_fit_are_left_out() {
        let mut shape = plate(100);
        shape.references.push(("short".to_owned(), vec![0]));
        shape.predictions[0].clusters.pop();
        shape.faces.as_mut().unwrap().of_point.pop();
        let digest = ShapeDigest::of(&shape);
        assert_eq!(
            (
                digest.references.len(),
                digest.predictions.len(),
                digest.faces.len()
            ),
            (1, 1, 0)
        );
        let empty = ShapeDigest::of(&ReportShape::default());
        assert!(empty.points.positions.is_empty() && empty.disc_radius > 0.0);
    }
}

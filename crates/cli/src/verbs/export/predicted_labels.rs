//! Carries predicted labels from points to faces: one label per sampled point goes in, and one label per face or triangle comes
//! out.

use anyhow::Result;
use partprobe_carrier::{
    Carrier, GivenShape, IGNORE, LabelLayer, NearestPoints, Point, PointSample, ShapeKind,
    carrier_of_given,
};
use std::collections::BTreeMap;

/// The label layer in which predictions are stored.
pub(super) const LAYER: &str = "predicted";

/// The labels of the points of a sample, and of the triangles from which they were drawn.
pub(super) struct PredictedLabels {
    of_point: Vec<i32>,
    /// The triangle of each point.
    triangles: Vec<u32>,
    /// One label per triangle, or per point of a cloud.
    of_triangle: Vec<i32>,
}

impl PredictedLabels {
    /// Labels each triangle by most of its points, or by the nearest point if it has none.
    ///
    /// # Shapes
    /// - `of_point`: `[point of the sample]`
    pub(super) fn new(carrier: &Carrier, sample: &PointSample, of_point: Vec<i32>) -> Self {
        let mesh = carrier.mesh();
        let mut votes = vec![Votes::default(); mesh.triangles.len()];
        for (&triangle, &label) in sample.triangles.iter().zip(&of_point) {
            votes[triangle as usize].add(label);
        }
        let positions: Vec<Point> = sample.points.iter().map(|&p| p.map(f64::from)).collect();
        let nearest = NearestPoints::new(&positions);
        let of_triangle = votes.iter().enumerate().map(|(triangle, votes)| {
            votes.winner().unwrap_or_else(|| {
                let point = nearest.nearest_to(centroid(mesh.corners(triangle)));
                point.map_or(IGNORE, |point| of_point[point as usize])
            })
        });
        Self {
            of_triangle: of_triangle.collect(),
            triangles: sample.triangles.clone(),
            of_point,
        }
    }

    /// The label of each point of the sample.
    pub(super) fn of_point(&self) -> &[i32] {
        &self.of_point
    }

    /// The label of each face: that of most of its points, or that of its first triangle if it has no points. A face without a
    /// triangle has no label.
    pub(super) fn of_faces(&self, carrier: &Carrier) -> Vec<i32> {
        let face_of_triangle = &carrier.mesh().tri_face;
        let n_faces = carrier.graph().faces.len();
        let mut votes = vec![Votes::default(); n_faces];
        for (&triangle, &label) in self.triangles.iter().zip(&self.of_point) {
            votes[face_of_triangle[triangle as usize] as usize].add(label);
        }
        let mut of_face: Vec<Option<i32>> = votes.iter().map(Votes::winner).collect();
        for (&face, &label) in face_of_triangle.iter().zip(&self.of_triangle) {
            of_face[face as usize].get_or_insert(label);
        }
        of_face
            .into_iter()
            .map(|label| label.unwrap_or(IGNORE))
            .collect()
    }

    /// The carrier with the predicted labels. They are a further layer of a B-Rep, and the given labels of any other shape.
    ///
    /// # Errors
    /// If the mesh has no extent.
    pub(super) fn carrier(&self, carrier: &Carrier) -> Result<Carrier> {
        if carrier.kind() == ShapeKind::Brep {
            let layer = LabelLayer::from(self.of_faces(carrier));
            return Ok(carrier.clone().with_layer(LAYER, layer)?);
        }
        let (mesh, meta) = (carrier.mesh(), carrier.meta());
        let is_cloud = carrier.kind() == ShapeKind::Cloud;
        let given = GivenShape {
            vertices: mesh.vertices.clone(),
            normals: if is_cloud {
                mesh.vertex_normal.clone()
            } else {
                Vec::new()
            },
            triangles: if is_cloud {
                Vec::new()
            } else {
                mesh.triangles.clone()
            },
            labels: self.of_triangle.clone(),
            notes: vec!["labels: predicted by a trained backbone".to_owned()],
            ..GivenShape::default()
        };
        let made = carrier_of_given(given, &meta.id, &meta.source_sha256)?;
        let layer = LabelLayer::from(made.part_of_face().to_vec());
        Ok(made.with_layer(LAYER, layer)?)
    }
}

/// The number of points of each label.
#[derive(Clone, Debug, Default)]
struct Votes(BTreeMap<i32, usize>);

impl Votes {
    fn add(&mut self, label: i32) {
        *self.0.entry(label).or_default() += 1;
    }

    /// The most frequent label, or `None` if there is no point. In a tie, it is the lowest one.
    fn winner(&self) -> Option<i32> {
        let (label, _) = self
            .0
            .iter()
            .max_by(|(a, n), (b, m)| n.cmp(m).then_with(|| b.cmp(a)))?;
        Some(*label)
    }
}

fn centroid(corners: [Point; 3]) -> Point {
    let [a, b, c] = corners;
    std::array::from_fn(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_frequent_label_wins_and_the_lowest_at_a_tie() {
        for (labels, expected) in [
            (&[][..], None),
            (&[3], Some(3)),
            (&[1, 2, 2], Some(2)),
            (&[2, 1, 2, 1], Some(1)),
        ] {
            let mut votes = Votes::default();
            labels.iter().for_each(|&label| votes.add(label));
            assert_eq!(votes.winner(), expected);
        }
    }
}

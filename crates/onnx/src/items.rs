//! Makes the list of the items for which a model computes features: points of a sample, or triangles.

use crate::error::OnnxError;
use partprobe_carrier::{
    Mesh, NormalKind, Point, centroid, keyed_rng, sample_by_area, triangle_area, unit_normal,
};

/// Points or triangles with their data for a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Items {
    /// The position of each point, or the centroid of each triangle, in millimeters.
    pub(crate) positions: Vec<Point>,
    /// The unit normal. It is 0 for a triangle without area.
    pub(crate) normals: Vec<Point>,
    /// The area as a fraction of the surface.
    pub(crate) areas: Vec<f64>,
}

impl Items {
    /// Points that are drawn uniformly by area. `key` names the shape, so each shape has its own random numbers.
    ///
    /// # Errors
    /// If the mesh has no area.
    pub(crate) fn of_points(
        mesh: &Mesh,
        n_points: usize,
        seed: u64,
        key: &str,
    ) -> Result<Self, OnnxError> {
        let mut rng = keyed_rng(seed, &["onnx", key]);
        let sample = sample_by_area(mesh, n_points, NormalKind::Triangle, &mut rng)
            .map_err(|error| OnnxError::NoSurface(error.to_string()))?;
        let widened = |points: &[[f32; 3]]| -> Vec<Point> {
            points.iter().map(|point| point.map(f64::from)).collect()
        };
        Ok(Self {
            positions: widened(&sample.points),
            normals: widened(&sample.normals),
            areas: vec![1.0 / n_points as f64; n_points],
        })
    }

    /// The triangles of a mesh.
    pub(crate) fn of_triangles(mesh: &Mesh) -> Self {
        let corners: Vec<[Point; 3]> = (0..mesh.triangles.len())
            .map(|triangle| mesh.corners(triangle))
            .collect();
        let areas: Vec<f64> = corners
            .iter()
            .map(|&corners| finite_area(corners))
            .collect();
        let total: f64 = areas.iter().sum();
        let fraction = |area: f64| if total > 0.0 { area / total } else { 0.0 };
        Self {
            positions: corners.iter().map(|&corners| centroid(corners)).collect(),
            normals: corners
                .iter()
                .map(|&corners| unit_normal(corners))
                .collect(),
            areas: areas.into_iter().map(fraction).collect(),
        }
    }

    /// The number of items.
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }
}

fn finite_area(corners: [Point; 3]) -> f64 {
    let area = triangle_area(corners);
    if area.is_finite() { area } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of area 3, one of area 1, and one without area.
    fn mesh() -> Mesh {
        let corners = [
            [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
            [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]],
            [[1.0, 1.0, 1.0]; 3],
        ];
        Mesh {
            vertices: corners.iter().flatten().copied().collect(),
            vertex_face: vec![0; 9],
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
            tri_face: vec![0; 3],
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn triangles_have_centroids_normals_and_fractions_of_the_area() {
        let items = Items::of_triangles(&mesh());
        assert_eq!(items.positions[0], [1.0, 2.0 / 3.0, 0.0]);
        assert_eq!(items.normals, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0; 3]]);
        assert_eq!(items.areas, [0.75, 0.25, 0.0]);
    }

    #[test]
    fn points_depend_only_on_the_seed_and_the_shape() {
        let points = |seed, key| Items::of_points(&mesh(), 40, seed, key).unwrap();
        assert_eq!(points(0, "a"), points(0, "a"));
        assert_ne!(points(0, "a"), points(1, "a"));
        assert_ne!(points(0, "a"), points(0, "b"));
        assert_eq!(points(0, "a").len(), 40);

        let flat = Mesh {
            triangles: vec![[6, 7, 8]],
            tri_face: vec![0],
            ..mesh()
        };
        assert!(matches!(
            Items::of_points(&flat, 40, 0, "a"),
            Err(OnnxError::NoSurface(_))
        ));
    }
}

//! Draws points on a mesh, uniformly by area (STEP-Parts, section 4.8: 2×10⁴ points with triangle normals).
//!
//! A mesh and a random generator go in, and points with normals and source triangles come out. The uniform point in a
//! triangle follows Osada et al., "Shape distributions" (2002).

use crate::random::{Rng, unit_interval};
use partprobe_shape::{Mesh, Point, cross, norm, subtract};

/// Points with normals, and the triangle from which each point was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointSample {
    /// Positions in millimeters.
    pub points: Vec<[f32; 3]>,
    /// Outward unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Source triangle of each point.
    pub triangles: Vec<u32>,
}

/// The kind of normal that a sampled point gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NormalKind {
    /// The normal of the triangle, as in the paper. It is constant on a triangle.
    Triangle,
    /// The normal of the true surface, interpolated between the normals that the carrier stores at its vertices.
    Analytic,
}

/// The reason why a carrier cannot be sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// No triangle has an area.
    #[error("the carrier has no surface to sample: the area of its triangles is 0")]
    NoArea,
    /// Analytic normals were requested, but the carrier does not store any.
    #[error("the carrier has no vertex normals; label again with `--attributes normal`")]
    NoVertexNormals,
}

/// Draws `n_points` points uniformly by area from `mesh`.
///
/// Each point of a cloud is drawn at most once. If the cloud has no more than `n_points` points, the sample consists of all of
/// them, in their order. They have the normals of the cloud for any value of `normals`.
///
/// The result depends only on the arguments. Cost: `O(T + n log T)` for `T` triangles.
///
/// # Errors
/// If the mesh has no area, or if `normals` needs vertex normals and the mesh has none.
pub fn sample_by_area(
    mesh: &Mesh,
    n_points: usize,
    normals: NormalKind,
    rng: &mut Rng,
) -> Result<PointSample, SampleError> {
    if mesh.is_cloud() {
        return Ok(points_of_cloud(mesh, n_points, rng));
    }
    if normals == NormalKind::Analytic && mesh.vertex_normal.is_empty() {
        return Err(SampleError::NoVertexNormals);
    }
    let cumulative: Vec<f64> = mesh
        .triangle_areas()
        .iter()
        .scan(0.0, |total, area| {
            *total += area;
            Some(*total)
        })
        .collect();
    let total = cumulative.last().copied().unwrap_or(0.0);
    if !(total > 0.0 && total.is_finite()) {
        return Err(SampleError::NoArea);
    }
    let mut sample = PointSample::default();
    for _ in 0..n_points {
        let [pick, u, v] = [(); 3].map(|()| unit_interval(rng));
        let triangle = cumulative
            .partition_point(|&sum| sum <= pick * total)
            .min(cumulative.len() - 1);
        let weights = barycentric(u, v);
        sample
            .points
            .push(combine(mesh.corners(triangle), weights).map(|x| x as f32));
        sample
            .normals
            .push(normal_at(mesh, triangle, weights, normals));
        sample.triangles.push(triangle as u32);
    }
    Ok(sample)
}

/// Different points of a cloud, in its order. Every set of `n_points` points has the same probability (Knuth, algorithm S).
fn points_of_cloud(cloud: &Mesh, n_points: usize, rng: &mut Rng) -> PointSample {
    let n_all = cloud.triangles.len();
    let mut n_wanted = n_points.min(n_all);
    let mut sample = PointSample::default();
    if n_wanted == 0 {
        return sample;
    }
    for (point, &[vertex, ..]) in (0u32..).zip(&cloud.triangles) {
        let n_left = n_all - point as usize;
        if n_wanted < n_left && n_wanted as f64 <= unit_interval(rng) * n_left as f64 {
            continue;
        }
        n_wanted -= 1;
        sample
            .points
            .push(cloud.vertices[vertex as usize].map(|x| x as f32));
        sample.normals.push(cloud.vertex_normal[vertex as usize]);
        sample.triangles.push(point);
        if n_wanted == 0 {
            break;
        }
    }
    sample
}

/// Uniform weights on a triangle, from two uniform numbers.
fn barycentric(u: f64, v: f64) -> [f64; 3] {
    let root = u.sqrt();
    [1.0 - root, root * (1.0 - v), root * v]
}

fn combine([a, b, c]: [Point; 3], [p, q, r]: [f64; 3]) -> Point {
    [0, 1, 2].map(|axis| p * a[axis] + q * b[axis] + r * c[axis])
}

fn normal_at(mesh: &Mesh, triangle: usize, weights: [f64; 3], kind: NormalKind) -> [f32; 3] {
    let [a, b, c] = mesh.corners(triangle);
    let facet = cross(subtract(b, a), subtract(c, a));
    let normal = match kind {
        NormalKind::Triangle => facet,
        NormalKind::Analytic => {
            let at_corners = mesh.triangles[triangle]
                .map(|vertex| mesh.vertex_normal[vertex as usize].map(f64::from));
            let smooth = combine(at_corners, weights);
            if norm(smooth) > 1e-6 { smooth } else { facet }
        }
    };
    let length = norm(normal);
    normal.map(|x| (x / length) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::keyed_rng;

    /// Two triangles in the planes z = 0 and x = 0. The ratio of their areas is 3 to 1.
    fn corner() -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [3.0, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [0.0, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [0.0, 0.0, 1.0],
            ],
            vertex_face: vec![0, 0, 0, 1, 1, 1],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            tri_face: vec![0, 1],
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn points_lie_on_their_triangles_in_proportion_to_area() {
        let sample = sample_by_area(
            &corner(),
            20_000,
            NormalKind::Triangle,
            &mut keyed_rng(0, &["test"]),
        )
        .unwrap();
        let first = sample
            .triangles
            .iter()
            .filter(|&&triangle| triangle == 0)
            .count();
        assert!(
            (first as f64 - 15_000.0).abs() < 5.0 * (20_000.0f64 * 0.25 * 0.75).sqrt(),
            "{first}"
        );
        for ((point, normal), &triangle) in sample
            .points
            .iter()
            .zip(&sample.normals)
            .zip(&sample.triangles)
        {
            let (axis, expected) = if triangle == 0 {
                (2, [0.0, 0.0, 1.0])
            } else {
                (0, [1.0, 0.0, 0.0])
            };
            assert_eq!(point[axis], 0.0);
            assert_eq!(*normal, expected);
        }
    }

    #[test]
    fn what_cannot_be_sampled_is_refused() {
        let draw = |mesh: &Mesh, kind| sample_by_area(mesh, 1, kind, &mut keyed_rng(0, &["test"]));
        assert_eq!(
            draw(&Mesh::default(), NormalKind::Triangle),
            Err(SampleError::NoArea)
        );
        assert_eq!(
            draw(&corner(), NormalKind::Analytic),
            Err(SampleError::NoVertexNormals)
        );
    }

    #[test]
    fn points_of_a_cloud_are_drawn_once() {
        let points: Vec<Point> = (0..100).map(|x| [f64::from(x), 0.0, 1.0]).collect();
        let cloud = Mesh::cloud(points, vec![[0.0, 0.0, 1.0]; 100]);
        let draw = |n_points, seed| {
            let mut rng = keyed_rng(seed, &["test"]);
            sample_by_area(&cloud, n_points, NormalKind::Triangle, &mut rng).unwrap()
        };
        let all: Vec<u32> = (0..100).collect();
        assert_eq!(draw(100, 0).triangles, all);
        assert_eq!(draw(20_000, 0).triangles, all);
        assert_eq!(draw(0, 0), PointSample::default());

        let some = draw(30, 1);
        assert_eq!(some.points.len(), 30);
        assert!(some.triangles.is_sorted_by(|a, b| a < b));
        assert!(
            some.points
                .iter()
                .zip(&some.triangles)
                .all(|(point, &idx)| point[0] == idx as f32)
        );
        assert_ne!(some.triangles, draw(30, 2).triangles);

        let n_times_first = (0..1000)
            .filter(|&seed| draw(30, seed).triangles[0] == 0)
            .count();
        assert!(
            (n_times_first as f64 - 300.0).abs() < 5.0 * 210.0f64.sqrt(),
            "{n_times_first}"
        );
    }

    #[test]
    fn analytic_normals_are_interpolated() {
        let mesh = Mesh {
            vertex_normal: vec![[0.0, 0.6, 0.8]; 6],
            ..corner()
        };
        let sample = sample_by_area(
            &mesh,
            10,
            NormalKind::Analytic,
            &mut keyed_rng(0, &["test"]),
        )
        .unwrap();
        assert!(
            sample
                .normals
                .iter()
                .all(|normal| (normal[1] - 0.6).abs() < 1e-6)
        );
    }
}

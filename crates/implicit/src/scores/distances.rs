//! Computes distances, F-score and normal consistency of two surfaces.
//!
//! The scores from points to triangles are exact: a surface that is compared with itself scores 0, 1 and 1. Published code
//! computes the scores from points to points. For two samples of one surface, these are not 0 and 1, but the sampling floor.

use super::reconstruction::{Reconstruction, positions};
use crate::geometry::Reference;
use partprobe_carrier::{Mesh, Point, PointSample, bounding_box, dot};
use partprobe_transfer::{
    Limits, Nearest, NearestPoint, NearestSurface, Query, Surface, TransferError, for_all,
};

/// Points that are nearer than this count in the F-score, in units of the longest side.
const NEAR: f64 = 0.005;

/// The scores of two surfaces. Distances are in units of the longest side of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceScores {
    /// The mean distance from one surface to the other, in both directions, halved.
    pub cdl1: f64,
    /// The harmonic mean of the fractions of points that are nearer than 0.005 to the other surface.
    pub f1: f64,
    /// The mean absolute cosine between the normals at a point and at the nearest triangle, in both directions.
    pub nc: f64,
}

/// The same from points to points, as in published code: each surface is scaled to its own bounding box, and the absolute value
/// of the normal consistency is taken for each coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointScores {
    /// See [`SurfaceScores::cdl1`].
    pub cdl1: f64,
    /// See [`SurfaceScores::f1`].
    pub f1: f64,
    /// See [`SurfaceScores::nc`]. Random normals score 0.75.
    pub nc: f64,
}

/// Compares a reconstruction with its reference. `of_reference` are points on the reference.
///
/// # Errors
/// If the reconstruction has coordinates that are not finite.
pub fn surface_scores(
    reconstruction: &Reconstruction,
    reference: &Reference,
    of_reference: &PointSample,
) -> Result<(SurfaceScores, PointScores), TransferError> {
    let side = reference.frame().longest_side();
    let own = NearestSurface::new(Surface::of_mesh(&reconstruction.mesh)?);
    let back: Vec<Nearest> = for_all(&queries(&positions(of_reference)), |query| {
        own.nearest(query, &Limits::NONE)
    })
    .into_iter()
    .flatten()
    .collect();
    let there = direction(
        &reconstruction.sample,
        &reconstruction.nearest,
        reference.mesh(),
        side,
    );
    let back = direction(of_reference, &back, &reconstruction.mesh, side);
    let exact = SurfaceScores {
        cdl1: 0.5 * (there.distance + back.distance),
        f1: harmonic_mean(there.near, back.near),
        nc: 0.5 * (there.normals + back.normals),
    };
    let by_points = point_scores(
        (&reconstruction.sample, &reconstruction.mesh),
        (of_reference, reference.mesh()),
    )?;
    Ok((exact, by_points))
}

/// The scores of two samples of the reference against each other, from points to points.
///
/// # Errors
/// If a coordinate is not finite.
pub fn sampling_floor(
    reference: &Reference,
    first: &PointSample,
    second: &PointSample,
) -> Result<PointScores, TransferError> {
    point_scores((first, reference.mesh()), (second, reference.mesh()))
}

/// Means over the points of one surface.
struct Direction {
    distance: f64,
    near: f64,
    normals: f64,
}

fn direction(sample: &PointSample, nearest: &[Nearest], mesh: &Mesh, side: f64) -> Direction {
    let (mut distance, mut near, mut normals) = (0.0, 0.0, 0.0);
    for (nearest, normal) in nearest.iter().zip(&sample.normals) {
        let relative_distance = nearest.distance / side;
        distance += relative_distance;
        near += f64::from(u8::from(relative_distance <= NEAR));
        let other = partprobe_carrier::unit_normal(mesh.corners(nearest.item as usize));
        normals += dot(normal.map(f64::from), other).abs();
    }
    let n = nearest.len().max(1) as f64;
    Direction {
        distance: distance / n,
        near: near / n,
        normals: normals / n,
    }
}

fn point_scores(
    first: (&PointSample, &Mesh),
    second: (&PointSample, &Mesh),
) -> Result<PointScores, TransferError> {
    let [a, b] = [first, second].map(|(sample, mesh)| scaled(sample, mesh));
    let there = point_direction(&a, &first.0.normals, &b, &second.0.normals)?;
    let back = point_direction(&b, &second.0.normals, &a, &first.0.normals)?;
    Ok(PointScores {
        cdl1: 0.5 * (there.distance + back.distance),
        f1: harmonic_mean(there.near, back.near),
        nc: 0.5 * (there.normals + back.normals),
    })
}

fn point_direction(
    points: &[Point],
    normals: &[[f32; 3]],
    others: &[Point],
    other_normals: &[[f32; 3]],
) -> Result<Direction, TransferError> {
    let tree = NearestPoint::new(others, &[])?;
    let nearest = for_all(&queries(points), |query| tree.nearest(query, &Limits::NONE));
    let (mut distance, mut near, mut normal_sum) = (0.0, 0.0, 0.0);
    for (nearest, normal) in nearest.iter().zip(normals) {
        let Some(nearest) = nearest else { continue };
        distance += nearest.distance;
        near += f64::from(u8::from(nearest.distance <= NEAR));
        let other = other_normals[nearest.item as usize];
        normal_sum += normal
            .iter()
            .zip(other)
            .map(|(a, b)| f64::from((a * b).abs()))
            .sum::<f64>();
    }
    let n = points.len().max(1) as f64;
    Ok(Direction {
        distance: distance / n,
        near: near / n,
        normals: normal_sum / n,
    })
}

/// The points, scaled to the bounding box of their own mesh.
fn scaled(sample: &PointSample, mesh: &Mesh) -> Vec<Point> {
    let Some([low, high]) = bounding_box(&mesh.vertices) else {
        return positions(sample);
    };
    let side = (0..3)
        .map(|axis| high[axis] - low[axis])
        .fold(f64::MIN_POSITIVE, f64::max);
    let center: Point = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let scale = |point: Point| std::array::from_fn(|axis| (point[axis] - center[axis]) / side);
    positions(sample).into_iter().map(scale).collect()
}

fn harmonic_mean(a: f64, b: f64) -> f64 {
    if a + b > 0.0 {
        2.0 * a * b / (a + b)
    } else {
        0.0
    }
}

fn queries(points: &[Point]) -> Vec<Query> {
    let query = |&position: &Point| Query {
        position,
        normal: None,
    };
    points.iter().map(query).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::cuboid;
    use crate::scores::reference_sample;

    /// A reconstruction that is a mesh moved along x.
    fn moved(mesh: &Mesh, reference: &Reference, by: f64) -> Reconstruction {
        let mut mesh = mesh.clone();
        mesh.vertices.iter_mut().for_each(|vertex| vertex[0] += by);
        let shifted = Reference::new(&mesh).unwrap();
        let sample = reference_sample(&shifted, 20_000, "moved", 0);
        let nearest = reference
            .nearest(&positions(&sample))
            .into_iter()
            .flatten()
            .collect();
        Reconstruction {
            label_of_triangle: vec![0; mesh.triangles.len()],
            labels: vec![0; sample.points.len()],
            mesh,
            sample,
            nearest,
        }
    }

    #[test]
    fn a_surface_and_itself_score_0_1_1() {
        let mesh = cuboid([1.0, 1.0, 1.0]);
        let reference = Reference::new(&mesh).unwrap();
        let sample = reference_sample(&reference, 20_000, "box", 0);
        let (exact, by_points) =
            surface_scores(&moved(&mesh, &reference, 0.0), &reference, &sample).unwrap();
        assert!(exact.cdl1 < 1e-7 && exact.f1 == 1.0, "{exact:?}");
        // A point at an edge may get the normal of the other side.
        assert!(exact.nc > 0.999);
        let floor = sampling_floor(
            &reference,
            &sample,
            &reference_sample(&reference, 20_000, "box", 1),
        )
        .unwrap();
        // The mean distance to the nearest of n points on an area A is √(A/n)/2.
        let expected = 0.5 * (6.0f64 / 20_000.0).sqrt();
        assert!((floor.cdl1 / expected - 1.0).abs() < 0.03, "{floor:?}");
        assert!(
            (by_points.cdl1 / expected - 1.0).abs() < 0.03,
            "{by_points:?}"
        );
    }

    #[test]
    fn a_moved_box_has_the_distance_of_its_formula() {
        let mesh = cuboid([1.0, 1.0, 1.0]);
        let reference = Reference::new(&mesh).unwrap();
        let sample = reference_sample(&reference, 20_000, "box", 0);
        let (exact, by_points) =
            surface_scores(&moved(&mesh, &reference, 0.2), &reference, &sample).unwrap();
        // Of six sides, two are 0.1 of the longest side away. Of the other four, a tenth is beyond the other box, at half of this
        // distance on average.
        assert!(
            exact.cdl1 > 0.1 / 3.0 && exact.cdl1 < 0.1 / 3.0 + 0.01,
            "{exact:?}"
        );
        assert!((exact.f1 - 0.62).abs() < 0.02, "{exact:?}");
        // Scaled to their own boxes, both are the same.
        assert!(by_points.cdl1 < 0.01, "{by_points:?}");
    }
}

//! Defines a shape in the frame of the networks, with its signed distances and nearest triangles.

use super::winding::WindingTree;
use partprobe_carrier::{Mesh, Point, PointSample, bounding_box, cross, dot};
use partprobe_transfer::{Limits, Nearest, NearestSurface, Query, Surface, TransferError, for_all};

/// The map between millimeters and the frame in which the longest side of a shape goes from −1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    center: Point,
    half: f64,
}

impl Frame {
    /// A position of the frame.
    #[must_use]
    pub fn to_frame(&self, point: Point) -> Point {
        std::array::from_fn(|axis| (point[axis] - self.center[axis]) / self.half)
    }

    /// A position in millimeters.
    #[must_use]
    pub fn to_millimeters(&self, point: Point) -> Point {
        std::array::from_fn(|axis| self.center[axis] + self.half * point[axis])
    }

    /// The longest side of the shape, in millimeters. It is the unit of all reported distances.
    #[must_use]
    pub fn longest_side(&self) -> f64 {
        2.0 * self.half
    }
}

/// The reason why a shape cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// A corner or a coordinate is not usable.
    #[error(transparent)]
    Surface(#[from] TransferError),
    /// The shape is empty or flat in all directions.
    #[error("the shape has no extent; leave it out")]
    NoExtent,
    /// The shape is a cloud, which has no inside.
    #[error("the shape is a point cloud, which has no inside; leave it out, or give a mesh")]
    Cloud,
    /// The shape has no volume, or is inside out.
    #[error(
        "the triangles enclose a volume of {volume} mm³; a signed distance needs a closed surface with its normals outward"
    )]
    Volume {
        /// The signed volume.
        volume: f64,
    },
    /// For many points, it is undecided whether they are inside.
    #[error(
        "the surface is not closed: {percent:.1} % of the box is neither inside nor outside; leave the shape out"
    )]
    Open {
        /// Points with a winding number far from 0 and 1, in percent.
        percent: f64,
    },
}

/// A closed mesh that is prepared for queries.
#[derive(Clone, Debug)]
pub struct Reference {
    frame: Frame,
    mesh: Mesh,
    nearest: NearestSurface,
    winding: WindingTree,
}

impl Reference {
    /// Prepares a mesh in millimeters.
    ///
    /// Cost: `O(T log T)` for `T` triangles.
    ///
    /// # Errors
    /// If the mesh is a cloud, has no extent or no positive volume, or has corners that are not vertices.
    pub fn new(mesh: &Mesh) -> Result<Self, ReferenceError> {
        let surface = Surface::of_mesh(mesh)?;
        if mesh.is_cloud() {
            return Err(ReferenceError::Cloud);
        }
        let used: Vec<Point> = (0..mesh.triangles.len())
            .flat_map(|t| mesh.corners(t))
            .collect();
        let [low, high] = bounding_box(&used).ok_or(ReferenceError::NoExtent)?;
        let half = (0..3)
            .map(|axis| 0.5 * (high[axis] - low[axis]))
            .fold(0.0, f64::max);
        if !(half > 0.0 && half.is_finite()) {
            return Err(ReferenceError::NoExtent);
        }
        let frame = Frame {
            center: std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis])),
            half,
        };
        let corners: Vec<[Point; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let volume: f64 = corners
            .iter()
            .map(|&[a, b, c]| dot(a, cross(b, c)) / 6.0)
            .sum();
        // A tiny volume may be the rounding error of a flat sheet, and does not count.
        if volume <= 1e-9 * half.powi(3) {
            return Err(ReferenceError::Volume { volume });
        }
        Ok(Self {
            frame,
            nearest: NearestSurface::new(surface),
            winding: WindingTree::new(corners),
            mesh: mesh.clone(),
        })
    }

    /// The frame of the networks.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The points of a sample in the frame of the networks.
    #[must_use]
    pub fn in_frame(&self, sample: &PointSample) -> Vec<[f32; 3]> {
        let position =
            |point: &[f32; 3]| self.frame.to_frame(point.map(f64::from)).map(|x| x as f32);
        sample.points.iter().map(position).collect()
    }

    /// The mesh in millimeters.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The nearest triangle of each point in millimeters.
    #[must_use]
    pub fn nearest(&self, points: &[Point]) -> Vec<Option<Nearest>> {
        for_all(&queries(points), |query| {
            self.nearest.nearest(query, &Limits::NONE)
        })
    }

    /// The signed distance of each point, in millimeters, negative inside, and its winding number.
    ///
    /// The distance is exact. The sign is that of the winding number: a point is inside if it is at least ½.
    #[must_use]
    pub fn signed_distances(&self, points: &[Point]) -> Vec<SignedDistance> {
        for_all(&queries(points), |query| {
            let nearest = self.nearest.nearest(query, &Limits::NONE);
            let distance = nearest.map_or(f64::INFINITY, |nearest| nearest.distance);
            let winding_number = self.winding.winding_number(query.position);
            SignedDistance {
                distance: if winding_number < 0.5 {
                    distance
                } else {
                    -distance
                },
                winding_number,
            }
        })
    }
}

/// The distance and the winding number of a point in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedDistance {
    /// In millimeters, negative inside.
    pub distance: f64,
    /// The number of times that the surface surrounds the point.
    pub winding_number: f64,
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
    use crate::fixtures::{cuboid, sphere, torus};
    use partprobe_carrier::{keyed_rng, unit_interval};

    #[test]
    fn distances_of_a_box_are_those_of_its_formula() {
        let half = [2.0, 1.0, 0.5];
        let reference = Reference::new(&cuboid(half)).unwrap();
        assert_eq!(reference.frame().longest_side(), 4.0);
        let mut rng = keyed_rng(1, &["box"]);
        let points: Vec<Point> = (0..2_000)
            .map(|_| std::array::from_fn(|axis| 2.4 * half[axis] * (unit_interval(&mut rng) - 0.5)))
            .collect();
        for (point, found) in points.iter().zip(reference.signed_distances(&points)) {
            let beyond: Point = std::array::from_fn(|axis| point[axis].abs() - half[axis]);
            let outside = beyond.map(|x| x.max(0.0));
            let inside = beyond
                .into_iter()
                .fold(f64::NEG_INFINITY, f64::max)
                .min(0.0);
            let expected = dot(outside, outside).sqrt() + inside;
            assert!(
                (found.distance - expected).abs() < 1e-12,
                "{point:?}: {found:?}"
            );
        }
    }

    #[test]
    fn the_frame_round_trips() {
        let reference = Reference::new(&torus([2.0, 0.5], [30, 12])).unwrap();
        let frame = reference.frame();
        let there = frame.to_frame([2.5, 0.0, 0.0]);
        assert!((there[0] - 1.0).abs() < 1e-12);
        assert!((frame.to_millimeters(there)[0] - 2.5).abs() < 1e-12);
    }

    #[test]
    fn what_has_no_inside_is_refused() {
        let refused = |mesh: &Mesh| Reference::new(mesh).unwrap_err();
        assert_eq!(refused(&Mesh::default()), ReferenceError::NoExtent);
        let mut flipped = sphere(1.0, [20, 10]);
        flipped
            .triangles
            .iter_mut()
            .for_each(|corners| corners.swap(1, 2));
        assert!(matches!(refused(&flipped), ReferenceError::Volume { volume } if volume < 0.0));
        let cloud = Mesh::cloud(vec![[0.0; 3], [1.0; 3]], vec![[0.0, 0.0, 1.0]; 2]);
        assert_eq!(refused(&cloud), ReferenceError::Cloud);
        let far = Mesh {
            vertices: vec![[f64::NAN; 3]],
            ..Mesh::default()
        };
        assert!(matches!(refused(&far), ReferenceError::Surface(_)));
    }
}

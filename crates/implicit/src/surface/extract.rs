//! Finds the triangles of a surface.
//!
//! First, the distance is computed at the middle of each of 32³ coarse cells. If it is more than twice the cell's radius, the
//! cell is left out. If the surface leaves a cell, the neighbor there is added again. So the surface has no holes, even if the
//! distances are wrong.

use super::cube::{CORNERS, Cases, Edge};
use super::grid::{COARSE, Resolution, coarse_center, coarse_radius};
use crate::network::Network;
use partprobe_carrier::{Mesh, Point};
use std::collections::HashMap;

/// A coarse cell is left out if the surface is farther away than this many of its radii. A learned distance has a slope of about
/// 1. If the slope is at most 2, nothing is missed.
const MARGIN: f32 = 2.0;

/// The smallest distance of a vertex from a grid point, as a fraction of a cell. So vertices do not coincide if a distance is
/// exactly 0.
const LEAST: f64 = 1e-4;

/// The reason why a network has no surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The distance is never 0.
    #[error("the network has no surface: its distance has the same sign everywhere; train longer")]
    Empty,
    /// A distance is NaN.
    #[error("the network's distance is not a number; lower the learning rate")]
    NotANumber,
}

/// The surface of a network, in its frame. Its normals point outward. It is closed except at the border of the grid, which is
/// slightly outside of the frame's cube.
///
/// Cost: one distance per point of the grid near the surface, on the threads of the current pool.
///
/// # Errors
/// If there is no surface.
pub fn surface(network: &Network, resolution: Resolution) -> Result<Mesh, SurfaceError> {
    let distances = |positions: &[[f32; 3]]| network.distances(positions);
    Narrowed::new(resolution, distances)?.mesh()
}

/// Values on a part of the grid.
struct Narrowed<F> {
    resolution: Resolution,
    distances: F,
    /// One value per grid point. It is NaN if it is not known.
    values: Vec<f32>,
    /// Whether each coarse cell is active.
    is_active: Vec<bool>,
}

impl<F: Fn(&[[f32; 3]]) -> Vec<f32>> Narrowed<F> {
    fn new(resolution: Resolution, distances: F) -> Result<Self, SurfaceError> {
        let centers: Vec<[f32; 3]> = (0..COARSE.pow(3))
            .map(|cell| coarse_center(cell_of(cell)))
            .collect();
        let found = distances(&centers);
        if found.iter().any(|x| !x.is_finite()) {
            return Err(SurfaceError::NotANumber);
        }
        let near = MARGIN * coarse_radius();
        let mut narrowed = Self {
            resolution,
            distances,
            values: vec![f32::NAN; (resolution.n_cells() + 1).pow(3)],
            is_active: found.iter().map(|x| x.abs() <= near).collect(),
        };
        let mut waiting: Vec<usize> = (0..found.len())
            .filter(|&cell| narrowed.is_active[cell])
            .collect();
        // If the sign changes between two middles, there is a surface between them, for any distances.
        waiting.extend(narrowed.where_signs_change(&found));
        while !waiting.is_empty() {
            narrowed.compute(&waiting)?;
            waiting = narrowed.cells_that_are_missing();
        }
        Ok(narrowed)
    }

    /// Cells without values that have another sign than a neighbor. They are made active.
    fn where_signs_change(&mut self, found: &[f32]) -> Vec<usize> {
        let mut added = Vec::new();
        for cell in 0..found.len() {
            let differs = |other: usize| (found[other] < 0.0) != (found[cell] < 0.0);
            if !self.is_active[cell] && neighbors(cell).any(differs) {
                added.push(cell);
            }
        }
        for &cell in &added {
            self.is_active[cell] = true;
        }
        added
    }

    /// Computes the distance at all grid points of these cells that have none.
    fn compute(&mut self, cells: &[usize]) -> Result<(), SurfaceError> {
        let (mut points, mut positions) = (Vec::new(), Vec::new());
        for &cell in cells {
            for grid_point in self.points_of(cell) {
                let index = self.resolution.point(grid_point);
                if self.values[index].is_nan() {
                    // Any number marks the point as used.
                    self.values[index] = 0.0;
                    points.push(index);
                    positions.push(grid_point.map(|x| self.resolution.coordinate(x)));
                }
            }
        }
        let found = (self.distances)(&positions);
        for (index, value) in points.into_iter().zip(found) {
            if !value.is_finite() {
                return Err(SurfaceError::NotANumber);
            }
            self.values[index] = value;
        }
        Ok(())
    }

    /// Cells that are left out although the surface enters them from a neighbor. They are made active.
    fn cells_that_are_missing(&mut self) -> Vec<usize> {
        let mut missing = Vec::new();
        for cell in (0..self.is_active.len()).filter(|&cell| !self.is_active[cell]) {
            let known = self
                .points_of(cell)
                .map(|point| self.values[self.resolution.point(point)]);
            let (mut inside, mut outside) = (false, false);
            for value in known.filter(|value| !value.is_nan()) {
                inside |= value < 0.0;
                outside |= value >= 0.0;
            }
            if inside && outside {
                missing.push(cell);
            }
        }
        for &cell in &missing {
            self.is_active[cell] = true;
        }
        missing
    }

    /// The grid points of a coarse cell, including those of its border.
    fn points_of(&self, cell: usize) -> impl Iterator<Item = [usize; 3]> + use<F> {
        let per_coarse = self.resolution.per_coarse();
        let first = cell_of(cell).map(|index| index * per_coarse);
        let n = per_coarse + 1;
        (0..n * n * n).map(move |i| [first[0] + i % n, first[1] + i / n % n, first[2] + i / n / n])
    }

    fn mesh(&self) -> Result<Mesh, SurfaceError> {
        let cases = Cases::new();
        let per_coarse = self.resolution.per_coarse();
        let mut builder = Builder::default();
        for cell in (0..self.is_active.len()).filter(|&cell| self.is_active[cell]) {
            let first = cell_of(cell).map(|index| index * per_coarse);
            for i in 0..per_coarse.pow(3) {
                let at = [
                    i % per_coarse,
                    i / per_coarse % per_coarse,
                    i / per_coarse / per_coarse,
                ];
                let cube: [usize; 3] = std::array::from_fn(|axis| first[axis] + at[axis]);
                self.add_cube(cube, &cases, &mut builder);
            }
        }
        if builder.triangles.is_empty() {
            return Err(SurfaceError::Empty);
        }
        Ok(Mesh {
            vertex_face: vec![0; builder.vertices.len()],
            tri_face: vec![0; builder.triangles.len()],
            vertices: builder.vertices,
            triangles: builder.triangles,
            vertex_normal: Vec::new(),
        })
    }

    fn add_cube(&self, cube: [usize; 3], cases: &Cases, builder: &mut Builder) {
        let corner = |corner: usize| std::array::from_fn(|axis| cube[axis] + (corner >> axis & 1));
        let mut case = 0u8;
        for index in 0..CORNERS {
            let is_inside = self.values[self.resolution.point(corner(index))] < 0.0;
            case |= u8::from(is_inside) << index;
        }
        for edges in cases.triangles(case) {
            let corners =
                edges.map(|edge| self.vertex(corner(usize::from(edge.corner)), edge, builder));
            builder.triangles.push(corners);
        }
    }

    /// The vertex on an edge of the grid, at the zero of the linearly interpolated distance.
    fn vertex(&self, from: [usize; 3], edge: Edge, builder: &mut Builder) -> u32 {
        let axis = usize::from(edge.axis);
        let start = self.resolution.point(from);
        if let Some(&vertex) = builder.vertex_of_edge.get(&(start, edge.axis)) {
            return vertex;
        }
        let mut to = from;
        to[axis] += 1;
        let [a, b] = [start, self.resolution.point(to)].map(|point| f64::from(self.values[point]));
        let mut position: Point = from.map(|index| f64::from(self.resolution.coordinate(index)));
        let end = f64::from(self.resolution.coordinate(to[axis]));
        position[axis] += (end - position[axis]) * (a / (a - b)).clamp(LEAST, 1.0 - LEAST);
        let vertex = builder.vertices.len() as u32;
        builder.vertices.push(position);
        builder.vertex_of_edge.insert((start, edge.axis), vertex);
        vertex
    }
}

#[derive(Default)]
struct Builder {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    vertex_of_edge: HashMap<(usize, u8), u32>,
}

fn cell_of(index: usize) -> [usize; 3] {
    [
        index % COARSE,
        index / COARSE % COARSE,
        index / COARSE / COARSE,
    ]
}

/// The cells at the six sides of a coarse cell.
fn neighbors(cell: usize) -> impl Iterator<Item = usize> {
    let at = cell_of(cell);
    (0..3).flat_map(move |axis| {
        let stride = COARSE.pow(axis as u32);
        let below = (at[axis] > 0).then(|| cell - stride);
        let above = (at[axis] + 1 < COARSE).then(|| cell + stride);
        below.into_iter().chain(above)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{norm, solid_mesh, weld};

    fn extracted(
        n_cells: usize,
        distance: impl Fn([f32; 3]) -> f32 + Copy,
    ) -> Result<Mesh, SurfaceError> {
        let distances = |positions: &[[f32; 3]]| positions.iter().map(|&x| distance(x)).collect();
        Narrowed::new(Resolution::new(n_cells).unwrap(), distances)?.mesh()
    }

    fn ball([x, y, z]: [f32; 3], center: f32, radius: f32) -> f32 {
        ((x - center).powi(2) + y * y + z * z).sqrt() - radius
    }

    #[test]
    fn a_ball_is_closed_and_has_its_volume() {
        let mesh = extracted(64, |x| ball(x, 0.0, 0.8)).unwrap();
        let solid = solid_mesh(&mesh, &weld(&mesh), |_| true);
        let expected = 4.0 / 3.0 * std::f64::consts::PI * 0.8f64.powi(3);
        assert!(
            solid.watertight && (solid.volume / expected - 1.0).abs() < 3e-3,
            "{solid:?}"
        );
        assert!(mesh.vertices.iter().all(|&x| (norm(x) - 0.8).abs() < 2e-3));
    }

    /// Small gaps, thin walls and saddles with very wrong distances: nothing is lost, and the surface is closed.
    #[test]
    fn narrowing_loses_nothing() {
        let waves = |[x, y, z]: [f32; 3]| {
            let gyroid = (7.0 * x).sin() * (7.0 * y).cos()
                + (7.0 * y).sin() * (7.0 * z).cos()
                + (7.0 * z).sin() * (7.0 * x).cos();
            (0.3 * gyroid).max(ball([x, y, z], 0.0, 0.9))
        };
        let steep = |x: [f32; 3]| 40.0 * ball(x, 0.1, 0.5).min(ball(x, -0.6, 0.1));
        check_closed(&extracted(64, waves).unwrap());
        let mesh = extracted(64, steep).unwrap();
        check_closed(&mesh);
        let n_left = mesh.vertices.iter().filter(|x| x[0] < -0.45).count();
        assert!(n_left > 20, "{n_left}");
    }

    #[track_caller]
    fn check_closed(mesh: &Mesh) {
        let solid = solid_mesh(mesh, &weld(mesh), |_| true);
        assert!(solid.watertight && solid.volume > 0.0, "{solid:?}");
    }

    #[test]
    fn what_has_no_surface_is_named() {
        assert_eq!(extracted(32, |_| 1.0).unwrap_err(), SurfaceError::Empty);
        assert_eq!(
            extracted(32, |_| f32::NAN).unwrap_err(),
            SurfaceError::NotANumber
        );
        assert_eq!((Resolution::new(100), Resolution::new(0)), (None, None));
        assert_eq!(Resolution::new(128).unwrap().n_cells(), 128);
    }
}

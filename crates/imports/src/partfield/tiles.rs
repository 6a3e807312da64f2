//! Joins labels exactly: each triangle of the exported mesh is a tile of one triangle of the carrier.
//!
//! The map names this triangle. It is checked first: the tiles of a triangle must lie in it, and together they must have its area
//! and its centroid. A point of the carrier then gets the label of its tile, among the tiles of its own triangle.

use crate::import::{JoinProblem, JoinedLabels};
use crate::mesh::{JoinedMesh, with_report};
use partprobe_carrier::{
    Carrier, IGNORE, Mesh, Point, centroid, distance, norm, subtract, triangle_area,
};
use partprobe_sources::{PointRule, SourceLabels};
use partprobe_transfer::{Limits, NearestSurface, Query, Surface, distance_to_triangle};
use std::fmt;
use std::sync::Arc;

/// The largest distance of the corner of a tile from its triangle, as a fraction of the diagonal. PartField stores positions in
/// single precision.
const TOLERANCE: f64 = 1e-6;

/// The tiles of a carrier.
pub(super) struct Tiles {
    /// The tiles, in the position of the carrier.
    mesh: Mesh,
    nearest: Arc<NearestSurface>,
    /// The triangle of the carrier of each tile.
    parent: Arc<[u32]>,
}

impl Tiles {
    /// The tiles of a carrier, by a mesh and the parent of each of its triangles.
    ///
    /// # Errors
    /// The reason why they are not the tiles of this carrier.
    pub(super) fn new(carrier: &Carrier, mesh: Mesh, parent: Vec<u32>) -> Result<Self, String> {
        check_tiles(
            carrier.mesh(),
            &mesh,
            &parent,
            TOLERANCE * carrier.meta().diagonal_mm,
        )?;
        let surface = Surface::of_mesh(&mesh).map_err(|error| error.to_string())?;
        Ok(Self {
            nearest: Arc::new(NearestSurface::new(surface)),
            mesh,
            parent: parent.into(),
        })
    }

    /// The tiles as a mesh.
    pub(super) fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The label of each tile's triangle.
    pub(super) fn labels_of_parents(&self, of_triangle: &[i32]) -> Vec<i32> {
        let label = |&triangle: &u32| of_triangle[triangle as usize];
        self.parent.iter().map(label).collect()
    }

    /// Joins the labels of the tiles.
    ///
    /// # Errors
    /// If there is not one label per tile, or no tile has one.
    pub(super) fn join(
        &self,
        carrier: &Carrier,
        labels: Vec<i32>,
        entries: Vec<String>,
        content_hash: String,
    ) -> Result<JoinedLabels, JoinProblem> {
        if labels.len() != self.parent.len() {
            return Err(JoinProblem::Refused(format!(
                "there are {} labels, and their mesh has {} triangles",
                labels.len(),
                self.parent.len()
            )));
        }
        let rule = LabelOfTile {
            nearest: Arc::clone(&self.nearest),
            parent: Arc::clone(&self.parent),
            labels,
        };
        let joined = JoinedMesh {
            by: "index",
            labels: SourceLabels::on_points(carrier.mesh(), Arc::new(rule)),
            unused: Vec::new(),
        };
        with_report(joined, entries, content_hash)
    }
}

/// Checks that each tile lies in its parent, and that the tiles of each triangle cover it.
fn check_tiles(own: &Mesh, tiles: &Mesh, parent: &[u32], tolerance: f64) -> Result<(), String> {
    if tiles.triangles.len() != parent.len() {
        return Err(format!(
            "the mesh has {} triangles, and the exported one has {}",
            tiles.triangles.len(),
            parent.len()
        ));
    }
    let mut covers: Vec<Cover> = (0..own.triangles.len())
        .map(|triangle| Cover::new(own.corners(triangle)))
        .collect();
    for (tile, &triangle) in parent.iter().enumerate() {
        let Some(cover) = covers.get_mut(triangle as usize) else {
            return Err("the map was made for another tessellation of this shape".to_owned());
        };
        let corners = tiles.corners(tile);
        let is_inside = |&corner: &Point| distance_to_triangle(corner, cover.around) <= tolerance;
        if !corners.iter().all(is_inside) {
            return Err(format!(
                "triangle {tile} of the mesh is not in triangle {triangle} of the shape"
            ));
        }
        cover.add(corners, tolerance);
    }

    match covers.iter().position(|cover| !cover.is_exact()) {
        Some(triangle) => Err(format!(
            "the triangles of the mesh do not cover triangle {triangle} of the shape exactly"
        )),
        None => Ok(()),
    }
}

/// The area and the first moment of a triangle's tiles. The moment shows a tile that occurs twice instead of another one.
struct Cover {
    around: [Point; 3],
    /// The area that is not covered yet. It is negative if too much is covered.
    left: f64,
    /// The first moment of the tiles around the centroid of the triangle.
    moment: Point,
    /// The largest rounding errors of the area and of the moment.
    allowed: [f64; 2],
}

impl Cover {
    fn new(around: [Point; 3]) -> Self {
        Self {
            around,
            left: triangle_area(around),
            moment: [0.0; 3],
            allowed: [0.0; 2],
        }
    }

    /// Adds a tile whose corners may be off by the tolerance.
    fn add(&mut self, corners: [Point; 3], tolerance: f64) {
        let area = triangle_area(corners);
        let offset = subtract(centroid(corners), centroid(self.around));
        let area_error = tolerance * perimeter(corners);
        self.left -= area;
        for (moment, x) in self.moment.iter_mut().zip(offset) {
            *moment += area * x;
        }
        self.allowed[0] += area_error;
        self.allowed[1] += tolerance * area + area_error * norm(offset);
    }

    fn is_exact(&self) -> bool {
        self.left.abs() <= self.allowed[0] && norm(self.moment) <= self.allowed[1]
    }
}

fn perimeter([a, b, c]: [Point; 3]) -> f64 {
    distance(a, b) + distance(b, c) + distance(c, a)
}

/// The label of a point's tile.
struct LabelOfTile {
    nearest: Arc<NearestSurface>,
    parent: Arc<[u32]>,
    labels: Vec<i32>,
}

impl fmt::Debug for LabelOfTile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the label of one of {} tiles", self.labels.len())
    }
}

impl PointRule for LabelOfTile {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let query = Query {
            position: point,
            normal: None,
        };
        let is_own = |tile: u32| self.parent[tile as usize] == triangle;
        let found = self.nearest.nearest_among(&query, &Limits::NONE, is_own);
        found.map_or(IGNORE, |found| self.labels[found.item as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::refine;

    fn square() -> Mesh {
        Mesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            tri_face: vec![0; 2],
            vertex_normal: Vec::new(),
        }
    }

    #[track_caller]
    fn check(change: impl Fn(&mut Mesh, &mut Vec<u32>), expected: Result<(), &str>) {
        let refined = refine(&square(), 0.3);
        let (mut tiles, mut parent) = (refined.mesh, refined.parent);
        change(&mut tiles, &mut parent);
        let found = check_tiles(&square(), &tiles, &parent, 1e-6);
        match (found, expected) {
            (Ok(()), Ok(())) => {}
            (Err(reason), Err(expected)) => assert!(reason.contains(expected), "{reason}"),
            (found, expected) => panic!("{found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn only_a_tiling_is_accepted() {
        check(|_, _| (), Ok(()));
        check(
            |tiles, _| {
                tiles
                    .vertices
                    .iter_mut()
                    .flatten()
                    .for_each(|x| *x = f64::from(*x as f32))
            },
            Ok(()),
        );
        check(
            |_, parent| _ = parent.pop(),
            Err("and the exported one has"),
        );
        check(|_, parent| parent[3] = 2, Err("another tessellation"));
        check(|_, parent| parent.reverse(), Err("is not in triangle"));
        check(
            |tiles, _| tiles.vertices[0][2] = 1e-3,
            Err("is not in triangle 0 of the shape"),
        );
        check(
            |tiles, _| tiles.triangles[1] = tiles.triangles[0],
            Err("do not cover triangle 0"),
        );
    }
}

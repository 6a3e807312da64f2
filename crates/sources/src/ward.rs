//! `ward-<K>`: Ward linkage of the triangles on features that cannot see sharp edges, at most K labels.
//!
//! This is a stand-in for a learned feature field that is clustered over the faces of a mesh. It contains no learned
//! features and is not a reimplementation of any published method, so its scores say nothing of one.
//!
//! The features of a triangle are the mean normal of the surface around it and its position. The mean runs over a cell
//! of a coarse grid and the cells beside it, so that thin walls, fillets and close edges blur into each other.
//! The three constants below are fixed: they were chosen before any score was seen, and must not follow scores.

use crate::factory::SourceFactory;
use crate::region_merging::welded_borders;
use crate::source::SourceLabels;
use crate::triangle_normal::normal_and_area;
use crate::ward_linkage::{Row, ward};
use carrier::{Labels, Mesh, Point, REFINE_FRACTION, refine, weld};
use std::collections::BTreeMap;

/// The side of a cell of the grid, as a fraction of the diagonal of the bounding box.
const CELL_FRACTION: f64 = 1.0 / 32.0;

/// The mean runs over this many cells on each side of the middle one, on each axis.
const REACH: i64 = 1;

/// What a distance of half the diagonal counts, where a difference of one normal length counts 1.
const WEIGHT_OF_POSITION: f64 = 1.0;

/// The labels of a smaller K are unions of those of a larger one.
pub(crate) const WARD: SourceFactory = SourceFactory::numbered_rule(
    "ward-<K>",
    "Ward linkage of triangles on blurred normals and position, at most K labels; a stand-in for learned features",
    1..=1000,
    |carrier, n_max, _| {
        let mesh = carrier.mesh();
        let areas: Vec<f64> = (0..mesh.triangles.len()).map(|triangle| normal_and_area(mesh, triangle).1).collect();
        let neighbors: Vec<[u32; 2]> = welded_borders(&weld(mesh)).iter().map(|border| border.between).collect();
        let total: f64 = areas.iter().sum();
        let weights: Vec<f64> = areas.iter().map(|area| if total > 0.0 { area / total } else { 0.0 }).collect();

        let clusters = ward(&features(mesh), &weights, &neighbors, n_max as usize);
        let raw: Vec<i32> = clusters.parts().iter().map(|&cluster| cluster as i32).collect();
        Ok(SourceLabels::on_plain(Labels::compacted(&raw)))
    },
);

/// The blurred normal and the position of each triangle, all finite.
fn features(mesh: &Mesh) -> Vec<Row> {
    let diagonal = mesh.diagonal();
    let scale = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
    // A large triangle lies in many cells: its pieces are what the grid sees.
    let fine = refine(mesh, scale * REFINE_FRACTION);
    let pieces: Vec<Piece> =
        (0..fine.mesh.triangles.len()).map(|piece| Piece::of(&fine.mesh, piece, scale * CELL_FRACTION)).collect();
    let field = blurred(&pieces);

    let mut sums = vec![([0.0; 6], 0.0); mesh.triangles.len()];
    for (piece, &parent) in pieces.iter().zip(&fine.parent) {
        let normal = field[&piece.cell];
        let position = piece.centroid.map(|x| WEIGHT_OF_POSITION * x / (0.5 * scale));
        let (sum, area) = &mut sums[parent as usize];
        for (sum, x) in sum.iter_mut().zip(normal.into_iter().chain(position)) {
            *sum += piece.area * x;
        }
        *area += piece.area;
    }
    let mean = |(sum, area): ([f64; 6], f64)| if area > 0.0 { sum.map(|x| x / area) } else { [0.0; 6] };
    sums.into_iter().map(mean).collect()
}

type Cell = [i64; 3];

/// A piece of a triangle that is about as small as a cell.
struct Piece {
    cell: Cell,
    centroid: Point,
    normal: Point,
    area: f64,
}

impl Piece {
    fn of(mesh: &Mesh, triangle: usize, cell_size: f64) -> Self {
        let [a, b, c] = mesh.corners(triangle);
        let centroid = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
        let (normal, area) = normal_and_area(mesh, triangle);
        Self { cell: centroid.map(|x| (x / cell_size).floor() as i64), centroid, normal, area }
    }
}

/// The mean normal around each cell, weighted by area; shorter than 1 where the surface bends or folds back.
fn blurred(pieces: &[Piece]) -> BTreeMap<Cell, Point> {
    let mut cells: BTreeMap<Cell, (Point, f64)> = BTreeMap::new();
    for piece in pieces {
        let (sum, area) = cells.entry(piece.cell).or_insert(([0.0; 3], 0.0));
        *sum = [0, 1, 2].map(|axis| sum[axis] + piece.area * piece.normal[axis]);
        *area += piece.area;
    }

    let around = |cell: &Cell| {
        let mut total = ([0.0; 3], 0.0);
        for x in -REACH..=REACH {
            for y in -REACH..=REACH {
                let from = [cell[0].saturating_add(x), cell[1].saturating_add(y), cell[2].saturating_sub(REACH)];
                let to = [from[0], from[1], cell[2].saturating_add(REACH)];
                for (sum, area) in cells.range(from..=to).map(|(_, sums)| sums) {
                    total.0 = [0, 1, 2].map(|axis| total.0[axis] + sum[axis]);
                    total.1 += area;
                }
            }
        }
        let (sum, area) = total;
        if area > 0.0 { sum.map(|x| x / area) } else { [0.0; 3] }
    };
    cells.keys().map(|cell| (*cell, around(cell))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use carrier::Point;

    fn mesh_of(triangles: &[[Point; 3]]) -> Mesh {
        Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            vertex_face: vec![0; 3 * triangles.len()],
            triangles: (0..).take(triangles.len()).map(|n: u32| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
            tri_face: vec![0; triangles.len()],
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn far_from_edges_the_normal_is_the_triangles_own() {
        let features = features(&mesh_of(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]));
        assert!((features[0][2] - 1.0).abs() < 1e-9 && features[0][..2] == [0.0, 0.0], "{features:?}");
    }

    #[test]
    fn the_two_sides_of_a_thin_wall_are_one_to_the_grid() {
        let side = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        let [a, b, c] = side(0.001);
        let thin = features(&mesh_of(&[side(0.02), [a, c, b]]));
        let [d, e, f] = side(0.5);
        let thick = features(&mesh_of(&[side(0.02), [d, f, e]]));
        assert!(thin.iter().all(|row| row[2].abs() < 0.2), "{thin:?}");
        assert!(thick.iter().all(|row| row[2].abs() > 0.99), "{thick:?}");
    }

    #[test]
    fn meshes_without_area_have_finite_features() {
        for triangle in [[[0.0; 3]; 3], [[f64::NAN; 3]; 3], [[f64::INFINITY; 3]; 3]] {
            assert!(features(&mesh_of(&[triangle])).iter().flatten().all(|x| x.is_finite()));
        }
        assert!(features(&Mesh::default()).is_empty());
    }
}

//! `ward-<K>`: Ward linkage of small triangles on features that cannot see sharp edges, at most K labels.
//!
//! This is a stand-in for a learned feature field that is clustered over the faces of a mesh. It contains no learned
//! features and is not a reimplementation of any published method, so its scores say nothing of one.
//!
//! The mesh is refined first, so that a cluster may end in the middle of a large triangle and labels belong to points.
//! The features of a small triangle are the mean normal of the surface around it and its position. The mean runs over a cell
//! of a coarse grid and the cells beside it, so that thin walls, fillets and close edges blur into each other.
//! The constants below are fixed: they were chosen before any score was seen, and must not follow scores.

use crate::factory::SourceFactory;
use crate::region_merging::welded_borders;
use crate::source::{PointRule, SourceLabels};
use crate::triangle_normal::normal_and_area;
use crate::ward_linkage::{Row, ward};
use partprobe_carrier::{
    IGNORE, Mesh, Point, REFINE_FRACTION, Refined, cross, dot, refine, refined_triangle_counts,
    subtract, weld,
};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// The side of a cell of the grid, as a fraction of the diagonal of the bounding box.
const CELL_FRACTION: f64 = 1.0 / 32.0;

/// The mean runs over this many cells on each side of the middle one, on each axis.
const REACH: i64 = 1;

/// The mesh is refined less if it would have this many pieces.
const MAX_PIECES: u32 = 50_000;

/// What a distance of half the diagonal counts, where a difference of one normal length counts 1.
const WEIGHT_OF_POSITION: f64 = 1.0;

/// The labels of a smaller K are unions of those of a larger one.
pub(crate) const WARD: SourceFactory = SourceFactory::numbered_rule(
    "ward-<K>",
    "Ward linkage of small triangles on blurred normals and position, at most K labels; no learned features",
    1..=1000,
    |carrier, n_max, _| {
        let rule = WardClusters::new(carrier.mesh(), n_max as usize);
        Ok(SourceLabels::on_points(carrier.mesh(), Arc::new(rule)))
    },
);

/// The clusters of the refined mesh, whose triangles are about as small as a cell.
#[derive(Debug)]
struct WardClusters {
    fine: Mesh,
    /// Where the pieces of each triangle of the plain mesh begin, and the end of the last.
    first_piece: Vec<usize>,
    cluster: Vec<u32>,
}

impl WardClusters {
    fn new(mesh: &Mesh, n_max: usize) -> Self {
        let size = size(mesh);
        let Refined { mesh: fine, parent } = refine(mesh, longest_edge(mesh));
        let pieces: Vec<Piece> = (0..fine.triangles.len())
            .map(|piece| Piece::of(&fine, piece, size * CELL_FRACTION))
            .collect();
        let total: f64 = pieces.iter().map(|piece| piece.area).sum();
        let share = |piece: &Piece| if total > 0.0 { piece.area / total } else { 0.0 };
        let weights: Vec<f64> = pieces.iter().map(share).collect();
        let neighbors: Vec<[u32; 2]> = welded_borders(&weld(&fine))
            .iter()
            .map(|border| border.between)
            .collect();

        let clusters = ward(&features(&pieces, size), &weights, &neighbors, n_max);
        let starts = 0..=mesh.triangles.len();
        let first_piece = starts
            .map(|triangle| parent.partition_point(|&of| (of as usize) < triangle))
            .collect();
        Self {
            fine,
            first_piece,
            cluster: clusters.parts().to_vec(),
        }
    }

    /// The piece that contains the point, or that it misses least.
    fn piece_at(&self, pieces: Range<usize>, point: Point) -> Option<usize> {
        let inside = |&piece: &usize| least_barycentric(self.fine.corners(piece), point);
        pieces.max_by(|a, b| inside(a).total_cmp(&inside(b)))
    }
}

impl PointRule for WardClusters {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let bounds =
            [triangle as usize, triangle as usize + 1].map(|at| self.first_piece.get(at).copied());
        let [Some(first), Some(end)] = bounds else {
            return IGNORE;
        };
        self.piece_at(first..end, point)
            .map_or(IGNORE, |piece| self.cluster[piece] as i32)
    }
}

/// The smallest of the point's three barycentric coordinates: not negative inside the triangle.
fn least_barycentric([a, b, c]: [Point; 3], point: Point) -> f64 {
    let normal = cross(subtract(b, a), subtract(c, a));
    let squared = dot(normal, normal);
    if squared <= 0.0 || !squared.is_finite() {
        return f64::NEG_INFINITY;
    }
    let across = |from: Point, to: Point| {
        dot(normal, cross(subtract(to, from), subtract(point, from))) / squared
    };
    across(a, b).min(across(b, c)).min(across(c, a))
}

/// The longest edge of a piece: 1/32 of the diagonal, or a power of two times that if there were too many pieces.
///
/// Long needles need it: each would fall into dozens of pieces.
fn longest_edge(mesh: &Mesh) -> f64 {
    let one_part = vec![
        0;
        mesh.tri_face
            .iter()
            .max()
            .map_or(0, |&last| last as usize + 1)
    ];
    let is_too_much = |edge: f64| {
        refined_triangle_counts(mesh, &one_part, edge, MAX_PIECES)
            .iter()
            .any(|&count| MAX_PIECES <= count)
    };

    let mut edge = size(mesh) * REFINE_FRACTION;
    while edge < size(mesh) && is_too_much(edge) {
        edge *= 2.0;
    }
    edge
}

/// The diagonal of the bounding box, or 1 where there is none to scale by.
fn size(mesh: &Mesh) -> f64 {
    let diagonal = mesh.diagonal();
    if diagonal > 0.0 && diagonal.is_finite() {
        diagonal
    } else {
        1.0
    }
}

/// The blurred normal and the position of each piece, all finite.
fn features(pieces: &[Piece], size: f64) -> Vec<Row> {
    let field = blurred(pieces);
    let feature = |piece: &Piece| {
        let [x, y, z] = piece
            .centroid
            .map(|x| WEIGHT_OF_POSITION * x / (0.5 * size));
        let [u, v, w] = field[&piece.cell];
        let row = [u, v, w, x, y, z];
        if row.iter().all(|x| x.is_finite()) {
            row
        } else {
            [0.0; 6]
        }
    };
    pieces.iter().map(feature).collect()
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
        Self {
            cell: centroid.map(|x| (x / cell_size).floor() as i64),
            centroid,
            normal,
            area,
        }
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
                let from = [
                    cell[0].saturating_add(x),
                    cell[1].saturating_add(y),
                    cell[2].saturating_sub(REACH),
                ];
                let to = [from[0], from[1], cell[2].saturating_add(REACH)];
                for (sum, area) in cells.range(from..=to).map(|(_, sums)| sums) {
                    total.0 = [0, 1, 2].map(|axis| total.0[axis] + sum[axis]);
                    total.1 += area;
                }
            }
        }
        let (sum, area) = total;
        if area > 0.0 {
            sum.map(|x| x / area)
        } else {
            [0.0; 3]
        }
    };
    cells.keys().map(|cell| (*cell, around(cell))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh_of(triangles: &[[Point; 3]]) -> Mesh {
        Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            vertex_face: vec![0; 3 * triangles.len()],
            triangles: (0..)
                .take(triangles.len())
                .map(|n: u32| [3 * n, 3 * n + 1, 3 * n + 2])
                .collect(),
            tri_face: vec![0; triangles.len()],
            vertex_normal: Vec::new(),
        }
    }

    fn features_of(triangles: &[[Point; 3]]) -> Vec<Row> {
        let mesh = mesh_of(triangles);
        let fine = refine(&mesh, longest_edge(&mesh)).mesh;
        let cell = size(&mesh) * CELL_FRACTION;
        let piece = |piece| Piece::of(&fine, piece, cell);
        features(
            &(0..fine.triangles.len()).map(piece).collect::<Vec<_>>(),
            size(&mesh),
        )
    }

    #[test]
    fn far_from_edges_the_normal_is_the_triangles_own() {
        let features = features_of(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
        assert!(features.len() > 500, "{}", features.len());
        assert!(
            features
                .iter()
                .all(|row| (row[2] - 1.0).abs() < 1e-9 && row[..2] == [0.0, 0.0]),
            "{features:?}"
        );
    }

    #[test]
    fn the_two_sides_of_a_thin_wall_are_one_to_the_grid() {
        let side = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        let mean_z = |z: f64| {
            let [a, b, c] = side(z);
            let rows = features_of(&[side(0.02), [a, c, b]]);
            rows.iter().map(|row| row[2].abs()).sum::<f64>() / rows.len() as f64
        };
        assert!(mean_z(0.001) < 0.2, "{}", mean_z(0.001));
        assert!(mean_z(0.5) > 0.99, "{}", mean_z(0.5));
    }

    #[test]
    fn a_mesh_of_needles_is_refined_less() {
        let needle = |n: u32| {
            let angle = f64::from(n) * 1e-4;
            [
                [0.0; 3],
                [angle.cos(), angle.sin(), 0.0],
                [(angle + 1e-4).cos(), (angle + 1e-4).sin(), 0.0],
            ]
        };
        let needles: Vec<[Point; 3]> = (0..4000).map(needle).collect();
        let rule = WardClusters::new(&mesh_of(&needles), 20);
        assert!(
            rule.cluster.len() < MAX_PIECES as usize && 8000 < rule.cluster.len(),
            "{}",
            rule.cluster.len()
        );
    }

    #[test]
    fn each_piece_is_found_at_its_centroid() {
        let mesh = mesh_of(&[
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ]);
        let rule = WardClusters::new(&mesh, 40);
        for triangle in 0..2 {
            for piece in rule.first_piece[triangle]..rule.first_piece[triangle + 1] {
                let [a, b, c] = rule.fine.corners(piece);
                let centroid = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
                assert_eq!(
                    rule.label(triangle as u32, centroid),
                    rule.cluster[piece] as i32
                );
            }
        }
        assert_eq!(rule.label(2, [0.0; 3]), IGNORE);
        assert_eq!(rule.first_piece[2], rule.cluster.len());
    }

    #[test]
    fn meshes_without_area_have_finite_features() {
        for triangle in [[[0.0; 3]; 3], [[f64::NAN; 3]; 3], [[f64::INFINITY; 3]; 3]] {
            assert!(
                features_of(&[triangle])
                    .iter()
                    .flatten()
                    .all(|x| x.is_finite())
            );
        }
        assert!(features_of(&[]).is_empty());
    }
}

//! Clusters small triangles into at most K labels by Ward's rule, on features in which sharp edges are blurred: `ward-<K>` and
//! its variants.
//!
//! This is a substitute for a learned feature field that is clustered over the faces of a mesh. It contains no learned features
//! and is not a reimplementation of any published method, so its scores do not apply to such a method.
//!
//! The mesh is refined first, so that a cluster may end in the middle of a large triangle and labels belong to points. The
//! features of a small triangle are the mean normal of the surface around it and its position. The mean runs over a cell of a
//! coarse grid and the cells next to it, so thin walls, fillets and close edges blur into each other. `ward-20-sharp` does not
//! blur, and `ward-20-coarse` blurs over cells of twice the size. The constants below are fixed. They were chosen before any
//! score was known and must not be changed because of scores.

use crate::degraded::step_parts;
use crate::factory::SourceFactory;
use crate::pieces::{PieceLabels, Pieces};
use crate::region_merging::welded_borders;
use crate::source::SourceLabels;
use crate::triangle_normal::{normal_and_area, size_or_one};
use partprobe_carrier::{Carrier, Mesh, Point, ShapeKind, weld};
use partprobe_cluster::{WardTree, WeightedRow};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The mean runs over this many cells on each side of the middle one, on each axis.
const REACH: i64 = 1;

/// The weight of a distance of half the diagonal, if a difference of one normal length has the weight 1.
const WEIGHT_OF_POSITION: f64 = 1.0;

/// The largest number of labels of the variants whose names do not end with a number.
const MANY: usize = 20;

/// The blurred normal of a small triangle, and its position.
type Row = [f64; 6];

/// The amount of blur of the normals.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Blur {
    /// The normal is that of the triangle itself.
    None,
    /// The normal is the mean over cells with this side, as a fraction of the diagonal of the bounding box.
    Cells(f64),
}

/// The blur of `ward-<K>` and `ward-match`.
const FINE: Blur = Blur::Cells(1.0 / 32.0);

/// The blur of `ward-20-coarse`.
const COARSE: Blur = Blur::Cells(1.0 / 16.0);

/// The labels of a smaller K are unions of those of a larger one.
pub(crate) const WARD: SourceFactory = SourceFactory::numbered_rule(
    "ward-<K>",
    "Ward linkage of small triangles on blurred normals and position, at most K labels; no learned features",
    1..=1000,
    |carrier, n_max, _| Ok(labels(carrier, n_max as usize, FINE)),
)
.needing(ShapeKind::Mesh);

/// As many labels as `step-parts` has, so that the two do not differ in granularity.
pub(crate) const WARD_MATCH: SourceFactory = SourceFactory::rule(
    "ward-match",
    "ward-<K> with as many labels as step-parts has, at most 20",
    |carrier, _| {
        let n_parts = step_parts(carrier).n_parts() as usize;
        Ok(labels(carrier, n_parts.clamp(1, MANY), FINE))
    },
)
.needing(ShapeKind::Mesh);

/// `ward-20` without blur.
pub(crate) const WARD_SHARP: SourceFactory = SourceFactory::rule(
    "ward-20-sharp",
    "ward-20 on the normals of the small triangles, without blur",
    |carrier, _| Ok(labels(carrier, MANY, Blur::None)),
)
.needing(ShapeKind::Mesh);

/// `ward-20` with twice the blur.
pub(crate) const WARD_COARSE: SourceFactory = SourceFactory::rule(
    "ward-20-coarse",
    "ward-20 with normals blurred twice as far",
    |carrier, _| Ok(labels(carrier, MANY, COARSE)),
)
.needing(ShapeKind::Mesh);

fn labels(carrier: &Carrier, n_max: usize, blur: Blur) -> SourceLabels {
    let rule = clustered(carrier.mesh(), n_max, blur);
    SourceLabels::on_points(carrier.mesh(), Arc::new(rule))
}

/// The clusters of the refined mesh. Its triangles are about as small as a cell.
fn clustered(mesh: &Mesh, n_max: usize, blur: Blur) -> PieceLabels {
    let pieces = Pieces::of(mesh);
    let size = size_or_one(mesh);
    let small: Vec<Piece> = (0..pieces.fine.triangles.len())
        .map(|piece| Piece::of(&pieces.fine, piece))
        .collect();
    let total: f64 = small.iter().map(|piece| piece.area).sum();
    let share = |piece: &Piece| if total > 0.0 { piece.area / total } else { 0.0 };
    let rows: Vec<WeightedRow<Row>> = features(&small, size, blur)
        .into_iter()
        .zip(small.iter().map(share))
        .map(|(numbers, weight)| WeightedRow { numbers, weight })
        .collect();
    let neighbors: Vec<[u32; 2]> = welded_borders(&weld(&pieces.fine))
        .iter()
        .map(|border| border.between)
        .collect();

    let clusters = WardTree::grow(&rows, &neighbors, n_max).cut(n_max);
    PieceLabels {
        pieces,
        labels: clusters.parts().to_vec(),
    }
}

/// The blurred normal and the position of each piece, all finite.
fn features(pieces: &[Piece], size: f64, blur: Blur) -> Vec<Row> {
    let normals: Vec<Point> = match blur {
        Blur::None => pieces.iter().map(|piece| piece.normal).collect(),
        Blur::Cells(fraction) => blurred(pieces, size * fraction),
    };
    let feature = |(piece, normal): (&Piece, &Point)| {
        let [x, y, z] = piece
            .centroid
            .map(|x| WEIGHT_OF_POSITION * x / (0.5 * size));
        let [u, v, w] = *normal;
        let row = [u, v, w, x, y, z];
        if row.iter().all(|x| x.is_finite()) {
            row
        } else {
            [0.0; 6]
        }
    };
    pieces.iter().zip(&normals).map(feature).collect()
}

type Cell = [i64; 3];

/// A piece of a triangle that is about as small as a cell of the grid.
struct Piece {
    centroid: Point,
    normal: Point,
    area: f64,
}

impl Piece {
    fn of(mesh: &Mesh, triangle: usize) -> Self {
        let [a, b, c] = mesh.corners(triangle);
        let centroid = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
        let (normal, area) = normal_and_area(mesh, triangle);
        Self {
            centroid,
            normal,
            area,
        }
    }

    fn cell(&self, cell_size: f64) -> Cell {
        self.centroid.map(|x| (x / cell_size).floor() as i64)
    }
}

/// The mean normal around the cell of each piece, weighted by area. It is shorter than 1 where the surface bends or folds back.
fn blurred(pieces: &[Piece], cell_size: f64) -> Vec<Point> {
    let mut cells: BTreeMap<Cell, (Point, f64)> = BTreeMap::new();
    for piece in pieces {
        let (sum, area) = cells
            .entry(piece.cell(cell_size))
            .or_insert(([0.0; 3], 0.0));
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
    let field: BTreeMap<Cell, Point> = cells.keys().map(|cell| (*cell, around(cell))).collect();
    let of_piece = |piece: &Piece| field[&piece.cell(cell_size)];
    pieces.iter().map(of_piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::mesh_of;

    fn features_of(triangles: &[[Point; 3]], blur: Blur) -> Vec<Row> {
        let mesh = mesh_of(triangles);
        let fine = Pieces::of(&mesh).fine;
        let piece = |piece| Piece::of(&fine, piece);
        let pieces: Vec<Piece> = (0..fine.triangles.len()).map(piece).collect();
        features(&pieces, size_or_one(&mesh), blur)
    }

    #[test]
    fn far_from_edges_the_normal_is_that_of_the_triangle() {
        let features = features_of(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]], FINE);
        assert!(features.len() > 500, "{}", features.len());
        assert!(
            features
                .iter()
                .all(|row| (row[2] - 1.0).abs() < 1e-9 && row[..2] == [0.0, 0.0]),
            "{features:?}"
        );
    }

    #[test]
    fn the_grid_does_not_separate_the_sides_of_a_thin_wall() {
        let side = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        let mean_z = |z: f64, blur: Blur| {
            let [a, b, c] = side(z);
            let rows = features_of(&[side(0.02), [a, c, b]], blur);
            rows.iter().map(|row| row[2].abs()).sum::<f64>() / rows.len() as f64
        };
        let (thin, thick) = (mean_z(0.001, FINE), mean_z(0.5, FINE));
        assert!(thin < 0.2 && thick > 0.99, "{thin} {thick}");
        // Only the wide blur mixes these two normals. Without blur, nothing is mixed.
        assert!(mean_z(0.12, FINE) > 0.9 && mean_z(0.12, COARSE) < 0.7);
        assert_eq!(mean_z(0.001, Blur::None), 1.0);
    }

    #[test]
    fn meshes_without_area_have_finite_features() {
        for triangle in [[[0.0; 3]; 3], [[f64::NAN; 3]; 3], [[f64::INFINITY; 3]; 3]] {
            assert!(
                features_of(&[triangle], FINE)
                    .iter()
                    .flatten()
                    .all(|x| x.is_finite())
            );
        }
        assert!(features_of(&[], COARSE).is_empty());
    }
}

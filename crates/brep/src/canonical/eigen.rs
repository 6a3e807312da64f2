//! Solves small symmetric problems: directions of least spread (eigenvectors of a 3 × 3 matrix), and three linear equations in
//! three unknowns.

use partprobe_shape::{Point, cross, dot};

/// Number of sweeps of rotations. Each sweep squares the error, so a few of them reach the last digit.
const SWEEPS: usize = 12;

/// The direction in which vectors spread least around `center`, and the spreads in ascending order.
pub(super) fn least_spread(
    vectors: impl Iterator<Item = Point>,
    center: Point,
) -> (Point, [f64; 3]) {
    let mut matrix = [[0.0; 3]; 3];
    for vector in vectors {
        let arm = [0, 1, 2].map(|axis| vector[axis] - center[axis]);
        for (row, &a) in matrix.iter_mut().zip(&arm) {
            for (cell, &b) in row.iter_mut().zip(&arm) {
                *cell += a * b;
            }
        }
    }
    smallest_eigenvector(matrix)
}

/// The eigenvector of the smallest eigenvalue of a symmetric matrix, and all eigenvalues, by Jacobi's rotations.
fn smallest_eigenvector(mut matrix: [[f64; 3]; 3]) -> (Point, [f64; 3]) {
    // Row `i` of `basis` becomes the eigenvector of the eigenvalue in entry `i` of the diagonal.
    let mut basis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut matrix, &mut basis, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| matrix[a][a].total_cmp(&matrix[b][b]));
    (basis[order[0]], order.map(|i| matrix[i][i]))
}

/// Makes one off-diagonal entry zero.
fn rotate(matrix: &mut [[f64; 3]; 3], basis: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if matrix[p][q] == 0.0 {
        return;
    }
    let ratio = (matrix[q][q] - matrix[p][p]) / (2.0 * matrix[p][q]);
    let tangent = ratio.signum() / (ratio.abs() + (1.0 + ratio * ratio).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    for row in matrix.iter_mut() {
        let (a, b) = (row[p], row[q]);
        (row[p], row[q]) = (cosine * a - sine * b, sine * a + cosine * b);
    }
    for k in 0..3 {
        let (a, b) = (matrix[p][k], matrix[q][k]);
        (matrix[p][k], matrix[q][k]) = (cosine * a - sine * b, sine * a + cosine * b);
        let (a, b) = (basis[p][k], basis[q][k]);
        (basis[p][k], basis[q][k]) = (cosine * a - sine * b, sine * a + cosine * b);
    }
}

/// The vector whose dot products with three rows are given. Returns `None` if the rows lie in a plane.
pub(super) fn solved(rows: [Point; 3], products: Point) -> Option<Point> {
    let across = [
        cross(rows[1], rows[2]),
        cross(rows[2], rows[0]),
        cross(rows[0], rows[1]),
    ];
    let volume = dot(rows[0], across[0]);
    let found = [0, 1, 2].map(|axis| {
        (0..3)
            .map(|row| products[row] * across[row][axis])
            .sum::<f64>()
            / volume
    });
    found.iter().all(|x| x.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn points_of_a_plane_spread_least_along_its_normal(
            turn in 0.0f64..6.0, tilt in 0.0f64..3.0, seeds in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 6..12)
        ) {
            let x = [turn.cos(), turn.sin(), 0.0];
            let y = [-turn.sin() * tilt.cos(), turn.cos() * tilt.cos(), tilt.sin()];
            let normal = cross(x, y);
            let points = seeds.iter().map(|(a, b)| [0, 1, 2].map(|axis| a * x[axis] + b * y[axis]));
            let (found, spreads) = least_spread(points, [0.0; 3]);
            prop_assume!(spreads[1] > 1e-3);
            prop_assert!(spreads[0].abs() < 1e-12 && (dot(found, normal).abs() - 1.0).abs() < 1e-9);
        }

        #[test]
        fn a_solution_solves(rows in prop::array::uniform3(prop::array::uniform3(-1.0f64..1.0)), x in prop::array::uniform3(-1.0f64..1.0)) {
            prop_assume!(dot(rows[0], cross(rows[1], rows[2])).abs() > 1e-2);
            let found = solved(rows, rows.map(|row| dot(row, x))).unwrap();
            prop_assert!((0..3).all(|axis| (found[axis] - x[axis]).abs() < 1e-9));
        }
    }

    #[test]
    fn rows_in_a_plane_have_no_solution() {
        assert_eq!(
            solved(
                [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
                [1.0, 1.0, 3.0]
            ),
            None
        );
    }
}

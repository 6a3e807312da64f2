//! Computes the eigenvalues of a symmetric 3 × 3 matrix, and the eigenvector of the smallest one.

use partprobe_shape::{Point, cross, dot, norm};

/// The eigenvalues of a symmetric matrix, largest first (Smith, 1961).
pub(crate) fn eigenvalues(matrix: [Point; 3]) -> [f64; 3] {
    let mean = (matrix[0][0] + matrix[1][1] + matrix[2][2]) / 3.0;
    let mut shifted = matrix;
    (0..3).for_each(|axis| shifted[axis][axis] -= mean);
    let size = (shifted.iter().map(|row| dot(*row, *row)).sum::<f64>() / 6.0).sqrt();
    if size == 0.0 || size.is_nan() {
        return [mean; 3];
    }
    let scaled = shifted.map(|row| row.map(|x| x / size));
    let half_determinant = 0.5 * dot(scaled[0], cross(scaled[1], scaled[2]));
    let angle = libm::acos(half_determinant.clamp(-1.0, 1.0)) / 3.0;
    let turn = 2.0 * std::f64::consts::PI / 3.0;
    [0.0, -turn, turn].map(|shift| mean + 2.0 * size * libm::cos(angle + shift))
}

/// A unit eigenvector of the smallest eigenvalue of a symmetric matrix. If there are several such directions, any of them is
/// returned.
pub(crate) fn least_direction(matrix: [Point; 3]) -> Point {
    let size = norm(matrix.map(norm));
    if !(size > 0.0 && size.is_finite()) {
        return [0.0, 0.0, 1.0];
    }
    let scaled = matrix.map(|row| row.map(|x| x / size));
    let [_, _, least] = eigenvalues(scaled);
    let mut shifted = scaled;
    (0..3).for_each(|axis| shifted[axis][axis] -= least);

    // The rows span the plane of the other directions.
    let [a, b, c] = shifted;
    let normal = longest([cross(a, b), cross(b, c), cross(c, a)]);
    if norm(normal) > 1e-9 {
        return unit(normal);
    }
    // The rows span a line. Any direction at a right angle to it is correct.
    let along = longest(shifted);
    if norm(along) < 1e-9 {
        return [0.0, 0.0, 1.0];
    }
    let across = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| cross(along, axis));
    unit(longest(across))
}

fn longest(vectors: [Point; 3]) -> Point {
    let [first, others @ ..] = vectors;
    let longer = |best: Point, next: Point| if norm(best) < norm(next) { next } else { best };
    others.into_iter().fold(first, longer)
}

fn unit(vector: Point) -> Point {
    let length = norm(vector);
    vector.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_are_those_of_known_matrices() {
        let close = |found: [f64; 3], expected: [f64; 3]| {
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?}"
            );
        };
        close(
            eigenvalues([[2.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 3.0]]),
            [5.0, 3.0, 2.0],
        );
        close(
            eigenvalues([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0]]),
            [3.0, 1.0, 0.0],
        );
        close(
            eigenvalues([[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]),
            [4.0; 3],
        );
    }

    #[track_caller]
    fn check_direction(matrix: [Point; 3], expected: impl Fn(Point) -> bool) {
        let found = least_direction(matrix);
        assert!(
            (norm(found) - 1.0).abs() < 1e-12 && expected(found),
            "{found:?}"
        );
    }

    #[test]
    fn the_least_direction_is_that_of_known_matrices() {
        let is_along = |axis: usize| move |found: Point| found[axis].abs() > 1.0 - 1e-9;
        check_direction(
            [[2.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 3.0]],
            is_along(0),
        );
        check_direction(
            [[2.0, 0.0, 0.0], [0.0, 1e-20, 0.0], [0.0, 0.0, 3.0]],
            is_along(1),
        );
        check_direction([[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]], |found| {
            found[0].abs() < 1e-9
        });
        check_direction([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], |_| {
            true
        });
        check_direction([[0.0; 3]; 3], |_| true);
    }
}

//! Applies, combines and inverts the motions of occurrences: 4 × 4 matrices of a rotation, a uniform scale and a translation.

use partprobe_shape::{Point, cross, dot, norm};

/// The rows of a matrix that is multiplied by column vectors.
pub(crate) type Matrix = [[f64; 4]; 4];

/// Whether a motion includes a reflection.
pub(crate) fn is_mirror(motion: &Matrix) -> bool {
    let [x, y, z] = [0, 1, 2].map(|row| [motion[row][0], motion[row][1], motion[row][2]]);
    dot(cross(x, y), z) < 0.0
}

/// The factor by which lengths are multiplied.
pub(crate) fn scale_of(motion: &Matrix) -> f64 {
    norm([motion[0][0], motion[1][0], motion[2][0]])
}

pub(crate) fn moved_point(motion: &Matrix, [x, y, z]: Point) -> Point {
    [0, 1, 2].map(|axis| {
        let [a, b, c, shift] = motion[axis];
        a * x + b * y + c * z + shift
    })
}

/// A direction, rotated by a motion.
pub(crate) fn moved_direction(motion: &Matrix, scale: f64, direction: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = direction.map(f64::from);
    [0, 1, 2].map(|axis| {
        let [a, b, c, _] = motion[axis];
        ((a * x + b * y + c * z) / scale) as f32
    })
}

/// The motion that applies `inner` first and then `outer`.
pub(crate) fn product(outer: &Matrix, inner: &Matrix) -> Matrix {
    let cell = |row: usize, column: usize| (0..4).map(|k| outer[row][k] * inner[k][column]).sum();
    [0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| cell(row, column)))
}

/// The inverse of a rotation or reflection with a uniform scale and a translation. Returns `None` if the scale is zero.
pub(crate) fn inverse(motion: &Matrix) -> Option<Matrix> {
    let square: f64 = (0..3).map(|row| motion[row][0] * motion[row][0]).sum();
    if square <= 0.0 {
        return None;
    }
    let rotated = |row: usize, column: usize| motion[column][row] / square;
    let shift = |row: usize| -(0..3).map(|k| rotated(row, k) * motion[k][3]).sum::<f64>();
    let row = |row: usize| {
        [
            rotated(row, 0),
            rotated(row, 1),
            rotated(row, 2),
            shift(row),
        ]
    };
    Some([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}

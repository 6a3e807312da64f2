//! Moves and scales positions into the frame in which a model was trained.

use partprobe_carrier::{Point, bounding_box, distance, subtract};

/// The origin and the unit length of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Frame {
    /// The center of the bounding box is the origin, and half of its longest side is 1.
    UnitBox,
    /// The mean of the points is the origin, and the farthest point is at distance 1.
    UnitSphere,
    /// Positions are not changed and are in millimeters.
    Millimeters,
}

/// The positions in a frame, times a factor.
///
/// `corners` are the vertices of the shape, which the bounding box encloses. A shape without size is only moved.
pub(crate) fn in_frame(
    positions: &[Point],
    corners: &[Point],
    frame: Frame,
    factor: f64,
) -> Vec<Point> {
    let (origin, unit) = match frame {
        Frame::UnitBox => box_frame(corners),
        Frame::UnitSphere => sphere_frame(positions),
        Frame::Millimeters => ([0.0; 3], 1.0),
    };
    let scale = if unit > 0.0 { factor / unit } else { factor };
    let moved = |&position: &Point| subtract(position, origin).map(|x| x * scale);
    positions.iter().map(moved).collect()
}

fn box_frame(corners: &[Point]) -> (Point, f64) {
    let Some([low, high]) = bounding_box(corners) else {
        return ([0.0; 3], 1.0);
    };
    let center = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
    let longest = subtract(high, low).into_iter().fold(0.0, f64::max);
    (center, 0.5 * longest)
}

fn sphere_frame(positions: &[Point]) -> (Point, f64) {
    let count = positions.len().max(1) as f64;
    let sum = positions.iter().fold([0.0; 3], |sum: Point, position| {
        [0, 1, 2].map(|axis| sum[axis] + position[axis])
    });
    let center = sum.map(|x| x / count);
    let distances = positions.iter().map(|&position| distance(position, center));
    (center, distances.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_those_of_their_names() {
        let positions = [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let corners = [[0.0; 3], [8.0, 2.0, 0.0]];
        let check = |frame, factor, expected: [Point; 2]| {
            assert_eq!(in_frame(&positions, &corners, frame, factor), expected);
        };
        check(Frame::Millimeters, 1.0, positions);
        check(
            Frame::UnitBox,
            1.0,
            [[-0.75, -0.25, 0.0], [-0.25, -0.25, 0.0]],
        );
        check(Frame::UnitSphere, 1.0, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
        check(Frame::UnitSphere, 0.5, [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    }

    #[test]
    fn a_shape_without_size_is_moved_only() {
        let one = [[2.0, 2.0, 2.0]];
        assert_eq!(in_frame(&one, &one, Frame::UnitBox, 1.0), [[0.0; 3]]);
        assert_eq!(in_frame(&one, &one, Frame::UnitSphere, 1.0), [[0.0; 3]]);
        assert!(in_frame(&[], &[], Frame::UnitSphere, 1.0).is_empty());
    }
}

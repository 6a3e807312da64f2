//! Defines the viewpoint of a shape: by a name, by two angles, or by a direction.

use crate::camera::{CORNERS, Look, unit};
use partprobe_carrier::{Point, cross, dot, norm, subtract};
use std::fmt;
use std::str::FromStr;

/// The position of the camera. It looks at the center of the shape from an infinite distance, so parallel lines stay parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewpoint {
    /// The corner, of eight, from which most labels are seen.
    Best,
    /// Always the upper front right.
    Corner,
    /// At two angles in degrees. Both are 0 at the front.
    Angles {
        /// To the right around the axis that points up: 90 is the right side, 180 the back.
        azimuth_deg: f64,
        /// Above the horizon: 90 is the top, -90 the bottom.
        elevation_deg: f64,
    },
    /// In this direction from the shape, in the coordinates of the shape.
    From(Point),
}

/// Names, each with its azimuth and elevation. The elevation of `iso` is the one at which the axes appear equally long.
const NAMED: [(&str, [f64; 2]); 7] = [
    ("front", [0.0, 0.0]),
    ("right", [90.0, 0.0]),
    ("back", [180.0, 0.0]),
    ("left", [270.0, 0.0]),
    ("top", [0.0, 90.0]),
    ("bottom", [0.0, -90.0]),
    ("iso", [45.0, 35.264_389_682_754_654]),
];
/// Two unit vectors count as parallel if their cross product is shorter than this.
const PARALLEL: f64 = 1e-6;

/// The reason why a text is not a viewpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a viewpoint; choose best, corner, front, back, left, right, top, bottom or iso, two angles such as 30,20 \
     (azimuth and elevation in degrees), or a direction such as 1,-1,0.5"
)]
pub struct NotAViewpoint(String);

/// The reason why a text is not an axis.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not an axis; choose x, y, z, -x, -y, -z, or a direction such as 0,1,0.2")]
pub struct NotAnAxis(String);

impl FromStr for Viewpoint {
    type Err = NotAViewpoint;

    fn from_str(text: &str) -> Result<Self, NotAViewpoint> {
        match text {
            "best" => return Ok(Self::Best),
            "corner" => return Ok(Self::Corner),
            _ => {}
        }
        let named = NAMED.iter().find(|(name, _)| *name == text);
        let numbers = named.map_or_else(|| numbers_of(text), |(_, angles)| angles.to_vec());
        match *numbers.as_slice() {
            [azimuth_deg, elevation_deg] if elevation_deg.abs() <= 90.0 => Ok(Self::Angles {
                azimuth_deg,
                elevation_deg,
            }),
            [x, y, z] if norm([x, y, z]) > 0.0 => Ok(Self::From([x, y, z])),
            _ => Err(NotAViewpoint(text.to_owned())),
        }
    }
}

impl fmt::Display for Viewpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Best => f.write_str("best"),
            Self::Corner => f.write_str("corner"),
            Self::Angles {
                azimuth_deg,
                elevation_deg,
            } => write!(f, "{azimuth_deg},{elevation_deg}"),
            Self::From([x, y, z]) => write!(f, "{x},{y},{z}"),
        }
    }
}

/// The finite numbers of a text, which are separated by commas. It is empty if a word is not a finite number.
fn numbers_of(text: &str) -> Vec<f64> {
    let numbers = text.split(',').map(|word| word.trim().parse::<f64>());
    let numbers: Result<Vec<f64>, _> = numbers.collect();
    let mut numbers = numbers.unwrap_or_default();
    if numbers.iter().any(|number| !number.is_finite()) {
        numbers.clear();
    }
    numbers
}

/// The axis of a shape that points up in its picture, as a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpAxis(Point);

impl Default for UpAxis {
    /// z, as in most CAD programs.
    fn default() -> Self {
        Self([0.0, 0.0, 1.0])
    }
}

impl FromStr for UpAxis {
    type Err = NotAnAxis;

    fn from_str(text: &str) -> Result<Self, NotAnAxis> {
        let refused = || NotAnAxis(text.to_owned());
        let (sign, axis) = text
            .strip_prefix('-')
            .map_or((1.0, text), |axis| (-1.0, axis));
        let along = ["x", "y", "z"].iter().position(|name| *name == axis);
        let vector = match along {
            Some(along) => {
                let mut vector = [0.0; 3];
                vector[along] = sign;
                vector
            }
            None => <[f64; 3]>::try_from(numbers_of(text)).map_err(|_| refused())?,
        };
        if norm(vector) > 0.0 {
            Ok(Self(unit(vector)))
        } else {
            Err(refused())
        }
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (along, name) in ["x", "y", "z"].iter().enumerate() {
            if self.0[along].abs() == 1.0 {
                let sign = if self.0[along] < 0.0 { "-" } else { "" };
                return write!(f, "{sign}{name}");
            }
        }
        let [x, y, z] = self.0;
        write!(f, "{x},{y},{z}")
    }
}

impl UpAxis {
    /// The directions to the right of a shape and to its front.
    fn right_and_front(self) -> [Point; 2] {
        let Self(up) = self;
        let across = |axis: Point| subtract(axis, up.map(|x| x * dot(axis, up)));
        let right = across([1.0, 0.0, 0.0]);
        let right = if norm(right) > 0.1 {
            unit(right)
        } else {
            unit(across([0.0, 1.0, 0.0]))
        };
        [right, cross(right, up)]
    }

    /// The sum of these multiples of right, front and up.
    fn combined(self, [right, front, up]: [f64; 3]) -> Point {
        let [along_right, along_front] = self.right_and_front();
        [0, 1, 2]
            .map(|axis| right * along_right[axis] + front * along_front[axis] + up * self.0[axis])
    }

    /// The views from the eight corners. The upper front right one comes first.
    pub(crate) fn corners(self) -> [Look; CORNERS.len()] {
        CORNERS.map(|[right, back, up]| Look {
            toward: self.combined([right, -back, up]),
            up: self.0,
        })
    }

    pub(crate) fn at_angles(self, azimuth_deg: f64, elevation_deg: f64) -> Look {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let (above, level) = elevation_deg.to_radians().sin_cos();
        Look {
            toward: self.combined([level * sin, level * cos, above]),
            up: self.combined([-above * sin, -above * cos, level]),
        }
    }

    /// The view from a direction. In the view from directly above, the front is at the bottom of the picture.
    pub(crate) fn from(self, direction: Point) -> Look {
        let toward = unit(direction);
        let height = dot(toward, self.0);
        if norm(cross(self.0, toward)) < PARALLEL {
            return self.at_angles(0.0, 90.0 * height.signum());
        }
        Look { toward, up: self.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(viewpoint: &str, up: &str) -> Look {
        let up: UpAxis = up.parse().unwrap();
        match viewpoint.parse().unwrap() {
            Viewpoint::Angles {
                azimuth_deg,
                elevation_deg,
            } => up.at_angles(azimuth_deg, elevation_deg),
            Viewpoint::From(direction) => up.from(direction),
            Viewpoint::Best | Viewpoint::Corner => up.corners()[0],
        }
    }

    #[track_caller]
    fn check(viewpoint: &str, up: &str, toward: Point, top: Point) {
        let found = look(viewpoint, up);
        let is_near = |a: Point, b: Point| norm(subtract(a, b)) < 1e-9;
        assert!(
            is_near(found.toward, toward) && is_near(found.up, top),
            "{viewpoint} {up}: {found:?}"
        );
    }

    #[test]
    fn names_angles_and_directions_agree() {
        let z = [0.0, 0.0, 1.0];
        check("front", "z", [0.0, -1.0, 0.0], z);
        check("right", "z", [1.0, 0.0, 0.0], z);
        check("back", "z", [0.0, 1.0, 0.0], z);
        check("270,0", "z", [-1.0, 0.0, 0.0], z);
        check("-90,0", "z", [-1.0, 0.0, 0.0], z);
        check("top", "z", z, [0.0, 1.0, 0.0]);
        check("0,0,3", "z", z, [0.0, 1.0, 0.0]);
        check("bottom", "z", [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]);
        check("0,0,-2", "z", [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]);
        check("0,-2,0", "z", [0.0, -1.0, 0.0], z);
        check("front", "y", z, [0.0, 1.0, 0.0]);
        check("right", "y", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        check("top", "y", [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]);
        check("front", "x", [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]);
        let third = 1.0 / 3.0_f64.sqrt();
        assert!(norm(subtract(look("iso", "z").toward, [third, -third, third])) < 1e-9);
        assert_eq!(look("corner", "z").toward, CORNERS[0]);
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for text in ["best", "corner", "30,20", "1,-1,0.5"] {
            assert_eq!(text.parse::<Viewpoint>().unwrap().to_string(), text);
        }
        for text in ["x", "-y", "z", "0.6,0,0.8"] {
            assert_eq!(text.parse::<UpAxis>().unwrap().to_string(), text);
        }
        for text in ["", "above", "1", "0,0,0", "0,91", "nan,0", "1,2,3,4"] {
            assert!(text.parse::<Viewpoint>().is_err(), "{text}");
        }
        for text in ["", "w", "0,0,0", "1,2", "--x", "inf,0,0"] {
            assert!(text.parse::<UpAxis>().is_err(), "{text}");
        }
    }
}

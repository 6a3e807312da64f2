//! Completes a direction to three axes at right angles.

use partprobe_carrier::{Point, cross, norm};

/// Two unit directions at right angles to a unit vector and to each other.
pub(crate) fn across(axis: Point) -> [Point; 2] {
    let mut helper = [0.0; 3];
    let flattest = if axis[0].abs() < 0.6 { 0 } else { 1 };
    helper[flattest] = 1.0;
    let u = cross(axis, helper);
    let length = norm(u);
    let u = u.map(|x| x / length);
    [u, cross(axis, u)]
}

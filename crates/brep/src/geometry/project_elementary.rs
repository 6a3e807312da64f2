//! Projects points onto cones and tori in closed form.

use partprobe_shape::Point;

/// The parameters of the foot on a cone, along its normal. If the slope is 0, the surface is a cylinder.
///
/// A cone continues behind its apex, where its radius is negative, and some files use that nappe.
pub(super) fn on_cone([x, y, z]: Point, radius: f64, slope: f64) -> [f64; 2] {
    let out = libm::hypot(x, y);
    let gap = |reach: f64| (reach - radius - z * slope).abs();
    let is_behind = slope != 0.0 && gap(-out) < 0.5 * gap(out);
    let (reach, turn) = if is_behind {
        (-out, std::f64::consts::PI)
    } else {
        (out, 0.0)
    };
    // Along the meridian (slope, 1) from (radius, 0).
    let v = ((reach - radius) * slope + z) / (1.0 + slope * slope);
    [libm::atan2(y, x) + turn, v]
}

pub(super) fn on_torus([x, y, z]: Point, major: f64, minor: f64) -> [f64; 2] {
    let out = libm::hypot(x, y);
    let v = libm::atan2(z, out - major);
    // If the torus meets itself, each of its sheets ends at the tips.
    let end = if major.abs() < minor {
        libm::acos(-major / minor)
    } else {
        std::f64::consts::PI
    };
    [libm::atan2(y, x), v.clamp(-end, end)]
}

//! Defines the classes of curves and surfaces of ISO 10303-42, in millimeters and radians. Their functions are in other modules.

use super::facets::Facets;
use partprobe_shape::{FaceType, Point};
use std::sync::Arc;

/// A right-handed orthonormal coordinate system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The point at which the axes meet.
    pub origin: Point,
    /// First axis, unit length.
    pub x: Point,
    /// Second axis, `z × x`.
    pub y: Point,
    /// Third axis, unit length.
    pub z: Point,
}

/// A curve in space with its natural parameter.
///
/// The fields of a variant are the letters of its formula.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(
    missing_docs,
    reason = "the formula of each variant says what its fields are"
)]
pub enum Curve {
    /// `origin + t·direction`. The direction is not normalized.
    Line { origin: Point, direction: Point },
    /// `origin + rx·cos t·x + ry·sin t·y`. It is a circle if the radii are equal.
    Ellipse { frame: Frame, rx: f64, ry: f64 },
    /// `origin + focal·t²·x + 2·focal·t·y`.
    Parabola { frame: Frame, focal: f64 },
    /// `origin + a·cosh t·x + b·sinh t·y`.
    Hyperbola { frame: Frame, a: f64, b: f64 },
    /// A B-spline, rational or not.
    Bspline(BsplineCurve),
    /// Straight between its points. The parameter is the index of a point.
    Polyline(Vec<Point>),
    /// Pieces end to end. Piece `i` covers the parameters `i..i+1`.
    Composite(Vec<CompositeSegment>),
    /// The basis moved by `distance` along `reference × tangent` (OFFSET_CURVE_3D).
    Offset {
        basis: Box<Curve>,
        distance: f64,
        reference: Point,
    },
    /// A curve in the parameter plane of a surface (PCURVE).
    OnSurface(Box<SurfaceCurve>),
}

/// `surface(scale[0]·x(t), scale[1]·y(t))`, where `(x, y, 0)` is a point of `curve`.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceCurve {
    /// The surface.
    pub surface: Arc<Surface>,
    /// The curve of the plane, with its third coordinate 0.
    pub curve: Curve,
    /// The factors from the plane's coordinates to the surface's parameters. They are never 0.
    pub scale: [f64; 2],
}

/// One piece of a composite curve: `curve` from parameter `start` to parameter `end`, which may run backwards.
#[derive(Clone, Debug, PartialEq)]
pub struct CompositeSegment {
    /// The underlying curve.
    pub curve: Curve,
    /// Its parameter where the piece begins.
    pub start: f64,
    /// Its parameter where the piece ends.
    pub end: f64,
}

/// A B-spline curve. Its poles (control points) are homogeneous: (x·w, y·w, z·w, w).
///
/// Invariant: `knots.len() == poles.len() + degree + 1`, knots do not decrease, `1 ≤ degree ≤ 30`.
#[derive(Clone, Debug, PartialEq)]
pub struct BsplineCurve {
    /// Polynomial degree.
    pub degree: usize,
    /// Knots with their multiplicities written out.
    pub knots: Vec<f64>,
    /// Homogeneous poles.
    pub poles: Vec<[f64; 4]>,
    /// Whether the end points coincide, so that the parameter may be wrapped.
    pub closed: bool,
}

/// A B-spline surface. Its poles (control points) are homogeneous. `poles[i * n_v + j]` has the `u` index `i` and the `v` index
/// `j`.
///
/// Invariant: `knots_u.len() == n_u + degree_u + 1`, and the same for v. Knots do not decrease.
#[derive(Clone, Debug, PartialEq)]
pub struct BsplineSurface {
    /// Polynomial degree along u.
    pub degree_u: usize,
    /// Polynomial degree along v.
    pub degree_v: usize,
    /// Knots along u with their multiplicities written out.
    pub knots_u: Vec<f64>,
    /// Knots along v with their multiplicities written out.
    pub knots_v: Vec<f64>,
    /// Number of poles along u.
    pub n_u: usize,
    /// Number of poles along v.
    pub n_v: usize,
    /// Homogeneous poles, with v varying fastest.
    pub poles: Vec<[f64; 4]>,
    /// Whether the surface meets itself at the ends of u.
    pub closed_u: bool,
    /// Whether the surface meets itself at the ends of v.
    pub closed_v: bool,
}

/// A surface with its natural parameters (u, v). Its normal is `∂u × ∂v`.
///
/// Lengths are in millimeters, angles in radians. The fields of a variant are the letters of its formula.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(
    missing_docs,
    reason = "the formula of each variant says what its fields are"
)]
pub enum Surface {
    /// `origin + u·x + v·y`.
    Plane(Frame),
    /// `origin + r·(cos u·x + sin u·y) + v·z`.
    Cylinder { frame: Frame, radius: f64 },
    /// `origin + (radius + v·slope)·(cos u·x + sin u·y) + v·z`; `slope` is the tangent of the half angle, and v runs along the
    /// axis.
    Cone {
        frame: Frame,
        radius: f64,
        slope: f64,
    },
    /// `origin + r·cos v·(cos u·x + sin u·y) + r·sin v·z`.
    Sphere { frame: Frame, radius: f64 },
    /// `origin + (major + minor·cos v)·(cos u·x + sin u·y) + minor·sin v·z`; horn and lemon tori have `|major| ≤ minor`.
    Torus {
        frame: Frame,
        major: f64,
        minor: f64,
    },
    /// A B-spline, rational or not.
    Bspline(Box<BsplineSurface>),
    /// `curve` at parameter v, rotated by u about the z axis of `axis`.
    Revolution { axis: Frame, curve: Box<Curve> },
    /// `curve(u) + v·direction`. The direction is not normalized.
    Extrusion { curve: Box<Curve>, direction: Point },
    /// `basis(u, v) + distance·unit normal`.
    Offset { basis: Box<Surface>, distance: f64 },
    /// Patches in a grid (RECTANGULAR_COMPOSITE_SURFACE).
    Composite(Box<CompositeSurface>),
    /// Triangles that a file gives instead of a surface (tessellated geometry).
    Facets(Box<Facets>),
}

/// Patches in a grid. `patches[i * n_v + j]` covers the parameters `i..i+1` and `j..j+1`.
///
/// Invariant: `patches.len() == n_u * n_v`, and there is at least one patch.
#[derive(Clone, Debug, PartialEq)]
pub struct CompositeSurface {
    /// Number of patches along u.
    pub n_u: usize,
    /// Number of patches along v.
    pub n_v: usize,
    /// The patches, with v varying fastest.
    pub patches: Vec<SurfacePatch>,
    /// Whether the surface meets itself at the ends of u.
    pub closed_u: bool,
    /// Whether the surface meets itself at the ends of v.
    pub closed_v: bool,
}

/// A rectangle of a surface: its parameters from `start` to `end`, which may run backwards.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePatch {
    /// The underlying surface.
    pub surface: Surface,
    /// Its u and v where the patch begins.
    pub start: [f64; 2],
    /// Its u and v where the patch ends.
    pub end: [f64; 2],
    /// The class that the file gives the surface.
    pub face_type: FaceType,
}

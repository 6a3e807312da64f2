//! Defines curves and surfaces as ISO 10303-42 does, in millimeters and radians.
//!
//! They have points, derivatives and normals, and points can be projected onto them:
//!
//! ```
//! use partprobe_brep::geometry::{Frame, Surface};
//!
//! let frame = Frame::new([0.0; 3], Some([0.0, 0.0, 1.0]), Some([1.0, 0.0, 0.0]));
//! let cylinder = Surface::Cylinder { frame, radius: 2.0 };
//! assert_eq!(cylinder.point(0.0, 5.0), [2.0, 0.0, 5.0]);
//!
//! let nearest = cylinder.project([0.0, 3.0, 1.0], None);
//! assert!((nearest.distance - 1.0).abs() < 1e-12);
//! ```
//!
//! Nothing here knows about STEP texts or meshes.

mod breaks;
mod bspline_basis;
mod bspline_curve;
mod bspline_surface;
mod composite_surface;
mod curvature;
mod curve;
mod facets;
mod frame;
mod gauss_newton;
pub(crate) mod linear;
pub(crate) mod nearest;
mod project_curve;
mod project_elementary;
mod project_surface;
mod project_sweep;
mod projection_grid;
mod revolution_sheets;
mod revolved_sphere;
mod second_derivatives;
mod surface;
mod surface_curve;
#[cfg(test)]
mod tests;
mod transform;
mod trim;
mod types;

pub use bspline_basis::BsplineError;
pub(crate) use bspline_basis::MAX_DEGREE;
pub use curvature::Curvature;
pub use facets::Facets;
pub use gauss_newton::Projection;
pub(crate) use project_surface::Projector;
pub(crate) use revolution_sheets::{half_of_covered_twice, revolution_sheets};
pub(crate) use revolved_sphere::revolved_sphere;
#[cfg(test)]
pub(crate) use transform::Transform;
pub(crate) use trim::{edge_length, trim};
pub use types::{
    BsplineCurve, BsplineSurface, CompositeSegment, CompositeSurface, Curve, Frame, Surface,
    SurfaceCurve, SurfacePatch,
};

//! Curves and surfaces as STEP defines them, in millimeters and radians: points, derivatives and normals,
//! projection of points, edges' ends and lengths, rigid motion. Nothing here knows about STEP text or meshes.

mod breaks;
mod bspline_basis;
mod bspline_curve;
mod bspline_surface;
mod composite_surface;
mod curvature;
mod curve;
mod facets;
mod frame;
pub(crate) mod linear;
pub(crate) mod nearest;
mod project_curve;
mod project_surface;
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

pub(crate) use bspline_basis::BsplineError;
pub(crate) use bspline_basis::MAX_DEGREE;
pub(crate) use curvature::Curvature;
pub use facets::Facets;
pub(crate) use project_surface::{Projection, Projector};
pub(crate) use revolution_sheets::{half_of_covered_twice, revolution_sheets};
pub(crate) use revolved_sphere::revolved_sphere;
#[cfg(test)]
pub(crate) use transform::Transform;
pub(crate) use trim::{edge_length, trim};
pub use types::{
    BsplineCurve, BsplineSurface, CompositeSegment, CompositeSurface, Curve, Frame, Surface,
    SurfaceCurve, SurfacePatch,
};

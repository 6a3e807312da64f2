//! Computes the angle between the oriented normals of two faces at the parametric midpoint of their edge.

use std::panic::{AssertUnwindSafe, catch_unwind};
use truck_meshalgo::prelude::{
    BoundedCurve, InnerSpace, ParametricCurve, ParametricSurface3D, Point3, SPHint2D,
    SearchNearestParameter, Vector3,
};
use truck_stepio::r#in::alias::{Curve3D, Surface};
use truck_topology::compress::CompressedFace;

/// The number of steps of truck's search for the nearest point of a surface.
const TRIALS: usize = 100;

/// The dihedral angle φ in degrees. Returns `None` if truck finds no normal.
pub(crate) fn dihedral_deg(curve: &Curve3D, faces: [&CompressedFace<Surface>; 2]) -> Option<f64> {
    // truck's search panics on degenerate surfaces.
    catch_unwind(AssertUnwindSafe(|| {
        let (start, end) = curve.range_tuple();
        let middle = curve.subs(0.5 * (start + end));
        let [a, b] = faces.map(|face| normal(face, middle));
        let (a, b) = (a?, b?);
        let phi = a.cross(b).magnitude().atan2(a.dot(b)).to_degrees();
        phi.is_finite().then_some(phi)
    }))
    .ok()
    .flatten()
}

fn normal(face: &CompressedFace<Surface>, at: Point3) -> Option<Vector3> {
    let (u, v) = face
        .surface
        .search_nearest_parameter(at, SPHint2D::None, TRIALS)?;
    let normal = face.surface.normal(u, v);
    Some(if face.orientation { normal } else { -normal })
}

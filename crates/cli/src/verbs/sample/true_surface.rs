//! Projects sampled points onto the true surfaces of their triangles.

use crate::config::Attribute;
use partprobe_brep::{Brep, FaceSurfaces, SurfacePoint};
use partprobe_carrier::{Carrier, PointSample, SurfaceAttributes, dot};

/// The largest distance to the surface in chord tolerances. A point that is farther away is not moved, because the face's edges
/// are off its surface, or the surface was extended too far.
const MAX_CHORDS: f64 = 10.0;

/// The requested data of the true surfaces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SurfaceRequest {
    /// Whether points are moved to their surfaces and get their normals.
    pub(super) project: bool,
    /// The attributes that are stored per point.
    pub(super) attributes: Vec<Attribute>,
}

impl SurfaceRequest {
    /// Whether the sample needs no surface.
    pub(super) fn is_nothing(&self) -> bool {
        !self.project && self.attributes.is_empty()
    }

    fn has(&self, attribute: Attribute) -> bool {
        self.attributes.contains(&attribute)
    }
}

/// The result for a sample.
pub(super) struct SurfaceResult {
    /// One row per point, for the requested attributes.
    pub(super) attributes: SurfaceAttributes,
    /// The number of points without a near surface. They and their normals are those of the mesh, and their attributes are NaN.
    pub(super) n_unprojected: usize,
}

/// Projects each point onto the surface of its face, and moves it there if requested.
///
/// The carrier must have been labeled with `uv` among its attributes.
pub(super) fn project_points(
    sample: &mut PointSample,
    carrier: &Carrier,
    brep: &Brep,
    wanted: &SurfaceRequest,
) -> SurfaceResult {
    let mut projected = SurfaceResult {
        attributes: SurfaceAttributes::default(),
        n_unprojected: 0,
    };
    let surfaces =
        FaceSurfaces::with_instances(brep, &carrier.graph().faces, &carrier.meta().instances);
    for i in 0..sample.points.len() {
        let found = surface_point(&surfaces, carrier, sample, i);
        projected.n_unprojected += usize::from(found.is_none());
        if let Some(found) = found {
            move_point(sample, i, &found, wanted);
        }
        let attributes = &mut projected.attributes;
        if wanted.has(Attribute::Uv) {
            attributes
                .uv
                .push(found.map_or([f64::NAN; 2], |found| found.uv));
        }
        if wanted.has(Attribute::Curvature) {
            attributes
                .curvature
                .push(found.map_or([f32::NAN; 2], |found| found.curvature));
            attributes
                .direction
                .push(found.map_or([[f32::NAN; 3]; 2], |found| found.direction));
        }
    }
    projected
}

fn surface_point(
    surfaces: &FaceSurfaces<'_>,
    carrier: &Carrier,
    sample: &PointSample,
    i: usize,
) -> Option<SurfacePoint> {
    let triangle = sample.triangles[i] as usize;
    let corner = carrier.mesh().triangles[triangle][0] as usize;
    let near = carrier.attributes().uv.get(corner).copied();
    let near = near.filter(|uv| uv.iter().all(|x| x.is_finite()));
    let found = surfaces.nearest(
        carrier.mesh().tri_face[triangle],
        sample.points[i].map(f64::from),
        near,
    )?;
    // The mesh determines which side is outside, because faces that contradict their neighbors were reversed in it.
    let is_reversed = found
        .normal
        .is_some_and(|normal| dot(normal, sample.normals[i].map(f64::from)) < 0.0);
    let found = if is_reversed { found.reversed() } else { found };
    (found.distance <= MAX_CHORDS * carrier.meta().chord_mm).then_some(found)
}

fn move_point(sample: &mut PointSample, i: usize, found: &SurfacePoint, wanted: &SurfaceRequest) {
    if wanted.project {
        sample.points[i] = found.point.map(|x| x as f32);
    }
    if let Some(normal) = found
        .normal
        .filter(|_| wanted.project || wanted.has(Attribute::Normal))
    {
        sample.normals[i] = normal.map(|x| x as f32);
    }
}

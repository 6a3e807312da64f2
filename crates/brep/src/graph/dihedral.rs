//! Measures the dihedral angle between two faces at a shared edge.

use crate::geometry::{Curve, Facets, Projector, Surface, trim};
use crate::model::{Brep, Loop};
use partprobe_shape::{Point, cross, dot, norm};

/// The fractions of an edge at which its angle may be measured. It is measured at the first point at which both normals are
/// defined.
const FRACTIONS: [f64; 7] = [0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875];

/// Largest number of edges from which a singular point is approached.
const MOST_STARTS: usize = 8;

/// Triangles that bend by less than this count as flat. In many files the coordinates have only seven digits.
const FLAT_DEG: f64 = 1e-3;

/// The surfaces of the faces, prepared to compute normals.
pub(super) struct Dihedral<'b> {
    brep: &'b Brep,
    projectors: Vec<Projector<'b>>,
}

impl<'b> Dihedral<'b> {
    /// Makes the projectors. Nothing is computed until an angle is requested.
    pub(super) fn new(brep: &'b Brep) -> Self {
        Self {
            brep,
            projectors: brep
                .faces
                .iter()
                .map(|face| Projector::new(&face.surface))
                .collect(),
        }
    }

    /// The angle between the oriented normals of two faces at an edge, in degrees. It is NaN if it is undefined.
    pub(super) fn phi(&self, edge: u32, faces: [u32; 2]) -> f64 {
        let edge = &self.brep.edges[edge as usize];
        if let [Some(a), Some(b)] = faces.map(|face| self.facets(face)) {
            let phi = self.facets_phi(&edge.curve, faces);
            return if is_reliable([a, b], phi) {
                phi
            } else {
                f64::NAN
            };
        }
        let (start, end) = trim(edge, &self.brep.vertices);
        let point_at = |fraction: f64| edge.curve.point(start + fraction * (end - start));
        let middle = point_at(FRACTIONS[0]);
        let normals = faces.map(|face| self.normal(face, middle));
        if let [Some(a), Some(b)] = normals {
            return angle_deg(a, b);
        }
        if let [Some(a), Some(b)] =
            faces.map(|face| self.limit_normal(face, middle, point_at(FRACTIONS[1])))
        {
            return angle_deg(a, b);
        }
        let elsewhere = FRACTIONS[1..].iter().find_map(|&fraction| {
            let point = point_at(fraction);
            Some(angle_deg(
                self.normal(faces[0], point)?,
                self.normal(faces[1], point)?,
            ))
        });
        elsewhere.unwrap_or(f64::NAN)
    }

    /// The angle between the triangles on both sides of the middle piece of an edge.
    fn facets_phi(&self, curve: &Curve, faces: [u32; 2]) -> f64 {
        let (low, high) = curve.range().unwrap_or((0.0, 1.0));
        let middle = curve.point((0.5 * (low + high - 1.0)).floor() + 0.5);
        match faces.map(|face| self.normal(face, middle)) {
            [Some(a), Some(b)] => angle_deg(a, b),
            _ => f64::NAN,
        }
    }

    fn facets(&self, face: u32) -> Option<&Facets> {
        match &*self.brep.faces[face as usize].surface {
            Surface::Facets(facets) => Some(facets),
            _ => None,
        }
    }

    /// The outward normal of a face at the point of its surface nearest to `point`.
    fn normal(&self, face: u32, point: Point) -> Option<Point> {
        let [u, v] = self.projectors[face as usize].project(point, None).uv;
        let normal = self.brep.faces[face as usize].surface.unit_normal(u, v)?;
        self.outward(face, normal)
    }

    /// The outward normal at `point`, or its limit. The limit is taken along the edge from `edge_point`, or else through the face
    /// from the middle of another edge. (If a whole edge is singular, no path along it helps.)
    fn limit_normal(&self, face: u32, point: Point, edge_point: Point) -> Option<Point> {
        let projector = &self.projectors[face as usize];
        let surface = &self.brep.faces[face as usize].surface;
        let at = projector.project(point, None).uv;
        let starts = std::iter::once(edge_point).chain(self.edge_middles(face).take(MOST_STARTS));
        let mut limits =
            starts.filter_map(|start| surface.limit_normal(at, projector.project(start, None).uv));
        self.outward(face, limits.next()?)
    }

    fn edge_middles(&self, face: u32) -> impl Iterator<Item = Point> + '_ {
        let loops = self.brep.faces[face as usize].loops.iter();
        let uses = loops.filter_map(|boundary| match boundary {
            Loop::Edges(uses) => Some(uses),
            Loop::Vertex(_) => None,
        });
        uses.flatten().map(|edge_use| {
            let edge = &self.brep.edges[edge_use.edge as usize];
            let (start, end) = trim(edge, &self.brep.vertices);
            edge.curve.point(0.5 * (start + end))
        })
    }

    fn outward(&self, face: u32, normal: Point) -> Option<Point> {
        let face = &self.brep.faces[face as usize];
        let is_finite = normal.iter().all(|x| x.is_finite());
        is_finite.then(|| {
            if face.is_inward() {
                normal.map(|x| -x)
            } else {
                normal
            }
        })
    }
}

/// Whether the angle between two faces of triangles is reliable. It is if it is larger than every angle inside the faces, or if
/// both faces are flat. A smaller angle may come from the tessellation and not from the part.
fn is_reliable(faces: [&Facets; 2], phi: f64) -> bool {
    let [a, b] = faces.map(Facets::largest_bend_deg);
    a.max(b) <= FLAT_DEG || phi > a.max(b)
}

/// The angle between two unit vectors. The arc cosine would lose half of the digits near 0° and 180°.
fn angle_deg(a: Point, b: Point) -> f64 {
    libm::atan2(norm(cross(a, b)), dot(a, b)).to_degrees()
}

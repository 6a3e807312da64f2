//! Holds the data of a shape that the meshing of each of its faces needs.

use super::edge_points::EdgePoints;
use super::settings::AttributeChoice;
use crate::model::{Brep, BrepFace};
use partprobe_shape::Point;

/// Data that all faces of a shape share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceContext<'a> {
    /// The shape.
    pub(crate) brep: &'a Brep,
    /// The divided edges, in the order of the shape's edges. An edge without finite points is `None`.
    pub(crate) edges: &'a [Option<EdgePoints>],
    /// The diagonal of the shape.
    pub(crate) size: f64,
    /// The shape's chord tolerance, in millimeters.
    pub(crate) chord: f64,
    /// The attributes that are kept at the vertices.
    pub(crate) attributes: AttributeChoice,
    /// A point near each solid, from which its volume is measured. The list is empty if volumes are not wanted.
    pub(crate) volume_origins: &'a [Point],
}

impl<'a> FaceContext<'a> {
    /// The point from which the volume under a face is measured. Returns `None` if volumes are not wanted.
    pub(super) fn volume_origin(&self, face: &BrepFace) -> Option<Point> {
        self.volume_origins
            .get(self.brep.shells.get(face.shell as usize)?.solid? as usize)
            .copied()
    }
}

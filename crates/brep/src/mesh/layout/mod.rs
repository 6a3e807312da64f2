//! Chooses the chart of a face and moves its loops by whole periods, so that the chart maps them to simple polygons.

mod loops;
mod polar;
mod stretched;

pub(crate) use loops::is_crossed;

use super::chart::Chart;
use super::edge_points::Tolerance;
use super::error::FaceMeshError;
use super::steps::Bounds;
use super::unwrap::{UvLoop, UvPoint};
use crate::geometry::Surface;
use polar::polar;
use stretched::stretched;

/// Data for the triangulation of a face.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// The map to the plane.
    pub(crate) chart: Chart,
    /// Boundaries that the chart maps to simple polygons.
    pub(crate) loops: Vec<UvLoop>,
    /// The rectangle of parameters that they cover.
    pub(crate) bounds: Bounds,
    /// Steps along u and v that the surface needs.
    pub(crate) steps: [usize; 2],
    /// The pole or apex inside the face that a winding boundary encloses.
    pub(crate) pole: Option<[f64; 2]>,
}

/// Chooses the chart by the windings of the loops. `inner` are parameters inside the face, if known. `size` is the diagonal of
/// the shape.
pub(crate) fn layout(
    surface: &Surface,
    loops: Vec<UvLoop>,
    inner: Option<[f64; 2]>,
    tolerance: Tolerance,
    size: f64,
) -> Result<Layout, FaceMeshError> {
    let winds = [0, 1].map(|axis| loops.iter().any(|bound| bound.windings[axis] != 0));
    let around = match winds {
        [false, false] => return stretched(surface, loops, inner, tolerance, size),
        [true, true] => return Err(FaceMeshError::WindsBothWays),
        [first, _] => usize::from(!first),
    };
    polar(surface, loops.clone(), around, inner, tolerance, size).or_else(|error| {
        match loops.as_slice() {
            [_] => stretched(
                surface,
                loops.iter().map(|bound| cut_open(surface, bound)).collect(),
                None,
                tolerance,
                size,
            ),
            _ => Err(error),
        }
    })
}

/// A boundary that winds around a surface without enclosing a pole, such as one turn of a thread. It is closed by a straight line
/// across the parameter plane: from the image of its start some periods away back to its start.
fn cut_open(surface: &Surface, bound: &UvLoop) -> UvLoop {
    let mut corners = bound.corners.clone();
    let period = surface.period().map(Option::unwrap_or_default);
    corners.extend(bound.corners.first().map(|first| UvPoint {
        uv: [0, 1].map(|axis| first.uv[axis] + f64::from(bound.windings[axis]) * period[axis]),
        segment: None,
        ..*first
    }));
    UvLoop {
        corners,
        windings: [0, 0],
    }
}

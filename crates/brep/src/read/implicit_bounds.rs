//! Makes the bounds that a surface has at the ends of its parameters. A `CURVE_BOUNDED_SURFACE` with `implicit_outer` extends
//! from them to the holes that it lists.

use super::curves::MAX_NESTING;
use super::edges::{EdgeTable, reversed};
use super::error::{EntityError, Problem};
use super::rectangle::{
    encloses_more_than_half, rectangle, reversed_if_mirrored, sides, sides_of_patch,
};
use super::space::Reader;
use crate::geometry::{CompositeSegment, Curve, Projector, Surface, SurfacePatch};
use crate::model::{EdgeUse, Loop};
use crate::part21::{Keyword, Record};
use partprobe_shape::{FaceType, Point};

/// Number of pieces of each edge of a hole from which its sense is determined.
const POINTS_ON_HOLE: usize = 8;

/// The loops at the ends of a surface's parameters. A closed surface has none. A side at which a surface meets itself and a side
/// that is a point do not bound anything. `same_sense` says whether the face's normal is the surface's normal.
///
/// # Errors
/// If a parameter has no end: such a surface cannot be its own outer bound.
pub(super) fn natural_border(
    reader: &Reader<'_, '_>,
    edges: &mut EdgeTable,
    basis: Record,
    (surface, same_sense): (&Surface, bool),
) -> Result<Vec<Loop>, EntityError> {
    let border = match basis.keyword {
        Keyword::RectangularTrimmedSurface | Keyword::RectangularCompositeSurface => {
            reversed_if_mirrored(
                reader,
                rectangle(edges, sides_of_patch(&reader.rectangle_of(basis)?)),
            )
        }
        _ if closes_in_itself(surface) => return Ok(Vec::new()),
        _ => {
            let sides = match surface {
                Surface::Bspline(surface) => sides(surface)?,
                _ => sides_of_patch(&between_ends(surface)?),
            };
            let border = rectangle(edges, sides);
            if same_sense { border } else { reversed(border) }
        }
    };
    Ok(match border {
        Loop::Edges(uses) => without_seams(uses),
        vertex @ Loop::Vertex(_) => vec![vertex],
    })
}

/// The surface of a revolved curve between the ends to which the file trims the curve. Otherwise a surface of revolution is read
/// with the whole curve. Returns `None` if a bounded surface has another basis, or if the curve has no ends.
pub(super) fn revolved_between_ends(
    reader: &Reader<'_, '_>,
    surface: &Surface,
    mut bounded: Record,
) -> Option<Surface> {
    for _ in 0..MAX_NESTING {
        match bounded.keyword {
            Keyword::CurveBoundedSurface => {
                let [_, basis] = reader.source.params(bounded).ok()?;
                bounded = reader.source.record(basis.reference().ok()?).ok()?;
            }
            Keyword::SurfaceOfRevolution => break,
            _ => return None,
        }
    }
    let (Surface::Revolution { axis, .. }, Keyword::SurfaceOfRevolution) =
        (surface, bounded.keyword)
    else {
        return None;
    };
    let [_, curve] = reader.source.params(bounded).ok()?;
    let segment = reader.segment(curve.reference().ok()?, 1).ok()?;
    let is_whole = segment
        .curve
        .range()
        .is_some_and(|(low, high)| [segment.start, segment.end] == [low, high]);
    // If the segment runs against the curve, the normal is reversed. The sense of the surface that was read already accounts for
    // this.
    let segment = if segment.start <= segment.end {
        segment
    } else {
        reversed_segment(segment)
    };
    (!is_whole).then(|| Surface::Revolution {
        axis: *axis,
        curve: Box::new(Curve::Composite(vec![segment])),
    })
}

fn reversed_segment(segment: CompositeSegment) -> CompositeSegment {
    CompositeSegment {
        start: segment.end,
        end: segment.start,
        ..segment
    }
}

/// The boundary, directed so that the hole is on its right, even if the file says otherwise: any bound other than the natural
/// ones is a hole. `same_sense` says whether the face's normal is the surface's normal.
pub(super) fn directed_as_hole(
    edges: &EdgeTable,
    boundary: Loop,
    surface: &Surface,
    same_sense: bool,
) -> Loop {
    let points = edges.points_along(&boundary, POINTS_ON_HOLE);
    let is_hole = match surface {
        Surface::Sphere { frame, .. } => Some(encloses_more_than_half(&points, frame.origin)),
        _ => runs_left(surface, &points).map(|runs_left| runs_left != same_sense),
    };
    if is_hole == Some(false) {
        reversed(boundary)
    } else {
        boundary
    }
}

/// Whether the natural border consists only of seams and poles.
fn closes_in_itself(surface: &Surface) -> bool {
    match surface {
        Surface::Sphere { .. } | Surface::Torus { .. } => true,
        Surface::Offset { basis, .. } => closes_in_itself(basis),
        _ => surface.period().iter().all(Option::is_some),
    }
}

/// The whole of a surface that has ends, as a patch.
fn between_ends(surface: &Surface) -> Result<SurfacePatch, EntityError> {
    match surface.range() {
        [Some(u), Some(v)] if [u.0, u.1, v.0, v.1].iter().all(|end| end.is_finite()) => {
            let (start, end) = ([u.0, v.0], [u.1, v.1]);
            Ok(SurfacePatch {
                surface: surface.clone(),
                start,
                end,
                face_type: FaceType::Other,
            })
        }
        _ => Err(Problem::Geometry("its surface has no ends that could be its outer bound").into()),
    }
}

/// The walk without the edges that it uses in both directions. On a closed surface only rims are left, and each is a separate
/// loop.
fn without_seams(uses: Vec<EdgeUse>) -> Vec<Loop> {
    let n_uses = |edge: u32| uses.iter().filter(|use_| use_.edge == edge).count();
    let rims: Vec<EdgeUse> = uses
        .iter()
        .copied()
        .filter(|use_| n_uses(use_.edge) == 1)
        .collect();
    if rims.len() == uses.len() {
        vec![Loop::Edges(uses)]
    } else {
        rims.into_iter().map(|rim| Loop::Edges(vec![rim])).collect()
    }
}

/// Whether a closed walk has its inside on the left, seen against `∂u × ∂v`. Returns `None` if it winds around the surface.
fn runs_left(surface: &Surface, points: &[Point]) -> Option<bool> {
    let projector = Projector::new(surface);
    let period = surface.period();
    let mut walk: Vec<[f64; 2]> = Vec::with_capacity(points.len() + 1);
    for &point in points.iter().chain(points.first()) {
        let uv = projector.project(point, None).uv;
        let before = walk.last().copied().unwrap_or(uv);
        let nearest_copy = |axis: usize| match period[axis] {
            Some(period) => uv[axis] + ((before[axis] - uv[axis]) / period).round() * period,
            None => uv[axis],
        };
        walk.push([nearest_copy(0), nearest_copy(1)]);
    }
    let (first, last) = (*walk.first()?, *walk.last()?);
    let winds = |axis: usize| {
        period[axis].is_some_and(|period| (last[axis] - first[axis]).abs() > 0.5 * period)
    };
    if winds(0) || winds(1) {
        return None;
    }
    let doubled: f64 = walk
        .windows(2)
        .map(|pair| pair[0][0] * pair[1][1] - pair[0][1] * pair[1][0])
        .sum();
    (doubled != 0.0).then_some(doubled > 0.0)
}

//! The bounds that a surface has of its own: where its parameters end. A `CURVE_BOUNDED_SURFACE` with `implicit_outer`
//! lies between them and the holes that it lists.

use super::bounded_surfaces::{encloses_more_than_half, rectangle, seen_from, sides, sides_of_patch};
use super::edges::{EdgeTable, reversed};
use super::error::{EntityError, Problem};
use super::space::Reader;
use crate::geometry::{CompositeSegment, Projector, Surface, SurfacePatch};
use crate::model::{EdgeUse, Loop};
use crate::part21::{Keyword, Record};
use carrier::Point;
use std::f64::consts::TAU;

/// Parts of each edge of a hole that are looked at to find its sense.
const PLACES_ON_HOLE: usize = 8;

/// The loops at the ends of a surface's parameters; none where it closes in itself. A side along which a surface meets
/// itself, and one that is a point, bound nothing.
///
/// # Errors
/// If a parameter has no end: such a surface cannot be its own outer bound.
pub(super) fn natural_border(
    reader: &Reader<'_, '_>,
    edges: &mut EdgeTable,
    basis: Record,
    surface: &Surface,
) -> Result<Vec<Loop>, EntityError> {
    if basis.keyword != Keyword::SurfaceOfRevolution && closes_in_itself(surface) {
        return Ok(Vec::new());
    }
    let sides = match surface {
        Surface::Bspline(surface) if basis.keyword != Keyword::RectangularTrimmedSurface => sides(surface)?,
        _ => sides_of_patch(&natural_patch(reader, basis, surface)?),
    };
    let Loop::Edges(uses) = seen_from(reader, rectangle(edges, sides)) else { return Ok(Vec::new()) };
    Ok(without_seams(uses))
}

/// The same walks with the hole on their right, whatever the file says: a bound beside the natural ones is a hole.
/// `same_sense` says whether the face's normal is the surface's.
pub(super) fn as_hole(edges: &EdgeTable, boundary: Loop, surface: &Surface, same_sense: bool) -> Loop {
    let places = edges.places_along(&boundary, PLACES_ON_HOLE);
    let is_hole = match surface {
        Surface::Sphere { frame, .. } => Some(encloses_more_than_half(&places, frame.origin)),
        _ => runs_left(surface, &places).map(|runs_left| runs_left != same_sense),
    };
    if is_hole == Some(false) { reversed(boundary) } else { boundary }
}

/// Whether the natural border is nothing but seams and poles. A turned curve that is trimmed ends although the curve that is
/// read from it does not; so this is not asked of it.
fn closes_in_itself(surface: &Surface) -> bool {
    match surface {
        Surface::Sphere { .. } | Surface::Torus { .. } => true,
        Surface::Offset { basis, .. } => closes_in_itself(basis),
        _ => surface.period().iter().all(Option::is_some),
    }
}

/// All of a surface that has ends, its parameters in the direction of the file's.
fn natural_patch(reader: &Reader<'_, '_>, basis: Record, surface: &Surface) -> Result<SurfacePatch, EntityError> {
    if matches!(basis.keyword, Keyword::RectangularTrimmedSurface | Keyword::RectangularCompositeSurface) {
        return reader.rectangle_of(basis);
    }
    let endless = || EntityError::from(Problem::Geometry("its surface has no ends that could be its outer bound"));
    let [u, v] = surface.range();
    let turn = if reader.is_mirrored() { -TAU } else { TAU };
    let (u, v) = match surface {
        Surface::Revolution { .. } if basis.keyword == Keyword::SurfaceOfRevolution => {
            let [_, curve] = reader.source.params(basis)?;
            let CompositeSegment { start, end, .. } = reader.segment(curve.reference()?, 1).map_err(|_| endless())?;
            ((0.0, turn), (start, end))
        }
        Surface::Offset { basis, .. } if matches!(**basis, Surface::Revolution { .. }) => {
            ((0.0, turn), v.ok_or_else(endless)?)
        }
        _ => (u.ok_or_else(endless)?, v.ok_or_else(endless)?),
    };
    if ![u.0, u.1, v.0, v.1].iter().all(|end| end.is_finite()) {
        return Err(endless());
    }
    let face_type = carrier::FaceType::Other;
    Ok(SurfacePatch { surface: surface.clone(), start: [u.0, v.0], end: [u.1, v.1], face_type })
}

/// The walk without the edges that it takes both ways; what is left of a closed surface are rims, each a loop of its own.
fn without_seams(uses: Vec<EdgeUse>) -> Vec<Loop> {
    let n_uses = |edge: u32| uses.iter().filter(|use_| use_.edge == edge).count();
    let rims: Vec<EdgeUse> = uses.iter().copied().filter(|use_| n_uses(use_.edge) == 1).collect();
    if rims.len() == uses.len() {
        vec![Loop::Edges(uses)]
    } else {
        rims.into_iter().map(|rim| Loop::Edges(vec![rim])).collect()
    }
}

/// Whether a closed walk has its inside on the left, seen against `∂u × ∂v`; none if it winds round the surface.
fn runs_left(surface: &Surface, places: &[Point]) -> Option<bool> {
    let projector = Projector::new(surface);
    let period = surface.period();
    let mut walk: Vec<[f64; 2]> = Vec::with_capacity(places.len() + 1);
    for &place in places.iter().chain(places.first()) {
        let uv = projector.project(place, None).uv;
        let before = walk.last().copied().unwrap_or(uv);
        let beside = |axis: usize| match period[axis] {
            Some(period) => uv[axis] + ((before[axis] - uv[axis]) / period).round() * period,
            None => uv[axis],
        };
        walk.push([beside(0), beside(1)]);
    }
    let (first, last) = (*walk.first()?, *walk.last()?);
    let winds = |axis: usize| period[axis].is_some_and(|period| (last[axis] - first[axis]).abs() > 0.5 * period);
    if winds(0) || winds(1) {
        return None;
    }
    let doubled: f64 = walk.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[0][1] * pair[1][0]).sum();
    (doubled != 0.0).then_some(doubled > 0.0)
}

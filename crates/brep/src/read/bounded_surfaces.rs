//! Surfaces that stand without topology in a `GEOMETRIC_SET`: each becomes a face that shares no edge.
//!
//! The bounds of a `CURVE_BOUNDED_SURFACE` are read from its boundary curves; a B-spline surface is bounded by
//! the ends of its parameters.

use super::curves::DirectedCurve;
use super::edges::{EdgeTable, reversed};
use super::error::{EntityError, Problem};
use super::space::Reader;
use crate::geometry::linear::sum;
use crate::geometry::{BsplineCurve, BsplineSurface, CompositeSegment, Curve, Surface};
use crate::model::{EdgeUse, Loop};
use crate::part21::{Keyword, Record};
use carrier::{Point, bounding_diagonal, cross, distance, dot, norm, subtract};
use std::sync::Arc;

/// Ends of segments farther apart than this part of the boundary's size do not meet.
const LARGEST_GAP: f64 = 0.01;

/// Whether an element of a geometric set is a surface with bounds.
pub(super) fn is_bounded_surface(reader: &Reader<'_, '_>, record: Record) -> bool {
    match record.keyword {
        Keyword::CurveBoundedSurface
        | Keyword::BSplineSurfaceWithKnots
        | Keyword::BezierSurface
        | Keyword::UniformSurface
        | Keyword::QuasiUniformSurface => true,
        Keyword::Complex => reader.source.exchange.partial(record, "B_SPLINE_SURFACE").is_some(),
        _ => false,
    }
}

/// The loops of a bounded surface, each walked with the surface on its left.
pub(super) fn loops_of(
    reader: &Reader<'_, '_>,
    edges: &mut EdgeTable,
    record: Record,
    surface: &Surface,
) -> Result<Vec<Loop>, EntityError> {
    if record.keyword != Keyword::CurveBoundedSurface {
        return match surface {
            Surface::Bspline(surface) => Ok(vec![seen_from(reader, rectangle(edges, surface)?)]),
            _ => Err(Problem::Geometry("it has no bounds").into()),
        };
    }
    let [_, _, boundaries] = reader.source.params(record)?;
    let boundaries = boundaries.list()?.iter().map(|boundary| {
        reader.source.entity(boundary?.reference()?, |record| {
            let segments = reader.composite_segments(record)?;
            Ok(seen_from(reader, segment_loop(edges, segments)?))
        })
    });
    let mut boundaries: Vec<Loop> = boundaries.collect::<Result<_, EntityError>>()?;
    if let ([boundary], Surface::Sphere { frame, .. }) = (boundaries.as_mut_slice(), surface)
        && encloses_more_than_half(&edges.corners_and_middles(boundary), frame.origin)
    {
        *boundary = reversed(std::mem::replace(boundary, Loop::Edges(Vec::new())));
    }
    Ok(boundaries)
}

/// In a mirror a boundary runs the other way round.
fn seen_from(reader: &Reader<'_, '_>, boundary: Loop) -> Loop {
    if reader.is_mirrored() { reversed(boundary) } else { boundary }
}

/// Whether the larger part of a sphere lies on the left of a closed walk. Files set the senses of these boundaries
/// carelessly, and what they mean is what the boundary encloses.
fn encloses_more_than_half(walk: &[Point], center: Point) -> bool {
    let places: Vec<Point> = walk.iter().map(|&place| subtract(place, center)).collect();
    let next = places.iter().cycle().skip(1);
    let area = places.iter().zip(next).fold([0.0; 3], |area, (&a, &b)| sum(area, cross(a, b)));
    let middle = places.iter().fold([0.0; 3], |middle, &place| sum(middle, place));
    dot(area, middle) < -1e-6 * norm(area) * norm(middle)
}

/// Edges for the segments of a closed boundary, each from the end of the one before.
fn segment_loop(edges: &mut EdgeTable, mut segments: Vec<CompositeSegment>) -> Result<Loop, EntityError> {
    set_end_to_end(&mut segments);
    let at = |segment: &CompositeSegment, part: f64| {
        segment.curve.point(segment.start + part * (segment.end - segment.start))
    };
    let size =
        bounding_diagonal(&segments.iter().flat_map(|s| [at(s, 0.0), at(s, 0.5), at(s, 1.0)]).collect::<Vec<_>>());
    let starts: Vec<Point> = segments.iter().map(|segment| at(segment, 0.0)).collect();
    let vertices: Vec<u32> = starts.iter().map(|&start| edges.push_vertex(start)).collect();
    let mut uses = Vec::with_capacity(segments.len());
    for (i, segment) in segments.into_iter().enumerate() {
        let next = (i + 1) % vertices.len();
        if distance(at(&segment, 1.0), starts[next]) > LARGEST_GAP * size {
            return Err(Problem::Geometry("its boundary does not close").into());
        }
        let same_sense = segment.end >= segment.start;
        let edge = edges.push_edge(0, [vertices[i], vertices[next]], Arc::new(segment.curve), same_sense);
        uses.push(EdgeUse { edge, forward: true });
    }
    Ok(Loop::Edges(uses))
}

/// Turns the segments that run against the walk: files set their senses carelessly.
fn set_end_to_end(segments: &mut [CompositeSegment]) {
    let ends = |segment: &CompositeSegment| [segment.start, segment.end].map(|t| segment.curve.point(t));
    let nearest = |p: Point, [a, b]: [Point; 2]| distance(p, a).min(distance(p, b));
    if let [first, second, ..] = segments {
        let ([start, end], second) = (ends(first), ends(second));
        if nearest(start, second) < nearest(end, second) {
            std::mem::swap(&mut first.start, &mut first.end);
        }
    }
    for i in 1..segments.len() {
        let [_, before] = ends(&segments[i - 1]);
        let [start, end] = ends(&segments[i]);
        if distance(before, end) < distance(before, start) {
            let segment = &mut segments[i];
            std::mem::swap(&mut segment.start, &mut segment.end);
        }
    }
}

/// The four sides of a clamped B-spline surface, counter-clockwise in its parameters; sides that meet are one
/// edge, and sides without length are left out.
fn rectangle(edges: &mut EdgeTable, surface: &BsplineSurface) -> Result<Loop, EntityError> {
    let [bottom, right, top, left] = sides(surface)?;
    let corner = |edges: &mut EdgeTable, curve: &BsplineCurve| edges.push_vertex(position_at(curve, curve.range().0));
    let at_00 = corner(edges, &bottom);
    let at_10 = if surface.closed_u { at_00 } else { corner(edges, &right) };
    let at_01 = if surface.closed_v { at_00 } else { corner(edges, &top) };
    let far = position_at(&top, top.range().1);
    let at_11 = match (surface.closed_u, surface.closed_v) {
        (true, _) => at_01,
        (_, true) => at_10,
        _ => edges.push_vertex(far),
    };
    let mut edge = |curve: BsplineCurve, ends: [u32; 2]| {
        let size = bounding_diagonal(&curve.poles.iter().map(|pole| [pole[0], pole[1], pole[2]]).collect::<Vec<_>>());
        (size > 0.0).then(|| edges.push_edge(0, ends, Arc::new(Curve::Bspline(curve)), true))
    };
    let bottom = edge(bottom, [at_00, at_10]);
    let right = edge(right, [at_10, at_11]);
    let top = if surface.closed_v { bottom } else { edge(top, [at_01, at_11]) };
    let left = if surface.closed_u { right } else { edge(left, [at_00, at_01]) };
    let walk = [(bottom, true), (right, true), (top, false), (left, false)];
    Ok(Loop::Edges(walk.iter().filter_map(|&(edge, forward)| Some(EdgeUse { edge: edge?, forward })).collect()))
}

/// The curves at the ends of the parameters: lowest v, highest u, highest v, lowest u.
fn sides(surface: &BsplineSurface) -> Result<[BsplineCurve; 4], EntityError> {
    let BsplineSurface { degree_u, degree_v, knots_u, knots_v, n_u, n_v, poles, .. } = surface;
    if !is_clamped(knots_u, *degree_u) || !is_clamped(knots_v, *degree_v) {
        return Err(Problem::Geometry("a surface without bounds has to be clamped").into());
    }
    let along_u = |j: usize| {
        let poles = (0..*n_u).map(|i| poles[i * n_v + j]).collect();
        BsplineCurve::new(*degree_u, knots_u.clone(), poles)
    };
    let along_v = |i: usize| BsplineCurve::new(*degree_v, knots_v.clone(), poles[i * n_v..][..*n_v].to_vec());
    Ok([along_u(0)?, along_v(n_u - 1)?, along_u(n_v - 1)?, along_v(0)?])
}

fn position_at(curve: &BsplineCurve, t: f64) -> Point {
    Curve::Bspline(curve.clone()).point(t)
}

/// The first and the last pole are the ends.
fn is_clamped(knots: &[f64], degree: usize) -> bool {
    let n = knots.len();
    knots[0] == knots[degree] && knots[n - 1] == knots[n - 1 - degree]
}

impl<'a> Reader<'_, 'a> {
    /// The segments of a boundary curve, however its class is called.
    fn composite_segments(&self, record: Record) -> Result<Vec<CompositeSegment>, EntityError> {
        let segments = match record.keyword {
            Keyword::CompositeCurve | Keyword::BoundaryCurve | Keyword::OuterBoundaryCurve => {
                self.source.params::<2>(record)?[1]
            }
            Keyword::Complex => self.source.part(record, "COMPOSITE_CURVE", 1)?.first::<1>()?[0],
            _ => return self.closed_segment(record.id),
        };
        self.segments(segments, 0)
    }

    /// A boundary that is one bounded curve.
    fn closed_segment(&self, id: u64) -> Result<Vec<CompositeSegment>, EntityError> {
        let DirectedCurve { curve, same_sense } = self.curve(id, 0)?;
        let (start, end) = curve.range().ok_or(Problem::Geometry("a boundary without ends"))?;
        let (start, end) = if same_sense { (start, end) } else { (end, start) };
        Ok(vec![CompositeSegment { curve, start, end }])
    }
}

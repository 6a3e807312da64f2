//! Reads surfaces of a `GEOMETRIC_SET`, which have no topology. Each becomes a face that shares no edge.
//!
//! The bounds of a `CURVE_BOUNDED_SURFACE` are read from its boundary curves. Every other bounded surface ends at the ends of its
//! parameters.

use super::curves::{DirectedCurve, MAX_NESTING};
use super::edges::{EdgeTable, reversed};
use super::error::{EntityError, Problem};
use super::implicit_bounds::{directed_as_hole, natural_border};
use super::rectangle::{
    encloses_more_than_half, rectangle, reversed_if_mirrored, sides, sides_of_patch,
};
use super::space::Reader;
use crate::geometry::{CompositeSegment, Surface};
use crate::model::{EdgeUse, Loop};
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::{Point, bounding_diagonal, distance};
use std::sync::Arc;

/// The ends of two segments do not meet if their distance exceeds this fraction of the boundary's size.
const LARGEST_GAP: f64 = 0.01;

/// Whether an element of a geometric set is a surface with bounds.
pub(super) fn is_bounded_surface(reader: &Reader<'_, '_>, record: Record) -> bool {
    match record.keyword {
        Keyword::CurveBoundedSurface
        | Keyword::RectangularTrimmedSurface
        | Keyword::RectangularCompositeSurface
        | Keyword::BSplineSurfaceWithKnots
        | Keyword::BezierSurface
        | Keyword::UniformSurface
        | Keyword::QuasiUniformSurface => true,
        Keyword::Complex => reader
            .source
            .exchange
            .partial(record, "B_SPLINE_SURFACE")
            .is_some(),
        _ => false,
    }
}

/// The loops of a bounded surface. Each has the surface on its left. `same_sense` says whether the face's normal is that of
/// `surface`.
pub(super) fn loops_of(
    reader: &Reader<'_, '_>,
    edges: &mut EdgeTable,
    record: Record,
    surface: &Surface,
    same_sense: bool,
) -> Result<Vec<Loop>, EntityError> {
    if record.keyword != Keyword::CurveBoundedSurface {
        let sides = match surface {
            Surface::Bspline(surface) if record.keyword != Keyword::RectangularTrimmedSurface => {
                sides(surface)?
            }
            _ => sides_of_patch(&reader.rectangle_of(record)?),
        };
        return Ok(vec![reversed_if_mirrored(reader, rectangle(edges, sides))]);
    }
    let mut loops = Vec::new();
    let mut bounded = record;
    // The basis of a bounded surface may be a bounded surface itself. Then all listed boundaries inside the natural bounds are
    // holes.
    for _ in 0..MAX_NESTING {
        let [_, basis] = reader.source.params(bounded)?;
        let basis = reader.source.record(basis.reference()?)?;
        let boundaries = listed_boundaries(reader, edges, bounded)?;
        if !has_implicit_outer(reader, bounded)? {
            loops.extend(boundaries);
            mend_sense_on_sphere(edges, surface, &mut loops);
            return Ok(loops);
        }
        loops.extend(
            boundaries
                .into_iter()
                .map(|boundary| directed_as_hole(edges, boundary, surface, same_sense)),
        );
        if basis.keyword != Keyword::CurveBoundedSurface {
            loops.splice(
                0..0,
                natural_border(reader, edges, basis, (surface, same_sense))?,
            );
            return Ok(loops);
        }
        bounded = basis;
    }
    Err(Problem::TooDeep.into())
}

/// Whether the outer bound of the surface is at the ends of its parameters.
fn has_implicit_outer(reader: &Reader<'_, '_>, record: Record) -> Result<bool, EntityError> {
    match reader.source.params(record) {
        Ok([_, _, _, Param::Unset | Param::Derived]) | Err(ParamError::Missing) => Ok(false),
        Ok([_, _, _, flag]) => Ok(flag.flag()?),
        Err(error) => Err(error.into()),
    }
}

/// The boundaries that a `CURVE_BOUNDED_SURFACE` names.
fn listed_boundaries(
    reader: &Reader<'_, '_>,
    edges: &mut EdgeTable,
    record: Record,
) -> Result<Vec<Loop>, EntityError> {
    let [_, _, boundaries] = reader.source.params(record)?;
    let boundaries = boundaries.list()?.iter().map(|boundary| {
        reader.source.entity(boundary?.reference()?, |record| {
            let segments = reader.composite_segments(record)?;
            Ok(reversed_if_mirrored(reader, segment_loop(edges, segments)?))
        })
    });
    boundaries.collect()
}

/// Reverses the only boundary on a sphere if it encloses the larger part of it.
fn mend_sense_on_sphere(edges: &EdgeTable, surface: &Surface, loops: &mut [Loop]) {
    if let ([boundary], Surface::Sphere { frame, .. }) = (loops, surface)
        && encloses_more_than_half(&edges.points_along(boundary, 2), frame.origin)
    {
        *boundary = reversed(std::mem::replace(boundary, Loop::Edges(Vec::new())));
    }
}

/// Makes edges of the segments of a closed boundary. Each begins at the end of the previous one.
fn segment_loop(
    edges: &mut EdgeTable,
    mut segments: Vec<CompositeSegment>,
) -> Result<Loop, EntityError> {
    set_end_to_end(&mut segments);
    let at = |segment: &CompositeSegment, fraction: f64| {
        segment
            .curve
            .point(segment.start + fraction * (segment.end - segment.start))
    };
    let size = bounding_diagonal(
        &segments
            .iter()
            .flat_map(|s| [at(s, 0.0), at(s, 0.5), at(s, 1.0)])
            .collect::<Vec<_>>(),
    );
    let starts: Vec<Point> = segments.iter().map(|segment| at(segment, 0.0)).collect();
    let vertices: Vec<u32> = starts
        .iter()
        .map(|&start| edges.push_vertex(start))
        .collect();
    let mut uses = Vec::with_capacity(segments.len());
    for (i, segment) in segments.into_iter().enumerate() {
        let next = (i + 1) % vertices.len();
        if distance(at(&segment, 1.0), starts[next]) > LARGEST_GAP * size {
            return Err(Problem::Geometry("its boundary does not close").into());
        }
        let same_sense = segment.end >= segment.start;
        let edge = edges.push_edge(
            0,
            [vertices[i], vertices[next]],
            Arc::new(segment.curve),
            same_sense,
        );
        uses.push(EdgeUse {
            edge,
            forward: true,
        });
    }
    Ok(Loop::Edges(uses))
}

/// Reverses the segments that run against the walk. In many files their senses are not reliable.
fn set_end_to_end(segments: &mut [CompositeSegment]) {
    let ends =
        |segment: &CompositeSegment| [segment.start, segment.end].map(|t| segment.curve.point(t));
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

impl<'a> Reader<'_, 'a> {
    /// The segments of a boundary curve of any class.
    fn composite_segments(&self, record: Record) -> Result<Vec<CompositeSegment>, EntityError> {
        let segments = match record.keyword {
            Keyword::CompositeCurve
            | Keyword::CompositeCurveOnSurface
            | Keyword::BoundaryCurve
            | Keyword::OuterBoundaryCurve => self.source.params::<2>(record)?[1],
            Keyword::Complex => self
                .source
                .class_params(record, "COMPOSITE_CURVE", 1)?
                .first::<1>()?[0],
            _ => return self.closed_segment(record.id),
        };
        self.segments(segments, 0)
    }

    /// The segment of a boundary that consists of one bounded curve.
    fn closed_segment(&self, id: u64) -> Result<Vec<CompositeSegment>, EntityError> {
        let DirectedCurve { curve, same_sense } = self.curve(id, 0)?;
        let (start, end) = curve
            .range()
            .ok_or(Problem::Geometry("a boundary without ends"))?;
        let (start, end) = if same_sense {
            (start, end)
        } else {
            (end, start)
        };
        Ok(vec![CompositeSegment { curve, start, end }])
    }
}

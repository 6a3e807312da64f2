//! Reads curves. Entities that only trim a curve or bind it to surfaces are followed to the curve itself.

use super::error::{EntityError, Problem};
use super::space::{Reader, Space};
use crate::geometry::{CompositeSegment, Curve};
use crate::part21::{Keyword, Param, ParamError, Params, Record};
use partprobe_shape::Point;

/// The largest depth of curves that refer to curves.
pub(super) const MAX_NESTING: u32 = 12;

/// A curve, and whether the entity that refers to it runs in its direction.
pub(super) struct DirectedCurve {
    pub(super) curve: Curve,
    /// False if a trimmed curve runs against its basis.
    pub(super) same_sense: bool,
}

impl From<Curve> for DirectedCurve {
    fn from(curve: Curve) -> Self {
        Self {
            curve,
            same_sense: true,
        }
    }
}

impl<'a> Reader<'_, 'a> {
    /// The curve in space that an instance defines.
    pub(super) fn curve(&self, id: u64, nesting: u32) -> Result<DirectedCurve, EntityError> {
        if nesting > MAX_NESTING {
            return Err(EntityError::from(Problem::TooDeep).within(id));
        }
        self.source
            .entity(id, |record| self.curve_of(record, nesting))
    }

    fn curve_of(&self, record: Record, nesting: u32) -> Result<DirectedCurve, EntityError> {
        if let Some(curve_3d) = self.curve_3d(record)? {
            return self.curve(curve_3d, nesting + 1);
        }
        match record.keyword {
            Keyword::Line => self.line(record).map(DirectedCurve::from),
            Keyword::Circle | Keyword::Ellipse | Keyword::Parabola | Keyword::Hyperbola => {
                self.conic(record).map(DirectedCurve::from)
            }
            Keyword::Polyline => {
                let [_, points] = self.source.params(record)?;
                Ok(Curve::Polyline(self.polyline_points(points)?).into())
            }
            Keyword::TrimmedCurve => {
                let [_, basis, _, _, sense] = self.source.params(record)?;
                let basis = self.curve(basis.reference()?, nesting + 1)?;
                Ok(DirectedCurve {
                    same_sense: basis.same_sense == self.source.flag(record, sense)?,
                    ..basis
                })
            }
            Keyword::CompositeCurve
            | Keyword::CompositeCurveOnSurface
            | Keyword::BoundaryCurve
            | Keyword::OuterBoundaryCurve => {
                self.composite(record, nesting).map(DirectedCurve::from)
            }
            Keyword::CurveReplica => {
                let (reader, parent) = self.without_replicas(record.id, Keyword::CurveReplica)?;
                reader.curve(parent.id, nesting + 1)
            }
            Keyword::OffsetCurve3d => self.offset_curve(record, nesting),
            Keyword::Complex => self.complex_curve(record, nesting),
            _ => Ok(Curve::Bspline(self.bspline_curve(record)?).into()),
        }
    }

    fn line(&self, record: Record) -> Result<Curve, EntityError> {
        let [_, origin, direction] = self.source.params(record)?;
        Ok(Curve::Line {
            origin: self.point(origin.reference()?)?,
            direction: self.vector(direction.reference()?)?,
        })
    }

    fn conic(&self, record: Record) -> Result<Curve, EntityError> {
        let [_, position, first] = self.source.params(record)?;
        let frame = self.frame_of_conic(position.reference()?)?;
        let first = self.radius(first)?;
        if matches!(record.keyword, Keyword::Circle) {
            return Ok(Curve::Ellipse {
                frame,
                rx: first,
                ry: first,
            });
        }
        if matches!(record.keyword, Keyword::Parabola) {
            return Ok(Curve::Parabola {
                frame,
                focal: first,
            });
        }
        let [_, _, _, second] = self.source.params(record)?;
        let second = self.radius(second)?;
        match record.keyword {
            Keyword::Ellipse => Ok(Curve::Ellipse {
                frame,
                rx: first,
                ry: second,
            }),
            _ => Ok(Curve::Hyperbola {
                frame,
                a: first,
                b: second,
            }),
        }
    }

    fn polyline_points(&self, points: Param<'a>) -> Result<Vec<Point>, EntityError> {
        let points = points
            .list()?
            .iter()
            .map(|point| self.point(point?.reference()?));
        let points: Vec<Point> = points.collect::<Result<_, _>>()?;
        if points.len() < 2 {
            Err(Problem::Geometry("a polyline needs two points").into())
        } else {
            Ok(points)
        }
    }

    fn offset_curve(&self, record: Record, nesting: u32) -> Result<DirectedCurve, EntityError> {
        let [_, basis, distance, _, reference] = self.source.params(record)?;
        let basis = self.curve(basis.reference()?, nesting + 1)?;
        let distance = self.length(distance)?;
        let reference = self.direction(reference.reference()?)?;
        // The offset lies on the other side if the basis is walked backwards, or if the representation is mirrored.
        let is_left = basis.same_sense != self.is_mirrored();
        let distance = if is_left { distance } else { -distance };
        let curve = Curve::Offset {
            basis: Box::new(basis.curve),
            distance,
            reference,
        };
        Ok(DirectedCurve {
            curve,
            same_sense: basis.same_sense,
        })
    }

    /// The curve of a complex instance: a composite curve or a B-spline.
    fn complex_curve(&self, record: Record, nesting: u32) -> Result<DirectedCurve, EntityError> {
        if let Some(params) = self.source.exchange.partial(record, "COMPOSITE_CURVE") {
            let [segments] = params.first()?;
            return Ok(Curve::Composite(self.segments(segments, nesting)?).into());
        }
        Ok(Curve::Bspline(self.bspline_curve(record)?).into())
    }

    fn composite(&self, record: Record, nesting: u32) -> Result<Curve, EntityError> {
        let [_, segments] = self.source.params(record)?;
        Ok(Curve::Composite(self.segments(segments, nesting)?))
    }

    pub(super) fn segments(
        &self,
        segments: Param<'a>,
        nesting: u32,
    ) -> Result<Vec<CompositeSegment>, EntityError> {
        let segments = segments.list()?.iter().map(|segment| {
            self.source.entity(segment?.reference()?, |record| {
                let [_, same_sense, parent] = self.source.params(record)?;
                let segment = self.segment(parent.reference()?, nesting + 1)?;
                Ok(if self.source.flag(record, same_sense)? {
                    segment
                } else {
                    reversed(segment)
                })
            })
        });
        let segments: Vec<_> = segments.collect::<Result<_, _>>()?;
        if segments.is_empty() {
            Err(Problem::Geometry("it has no segments").into())
        } else {
            Ok(segments)
        }
    }

    /// A bounded curve as a piece of its basis.
    pub(super) fn segment(&self, id: u64, nesting: u32) -> Result<CompositeSegment, EntityError> {
        if nesting > MAX_NESTING {
            return Err(EntityError::from(Problem::TooDeep).within(id));
        }
        let record = self.source.record(id)?;
        if record.keyword == Keyword::TrimmedCurve {
            return self
                .trimmed_segment(record, nesting)
                .map_err(|error| error.within(id));
        }
        if let Some(curve_3d) = self.curve_3d(record).map_err(|error| error.within(id))? {
            return self.segment(curve_3d, nesting + 1);
        }
        let DirectedCurve { curve, same_sense } = self.curve(id, nesting)?;
        let unbounded =
            || EntityError::from(Problem::Geometry("a segment without ends")).within(id);
        let (start, end) = curve.range().ok_or_else(unbounded)?;
        let segment = CompositeSegment { curve, start, end };
        Ok(if same_sense {
            segment
        } else {
            reversed(segment)
        })
    }

    /// The geometry of a curve that has no curve in space: the surface of its first `PCURVE`, and the curve in the parameter
    /// plane of that surface, in the units of the file.
    pub(super) fn parameter_curve(
        &self,
        id: u64,
    ) -> Result<Option<(u64, DirectedCurve)>, EntityError> {
        self.source.entity(id, |record| {
            let Some(record) = self.pcurve_of(record)? else {
                return Ok(None);
            };
            let [_, surface, representation] = self.source.params(record)?;
            let curve = self.curve_of_parameter_plane(representation.reference()?)?;
            Ok(Some((surface.reference()?, curve)))
        })
    }

    /// The curve in a parameter plane that a `DEFINITIONAL_REPRESENTATION` lists, in the units of the file.
    pub(super) fn curve_of_parameter_plane(
        &self,
        representation: u64,
    ) -> Result<DirectedCurve, EntityError> {
        let representation = self.source.record(representation)?;
        let [_, items] = self.source.params(representation)?;
        let [curve] = items.list()?.first()?;
        let plane = Space {
            mm_per_unit: 1.0,
            motion: None,
            ..self.space
        };
        Reader {
            space: plane,
            ..*self
        }
        .curve(curve.reference()?, 1)
    }

    /// The curve itself if it is a `PCURVE`, or else the first `PCURVE` to which it is bound.
    fn pcurve_of(&self, record: Record) -> Result<Option<Record>, EntityError> {
        if record.keyword == Keyword::Pcurve {
            return Ok(Some(record));
        }
        let Some(params) = self.surface_curve(record)? else {
            return Ok(None);
        };
        let [_, bound_to] = params.first()?;
        for associated in bound_to.list()?.iter() {
            let associated = self.source.record(associated?.reference()?)?;
            if associated.keyword == Keyword::Pcurve {
                return Ok(Some(associated));
            }
        }
        Ok(None)
    }

    /// The curve in space of a curve that is bound to surfaces. Returns `None` for any other curve.
    pub(super) fn curve_3d(&self, record: Record) -> Result<Option<u64>, EntityError> {
        let Some(params) = self.surface_curve(record)? else {
            return Ok(None);
        };
        let [curve_3d] = params.first()?;
        Ok(Some(curve_3d.reference()?))
    }

    /// The attributes of a curve that is bound to surfaces. Returns `None` for any other curve.
    fn surface_curve(&self, record: Record) -> Result<Option<Params<'a>>, ParamError> {
        match record.keyword {
            Keyword::SurfaceCurve
            | Keyword::SeamCurve
            | Keyword::IntersectionCurve
            | Keyword::BoundedSurfaceCurve => self
                .source
                .class_params(record, "SURFACE_CURVE", 1)
                .map(Some),
            Keyword::Complex => Ok(self.source.exchange.partial(record, "SURFACE_CURVE")),
            _ => Ok(None),
        }
    }

    fn trimmed_segment(
        &self,
        record: Record,
        nesting: u32,
    ) -> Result<CompositeSegment, EntityError> {
        let [_, basis, start, end, sense] = self.source.params(record)?;
        let DirectedCurve { curve, same_sense } = self.curve(basis.reference()?, nesting + 1)?;
        let forward = self.source.flag(record, sense)? == same_sense;
        let start = self.trim_parameter(&curve, start)?;
        let mut end = self.trim_parameter(&curve, end)?;
        if let Some(period) = curve.period() {
            if forward && end <= start {
                end += period;
            } else if !forward && end >= start {
                end -= period;
            }
        }
        Ok(CompositeSegment { curve, start, end })
    }

    /// The parameter that a trimming select gives: as a value, or as a point on the curve.
    fn trim_parameter(&self, curve: &Curve, select: Param<'a>) -> Result<f64, EntityError> {
        let params = select.list()?;
        for param in params.iter() {
            if let value @ (Param::Typed(..) | Param::Number(_)) = param? {
                let value = value.number()?;
                let is_angle = matches!(curve, Curve::Ellipse { .. });
                return Ok(if is_angle {
                    value * self.space.rad_per_unit
                } else {
                    value
                });
            }
        }
        let [point] = params.first()?;
        let id = point
            .reference()
            .map_err(|_| ParamError::Kind("a trimming point"))?;
        Ok(curve.project(self.point(id)?))
    }
}

fn reversed(segment: CompositeSegment) -> CompositeSegment {
    CompositeSegment {
        start: segment.end,
        end: segment.start,
        ..segment
    }
}

//! Reads points of every class: those with coordinates, and those on a curve or a surface at a parameter.
//!
//! A parameter on a trimmed curve or surface is not read. Some writers count it from the start of the trimmed piece, others from
//! the start of the basis. A guess might silently move the point.

use super::curves::{DirectedCurve, MAX_NESTING};
use super::error::{EntityError, Problem};
use super::space::Reader;
use super::surfaces::TypedSurface;
use crate::geometry::Surface;
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::Point;

/// A parameter may lie beyond the end of a curve or a surface by this fraction of its extent.
const BEYOND: f64 = 1e-9;

/// A point on a curve may depend on another curve through such a point. This is the largest depth.
const MAX_DEPENDENCE: u32 = 4;

impl<'a> Reader<'_, 'a> {
    /// The position of a point: a `CARTESIAN_POINT`, a point on a curve or a surface, or a replica.
    pub(super) fn point(&self, id: u64) -> Result<Point, EntityError> {
        self.source.entity(id, |record| {
            if record.keyword == Keyword::CartesianPoint {
                self.cartesian_point(record)
            } else {
                self.dependent(record)
            }
        })
    }

    /// The position of a point that is defined by other geometry.
    fn dependent(&self, record: Record) -> Result<Point, EntityError> {
        if self.dependence >= MAX_DEPENDENCE {
            return Err(Problem::TooDeep.into());
        }
        let inner = Reader {
            dependence: self.dependence + 1,
            ..*self
        };
        match record.keyword {
            Keyword::PointOnSurface => inner.point_on_surface(record),
            Keyword::PointOnCurve => inner.point_on_curve(record),
            Keyword::PointReplica => {
                let (reader, parent) = inner.without_replicas(record.id, Keyword::PointReplica)?;
                reader.point(parent.id)
            }
            Keyword::DegeneratePcurve => inner.degenerate_curve(record),
            Keyword::EvaluatedDegeneratePcurve => {
                let [_, _, _, equivalent] = self.source.params(record)?;
                inner.point(equivalent.reference()?)
            }
            Keyword::Complex => inner.complex_point(record),
            _ => Err(self.source.wrong_class(record, "point")),
        }
    }

    /// The position of a complex instance. One of its classes has coordinates or parameters.
    fn complex_point(&self, record: Record) -> Result<Point, EntityError> {
        let partial = |name| self.source.exchange.partial(record, name);
        if let Some(params) = partial("CARTESIAN_POINT") {
            let [coordinates] = params.first()?;
            return self.placed(coordinates);
        }
        if let Some(params) = partial("POINT_ON_SURFACE") {
            let [basis, u, v] = params.first()?;
            return self.at_parameters(basis, [u, v]);
        }
        if let Some(params) = partial("POINT_ON_CURVE") {
            let [basis, t] = params.first()?;
            return self.at_parameter(basis, t);
        }
        Err(self.source.wrong_class(record, "point"))
    }

    fn point_on_surface(&self, record: Record) -> Result<Point, EntityError> {
        let [_, basis, u, v] = self.source.params(record)?;
        self.at_parameters(basis, [u, v])
    }

    fn point_on_curve(&self, record: Record) -> Result<Point, EntityError> {
        let [_, basis, t] = self.source.params(record)?;
        self.at_parameter(basis, t)
    }

    /// The point of a surface at two parameters that the file gives.
    fn at_parameters(
        &self,
        basis: Param<'a>,
        parameters: [Param<'a>; 2],
    ) -> Result<Point, EntityError> {
        let (reader, basis) = self.without_replicas(basis.reference()?, Keyword::SurfaceReplica)?;
        if matches!(
            basis.keyword,
            Keyword::RectangularTrimmedSurface | Keyword::RectangularCompositeSurface
        ) {
            return Err(Problem::Geometry(
                "its parameters are those of a trimmed surface, name the basis instead",
            )
            .into());
        }
        let TypedSurface { surface, .. } = reader.surface(basis.id, 0)?;
        let scales = reader.parameter_scales(&surface);
        let [u, v] = parameters;
        let [u, v] = [u.number()? * scales[0], v.number()? * scales[1]];
        let ends = if has_free_parameters(&surface) {
            [None, None]
        } else {
            surface.range()
        };
        let period = surface.period();
        if is_beyond(u, ends[0], period[0]) || is_beyond(v, ends[1], period[1]) {
            return Err(
                Problem::Geometry("its parameters lie beyond the ends of its surface").into(),
            );
        }
        self.in_reach(surface.point(u, v))
    }

    /// The point of a curve at a parameter that the file gives.
    fn at_parameter(&self, basis: Param<'a>, parameter: Param<'a>) -> Result<Point, EntityError> {
        let (reader, basis) = self.without_replicas(basis.reference()?, Keyword::CurveReplica)?;
        reader.check_parameter(basis)?;
        let DirectedCurve { curve, .. } = reader.curve(basis.id, 0)?;
        let t = parameter.number()? * reader.parameter_scale(&curve);
        if is_beyond(t, curve.range(), curve.period()) {
            return Err(
                Problem::Geometry("its parameter lies beyond the ends of its curve").into(),
            );
        }
        self.in_reach(curve.point(t))
    }

    /// Refuses curves whose parameter in the file differs from the parameter of the curve that is read.
    fn check_parameter(&self, mut record: Record) -> Result<(), EntityError> {
        for _ in 0..MAX_NESTING {
            if let Some(curve_3d) = self.curve_3d(record)? {
                record = self.source.record(curve_3d)?;
                continue;
            }
            match record.keyword {
                Keyword::TrimmedCurve => {
                    let [_, basis, start, _, sense] = self.source.params(record)?;
                    if !sense.flag()? || !begins_at_zero(start) {
                        let reason =
                            "its parameter is that of a trimmed curve, name the basis instead";
                        return Err(Problem::Geometry(reason).into());
                    }
                    record = self.source.record(basis.reference()?)?;
                }
                Keyword::CompositeCurve | Keyword::CompositeCurveOnSurface => {
                    return Err(Problem::Geometry(
                        "its parameter is that of a composite curve, name a segment instead",
                    )
                    .into());
                }
                _ => return Ok(()),
            }
        }
        Err(Problem::TooDeep.into())
    }

    /// The position of a `DEGENERATE_PCURVE`: the point to which a curve of the parameter plane shrinks.
    fn degenerate_curve(&self, record: Record) -> Result<Point, EntityError> {
        let [_, surface, representation] = self.source.params(record)?;
        let TypedSurface { surface, .. } = self.surface(surface.reference()?, 0)?;
        let DirectedCurve { curve, .. } =
            self.curve_of_parameter_plane(representation.reference()?)?;
        let t = curve.range().map_or(0.0, |(low, _)| low);
        let ([x, y, _], scales) = (curve.point(t), self.parameter_scales(&surface));
        self.in_reach(surface.point(x * scales[0], y * scales[1]))
    }
}

/// Whether the parameters of a surface may lie beyond its natural ends, because its formula is valid there, too.
fn has_free_parameters(surface: &Surface) -> bool {
    matches!(
        surface,
        Surface::Plane(_)
            | Surface::Cylinder { .. }
            | Surface::Cone { .. }
            | Surface::Sphere { .. }
            | Surface::Torus { .. }
    )
}

fn is_beyond(t: f64, ends: Option<(f64, f64)>, period: Option<f64>) -> bool {
    let is_outside = |(low, high): (f64, f64)| {
        let margin = BEYOND * (high - low);
        t < low - margin || t > high + margin
    };
    !t.is_finite() || (period.is_none() && ends.is_some_and(is_outside))
}

/// Whether a trimming begins at the parameter 0.
fn begins_at_zero(start: Param<'_>) -> bool {
    let values = start
        .list()
        .into_iter()
        .flat_map(|list| list.iter().flatten());
    values
        .filter(|value| matches!(value, Param::Typed(..) | Param::Number(_)))
        .any(|value| value.number() == Ok(0.0))
}

//! Reads B-spline curves and surfaces in all their subtypes, plain or complex, rational or not.

use super::error::{EntityError, Problem};
use super::space::Reader;
use crate::geometry::{BsplineCurve, BsplineSurface, MAX_DEGREE};
use crate::part21::{Keyword, Param, Params, Record};

/// How a file gives the knots of a spline.
#[derive(Clone, Copy, Debug, PartialEq)]
enum KnotRule {
    /// The file lists them.
    Listed,
    /// One unit step per pole, not clamped.
    Uniform,
    /// Clamped, with one unit step per interior knot.
    QuasiUniform,
    /// Clamped, with Bézier pieces end to end.
    Bezier,
}

impl<'a> Reader<'_, 'a> {
    /// The B-spline curve of a plain or complex instance.
    pub(super) fn bspline_curve(&self, record: Record) -> Result<BsplineCurve, EntityError> {
        let rule = match record.keyword {
            Keyword::BSplineCurveWithKnots => KnotRule::Listed,
            Keyword::UniformCurve => KnotRule::Uniform,
            Keyword::QuasiUniformCurve => KnotRule::QuasiUniform,
            Keyword::BezierCurve => KnotRule::Bezier,
            Keyword::Complex => self.complex_rule(record, "CURVE"),
            _ => return Err(self.source.wrong_class(record, "curve")),
        };
        let [degree, control_points] = self
            .source
            .class_params(record, "B_SPLINE_CURVE", 1)?
            .first()?;
        let degree = checked_degree(degree)?;
        let weights = self.weights(record, "RATIONAL_B_SPLINE_CURVE")?;
        let mut poles = Vec::new();
        self.push_poles(control_points, &mut poles)?;
        apply_weights(&mut poles, weights, |weights| weights.numbers())?;
        let knots = match rule {
            KnotRule::Listed => {
                let [multiplicities, knots] = self
                    .source
                    .class_params(record, "B_SPLINE_CURVE_WITH_KNOTS", 6)?
                    .first()?;
                expanded_knots(multiplicities, knots, poles.len() + degree + 1)?
            }
            rule => ruled_knots(rule, poles.len(), degree)?,
        };
        Ok(BsplineCurve::new(degree, knots, poles)?)
    }

    /// The B-spline surface of a plain or complex instance.
    pub(super) fn bspline_surface(&self, record: Record) -> Result<BsplineSurface, EntityError> {
        let rule = match record.keyword {
            Keyword::BSplineSurfaceWithKnots => KnotRule::Listed,
            Keyword::UniformSurface => KnotRule::Uniform,
            Keyword::QuasiUniformSurface => KnotRule::QuasiUniform,
            Keyword::BezierSurface => KnotRule::Bezier,
            Keyword::Complex => self.complex_rule(record, "SURFACE"),
            _ => return Err(self.source.wrong_class(record, "surface")),
        };
        let [degree_u, degree_v, rows] = self
            .source
            .class_params(record, "B_SPLINE_SURFACE", 1)?
            .first()?;
        let degree = [checked_degree(degree_u)?, checked_degree(degree_v)?];
        let weights = self.weights(record, "RATIONAL_B_SPLINE_SURFACE")?;
        let (mut poles, counts) = self.pole_grid(rows)?;
        apply_weights(&mut poles, weights, |rows| {
            let rows = rows.iter().map(|row| row?.list()?.numbers());
            Ok(rows.collect::<Result<Vec<_>, _>>()?.concat())
        })?;
        let knots = match rule {
            KnotRule::Listed => self.surface_knots(record, degree, counts)?,
            rule => [
                ruled_knots(rule, counts[0], degree[0])?,
                ruled_knots(rule, counts[1], degree[1])?,
            ],
        };
        Ok(BsplineSurface::new(degree, knots, counts, poles)?)
    }

    fn surface_knots(
        &self,
        record: Record,
        degree: [usize; 2],
        counts: [usize; 2],
    ) -> Result<[Vec<f64>; 2], EntityError> {
        let [times_u, times_v, knots_u, knots_v] = self
            .source
            .class_params(record, "B_SPLINE_SURFACE_WITH_KNOTS", 8)?
            .first()?;
        Ok([
            expanded_knots(times_u, knots_u, counts[0] + degree[0] + 1)?,
            expanded_knots(times_v, knots_v, counts[1] + degree[1] + 1)?,
        ])
    }

    fn complex_rule(&self, record: Record, kind: &str) -> KnotRule {
        let is_a = |name: &str| {
            self.source
                .exchange
                .partial(record, &format!("{name}_{kind}"))
                .is_some()
        };
        match () {
            () if is_a("BEZIER") => KnotRule::Bezier,
            () if is_a("QUASI_UNIFORM") => KnotRule::QuasiUniform,
            () if is_a("UNIFORM") => KnotRule::Uniform,
            () => KnotRule::Listed,
        }
    }

    /// The list of weights of a rational spline. Returns `None` for any other spline.
    fn weights(&self, record: Record, name: &str) -> Result<Option<Params<'a>>, EntityError> {
        if record.keyword != Keyword::Complex {
            return Ok(None);
        }
        let Some(params) = self.source.exchange.partial(record, name) else {
            return Ok(None);
        };
        let [weights] = params.first()?;
        Ok(Some(weights.list()?))
    }

    /// The poles of a surface, with v varying fastest, and their numbers along u and v.
    fn pole_grid(&self, rows: Param<'a>) -> Result<(Vec<[f64; 4]>, [usize; 2]), EntityError> {
        let mut poles = Vec::new();
        let mut n_rows = 0;
        let mut n_columns = 0;
        for row in rows.list()?.iter() {
            let n_before = poles.len();
            self.push_poles(row?, &mut poles)?;
            let n_poles = poles.len() - n_before;
            if n_rows > 0 && n_poles != n_columns {
                return Err(Problem::Geometry("its rows of poles differ in length").into());
            }
            n_columns = n_poles;
            n_rows += 1;
        }
        Ok((poles, [n_rows, n_columns]))
    }

    fn push_poles(&self, points: Param<'a>, poles: &mut Vec<[f64; 4]>) -> Result<(), EntityError> {
        for point in points.list()?.iter() {
            let [x, y, z] = self.point(point?.reference()?)?;
            poles.push([x, y, z, 1.0]);
        }
        Ok(())
    }
}

/// The degree, if splines of this degree can be evaluated. A file may state any number.
fn checked_degree(param: Param<'_>) -> Result<usize, EntityError> {
    match param.count()? {
        degree @ 1..=MAX_DEGREE => Ok(degree),
        _ => Err(Problem::Geometry("its degree is not between 1 and 30").into()),
    }
}

/// Makes poles homogeneous. Without weights they already are.
fn apply_weights<'a>(
    poles: &mut [[f64; 4]],
    weights: Option<Params<'a>>,
    numbers: impl FnOnce(Params<'a>) -> Result<Vec<f64>, crate::part21::ParamError>,
) -> Result<(), EntityError> {
    let Some(weights) = weights else {
        return Ok(());
    };
    let weights = numbers(weights)?;
    if weights.len() != poles.len() {
        return Err(Problem::Geometry("it has not one weight for each pole").into());
    }
    for (pole, weight) in poles.iter_mut().zip(weights) {
        *pole = pole.map(|x| x * weight);
    }
    Ok(())
}

/// The knots, repeated by their multiplicities. Their total number must be `n_knots`.
fn expanded_knots(
    multiplicities: Param<'_>,
    knots: Param<'_>,
    n_knots: usize,
) -> Result<Vec<f64>, EntityError> {
    let miscounted = || {
        EntityError::from(Problem::Geometry(
            "its knots do not fit its degree and its poles",
        ))
    };
    let mut written = Vec::new();
    let mut multiplicities = multiplicities.list()?;
    for knot in knots.list()?.iter() {
        let knot = knot?.number()?;
        let times = multiplicities
            .next_param()?
            .ok_or_else(miscounted)?
            .count()?;
        // This is checked before the list grows, because a file may state any number.
        if times > n_knots - written.len() {
            return Err(miscounted());
        }
        written.resize(written.len() + times, knot);
    }
    if written.len() == n_knots {
        Ok(written)
    } else {
        Err(miscounted())
    }
}

/// The knots that a rule gives to a spline with `n_poles` poles.
fn ruled_knots(rule: KnotRule, n_poles: usize, degree: usize) -> Result<Vec<f64>, EntityError> {
    if n_poles <= degree {
        return Err(Problem::Geometry("it has too few poles for its degree").into());
    }
    let clamped = |n_spans: usize, times: usize| {
        let inner = (1..n_spans).flat_map(|knot| std::iter::repeat_n(knot as f64, times));
        let ends = |knot: f64| std::iter::repeat_n(knot, degree + 1);
        ends(0.0).chain(inner).chain(ends(n_spans as f64)).collect()
    };
    match rule {
        KnotRule::Bezier if (n_poles - 1).is_multiple_of(degree) => {
            Ok(clamped((n_poles - 1) / degree, degree))
        }
        KnotRule::Bezier => {
            Err(Problem::Geometry("its poles make no whole number of Bézier pieces").into())
        }
        KnotRule::QuasiUniform => Ok(clamped(n_poles - degree, 1)),
        KnotRule::Uniform | KnotRule::Listed => Ok((0..=n_poles + degree)
            .map(|knot| knot as f64 - degree as f64)
            .collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(rule: KnotRule, n_poles: usize, degree: usize, expected: Option<&[f64]>) {
        assert_eq!(ruled_knots(rule, n_poles, degree).ok().as_deref(), expected);
    }

    #[test]
    fn knots_follow_their_rule() {
        check(
            KnotRule::Uniform,
            3,
            2,
            Some(&[-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]),
        );
        check(
            KnotRule::QuasiUniform,
            4,
            2,
            Some(&[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]),
        );
        check(
            KnotRule::Bezier,
            5,
            2,
            Some(&[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0]),
        );
        check(KnotRule::Bezier, 4, 2, None);
        check(KnotRule::Uniform, 2, 2, None);
    }
}

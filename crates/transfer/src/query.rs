//! What is asked of a labeled surface or cloud, and what comes back.

use partprobe_carrier::{Point, PointSample, dot};
use rayon::prelude::*;

/// A point that wants a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// The position.
    pub position: Point,
    /// The unit normal of the surface at the point, if it is known; a limit on angles needs it.
    pub normal: Option<Point>,
}

/// What a labeled triangle or point must satisfy to give its label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest distance, in the unit of the positions.
    pub max_distance: f64,
    /// The largest angle between the two normals, in degrees; `None` lets any normal pass. A point without a normal
    /// then finds nothing.
    pub max_angle_deg: Option<f64>,
}

impl Limits {
    /// Any distance and any normal.
    pub const NONE: Self = Self {
        max_distance: f64::INFINITY,
        max_angle_deg: None,
    };

    /// The same limits, with normals that agree: the variant of a channel that does not take a label from the other
    /// side of a sheet, or from around a sharp edge.
    #[must_use]
    pub fn with_normals_within(self, max_angle_deg: f64) -> Self {
        Self {
            max_angle_deg: Some(max_angle_deg),
            ..self
        }
    }

    /// The lowest cosine between two normals that agree; `None` if any two do.
    pub(crate) fn min_cosine(&self) -> Option<f64> {
        self.max_angle_deg.map(|degrees| degrees.to_radians().cos())
    }
}

/// Whether the normals of a query and of a labeled item agree.
pub(crate) fn normals_agree(query: &Query, normal: Point, min_cosine: Option<f64>) -> bool {
    match (min_cosine, query.normal) {
        (None, _) => true,
        (Some(_), None) => false,
        (Some(least), Some(own)) => normal != [0.0; 3] && dot(own, normal) >= least,
    }
}

/// What was found for a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The index of the triangle, vertex or point.
    pub item: u32,
    /// Its distance.
    pub distance: f64,
}

/// The points of a sample with their normals, as queries.
#[must_use]
pub fn queries_of(sample: &PointSample) -> Vec<Query> {
    let pairs = sample.points.iter().zip(&sample.normals);
    pairs
        .map(|(point, normal)| Query {
            position: point.map(f64::from),
            normal: Some(normal.map(f64::from)),
        })
        .collect()
}

/// Answers each query, in parallel; the answers are in the order of the queries.
pub fn for_all<T: Send>(queries: &[Query], answer: impl Fn(&Query) -> T + Send + Sync) -> Vec<T> {
    queries.par_iter().map(answer).collect()
}

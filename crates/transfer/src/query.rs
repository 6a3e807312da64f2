//! Defines a query to a labeled surface or cloud, and its result.

use partprobe_carrier::{Point, PointSample, bounding_box, dot};
use rayon::prelude::*;

/// A point that needs a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// The position.
    pub position: Point,
    /// The unit normal of the surface at the point, if it is known. A limit on angles needs it.
    pub normal: Option<Point>,
}

/// Conditions that a labeled triangle or point must satisfy so that its label is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest distance, in the unit of the positions.
    pub max_distance: f64,
    /// The largest angle between the two normals, in degrees, or `None` if any normal is allowed. With a limit, a point without a
    /// normal finds nothing.
    pub max_angle_deg: Option<f64>,
}

impl Limits {
    /// Any distance and any normal.
    pub const NONE: Self = Self {
        max_distance: f64::INFINITY,
        max_angle_deg: None,
    };

    /// The same limits with a limit on the angle between normals. Then a channel does not take a label from the other side of a
    /// sheet, or from the other side of a sharp edge.
    #[must_use]
    pub fn with_normals_within(self, max_angle_deg: f64) -> Self {
        Self {
            max_angle_deg: Some(max_angle_deg),
            ..self
        }
    }

    /// The lowest cosine between two normals that agree. Returns `None` if there is no limit.
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

/// The item that was found for a query.
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

/// The item at which a search starts: the result of the previous search. The answer does not depend on it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Start(pub(crate) Option<u32>);

/// The number of queries that one thread answers one after the other. Each search starts where the previous one ended.
const CHUNK: usize = 512;

/// Answers the queries in parallel. The answers are in the order of the queries.
///
/// Queries that are near each other are answered one after the other, because they visit the same region of a tree. This only
/// changes the time.
pub fn for_all<T: Send>(queries: &[Query], answer: impl Fn(&Query) -> T + Send + Sync) -> Vec<T> {
    for_all_from(queries, |query, _| answer(query))
}

/// The same, with searches that start where the previous one ended.
pub(crate) fn for_all_from<T: Send>(
    queries: &[Query],
    answer: impl Fn(&Query, &mut Start) -> T + Send + Sync,
) -> Vec<T> {
    // The upper half of a key is the position on the curve, and the lower half is the index of the query.
    let positions = curve_positions(queries).into_iter().zip(0u64..);
    let mut order: Vec<u64> = positions
        .map(|(position, query)| u64::from(position) << 32 | query)
        .collect();
    order.par_sort_unstable();
    let index = |&key: &u64| (key & u64::from(u32::MAX)) as usize;

    let answers: Vec<Vec<T>> = order
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut start = Start::default();
            // The queries are copied first, because a loop that only copies waits less for memory than a search does.
            let near: Vec<Query> = chunk.iter().map(|key| queries[index(key)]).collect();
            near.iter().map(|query| answer(query, &mut start)).collect()
        })
        .collect();

    let mut in_order: Vec<Option<T>> = queries.iter().map(|_| None).collect();
    for (key, answer) in order.iter().zip(answers.into_iter().flatten()) {
        in_order[index(key)] = Some(answer);
    }
    // Each query was answered once, so no slot is empty.
    in_order.into_iter().flatten().collect()
}

/// The binary logarithm of the number of cells along each axis of the grid that orders queries.
const CELL_BITS: u32 = 10;

/// The position of each query on the z-order curve through a grid over all queries.
fn curve_positions(queries: &[Query]) -> Vec<u32> {
    let positions: Vec<Point> = queries.iter().map(|query| query.position).collect();
    let Some([low, high]) = bounding_box(&positions) else {
        return Vec::new();
    };
    let widest = (0..3)
        .map(|axis| high[axis] - low[axis])
        .fold(0.0, f64::max);
    let n_cells = f64::from(1u32 << CELL_BITS) - 1.0;
    let cell = |position: Point, axis: usize| {
        // A width of 0 gives NaN, which is cell 0.
        ((position[axis] - low[axis]) / widest * n_cells) as u32
    };
    let code = |position: &Point| {
        (0..3).fold(0, |code, axis| code | spread(cell(*position, axis)) << axis)
    };
    positions.par_iter().map(code).collect()
}

/// Puts two zero bits between the lowest ten bits.
fn spread(cell: u32) -> u32 {
    let cell = (cell | cell << 16) & 0x0300_00ff;
    let cell = (cell | cell << 8) & 0x0300_f00f;
    let cell = (cell | cell << 4) & 0x030c_30c3;
    (cell | cell << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn answers_are_in_the_order_of_the_queries(
            positions in proptest::collection::vec(proptest::array::uniform3(-5.0..5.0f64), 0..300),
        ) {
            let queries: Vec<Query> =
                positions.iter().map(|&position| Query { position, normal: None }).collect();
            prop_assert_eq!(for_all(&queries, |query| query.position), positions);
        }
    }

    #[test]
    fn neighbors_on_the_curve_share_their_highest_bits() {
        assert_eq!(spread(0b11_1111_1111), 0x0924_9249);
        assert_eq!(spread(0b101), 0b1_000_001);
    }
}

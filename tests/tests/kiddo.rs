//! Tests the nearest points that label transfer finds against those of kiddo, a k-d tree that shares no code with it.
//!
//! `cargo test --release -p partprobe-tests --features kiddo --test kiddo` runs it.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot make its own points has failed"
)]

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use partprobe_carrier::{Point, keyed_rng};
use partprobe_transfer::{Limits, NearestPoint, Query};
use proptest::prelude::*;

/// Points in the unit cube; with `levels` they lie on a grid, so that many distances are equal.
fn cloud(n: usize, levels: u64, seed: u64) -> Vec<Point> {
    let mut rng = keyed_rng(seed, &["cloud"]);
    let mut coordinate = || (rng.next_u64() % levels) as f64 / levels as f64;
    (0..n)
        .map(|_| [coordinate(), coordinate(), coordinate()])
        .collect()
}

proptest! {
    #[test]
    fn the_distance_of_the_nearest_point_agrees_with_kiddo(
        n in 1usize..600,
        levels in prop_oneof![Just(1u64 << 40), Just(4)],
        seed in 0u64..1 << 32,
    ) {
        let points = cloud(n, levels, seed);
        let ours = NearestPoint::new(&points, &[]).unwrap();
        // A tree of equal points may not be built: the buckets of a k-d tree split by coordinates.
        let mut distinct = points.clone();
        distinct.sort_by(|a, b| a.partial_cmp(b).unwrap());
        distinct.dedup();
        let theirs: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&distinct).unwrap();

        for position in cloud(50, 1 << 40, seed + 1) {
            let query = Query { position, normal: None };
            let found = ours.nearest(&query, &Limits::NONE).unwrap();
            let expected = theirs.query(&position).nearest_one::<SquaredEuclidean<f64>>().execute();
            prop_assert!((found.distance - expected.distance.sqrt()).abs() < 1e-12);
        }
    }
}

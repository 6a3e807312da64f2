//! Measures how many labels each channel loses if the labels are identical, on four solids with few triangles.
//!
//! The expected numbers are scores after Hungarian matching: accuracy and mIoU. They were measured before this crate
//! existed, with k-d trees of SciPy.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod solids;

use partprobe_carrier::{Mesh, NormalKind, keyed_rng, sample_by_area};
use partprobe_eval::score_clusters;
use partprobe_transfer::{
    Channel, LabeledSurface, Limits, NearestPoint, Query, Surface, ceiling, for_all, queries_of,
};

const N_POINTS: usize = 100_000;

struct Labeled {
    mesh: Mesh,
    labels: Vec<i32>,
}

struct Points {
    queries: Vec<Query>,
    triangles: Vec<u32>,
}

fn labeled(mesh: Mesh) -> Labeled {
    let labels = mesh.tri_face.iter().map(|&face| face as i32).collect();
    Labeled { mesh, labels }
}

fn points(mesh: &Mesh, n: usize, purpose: &str) -> Points {
    let mut rng = keyed_rng(0, &[purpose]);
    let sample = sample_by_area(mesh, n, NormalKind::Triangle, &mut rng).unwrap();
    Points {
        queries: queries_of(&sample),
        triangles: sample.triangles,
    }
}

/// Accuracy and mIoU of the labels that came through a channel.
fn through(solid: &Labeled, channel: Channel, limits: &Limits) -> [f64; 2] {
    let surface = Surface::of_mesh(&solid.mesh).unwrap();
    let labeled = LabeledSurface::new(surface, &solid.labels).unwrap();
    let sampled = points(&solid.mesh, N_POINTS, "asked");
    let found = ceiling(
        channel,
        &labeled,
        &sampled.queries,
        &sampled.triangles,
        limits,
    )
    .unwrap();
    assert_eq!(found.carried.n_unlabeled, 0);

    let scores = scores_of(&found.own, &found.carried.labels);
    assert!(scores[0] >= found.agreement());
    scores
}

/// The same through `n` labeled points of the surface.
fn through_points(solid: &Labeled, n: usize) -> [f64; 2] {
    let label_of = |&triangle: &u32| solid.labels[triangle as usize];
    let cloud = points(&solid.mesh, n, "cloud");
    let positions: Vec<_> = cloud.queries.iter().map(|query| query.position).collect();
    let nearest = NearestPoint::new(&positions, &[]).unwrap();
    let sampled = points(&solid.mesh, N_POINTS, "asked");
    let carried = for_all(&sampled.queries, |query| {
        let found = nearest.nearest(query, &Limits::NONE).unwrap();
        label_of(&cloud.triangles[found.item as usize])
    });
    let own: Vec<i32> = sampled.triangles.iter().map(label_of).collect();
    scores_of(&own, &carried)
}

fn scores_of(own: &[i32], carried: &[i32]) -> [f64; 2] {
    let carried: Vec<u32> = carried.iter().map(|&label| label as u32).collect();
    let scores = score_clusters(&carried, own).unwrap();
    [scores.accuracy, scores.miou]
}

#[track_caller]
fn check(found: [f64; 2], expected: [f64; 2]) {
    let is_near = |(found, expected): (&f64, &f64)| (found - expected).abs() <= 0.02;
    assert!(
        found.iter().zip(&expected).all(is_near),
        "{found:?}, expected {expected:?}"
    );
}

/// The nearest vertex, then 2×10⁴ and 2×10⁵ labeled points.
#[track_caller]
fn check_solid(mesh: Mesh, n_triangles: usize, expected: [[f64; 2]; 3]) {
    let solid = labeled(mesh);
    assert_eq!(solid.mesh.triangles.len(), n_triangles);
    check(
        through(&solid, Channel::NnVertex, &Limits::NONE),
        expected[0],
    );
    check(through_points(&solid, 20_000), expected[1]);
    check(through_points(&solid, 200_000), expected[2]);

    assert_eq!(through(&solid, Channel::Index, &Limits::NONE), [1.0, 1.0]);
    let same_corners = Channel::Triangle { tolerance: 1e-9 };
    assert_eq!(through(&solid, same_corners, &Limits::NONE), [1.0, 1.0]);
    // Points are stored in single precision, so a few points near an edge are nearer to the other side of it.
    let [accuracy, miou] = through(&solid, Channel::NnSurface, &Limits::NONE);
    assert!(accuracy > 0.9999 && miou > 0.9999, "{accuracy} {miou}");
    let sharp = Limits::NONE.with_normals_within(30.0);
    let [accuracy, miou] = through(&solid, Channel::NnSurface, &sharp);
    assert!(accuracy > 0.9999 && miou > 0.9999, "{accuracy} {miou}");
}

#[test]
fn a_box_keeps_a_third_of_its_labels_at_the_nearest_vertex() {
    let expected = [[0.334, 0.181], [0.986, 0.972], [0.995, 0.991]];
    check_solid(solids::block([1.0, 1.0, 1.0]), 12, expected);
}

#[test]
fn a_plate_keeps_less() {
    let expected = [[0.272, 0.118], [0.984, 0.932], [0.995, 0.977]];
    check_solid(solids::block([10.0, 10.0, 1.0]), 12, expected);
}

#[test]
fn a_bracket_with_a_hole_keeps_less_than_half() {
    let expected = [[0.445, 0.145], [0.977, 0.943], [0.992, 0.981]];
    check_solid(solids::bracket(), 280, expected);
}

#[test]
fn a_tube_keeps_half() {
    let expected = [[0.500, 0.271], [0.988, 0.964], [0.996, 0.987]];
    check_solid(solids::tube(64), 512, expected);
}

#[test]
fn normals_that_agree_make_the_nearest_vertex_exact_on_a_box() {
    let solid = labeled(solids::block([3.0, 2.0, 1.0]));
    let sharp = Limits::NONE.with_normals_within(30.0);
    assert_eq!(through(&solid, Channel::NnVertex, &sharp), [1.0, 1.0]);
}

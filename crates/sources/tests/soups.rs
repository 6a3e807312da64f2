//! Tests laws of all sources on random triangles: any mesh is labeled or refused, and always in the same way.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its own carrier has failed"
)]

use partprobe_carrier::{
    Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, IGNORE, Mesh, NormalKind, Point,
    PointSample, Units, keyed_rng, sample_by_area,
};
use partprobe_sources::{SOURCES, SourceError, SourceFactory, StepParts, source_named};
use proptest::prelude::*;

/// The largest number of triangles of a soup.
const MAX_TRIANGLES: usize = 16;

/// A carrier with these triangles, each on one of three faces.
fn carrier_of(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Carrier {
    let face = |face_type| Face::new(1, face_type, 1.0);
    let edges = [([0, 1], 3.0), ([1, 2], f64::NAN)].map(|(faces, phi)| Edge {
        faces,
        phi,
        length: 1.0,
    });
    let mesh = Mesh {
        vertex_face: vec![0; vertices.len()],
        tri_face: (0..)
            .take(triangles.len())
            .map(|idx: u32| idx % 3)
            .collect(),
        vertices,
        triangles,
        vertex_normal: Vec::new(),
    };
    let meta = CarrierMeta {
        id: "soup".to_owned(),
        source_sha256: String::new(),
        theta_deg: 8.0,
        tau_min: 0,
        chord_mm: 0.01,
        angle_rad: 0.3,
        diagonal_mm: mesh.diagonal(),
        units: Units::millimeters_and_radians(),
        lost: Vec::new(),
        notes: Vec::new(),
        instances: Vec::new(),
    };
    let graph = FaceGraph {
        faces: [FaceType::Plane, FaceType::Plane, FaceType::Cylinder]
            .map(face)
            .into(),
        edges: edges.into(),
    };
    let rule = StepParts {
        theta_deg: meta.theta_deg,
        tau_min: meta.tau_min,
    };
    let layers = rule.layers(&mesh, &graph);
    Carrier::new(mesh, graph, layers, meta).unwrap()
}

/// Coordinates that often coincide and are sometimes not finite.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => (0i8..4).prop_map(f64::from),
        10 => -1.0f64..1.0,
        1 => Just(1e-300),
        1 => Just(1e200),
    ]
}

fn soup(coordinate: impl Strategy<Value = f64>) -> impl Strategy<Value = Carrier> {
    let vertices = proptest::collection::vec(proptest::array::uniform3(coordinate), 3..30);
    let corners = proptest::array::uniform3(0u32..30);
    let triangles = proptest::collection::vec(corners, 0..MAX_TRIANGLES);
    // A distant vertex that belongs to no triangle. Then the triangles are small relative to the diagonal and are not refined.
    let far = prop_oneof![4 => Just(1000.0), 1 => Just(0.0)];
    (vertices, triangles, far).prop_map(|(mut vertices, triangles, far)| {
        let n_vertices = vertices.len() as u32;
        vertices.push([far, 0.0, 0.0]);
        let within = |corners: [u32; 3]| corners.map(|corner| corner % n_vertices);
        carrier_of(vertices, triangles.into_iter().map(within).collect())
    })
}

/// The name of each source. A source with a number has two names: one with the lowest number and one with 20.
fn names() -> Vec<String> {
    let names_of = |factory: &SourceFactory| match factory.numbers() {
        None => vec![factory.pattern().to_owned()],
        Some(numbers) => {
            let stem = factory.pattern().split('<').next().unwrap();
            let typical = 20.clamp(*numbers.start(), *numbers.end());
            let chosen = [*numbers.start(), typical];
            chosen.map(|number| format!("{stem}{number}")).to_vec()
        }
    };
    SOURCES.iter().flat_map(names_of).collect()
}

/// The labels of triangles and points, or the refusal.
type Outcome = Result<(Vec<i32>, Vec<i32>), SourceError>;

fn outcome(name: &str, carrier: &Carrier, sample: &PointSample) -> Outcome {
    let labels = source_named(name).unwrap().labels(carrier, 7)?;
    let of_triangles = labels.of_triangles().of_triangle().to_vec();
    let n_labels = labels.n_labels() as i32;
    assert_eq!(of_triangles.len(), carrier.mesh().triangles.len(), "{name}");
    assert!(
        of_triangles
            .iter()
            .all(|label| (IGNORE..n_labels).contains(label)),
        "{name}"
    );
    let of_points = labels.label_of_points(sample)?;
    assert_eq!(of_points.len(), sample.points.len(), "{name}");
    assert!(of_points.iter().all(|&label| label >= IGNORE), "{name}");
    Ok((of_triangles, of_points))
}

fn sample_of(carrier: &Carrier) -> PointSample {
    let mut rng = keyed_rng(1, &["test"]);
    // A soup without area has no points.
    sample_by_area(carrier.mesh(), 50, NormalKind::Triangle, &mut rng).unwrap_or_default()
}

/// The outcomes of all sources, computed with this many threads.
fn outcomes(carrier: &Carrier, n_threads: usize) -> Vec<Outcome> {
    use rayon::prelude::*;
    let sample = sample_of(carrier);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
    pool.build().unwrap().install(|| {
        let names = names();
        names
            .par_iter()
            .map(|name| outcome(name, carrier, &sample))
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_triangles_are_labeled_or_refused_in_one_way(carrier in soup(coordinate())) {
        prop_assert_eq!(outcomes(&carrier, 1), outcomes(&carrier, 3));
    }

    #[test]
    fn coordinates_that_are_not_finite_are_tolerated(
        carrier in soup(prop_oneof![4 => coordinate(), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)]),
    ) {
        prop_assert_eq!(outcomes(&carrier, 1), outcomes(&carrier, 2));
    }
}

#[test]
fn small_and_degenerate_meshes_are_labeled() {
    let corners = || vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for triangles in [
        vec![],
        vec![[0, 1, 2]],
        vec![[0, 0, 1]],
        vec![[2, 2, 2]; 40],
        vec![[0, 1, 2]; 40],
        // A closed tetrahedron, an open one, and one with a fin at an edge.
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 2]],
    ] {
        let carrier = carrier_of(corners(), triangles);
        for (name, outcome) in names().iter().zip(outcomes(&carrier, 1)) {
            let is_refusal = matches!(outcome, Err(SourceError::Unfit { .. }));
            assert!(outcome.is_ok() || is_refusal, "{name}: {outcome:?}");
        }
    }
}

//! Tests the sources that use only the mesh, on real carriers.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot label its own part has failed"
)]

use partprobe_carrier::{Carrier, Labels, NormalKind, Partition, keyed_rng, sample_by_area};
use partprobe_label::{LabelOptions, label};
use partprobe_sources::source_named;
use partprobe_synth::fixtures;
use std::collections::BTreeSet;

fn carrier_of(step: &str) -> Carrier {
    let file = label(step.as_bytes(), "shape", &LabelOptions::default()).unwrap();
    file.shapes.into_iter().next().unwrap().carrier.unwrap()
}

fn labels(name: &str, carrier: &Carrier) -> Labels {
    source_named(name)
        .unwrap()
        .labels(carrier, 0)
        .unwrap()
        .of_triangles()
        .clone()
}

#[track_caller]
fn check(name: &str, step: &str, n_expected: u32) {
    assert_eq!(
        labels(name, &carrier_of(step)).n_labels(),
        n_expected,
        "{name}"
    );
}

#[test]
fn regions_grow_up_to_sharp_edges() {
    let cuboid = fixtures::cuboid([3.0, 2.0, 1.0]);
    check("dihedral-grow-30", &cuboid, 6);
    check("dihedral-grow-89", &cuboid, 6);
    check("dihedral-grow-90", &cuboid, 1);
    // Bottom, side and top.
    check(
        "dihedral-grow-30",
        &fixtures::cylinder(2.0, 5.0, fixtures::FullTurn::Seamed),
        3,
    );
    check("dihedral-grow-30", &fixtures::torus(5.0, 1.0), 1);
    // Two bodies that do not touch.
    check(
        "dihedral-grow-180",
        &fixtures::two_blocks([1.0, 2.0, 3.0]),
        2,
    );
    check("smooth-180", &fixtures::two_blocks([1.0, 2.0, 3.0]), 2);
    check("solid", &fixtures::two_blocks([1.0, 2.0, 3.0]), 2);
    check("shell", &fixtures::hollow_block([3.0, 3.0, 3.0], 0.5), 2);
    check("solid", &fixtures::hollow_block([3.0, 3.0, 3.0], 0.5), 1);
}

#[test]
fn random_trials_find_the_primitives_of_bodies() {
    use fixtures::FullTurn::Seamed;
    check("ransac-5", &fixtures::cuboid([3.0, 2.0, 1.0]), 6);
    check("ransac-5", &fixtures::cylinder(2.0, 5.0, Seamed), 3);
    check("ransac-5", &fixtures::sphere(2.0, Seamed), 1);
    check("ransac-5", &fixtures::hemisphere(2.0, Seamed), 2);
    check("ransac-5", &fixtures::cone(2.0, 5.0, Seamed), 2);
    check("ransac-5", &fixtures::two_blocks([1.0, 2.0, 3.0]), 12);
    check(
        "ransac-5",
        &fixtures::hollow_block([3.0, 3.0, 3.0], 0.5),
        12,
    );
    // A spacer with a taper of 2.3°: two rings, a hole, a chamfer, and the outer cone, whose facets are not divided along
    // lines through its tip.
    let settings = partprobe_synth::SynthSettings {
        seed: 15,
        min_parts: 4,
        max_parts: 30,
    };
    check("ransac-10", &partprobe_synth::part(&settings, 15).step, 5);
}

#[test]
fn ward_finds_the_sides_of_a_block_and_keeps_its_bound() {
    let cuboid = carrier_of(&fixtures::cuboid([3.0, 3.0, 3.0]));
    let grouping = |name: &str| Partition::from_keys(labels(name, &cuboid).of_triangle());
    assert_eq!(grouping("ward-6"), grouping("brep-face"));

    for index in 0..6 {
        let part = partprobe_synth::part(
            &partprobe_synth::SynthSettings {
                seed: 5,
                min_parts: 4,
                max_parts: 20,
            },
            index,
        );
        let carrier = carrier_of(&part.step);
        let mut rng = keyed_rng(1, &["test"]);
        let sample = sample_by_area(carrier.mesh(), 2000, NormalKind::Triangle, &mut rng).unwrap();
        let at = |name: &str| {
            source_named(name)
                .unwrap()
                .labels(&carrier, 0)
                .unwrap()
                .label_of_points(&sample)
                .unwrap()
        };
        let (fine, coarse) = (at("ward-20"), at("ward-7"));
        let n_distinct = |labels: &[i32]| labels.iter().collect::<BTreeSet<_>>().len();
        assert!(
            n_distinct(&fine) <= 20 && 7 < n_distinct(&fine),
            "{}",
            n_distinct(&fine)
        );
        assert_eq!(n_distinct(&coarse), 7);
        let pairs: BTreeSet<_> = fine.iter().zip(&coarse).collect();
        assert_eq!(
            pairs.len(),
            n_distinct(&fine),
            "a label of ward-20 lies in one of ward-7"
        );
        assert_eq!(fine, at("ward-20"));
    }
    check("ward-1", &fixtures::two_blocks([1.0, 2.0, 3.0]), 1);
}

#[test]
fn ward_variants_have_the_number_of_labels_in_their_names() {
    let cuboid = fixtures::cuboid([3.0, 3.0, 3.0]);
    check("ward-match", &cuboid, 6);
    let part = |min_parts: u32, max_parts: u32| {
        let settings = partprobe_synth::SynthSettings {
            seed: 5,
            min_parts,
            max_parts,
        };
        carrier_of(&partprobe_synth::part(&settings, 0).step)
    };
    let few = part(4, 10);
    let n_parts = few.n_parts() as u32;
    assert!((2..20).contains(&n_parts));
    assert_eq!(
        labels("ward-match", &few),
        labels(&format!("ward-{n_parts}"), &few)
    );
    let many = part(40, 60);
    assert!(many.n_parts() > 20);
    assert_eq!(labels("ward-match", &many), labels("ward-20", &many));

    let blurs = ["ward-20-sharp", "ward-20", "ward-20-coarse"].map(|name| labels(name, &many));
    assert!(blurs.iter().all(|labels| labels.n_labels() <= 20));
    let distinct: BTreeSet<&[i32]> = blurs.iter().map(Labels::of_triangle).collect();
    assert_eq!(distinct.len(), 3);
}

#[test]
fn thickness_distinguishes_a_wall_from_a_block() {
    check(
        "sdf-5",
        &fixtures::sphere(2.0, fixtures::FullTurn::Seamed),
        1,
    );
    check("sdf-1", &fixtures::cuboid([3.0, 2.0, 1.0]), 1);
    // Two blocks of one size are two labels.
    check("sdf-1", &fixtures::two_blocks([1.0, 2.0, 3.0]), 2);
    // The outside and the void of a hollow block do not touch.
    check("sdf-1", &fixtures::hollow_block([3.0, 3.0, 3.0], 0.5), 2);
}

//! Tests laws of the partition on the text itself: where a solid stands, its unit, and the order of its faces in the file
//! decide nothing but names.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own text has failed"
)]

use partprobe_brep::{ReadBudget, Tessellation, TessellationOptions, read, tessellate};
use partprobe_sources::partition_by_type_and_angle;
use partprobe_synth::{SynthSettings, part};
use proptest::prelude::*;
use std::collections::BTreeSet;

fn step_text(index: u64) -> String {
    part(
        &SynthSettings {
            seed: 41,
            min_parts: 2,
            max_parts: 30,
        },
        index,
    )
    .step
}

fn shape_of(step: &str) -> Tessellation {
    let brep =
        read(step.as_bytes(), &ReadBudget::default()).unwrap_or_else(|error| panic!("{error}"));
    tessellate(&brep, &TessellationOptions::default())
}

/// The partition as sets of `#` numbers: independent of the order of faces.
fn parts_by_id(shape: &Tessellation) -> BTreeSet<BTreeSet<u64>> {
    let partition = partition_by_type_and_angle(&shape.graph, 8.0);
    let mut parts = vec![BTreeSet::new(); partition.n_parts() as usize];
    for (face, &part) in shape.graph.faces.iter().zip(partition.parts()) {
        parts[part as usize].insert(face.step_id);
    }
    parts.into_iter().collect()
}

/// Maps the three numbers of every instance of `keyword`; generated files have one instance a line.
fn map_triples(step: &str, keyword: &str, map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let mut out = String::with_capacity(step.len());
    for line in step.split_inclusive('\n') {
        let opening =
            line.contains(&format!("={keyword}(")) || line.contains(&format!("= {keyword}("));
        match (opening, line.rfind(",("), line.rfind("))")) {
            (true, Some(start), Some(end)) => {
                let numbers: Vec<f64> = line[start + 2..end]
                    .split(',')
                    .map(|x| x.trim().parse().unwrap())
                    .collect();
                let [x, y, z] = map([numbers[0], numbers[1], numbers[2]]);
                out.push_str(&format!(
                    "{},({x:?},{y:?},{z:?}{}",
                    &line[..start],
                    &line[end..]
                ));
            }
            _ => out.push_str(line),
        }
    }
    out
}

fn rotated([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    let [x, y, z] = [cos * x - sin * y, sin * x + cos * y, z];
    // A second axis, so that nothing stays parallel to the frame.
    [x, cos * y - sin * z, sin * y + cos * z]
}

/// Turns the face list of the closed shell by `shift` places.
fn with_faces_shifted(step: &str, shift: usize) -> String {
    let begin = step.find("CLOSED_SHELL(").expect("a closed shell");
    let open = begin + step[begin..].find(",(").expect("a face list") + 2;
    let close = open + step[open..].find(')').expect("the end of the face list");
    let mut faces: Vec<&str> = step[open..close].split(',').collect();
    let places = shift % faces.len();
    faces.rotate_left(places);
    format!("{}{}{}", &step[..open], faces.join(","), &step[close..])
}

/// The instances in another order under other numbers, and the new number of each old one.
fn renumbered(step: &str, factor: u64, shift: usize) -> (String, impl Fn(u64) -> u64) {
    // Multiplication is a bijection modulo a prime; no generated file has that many instances.
    let new_number = move |old: u64| old * factor % 1_000_003;
    let renumber = |line: &str| {
        let mut pieces = line.split('#');
        let mut out = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let digits = piece
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(piece.len());
            out.push_str(&format!(
                "#{}{}",
                new_number(piece[..digits].parse().unwrap()),
                &piece[digits..]
            ));
        }
        out
    };
    let (mut instances, frame): (Vec<&str>, Vec<&str>) =
        step.lines().partition(|line| line.starts_with('#'));
    let places = shift % instances.len();
    instances.rotate_left(places);
    instances.reverse();
    let data = frame
        .iter()
        .position(|line| line.trim() == "DATA;")
        .expect("a data section")
        + 1;
    let instances: Vec<String> = instances.into_iter().map(renumber).collect();
    (
        [
            &frame[..data].join("\n"),
            &instances.join("\n"),
            &frame[data..].join("\n"),
        ]
        .map(String::as_str)
        .join("\n"),
        new_number,
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn a_rigid_motion_leaves_the_parts_and_areas_alone(index in 0u64..2000, angle in 0.1f64..3.0, shift in -50.0f64..50.0) {
        let text = step_text(index);
        let turned = map_triples(&text, "DIRECTION", |direction| rotated(direction, angle));
        let moved = map_triples(&turned, "CARTESIAN_POINT", |point| rotated(point, angle).map(|x| x + shift));
        prop_assert!(moved != text);
        let (before, after) = (shape_of(&text), shape_of(&moved));
        prop_assert_eq!(parts_by_id(&before), parts_by_id(&after));
        for (a, b) in before.graph.faces.iter().zip(&after.graph.faces) {
            prop_assert!((a.area - b.area).abs() <= 1e-4 * a.area, "face #{}: {} and {}", a.step_id, a.area, b.area);
        }
    }

    #[test]
    fn another_unit_scales_the_areas_and_nothing_else(index in 0u64..2000) {
        let text = step_text(index);
        prop_assume!(text.contains("SI_UNIT(.MILLI.,.METRE.)") && !text.contains("INCH"));
        let in_centimeters = text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)");
        let (before, after) = (shape_of(&text), shape_of(&in_centimeters));
        prop_assert_eq!(parts_by_id(&before), parts_by_id(&after));
        for (a, b) in before.graph.faces.iter().zip(&after.graph.faces) {
            prop_assert!((100.0 * a.area - b.area).abs() <= 1e-3 * b.area, "face #{}", a.step_id);
        }
    }

    #[test]
    fn the_order_of_faces_only_renumbers(index in 0u64..2000, shift in 1usize..20) {
        let text = step_text(index);
        let (before, after) = (shape_of(&text), shape_of(&with_faces_shifted(&text, shift)));
        prop_assert_eq!(parts_by_id(&before), parts_by_id(&after));
        prop_assert_eq!(before.graph.edges.len(), after.graph.edges.len());
    }

    #[test]
    fn numbers_and_positions_of_instances_do_not_matter(index in 0u64..2000, factor in 2u64..1_000_000, shift in 0usize..5000) {
        let text = step_text(index);
        let (other, new_number) = renumbered(&text, factor, shift);
        let (before, after) = (shape_of(&text), shape_of(&other));
        let renamed: BTreeSet<BTreeSet<u64>> =
            parts_by_id(&before).iter().map(|part| part.iter().map(|&id| new_number(id)).collect()).collect();
        prop_assert_eq!(renamed, parts_by_id(&after));
        let areas = |shape: &Tessellation| shape.graph.faces.iter().map(|face| face.area).collect::<Vec<_>>();
        prop_assert_eq!(areas(&before), areas(&after));
    }
}

//! Tests that generated parts go through the reader and the mesher, and come back as they were made:
//! same faces, types and partition, areas and volumes of the closed forms, closed meshes.

use partprobe_brep::{ReadBudget, Tessellation, TessellationOptions, read, tessellate};
use partprobe_carrier::{border_sides, distance, solid_mesh, weld};
use partprobe_sources::partition_by_type_and_angle;
use partprobe_synth::{SynthPart, SynthSettings, part};

const N_PARTS: u64 = 200;
/// The part of a face that chords of the default tolerances may take from it: a disc loses 1.5 %.
const BY_ANGLE: f64 = 0.02;
/// The mean width of the strip between chords and a border, as a part of the chord tolerance: narrow faces may lose that.
const BY_CHORD: f64 = 0.25;

fn shape_of(name: &str, step: &str) -> Tessellation {
    let brep = read(step.as_bytes(), &ReadBudget::default())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let shape = tessellate(&brep, &TessellationOptions::default());
    assert!(shape.lost.is_empty(), "{name} lost {:?}", shape.lost);
    shape
}

fn check_all(check: impl Fn(&SynthPart, &Tessellation)) {
    let settings = SynthSettings {
        seed: 20,
        min_parts: 2,
        max_parts: 40,
    };
    for index in 0..N_PARTS {
        let part = part(&settings, index);
        check(&part, &shape_of(&part.name, &part.step));
    }
}

#[test]
fn faces_types_and_partition_are_those_of_the_generator() {
    check_all(|part, shape| {
        let types: Vec<_> = shape
            .graph
            .faces
            .iter()
            .map(|face| face.face_type)
            .collect();
        assert_eq!(types, part.face_types, "{}", part.name);
        let partition = partition_by_type_and_angle(&shape.graph, 8.0);
        assert_eq!(partition.parts(), part.face_parts, "{}", part.name);
    });
}

#[test]
fn areas_are_those_of_the_trimmed_surfaces() {
    check_all(|part, shape| {
        for (i, (face, area)) in shape.graph.faces.iter().zip(&part.face_areas).enumerate() {
            let Some(area) = area else { continue };
            let error = (face.area - area).abs() / area;
            assert!(
                error < 1e-3,
                "{} face {i}: {} is not {area}",
                part.name,
                face.area
            );
        }
    });
}

/// Chords take from a face what is round of it, and a strip beside its border.
#[test]
fn quadrature_and_triangles_agree_on_every_face() {
    check_all(|part, shape| {
        let n_faces = shape.graph.faces.len();
        let (mut of_triangles, mut border) = (vec![0.0; n_faces], vec![0.0; n_faces]);
        for (area, &face) in shape
            .mesh
            .triangle_areas()
            .into_iter()
            .zip(&shape.mesh.tri_face)
        {
            of_triangles[face as usize] += area;
        }
        for [a, b] in border_sides(&shape.mesh.triangles) {
            let [from, to] = [a, b].map(|vertex| shape.mesh.vertices[vertex as usize]);
            border[shape.mesh.vertex_face[a as usize] as usize] += distance(from, to);
        }
        for (i, face) in shape.graph.faces.iter().enumerate() {
            let allowed = BY_ANGLE * face.area + BY_CHORD * shape.chord_mm * border[i];
            let (name, difference) = (&part.name, (face.area - of_triangles[i]).abs());
            assert!(
                difference < allowed,
                "{name} face {i}: {} is not {}",
                face.area,
                of_triangles[i]
            );
        }
        assert_eq!(shape.notes, [], "{}", part.name);
    });
}

#[test]
fn meshes_close_and_bound_the_volume() {
    check_all(|part, shape| {
        let solid = solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true);
        assert!(solid.watertight, "{} is not watertight", part.name);
        // The chord tolerance moves each face by at most itself.
        let area: f64 = shape.graph.faces.iter().map(|face| face.area).sum();
        let error = (solid.volume - part.volume).abs();
        assert!(
            error < area * shape.chord_mm,
            "{}: volume {} is not {}",
            part.name,
            solid.volume,
            part.volume
        );
    });
}

#[test]
fn every_fixture_is_read_without_loss() {
    for (name, step) in partprobe_synth::fixtures::all() {
        let shape = shape_of(&name, &step);
        if name != "open-box" {
            assert!(
                solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true).watertight,
                "{name} is not watertight"
            );
        }
    }
}

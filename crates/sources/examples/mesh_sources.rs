//! Writes the results that `tools/mesh_sources/compare.py` compares with other libraries: one JSON line per shape.
//!
//! The shapes are STEP files, or 20 generated parts if no file is named. A line holds the refined mesh, the shape diameter
//! and the label by `sdf-<K>` at each of its triangles, and points with normals and their labels by `ransac-<PERMILLE>`.

#![allow(clippy::print_stdout, reason = "an example prints what it has made")]

use partprobe_carrier::{
    Carrier, NormalKind, PointSample, REFINE_FRACTION, RefinedMesh, keyed_rng, refine,
    sample_by_area, weld,
};
use partprobe_label::{LabelOptions, label};
use partprobe_sources::{shape_diameters, source_named};
use partprobe_synth::{SynthSettings, part};
use std::error::Error;

/// Number of points of each shape.
const N_POINTS: usize = 20_000;

/// Number of generated parts, if no file is named.
const N_PARTS: u64 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut source = || {
        arguments
            .next()
            .ok_or("name two sources, such as ransac-10 sdf-5")
    };
    let sources = [source()?, source()?];
    let files: Vec<String> = arguments.collect();
    for path in &files {
        print_shape(path, &std::fs::read(path)?, &sources)?;
    }

    let settings = SynthSettings {
        seed: 15,
        min_parts: 4,
        max_parts: 30,
    };
    let n_generated = if files.is_empty() { N_PARTS } else { 0 };
    for index in 0..n_generated {
        let generated = part(&settings, index);
        print_shape(&generated.name, generated.step.as_bytes(), &sources)?;
    }
    Ok(())
}

/// Prints the line of the first shape of a file.
fn print_shape(name: &str, step: &[u8], sources: &[String; 2]) -> Result<(), Box<dyn Error>> {
    let file = label(step, name, &LabelOptions::default())?;
    let shape = file.shapes.into_iter().next().ok_or("no shape")?;
    println!("{}", line(name, &shape.carrier?, sources)?);
    Ok(())
}

fn line(
    name: &str,
    carrier: &Carrier,
    [of_points, of_triangles]: &[String; 2],
) -> Result<String, Box<dyn Error>> {
    let fine = refine(carrier.mesh(), REFINE_FRACTION * carrier.mesh().diagonal());
    let welded = weld(&fine.mesh);
    let diameters: Vec<String> = shape_diameters(&fine.mesh)
        .iter()
        .map(|diameter| diameter.map_or_else(|| "null".to_owned(), |value| value.to_string()))
        .collect();
    let triangle_labels = source_named(of_triangles)?
        .labels(carrier, 0)?
        .label_of_points(&centroids(&fine))?;

    let mut rng = keyed_rng(0, &["mesh sources"]);
    let sample = sample_by_area(carrier.mesh(), N_POINTS, NormalKind::Triangle, &mut rng)?;
    let labels = source_named(of_points)?
        .labels(carrier, 0)?
        .label_of_points(&sample)?;
    let (vertices, triangles) = (welded.vertices, welded.triangles);
    let (points, normals) = (sample.points, sample.normals);
    Ok(format!(
        "{{\"name\":{name:?},\"vertices\":{vertices:?},\"triangles\":{triangles:?},\"diameters\":[{}],\
         \"triangle_labels\":{triangle_labels:?},\
         \"points\":{points:?},\"normals\":{normals:?},\"labels\":{labels:?}}}",
        diameters.join(",")
    ))
}

/// The center of each triangle of a refined mesh, as a sample of the plain mesh.
fn centroids(fine: &RefinedMesh) -> PointSample {
    let center = |triangle: usize| {
        let [a, b, c] = fine.mesh.corners(triangle);
        [0, 1, 2].map(|axis| ((a[axis] + b[axis] + c[axis]) / 3.0) as f32)
    };
    PointSample {
        points: (0..fine.mesh.triangles.len()).map(center).collect(),
        normals: Vec::new(),
        triangles: fine.parent.clone(),
    }
}

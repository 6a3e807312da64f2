//! Benchmarks reading and tessellating: a generated part with many faces, and a hand-written text of one triangle with many
//! other instances around it.

use divan::Bencher;
use partprobe_brep::part21::{Exchange, normalized};
use partprobe_brep::{ReadBudget, TessellationOptions, read, tessellate};
use partprobe_synth::SynthSettings;
use std::hint::black_box;

fn main() {
    divan::main();
}

/// Largest number of instances in a benchmarked text.
const MAX_ENTITIES: u64 = 1_000_000;

/// The text of a generated part with this many machined parts.
fn generated(n_parts: usize) -> String {
    let settings = SynthSettings {
        seed: 1,
        min_parts: n_parts as u32,
        max_parts: n_parts as u32,
    };
    partprobe_synth::part(&settings, 0).step
}

/// A triangle in a shell, and this many points that no face uses.
fn handwritten(n_points: usize) -> String {
    let mut data = String::from(
        "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=CARTESIAN_POINT('',(10.,0.,0.));#3=CARTESIAN_POINT('',(0.,10.,0.));\n\
         #4=POLY_LOOP('',(#1,#2,#3));#5=FACE_OUTER_BOUND('',#4,.T.);#6=FACE('',(#5));\n\
         #7=OPEN_SHELL('',(#6));#8=SHELL_BASED_SURFACE_MODEL('',(#7));\n",
    );
    for i in 0..n_points {
        data += &format!(
            "#{}=CARTESIAN_POINT('',({i}.5,-{i}.25E-1,{i}.));\n",
            100 + i
        );
    }
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
         FILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));\nENDSEC;\nDATA;\n{data}ENDSEC;\nEND-ISO-10303-21;\n"
    )
}

/// Indexing alone, without following a reference.
#[divan::bench(args = [1_000, 100_000])]
fn index_handwritten(bencher: Bencher<'_, '_>, n_points: usize) {
    let text = handwritten(n_points);
    bencher.bench(|| {
        let text = normalized(black_box(text.as_bytes()));
        let mut lost = Vec::new();
        Exchange::index(&text, MAX_ENTITIES, &mut lost).map(|exchange| exchange.records().len())
    });
}

#[divan::bench(args = [1_000, 100_000])]
fn read_handwritten(bencher: Bencher<'_, '_>, n_points: usize) {
    let text = handwritten(n_points);
    bencher.bench(|| read(black_box(text.as_bytes()), &ReadBudget::default()));
}

#[divan::bench(args = [4, 16])]
fn read_generated(bencher: Bencher<'_, '_>, n_parts: usize) {
    let text = generated(n_parts);
    bencher.bench(|| read(black_box(text.as_bytes()), &ReadBudget::default()));
}

#[divan::bench(args = [4, 16])]
fn tessellate_generated(bencher: Bencher<'_, '_>, n_parts: usize) {
    let text = generated(n_parts);
    let brep = read(text.as_bytes(), &ReadBudget::default()).expect("a generated part is readable");
    bencher.bench(|| tessellate(black_box(&brep), &TessellationOptions::default()));
}

//! Compares the two kernels' readings of each STEP file. Prints one line of JSON per file.
//!
//! `cargo run --release -p partprobe-truck --features truck --example agreement -- FILE…`
//! truck never ends on some files, so start one process per file, with a timeout (`xargs -n 1 timeout 60`).

use partprobe_brep::{ReadBudget, TessellationOptions};
use partprobe_shape::FaceGraph;
use partprobe_sources::partition_by_type_and_angle;
use partprobe_truck::{KernelAgreement, Reading, TruckSettings, shape};

fn main() {
    for path in std::env::args().skip(1) {
        println!("{{\"file\":{path:?},{}}}", line_of(&path));
    }
}

fn line_of(path: &str) -> String {
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(error) => {
            return format!(
                "\"status\":\"unreadable\",\"reason\":{:?}",
                error.to_string()
            );
        }
    };
    let brep = match partprobe_brep::read(&text, &ReadBudget::default()) {
        Ok(brep) => brep,
        Err(error) => {
            return format!(
                "\"status\":\"own kernel failed\",\"reason\":{:?}",
                error.to_string()
            );
        }
    };
    let ours = partprobe_brep::tessellate(&brep, &TessellationOptions::default());
    let units = &brep.units;
    let settings = TruckSettings {
        mm_per_unit: units.mm_per_unit,
        rad_per_unit: units.rad_per_unit,
        chord_fraction: 5e-4,
    };
    let theirs = match shape(&String::from_utf8_lossy(&text), &settings) {
        Ok(theirs) => theirs,
        Err(error) => {
            return format!(
                "\"status\":\"truck failed\",\"reason\":{:?}",
                error.to_string()
            );
        }
    };
    let parts = [&ours.graph, &theirs.graph].map(|graph| partition_by_type_and_angle(graph, 8.0));
    let [a, b] = [
        (&ours.graph, parts[0].parts()),
        (&theirs.graph, parts[1].parts()),
    ]
    .map(reading);
    let KernelAgreement {
        faces,
        types,
        adjacency,
        partition,
        n_common_faces,
        n_equal_areas,
    } = KernelAgreement::of(a, b);
    format!(
        "\"status\":\"both\",\"faces\":{faces},\"types\":{types},\"adjacency\":{adjacency},\"partition\":{partition},\
         \"n_common_faces\":{n_common_faces},\"n_equal_areas\":{n_equal_areas},\"n_lost\":{}",
        theirs.lost.len()
    )
}

fn reading<'a>((graph, parts): (&'a FaceGraph, &'a [u32])) -> Reading<'a> {
    Reading { graph, parts }
}

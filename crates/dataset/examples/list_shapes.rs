//! Prints the shapes of a data set, with their carriers: `cargo run --example list_shapes -- dataset/`

use partprobe_dataset::{Dataset, DatasetError};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give the folder of a data set")?;
    Ok(list(Path::new(&path))?)
}

fn list(path: &Path) -> Result<(), DatasetError> {
    let dataset = Dataset::open(path)?;
    for entry in dataset.entries() {
        if entry.file.is_none() {
            let reason = entry.reason.as_deref().unwrap_or("no carrier");
            println!("{}: {}, {reason}", entry.source, entry.status.name());
            continue;
        }
        let carrier = dataset.carrier(entry)?;
        println!(
            "{}: {} faces, {} parts, {} triangles",
            entry.id,
            entry.n_faces,
            carrier.n_parts(),
            carrier.mesh().triangles.len()
        );
    }
    Ok(())
}

//! Prints the faces of released labels: `cargo run --release -p partprobe-release --example print_labels -- package/labels-00000.parquet`

use partprobe_release::{ReleasedRow, rows_from_parquet};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give a file of a package, for example package/labels-00000.parquet")?;
    for ReleasedRow { shape, labels } in rows_from_parquet(std::fs::read(path)?)? {
        println!("{} ({}): {}", shape.id, shape.source_sha256, shape.status);
        let labels = labels.unwrap_or_default();
        let faces = labels.step_id.iter().zip(&labels.face_type);
        for ((step_id, face_type), part) in faces.zip(&labels.label) {
            println!("  #{step_id}: {face_type}, part {part}");
        }
    }
    Ok(())
}

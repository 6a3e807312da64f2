//! Labels every STEP file of a folder and prints the number of parts of each.
//!
//! ```sh
//! cargo run --release -p partprobe-label --example label_folder -- parts/
//! ```

use partprobe_label::{LabelOptions, label};
use std::error::Error;
use std::fs;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("give the path of a folder with STEP files")?;
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_, std::io::Error>>()?;
    paths.retain(|path| {
        path.extension()
            .is_some_and(|end| end.eq_ignore_ascii_case("step"))
    });
    paths.sort();

    let options = LabelOptions::default();
    for path in paths {
        let id = path.file_stem().unwrap_or_default().to_string_lossy();
        match label(&fs::read(&path)?, &id, &options) {
            Ok(file) => {
                for shape in file.shapes {
                    let carrier = shape.carrier?;
                    println!(
                        "{}: {} parts, {} triangles",
                        shape.id,
                        carrier.n_parts(),
                        carrier.mesh().triangles.len()
                    );
                }
            }
            Err(error) => println!("{id}: {error}"),
        }
    }
    Ok(())
}

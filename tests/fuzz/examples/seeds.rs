//! Writes the first inputs of both targets: every fixture of the generator and some of its parts.
//! `cargo run --release --example seeds -- FOLDER…`

use std::path::PathBuf;
use std::{env, fs, io};
use partprobe_synth::{SynthSettings, fixtures, part};

const N_PARTS: u64 = 24;

fn main() -> io::Result<()> {
    let settings = SynthSettings { seed: 3, min_parts: 2, max_parts: 12 };
    let parts = (0..N_PARTS).map(|index| part(&settings, index)).map(|part| (part.name, part.step));
    let seeds: Vec<(String, String)> = fixtures::all().into_iter().chain(parts).collect();
    for folder in env::args_os().skip(1).map(PathBuf::from) {
        fs::create_dir_all(&folder)?;
        for (name, text) in &seeds {
            fs::write(folder.join(name.replace(['/', ' '], "-")), text)?;
        }
    }
    Ok(())
}

//! Reads and writes data sets of labeled STEP shapes.
//!
//! A data set is a folder with carriers, with `index.jsonl`, which has one line per shape, and with `dataset.json`, which has the
//! settings. `partprobe label` writes it. You can also write one yourself: a [`DatasetWriter`] takes carriers. To read a data
//! set, open it, go through its entries, and read the carrier of each:
//!
//! ```
//! use partprobe_dataset::{Dataset, DatasetWriter, IndexEntry, Status};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = &folder.path().join("dataset");
//! # let generated = partprobe_synth::SynthSettings { seed: 7, min_parts: 4, max_parts: 10 };
//! # let text = partprobe_synth::part(&generated, 0).step;
//! let options = partprobe_label::LabelOptions::default();
//! let settings = serde_json::json!({ "label": { "theta_deg": options.theta_deg, "tau_min": options.tau_min } });
//! let mut writer = DatasetWriter::create(path, &settings)?;
//! let file = partprobe_label::label(text.as_bytes(), "bracket", &options)?;
//! for shape in file.shapes {
//!     match shape.carrier {
//!         Ok(carrier) => writer.add("bracket.step", &carrier)?,
//!         Err(error) => writer.add_without_carrier(IndexEntry::without_carrier(
//!             &shape.id, "bracket.step", Status::Failed, error.to_string(),
//!         ))?,
//!     }
//! }
//! writer.finish()?;
//!
//! let dataset = Dataset::open(path)?;
//! for entry in dataset.labeled() {
//!     let carrier = dataset.carrier(entry)?;
//!     println!("{}: {} parts, {} triangles", entry.id, carrier.n_parts(), carrier.mesh().triangles.len());
//! }
//! # assert_eq!(dataset.labeled().len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guarantees: `Dataset::carrier` returns an error if the carrier is missing, damaged, changed, or of another shape. Files are
//! written completely and then renamed. A data set has an index only if it is complete. Only the [`Journal`] of an unfinished
//! batch is appended to, and an incomplete end of it is dropped. Paths in an index cannot lead out of the data set.
//!
//! Limits: this is the one library of partprobe that opens files. It does not print, read the clock or label anything.

mod atomic_write;
mod audit;
mod carrier_file;
mod dataset;
mod index_entry;
mod journal;
mod json_lines;
mod lock;
mod shape_files;
mod timing;
mod writer;

pub use atomic_write::{OutputError, is_unfinished, write_atomically, write_atomically_with};
pub use audit::{Audit, Damage};
pub use carrier_file::{CarrierRef, DamageReason, DamagedCarrier};
pub use dataset::{Dataset, DatasetError, INDEX_FILE, SETTINGS_FILE};
pub use index_entry::{IndexEntry, Status};
pub use journal::{
    FileRecord, JOURNAL_FILE, Journal, JournalError, JournalLine, WrittenFile, compare_paths,
    for_each_line, is_being_written, write_journal,
};
pub use json_lines::{json_document, json_lines};
pub use lock::is_locked_elsewhere;
pub use shape_files::{FileKind, FileLayout, ShapeFiles};
pub use timing::{TIMING_FILE, Timing};
pub use writer::{DatasetWriteError, DatasetWriter, is_plain_name};

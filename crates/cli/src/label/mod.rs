//! Labels STEP files, meshes and point clouds into a data set of carriers (`partprobe label`).
//!
//! A list of paths to files, folders, lists and archives goes in, and a folder that [`partprobe_dataset::Dataset`] opens comes
//! out. One thread reads ahead, including archives. One supervisor per worker writes the results and records them in the journal,
//! so that a batch can be resumed after any interruption. Every file is read in a worker process with an address-space limit and
//! a watchdog, so neither a stack overflow nor an allocation failure ends a batch. This process only starts workers and writes
//! their results. The data set's bytes do not depend on the number of workers.

mod batch;
mod changed_inputs;
mod emit;
mod foreign_file;
mod found;
mod frames;
mod input_bytes;
mod input_files;
mod job;
mod list_file;
mod other_endings;
mod over_budget;
mod path_text;
mod producer;
mod protocol;
mod reason_counts;
mod record;
mod released;
mod renamed_inputs;
mod shape;
mod shape_id;
mod shard;
mod step_text;
mod summary;
mod target;
mod task_queue;
mod text_hash;
mod unread;
mod walk;
mod worker;
mod worker_process;

pub(crate) use batch::{StoppedBatch, label_paths};
pub(crate) use input_files::{InputFile, InputList, input_files};
pub(crate) use job::LabelJob;
pub(crate) use reason_counts::ReasonCounts;
pub(crate) use released::ReleasedLabels;
pub(crate) use shape::{carriers_of_path, carriers_of_text};
pub(crate) use shape::{given_carrier, visit_carriers};
pub(crate) use shard::Shard;
pub(crate) use step_text::step_text;
pub(crate) use summary::Summary;
pub(crate) use target::belongs_to_data_set;
pub(crate) use unread::{warn_of_repeated, warn_of_unread};
pub(crate) use worker::{WorkerArgs, worker};

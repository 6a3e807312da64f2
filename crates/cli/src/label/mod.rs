//! `partprobe label`: STEP files to a data set of carriers.
//!
//! What goes in is a list of paths to files, folders, lists and archives; what comes out is a folder that
//! [`crate::dataset::Dataset`] opens. One thread reads ahead, archives included; a supervisor for each worker writes
//! what comes back and notes it in the journal, so that a batch can be resumed whatever ended it.
//! Every file is read in a worker process with an address-space limit and a watchdog, so that neither a stack
//! overflow nor an allocation failure ends a batch; this process only starts workers and writes what they return.
//! The data set's bytes do not depend on the number of workers.

mod batch;
mod changed_sources;
mod emit;
mod feed;
mod foreign_file;
mod frames;
mod job;
mod list_file;
mod other_endings;
mod path_text;
mod reason_counts;
mod record;
mod shape;
mod shape_id;
mod shard;
mod source_files;
mod step_text;
mod summary;
mod target;
mod task_queue;
mod text_hash;
mod unread;
mod verb;
mod walk;
mod worker;
mod worker_process;

pub use batch::{Stopped, label_paths};
pub use job::LabelJob;
pub use reason_counts::ReasonCounts;
pub(crate) use shape::visit_carriers;
pub use shape::{carriers_of_path, carriers_of_text};
pub use shard::Shard;
pub use source_files::{SourceFile, SourceList, id_of_path, source_files};
pub use step_text::step_text;
pub use summary::Summary;
pub(crate) use unread::{warn_of_repeated, warn_of_unread};
pub use verb::{LabelArgs, label};
pub use worker::{WorkerArgs, worker};

//! `partprobe label`: STEP files to a data set of carriers.
//!
//! What goes in is a list of paths; what comes out is a folder that [`crate::dataset::Dataset`] opens.
//! Every file is read in a worker process with an address-space limit and a watchdog, so that neither a stack
//! overflow nor an allocation failure ends a batch; this process only starts workers and writes what they return.
//! The data set's bytes do not depend on the number of workers.

mod batch;
mod equal_solids;
mod frames;
mod second_kernel;
mod shape;
mod source_files;
mod summary;
mod verb;
mod worker;
mod worker_process;

pub use batch::{LabelJob, label_paths};
pub use shape::carriers_of_path;
pub use source_files::{SourceFile, source_files};
pub use summary::Summary;
pub use verb::{LabelArgs, label};
pub use worker::{WorkerArgs, worker};

//! Makes a run folder: from labeled shapes to trained backbones and their scores.
//!
//! The commands `run`, `train`, `eval`, `embed` and `replay` call this. The computations are in the libraries. This module names
//! files, sets threads and shows progress.

mod bounds;
mod choice;
mod collisions;
mod damaged_json;
mod data;
mod data_path;
mod data_settings;
mod endpoints;
mod evaluation;
mod execution;
mod false_alarms;
mod folder;
mod footer;
mod frozen_parts;
mod held_out;
mod host;
mod initial_weights;
mod loading;
mod longer;
mod manifest;
mod next_command;
mod nonfinite;
mod observer;
mod page;
mod results;
mod scoring_context;
mod scoring_keys;
mod shapes;
mod source_card;
mod split_file;
mod stages;
mod tensorboard;
mod training;
mod training_args;
mod training_job;
mod training_log;
mod training_shapes;
mod validation;
mod verdict;
mod weights;

pub(crate) use choice::choose;
pub(crate) use data_path::{remember_data, remembered_data};
pub(crate) use data_settings::{ensure_settings_of, settings_of, with_data};
pub(crate) use endpoints::EndpointTables;
pub(crate) use evaluation::{embedding_members, npz_bytes};
pub(crate) use execution::{Execution, ExecutionArgs, MachineArgs};
pub(crate) use false_alarms::{error_rate, measured_false_alarms};
pub(crate) use folder::RunFolder;
pub(crate) use frozen_parts::ensure_frozen_parts;
pub(crate) use host::{RunRecord, today};
pub(crate) use initial_weights::ensure_initial_weights;
pub(crate) use nonfinite::DumpedUpdate;
pub(crate) use page::{charts_of_folder, page_of_folder, page_of_run, tables_of_folder};
pub(crate) use results::checked_expectations;
pub(crate) use scoring_keys::is_scoring;
pub(crate) use shapes::{Points, Shape, ShapeLoader, named_sources};
pub(crate) use split_file::ensure_source_of_run;
pub(crate) use stages::Run;
pub(crate) use training_args::{TrainingArgs, TrainingProcessArgs};
pub(crate) use training_job::train_settings;
pub(crate) use verdict::verdict_settings;
pub(crate) use weights::{read_weights, weights_path};

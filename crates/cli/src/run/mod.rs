//! `partprobe run` and its stages `train`, `embed` and `eval`, and `replay`: from labeled shapes to a scored comparison.
//!
//! What goes in is a config and a data set; what comes out is a run folder. The arithmetic is that of the libraries:
//! here files are named, threads are counted and progress is shown.

mod choice;
mod collisions;
mod comparison;
mod curves;
mod damaged_json;
mod data_settings;
mod divergence;
mod embed;
mod embed_input;
mod evaluation;
mod folder;
mod held_out;
mod host;
mod loading;
mod observer;
mod outcome;
mod report;
mod shapes;
mod split_file;
mod stages;
mod training;
mod training_log;
mod training_shapes;
mod validation;
mod weights;

pub(crate) use comparison::{RunArgs, run};
pub(crate) use divergence::{ReplayArgs, replay};
pub(crate) use embed::{EmbedArgs, embed};
pub(crate) use stages::{EvalArgs, TrainArgs, evaluate_run, train};

//! Loads configs: a TOML file is merged over the configs on which it is based, and `--set` over all of them.
//!
//! The name of a shipped config or a path goes in, and typed, checked settings come out. Unknown keys are errors, and no default
//! is in code: `configs/base.toml` has all of them.

mod chain;
mod clusterer_name;
mod difference;
mod endpoint;
mod explicit;
mod flag;
mod kernel_options;
mod merge;
mod metric_name;
mod paths;
mod problem;
mod ranges;
mod settings;
mod source_names;
mod source_table;
mod training_tables;

pub(crate) use clusterer_name::ClustererName;
#[cfg(feature = "train")]
pub(crate) use difference::shown;
pub(crate) use difference::{Difference, differences, listed};
#[cfg(feature = "train")]
pub(crate) use endpoint::{EndpointConfig, EndpointNormals, EndpointShapes};
pub(crate) use explicit::{explicit_table, with_table};
pub(crate) use flag::by_flag;
#[cfg(feature = "train")]
pub(crate) use flag::{as_written, is_set, key_of};
pub(crate) use merge::{
    LoadedConfig, load, load_standard_input, shipped, shipped_descriptions, shipped_names,
};
pub(crate) use metric_name::MetricName;
#[cfg(feature = "train")]
pub(crate) use paths::are_same_place;
pub(crate) use problem::nearest;
#[cfg(feature = "train")]
pub(crate) use problem::suggestion;
#[cfg(feature = "train")]
pub(crate) use settings::overrides_of_preparation;
pub(crate) use settings::{
    Attribute, Config, DataSource, Emit, EvalConfig, Keep, LabelConfig, NormalConfig, SampleConfig,
    SelectConfig, SplitConfig, SynthConfig,
};
pub(crate) use source_names::ResolvedSource;
pub(crate) use source_table::{FOREIGN_SUPERVISION, SourceTable};

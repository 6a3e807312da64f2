//! Configs: a TOML file on top of `base.toml` on top of nothing, and `--set` on top of both.
//!
//! What goes in is the name of a shipped config or a path; what comes out is checked once and typed.
//! Unknown keys are errors, and no default stands in code: `configs/base.toml` holds them all.

mod clusterer_name;
mod difference;
mod kernel_options;
mod merge;
mod problem;
mod settings;
mod stated;
mod training_tables;

pub(crate) use clusterer_name::ClustererName;
pub(crate) use difference::{Difference, differences, listed};
pub(crate) use merge::{Loaded, load};
pub(crate) use settings::{
    Attribute, Config, DataSource, Emit, EvalConfig, Keep, KernelConfig, LabelConfig, NormalConfig,
    SampleConfig, SelectConfig, SplitConfig, SynthConfig, UnitConfig, ValidMetric,
};
pub(crate) use stated::{stated_table, with_table};

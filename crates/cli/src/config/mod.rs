//! Configs: a TOML file on top of `base.toml` on top of nothing, and `--set` on top of both.
//!
//! What goes in is the name of a shipped config or a path; what comes out is checked once and typed.
//! Unknown keys are errors, and no default stands in code: `configs/base.toml` holds them all.

mod clusterer_name;
mod difference;
mod merge;
mod metric_name;
mod problem;
mod settings;
mod stated;
mod training_tables;

pub use clusterer_name::ClustererName;
pub use difference::{Difference, differences, listed};
pub use merge::{Loaded, load, shipped_names};
pub use metric_name::MetricName;
pub use settings::{
    Attribute, CompareConfig, Config, DataConfig, DataSource, Emit, EvalConfig, Keep, KernelConfig,
    LabelConfig, NormalConfig, SampleConfig, SelectConfig, SplitConfig, SynthConfig, TrainTable,
    UnitConfig,
};
pub use stated::{stated_table, with_table};
pub use training_tables::{
    AugmentConfig, LossConfig, NetConfig, NoDefect, OptimConfig, TokenConfig,
};

//! Fits one network to the points of one shape.

mod adam;
mod batch;
mod flatcad;
mod losses;
mod oracle;
mod settings;
mod task;
mod update;

pub use losses::Losses;
pub use settings::{Mode, SegGrad, Settings};
pub use update::{LabelError, PointLabels, Training};

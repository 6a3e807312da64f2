//! Holds what the fuzz targets share: the labeling of a text, and edits that keep its syntax. Files and time are
//! libFuzzer's.

mod edit;
mod labeling;

pub use edit::edited;
pub use labeling::label;

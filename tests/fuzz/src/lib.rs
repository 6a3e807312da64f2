//! What the fuzz targets share: the labelling of a text, and edits that keep its syntax. Files and time are libFuzzer's.

mod edit;
mod labelling;

pub use edit::edited;
pub use labelling::label;

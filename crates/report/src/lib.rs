//! Writes the report of a run: scores, a log and the points of test shapes go in, and the text of one HTML page comes out.
//!
//! ```
//! use partprobe_report::{ReportShape, RunReport, ShapeDigest};
//!
//! let shape = ReportShape {
//!     id: "bracket".to_owned(),
//!     points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
//!     normals: vec![[0.0, 0.0, 1.0]; 3],
//!     references: vec![("step-parts".to_owned(), vec![0, 0, 1])],
//!     ..ReportShape::default()
//! };
//! let digests = [ShapeDigest::of(&shape)];
//! let report = RunReport { name: "my run", shapes: &digests, ..RunReport::default() };
//! let page = report.to_html();
//! assert!(page.starts_with("<!doctype html>") && page.contains("bracket"));
//! ```
//!
//! # What it guarantees
//!
//! - The page is one file, and loads nothing from elsewhere.
//! - It has at most [`MAX_BYTES`] bytes: points of shapes are thinned out until it fits.
//! - Every text that comes from the caller is escaped.
//! - The same report gives the same page.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, and does not compute the scores of the tables. They come from `partprobe-eval`.

mod answer;
mod chart;
mod curves;
mod distributions;
mod dose_response;
mod embedded_points;
mod facts;
mod gallery;
mod html;
mod kept_points;
mod log_series;
mod lost_parts;
mod matched;
mod names;
mod overview;
mod packed_points;
mod run_report;
mod score_tables;
mod shape_digest;
mod shape_scores;
mod sortable_table;
mod statistics;
mod type_confusion;
mod viewer;

pub use chart::Chart;
pub use embedded_points::MAX_BYTES;
pub use facts::Fact;
pub use run_report::RunReport;
pub use shape_digest::{Prediction, ReportShape, ShapeDigest, ShapeFaces};

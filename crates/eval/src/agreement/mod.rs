//! Compares two label sources on the same shapes (paper §4.3 and §4.4), without any training.
//!
//! Labels of the same points by both sources, the labeled triangles of a carrier, and afterwards one row per shape, source and
//! channel go in. Scores of a shape and tables over all shapes come out. Nothing here chooses points, moves labels from one mesh
//! to another, opens a file or prints.

mod ari;
mod borders;
mod card;
mod curve;
mod merges;
mod rows;
mod segments;
mod shape;
mod sizes;
mod statistic;
mod tables;
mod text;
mod triangles;

pub use ari::adjusted_rand_index;
pub(crate) use ari::index_of_pair_counts;
pub use borders::{Border, label_borders, length_of_borders};
pub use card::{CardRow, CardTables, PairRow, SourceCard, card_tables};
pub use curve::{AgreementBin, DISTANCE_LIMITS, THICKNESS_LIMITS};
pub use merges::{n_merges, n_splits};
pub use rows::{AgreementMetric, AgreementRow, CeilingScores, RefusedShape};
pub use segments::BorderTree;
pub use shape::{BANDS, PointPositions, ShapeAgreement, agreement};
pub use sizes::size_entropy;
pub use statistic::{Statistic, statistic};
pub use tables::{
    AgreementTable, AgreementTables, AgreementTablesSettings, CurvePoint, KBinAgreement,
    agreement_tables,
};
pub use triangles::TriangleTree;

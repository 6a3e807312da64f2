//! Matching, scores, statistics and tables: predicted clusters beside reference labels → numbers that can be compared.
//!
//! In come labels per point, rows of scores, or the outlines of shapes; out come scores, tables, outcomes and a split.
//! Nothing here trains, clusters, opens a file or prints. Sums go in the order of shape ids, so that the order
//! of the input and the number of threads before it cannot change a digit.

mod agreement;
mod bootstrap;
mod confusion;
mod expectation;
mod gtc;
mod k_bin;
mod matching;
mod metric;
mod metrics;
mod oracle_k;
mod score_row;
mod scores;
mod split;
mod table_text;
mod tables;

pub use agreement::{
    AgreementBin, AgreementMetric, AgreementRow, AgreementTable, AgreementTables,
    AgreementTablesSettings, BANDS, Border, BorderTree, CardRow, CardTables, Ceiling, CurvePoint,
    DISTANCE_LIMITS, KBinAgreement, PairRow, PointPositions, RefusedShape, ShapeAgreement,
    SourceCard, Statistic, THICKNESS_LIMITS, TriangleTree, adjusted_rand_index, agreement,
    agreement_tables, card_tables, label_borders, length_of_borders, n_merges, n_splits,
    size_entropy, statistic,
};
pub use bootstrap::{Bootstrap, Interval};
pub use confusion::{Confusion, ScoreError};
pub use expectation::{ExpectationError, ExpectationOutcome, Expectations, TrainingFigures};
pub use gtc::{Gtc, gtc};
pub use k_bin::KBin;
pub use matching::{Matching, match_clusters};
pub use metric::{Metric, ScoredShape};
pub use metrics::{ACCURACY, GTC_ACCURACY, GTC_MIOU, METRICS, MIOU};
pub use oracle_k::{OracleError, OracleScores, TokenizedShape, score_oracle_k};
pub use score_row::ScoreRow;
pub use scores::{ShapeScores, score_clusters};
pub use split::{
    DistinctShapes, Duplicate, Split, SplitCandidate, SplitError, SplitFractions, seeded_rank,
    split,
};
pub use tables::{BinMean, Difference, DifferenceRow, TableRow, TableSettings, Tables, tables};

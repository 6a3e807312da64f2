//! Scores predicted clusters against reference labels, averages scores into tables, and splits shapes.
//!
//! ```
//! use partprobe_eval::score_clusters;
//!
//! // One predicted cluster and one reference label per point. A negative reference label is ignored.
//! let predicted = [7, 7, 7, 2, 2];
//! let reference = [0, 0, 1, 1, -1];
//! let scores = score_clusters(&predicted, &reference)?;
//! assert_eq!(scores.k, 2);
//! assert_eq!(scores.accuracy, 0.75);
//! # Ok::<(), partprobe_eval::ScoreError>(())
//! ```
//!
//! # What it guarantees
//!
//! - Clusters are matched to parts optimally, and the names of the labels do not matter.
//! - Sums are in the order of shape ids. The order of the input and the number of threads that made it do not change a
//!   digit.
//! - Labels that cannot be scored give a [`ScoreError`].
//!
//! # What it does not do
//!
//! It does not train, opens no file and prints nothing. Clusters come from `partprobe-cluster`.

mod agreement;
mod best_cut;
mod bootstrap;
mod boundary;
mod confusion;
mod expectation;
mod false_alarms;
mod gtc;
mod junit;
mod k_bin;
mod matching;
mod metric;
mod metrics;
mod oracle_k;
mod paired;
mod point_scores;
mod probe;
mod score_row;
mod scores;
mod split;
mod tables;
mod verdict;

pub use agreement::{
    AgreementBin, AgreementMetric, AgreementRow, AgreementTable, AgreementTables,
    AgreementTablesSettings, BANDS, Border, BorderTree, CardRow, CardTables, CeilingScores,
    CurvePoint, DISTANCE_LIMITS, KBinAgreement, PairRow, PointPositions, RefusedShape,
    ShapeAgreement, SourceCard, Statistic, THICKNESS_LIMITS, TriangleTree, adjusted_rand_index,
    agreement, agreement_tables, card_tables, label_borders, length_of_borders, n_merges, n_splits,
    size_entropy, statistic,
};
pub use best_cut::best_cut_ari;
pub use bootstrap::{Bootstrap, Interval};
pub use boundary::{BOUNDARY_RADIUS, near_boundary};
pub use confusion::{Confusion, ScoreError};
pub use expectation::{ExpectationError, ExpectationOutcome, Expectations, TrainingFigures};
pub use false_alarms::{FalseAlarms, false_alarms};
pub use gtc::{Gtc, gtc, split_gtc};
pub use junit::junit_xml;
pub use k_bin::KBin;
pub use matching::{Matching, match_clusters};
pub use metric::{Metric, ScoredShape};
pub use metrics::{
    ACCURACY, ARI, ASA, BEST_CUT_ARI, BEST_OVERLAP_MIOU, BOUNDARY_ACCURACY, COUNT_ERROR,
    GTC_ACCURACY, GTC_MIOU, METRICS, MIOU, MIOU_LARGE, PAIR_AUC, PANOPTIC_QUALITY,
    SPLIT_GTC_ACCURACY, SPLIT_GTC_MIOU,
};
pub use oracle_k::{OracleError, OracleScores, TokenizedShape, score_oracle_k};
pub use paired::{Difference, SIGNIFICANCE};
pub use point_scores::{PointEmbeddings, PointScores};
pub use probe::{ProbeScore, ProbeScores, probe};
pub use score_row::ScoreRow;
pub use scores::{ShapeScores, clusters_of_labels, score_clusters};
pub use split::{
    DistinctShapes, Duplicate, Manifest, ManifestError, ManifestLine, NearShape, ShapeKey,
    SideName, Split, SplitCandidate, SplitError, SplitFractions, SplitRule, TrainShare,
    seeded_rank, split, split_by_manifest,
};
pub use tables::{
    BinMean, DOSE_KINDS, DifferenceRow, DoseCurve, DoseKind, DosePlacement, DosePoint, Endpoint,
    EndpointError, HomeAdvantage, TableRow, TableSettings, Tables, labels_row, tables,
};
pub use verdict::{LOOK_LIMITS, Look, Needed, Verdict, VerdictError, VerdictSettings, look};

//! Lists the reasons why an update could not be made.

use crate::config::ConfigError;
use crate::data::tokens::TokenizeError;
use crate::kernels::one_thread::ThreadError;

/// The reason why an update could not be made. The training does not change.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The initial weights are those of another network.
    #[error(
        "the initial weights are of another network; train with the `net` settings that they were trained with"
    )]
    OtherNetwork,
    /// No parameter of the network has a name with this beginning.
    #[error("train.freeze: the network has no part `{0}`")]
    NoSuchPart(String),
    /// An earlier update had another learning rate than in the new schedule.
    #[error(
        "update {step} had another learning rate than the new `optim.schedule` and `train.steps` give it"
    )]
    OtherRate {
        /// The first such update, counted from 1.
        step: usize,
    },
    /// The operating system could not start a thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// There is no shape to train on.
    #[error("there is no shape to train on; widen `select` or give more data")]
    NoShapes,
    /// A shape does not have one label per point.
    #[error(
        "shape `{shape}` has {n_labels} labels for {n_points} points; label and sample it again"
    )]
    Labels {
        /// The id of the shape.
        shape: String,
        /// The number of its labels.
        n_labels: usize,
        /// The number of its points.
        n_points: usize,
    },
    /// A shape's points cannot be grouped into tokens.
    #[error("shape `{shape}`: {problem}")]
    Tokens {
        /// The id of the shape.
        shape: String,
        /// What is wrong with its points.
        problem: TokenizeError,
    },
    /// Points, loss or gradient of a shape are NaN or infinite.
    #[error(
        "step {step}: shape `{shape}` gave numbers that are not finite; lower `optim.learning_rate`, or leave the shape out of the data set"
    )]
    NonFinite {
        /// The id of the shape.
        shape: String,
        /// The update that was tried, counted from 1.
        step: usize,
    },
}

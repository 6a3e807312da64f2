//! Runs all tensor operations in pools of one thread.
//!
//! A tensor library may divide a sum by the number of threads, which changes its rounding. With one thread there is only
//! one way to add. Several shapes are computed at the same time instead.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// The operating system gave no thread.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no thread could be started: {0}; free memory or raise the limit on processes")]
pub struct ThreadError(String);

/// A pool of a single thread.
pub(crate) fn one_thread_pool() -> Result<ThreadPool, ThreadError> {
    ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|error| ThreadError(error.to_string()))
}

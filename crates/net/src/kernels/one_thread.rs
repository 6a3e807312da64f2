//! Runs all tensor operations in pools of one thread.
//!
//! A tensor library may divide a sum by the number of threads, which changes its rounding. With one thread, there is only one
//! order of addition. Several shapes are computed at the same time instead.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::resume_unwind;
use std::thread;

/// The operating system could not start a thread.
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

/// Runs work in a pool of a single thread.
///
/// The caller waits and does nothing else. `ThreadPool::install` alone would let a caller that is a thread of another pool start
/// the next shape of that pool while it waits, and from there the next one: each uses memory for a shape and a piece of the
/// stack, until the stack is full.
///
/// # Errors
/// If the operating system cannot start a thread.
pub(crate) fn on_one_thread<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R, ThreadError> {
    let pool = one_thread_pool()?;
    thread::scope(|scope| {
        let waiting = thread::Builder::new()
            .spawn_scoped(scope, || pool.install(work))
            .map_err(|error| ThreadError(error.to_string()))?;
        Ok(waiting.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::cell::Cell;

    thread_local! {
        static DEPTH: Cell<usize> = const { Cell::new(0) };
    }

    #[test]
    fn a_waiting_thread_of_another_pool_starts_no_second_shape() {
        let deepest = one_thread_pool().unwrap().install(|| {
            let depth_of = |number: u64| {
                let depth = DEPTH.get() + 1;
                DEPTH.set(depth);
                let found = on_one_thread(|| {
                    thread::sleep(std::time::Duration::from_millis(1));
                    number
                });
                DEPTH.set(depth - 1);
                assert_eq!(found, Ok(number));
                depth
            };
            (0..64u64).into_par_iter().map(depth_of).max()
        });
        assert_eq!(deepest, Some(1));
    }
}

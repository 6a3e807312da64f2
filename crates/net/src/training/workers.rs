//! Distributes the shapes of a batch to pools of one thread each.
//!
//! The assignment of shapes to pools is random, but the results and their order are not.

use crate::kernels::one_thread::{ThreadError, one_thread_pool};
use rayon::ThreadPool;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// The threads of a training. Each of them is a pool in which tensor operations use one thread.
#[derive(Debug)]
pub(super) struct Workers {
    pools: Vec<ThreadPool>,
}

impl Workers {
    /// Starts `n_threads` workers, at least one.
    pub(super) fn new(n_threads: usize) -> Result<Self, ThreadError> {
        Ok(Self {
            pools: (0..n_threads.max(1))
                .map(|_| one_thread_pool())
                .collect::<Result<_, _>>()?,
        })
    }

    /// Does the jobs with all workers at once. A worker that is done takes the next job. The results are in the order of the
    /// jobs.
    pub(super) fn map<J: Sync, R: Send>(
        &self,
        jobs: &[J],
        work: impl Fn(usize, &J) -> R + Sync,
    ) -> Vec<R> {
        let next = AtomicUsize::new(0);
        let take_turns = || {
            let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&at| at < jobs.len());
            std::iter::from_fn(take)
                .map(|at| (at, work(at, &jobs[at])))
                .collect::<Vec<_>>()
        };
        let mut results: Vec<(usize, R)> = thread::scope(|scope| {
            let spawn = |pool: &'_ ThreadPool| pool.install(take_turns);
            let threads: Vec<_> = self
                .pools
                .iter()
                .map(|pool| scope.spawn(move || spawn(pool)))
                .collect();
            let join = |thread: thread::ScopedJoinHandle<'_, _>| {
                thread
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().flat_map(join).collect()
        });
        results.sort_unstable_by_key(|(at, _)| *at);
        results.into_iter().map(|(_, result)| result).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_jobs() {
        for n_threads in [0, 1, 2, 7] {
            let workers = Workers::new(n_threads).unwrap();
            let jobs: Vec<u64> = (0..20).map(|k| 20 - k).collect();
            let slow_first = |at: usize, &job: &u64| {
                std::hint::black_box((0..job * 1000).sum::<u64>());
                (at, 3 * job)
            };
            let expected: Vec<_> = jobs
                .iter()
                .enumerate()
                .map(|(at, &job)| (at, 3 * job))
                .collect();
            assert_eq!(workers.map(&jobs, slow_first), expected);
            assert!(workers.map(&[] as &[u64], slow_first).is_empty());
        }
    }
}

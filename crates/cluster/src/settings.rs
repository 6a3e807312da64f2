//! Defines how k-means runs: the settings of one call, and those that a config gives to every clusterer.

/// The settings of one call of k-means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KMeansSettings {
    /// The number of clusters to look for, at least 1.
    pub k: usize,
    /// The number of seeded restarts, of which the best counts. A value of 0 counts as 1. One restart loses up to 20 points of
    /// mIoU against ten.
    pub restarts: usize,
    /// The largest number of iterations of one restart.
    pub max_iterations: usize,
    /// A restart ends when no center moves further than this, as a fraction of the size of the rows (1 on the sphere).
    pub tolerance: f64,
}

impl KMeansSettings {
    /// The settings of the paper's column: ten restarts of at most 300 iterations, tolerance 1e-6.
    #[must_use]
    pub fn with_k(k: usize) -> Self {
        Self {
            k,
            restarts: 10,
            max_iterations: 300,
            tolerance: 1e-6,
        }
    }
}

/// The settings that a config gives to every algorithm. Each algorithm uses those that it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClustererSettings {
    /// The number of seeded restarts, of which the best counts.
    pub restarts: usize,
    /// The largest number of iterations of one restart.
    pub max_iterations: usize,
    /// A restart ends when no center moves further than this, as a fraction of the size of the rows.
    pub tolerance: f64,
}

impl ClustererSettings {
    /// The same settings for one call of k-means that looks for `k` clusters.
    pub(crate) fn for_k(self, k: usize) -> KMeansSettings {
        KMeansSettings {
            k,
            restarts: self.restarts,
            max_iterations: self.max_iterations,
            tolerance: self.tolerance,
        }
    }
}

//! Defines the interface of a clustering algorithm.
//!
//! To add an algorithm, write one file with a type that implements [`Clusterer`] and a `FACTORY`, and add the factory
//! to [`CLUSTERERS`](crate::CLUSTERERS). Configs, messages and scores follow the list.

use crate::clusters::{ClusterError, Clusters};
use crate::settings::ClustererSettings;
use partprobe_carrier::Embeddings;

/// An algorithm that divides rows of numbers into clusters. Their number is given, or the algorithm finds it.
pub trait Clusterer {
    /// The name in configs, score files and tables, for example `k-means`.
    fn name(&self) -> &'static str;

    /// Divides the rows into `k` clusters, or fewer if there are fewer different rows. An algorithm that finds the number
    /// of clusters itself does not use `k`.
    ///
    /// `weights` is the number of points of each row. An algorithm that needs random numbers draws them only from `seed` and
    /// `key`. `key` names the shape, so each shape has its own random numbers.
    ///
    /// # Errors
    /// If the number of weights is not the number of rows, a number is not finite, or `k` is 0.
    fn cluster(
        &self,
        rows: &Embeddings,
        weights: &[u32],
        k: usize,
        seed: u64,
        key: &str,
    ) -> Result<Clusters, ClusterError>;
}

/// An entry of [`CLUSTERERS`](crate::CLUSTERERS): a name, and how the algorithm is made from the settings.
#[derive(Clone, Copy, Debug)]
pub struct ClustererFactory {
    /// The name of the clusterers that it makes.
    pub name: &'static str,
    /// Makes the clusterer.
    pub make: fn(&ClustererSettings) -> Box<dyn Clusterer + Send + Sync>,
}

//! The seam between clustering algorithms and their callers, and the list of the algorithms that a config can name.
//!
//! To add an algorithm, write one file with a type that implements [`Clusterer`] and a `FACTORY`, and add the factory
//! to [`CLUSTERERS`]. Configs, messages and scores follow the list.

use crate::clusters::{ClusterError, Clusters};
use crate::{average_link, kmeans};
use partprobe_carrier::Embeddings;

/// An algorithm that divides rows of numbers into a given number of clusters.
pub trait Clusterer {
    /// The name in configs, score files and tables, for example `k-means`.
    fn name(&self) -> &'static str;

    /// Divides the rows into at most `k` clusters; fewer if there are fewer different rows.
    ///
    /// `weights` holds the number of points that each row stands for. An algorithm that needs random numbers draws
    /// them from `seed` and `key` alone; `key` names the shape, so that each shape has its own.
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

/// The settings that a config gives to every algorithm; each algorithm takes those that it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClustererSettings {
    /// The number of seeded restarts; the best one counts.
    pub restarts: usize,
    /// The largest number of iterations of one restart.
    pub max_iterations: usize,
    /// A restart ends when no center moves further than this, as a fraction of the size of the rows.
    pub tolerance: f64,
}

/// An entry of [`CLUSTERERS`]: a name, and how the algorithm is made from the settings.
#[derive(Clone, Copy, Debug)]
pub struct ClustererFactory {
    /// The name of the clusterers that it makes.
    pub name: &'static str,
    /// Makes the clusterer.
    pub make: fn(&ClustererSettings) -> Box<dyn Clusterer + Send + Sync>,
}

/// Every algorithm that a config can name, in the order in which messages list them.
pub const CLUSTERERS: &[ClustererFactory] = &[kmeans::FACTORY, average_link::FACTORY];

impl ClustererFactory {
    /// Returns the factory with this name, or `None` if [`CLUSTERERS`] has none.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        CLUSTERERS.iter().find(|factory| factory.name == name)
    }

    /// The names of [`CLUSTERERS`], separated by commas.
    #[must_use]
    pub fn known_names() -> String {
        let names: Vec<&str> = CLUSTERERS.iter().map(|factory| factory.name).collect();
        names.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: ClustererSettings = ClustererSettings {
        restarts: 2,
        max_iterations: 20,
        tolerance: 1e-6,
    };

    #[test]
    fn a_clusterer_has_the_name_of_its_factory_and_is_found_by_it() {
        for factory in CLUSTERERS {
            assert_eq!((factory.make)(&SETTINGS).name(), factory.name);
            let same_name = CLUSTERERS.iter().filter(|other| other.name == factory.name);
            assert_eq!(same_name.count(), 1, "{}", factory.name);
            assert_eq!(
                ClustererFactory::named(factory.name).map(|found| found.name),
                Some(factory.name)
            );
        }
        assert!(ClustererFactory::named("ward").is_none());
        assert_eq!(ClustererFactory::known_names(), "k-means, average-link");
    }

    #[test]
    fn every_clusterer_separates_two_directions_and_refuses_what_cannot_be_clustered() {
        let rows = Embeddings::new(2, vec![1.0, 0.0, 0.0, 1.0, 0.9, 0.1, 0.1, 0.9]).unwrap();
        for factory in CLUSTERERS {
            let clusterer = (factory.make)(&SETTINGS);
            let clusters = clusterer.cluster(&rows, &[1, 2, 3, 4], 2, 0, "a").unwrap();
            assert_eq!(clusters.assignment, [0, 1, 0, 1], "{}", factory.name);
            assert_eq!(
                clusterer.cluster(&rows, &[1; 4], 0, 0, "a"),
                Err(ClusterError::NoClusters)
            );
            let error = ClusterError::Weights {
                n_weights: 3,
                n_rows: 4,
            };
            assert_eq!(clusterer.cluster(&rows, &[1; 3], 2, 0, "a"), Err(error));
        }
    }
}

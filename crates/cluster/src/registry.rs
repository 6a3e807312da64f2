//! Lists the clustering algorithms that a config can name.

use crate::clusterer::ClustererFactory;
use crate::{average_link, kmeans, modes};

/// Every algorithm that a config can name, in the order in which messages list them.
pub const CLUSTERERS: &[ClustererFactory] =
    &[kmeans::FACTORY, average_link::FACTORY, modes::FACTORY];

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
    use crate::clusters::ClusterError;
    use crate::settings::ClustererSettings;
    use partprobe_carrier::Embeddings;

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
        let known = ClustererFactory::known_names();
        let names = CLUSTERERS.iter().map(|factory| factory.name);
        assert!(known.split(", ").eq(names), "{known}");
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

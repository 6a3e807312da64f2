//! Clustering of rows of numbers: `Embeddings` and a multiplicity a row → `Clusters`.
//!
//! A row may stand for many points (a token for its voxel's), so every algorithm here takes one
//! multiplicity a row, and the answer is exactly that of clustering the points themselves.
//! Nothing here opens a file, prints, starts a thread or draws a number that is not keyed:
//! the clusters depend on the rows, the multiplicities, the settings, the seed and the key alone.

mod average_link;
mod clusterer;
mod clusters;
mod distance;
mod kmeans;
mod lloyd;
mod seeding;

pub use average_link::{AverageLink, average_link_cosine};
pub use clusterer::{CLUSTERERS, Clusterer, ClustererFactory, ClustererSettings};
pub use clusters::{ClusterError, Clusters};
pub use kmeans::{KMeansSettings, SphericalKMeans, euclidean_kmeans, spherical_kmeans};

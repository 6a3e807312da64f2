//! Divides rows of numbers into clusters: spherical and Euclidean k-means, average link on cosines, and Ward linkage over a
//! graph. The silhouette measures how well clusters are separated.
//!
//! ```
//! use partprobe_carrier::Embeddings;
//! use partprobe_cluster::{KMeansSettings, spherical_kmeans};
//!
//! // Two directions. The second row stands for three points, the others for one.
//! let rows = Embeddings::new(2, vec![1.0, 0.0, 0.0, 1.0, 0.9, 0.1])?;
//! let weights = [1, 3, 1];
//! let clusters = spherical_kmeans(&rows, &weights, &KMeansSettings::with_k(2), 0, "my shape")?;
//! assert_eq!(clusters.assignment, [0, 1, 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - A row may represent several points. For example, a token represents the points of its voxel. Every algorithm takes one
//!   multiplicity per row, and the result is exactly that of clustering the points themselves.
//! - The clusters depend only on the rows, the multiplicities, the settings, the seed and the key: the same input gives the same
//!   clusters on every machine.
//! - Rows that cannot be clustered give a [`ClusterError`].
//!
//! # What it does not do
//!
//! It opens no file, prints nothing and starts no thread. It does not choose the number of clusters: [`Silhouette`]
//! compares clusterings, and the caller decides.

mod average_link;
mod clusterer;
mod clusters;
mod distance;
mod kmeans;
mod lloyd;
mod modes;
mod points;
mod region_growing;
mod registry;
mod seeding;
mod settings;
mod silhouette;
mod vector_unit;
mod ward_linkage;

pub use average_link::{AverageLink, AverageLinkTree, average_link_cosine};
pub use clusterer::{Clusterer, ClustererFactory};
pub use clusters::{ClusterError, Clusters};
pub use kmeans::{SphericalKMeans, euclidean_kmeans, spherical_kmeans};
pub use modes::Modes;
pub use region_growing::{RegionGrowing, Regions};
pub use registry::CLUSTERERS;
pub use settings::{ClustererSettings, KMeansSettings};
pub use silhouette::Silhouette;
pub use ward_linkage::{WardTree, WeightedRow};

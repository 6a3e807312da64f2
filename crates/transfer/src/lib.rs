//! Carries the labels of one surface to the points and triangles of another.
//!
//! Takes triangles with a label each, or labeled points, and the points that need a label. Returns their labels, and the
//! number of points without one. Each way to carry labels is a [`Channel`]. A channel can lose labels even if both
//! surfaces are the same, so every agreement that is measured through a channel needs its [`ceiling()`].
//!
//! ```
//! use partprobe_transfer::{Limits, NearestSurface, Query, Surface};
//!
//! // A square in the plane z = 0, in two triangles that are labeled 7 and 8.
//! let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
//! let triangles = [[0, 1, 2], [0, 2, 3]];
//! let labels = [7, 8];
//! let surface = NearestSurface::new(Surface::new(&vertices, &triangles)?);
//!
//! let above = Query { position: [0.9, 0.2, 0.5], normal: None };
//! let found = surface.nearest(&above, &Limits::NONE).unwrap();
//! assert_eq!(labels[found.item as usize], 7);
//! assert_eq!(found.distance, 0.5);
//! # Ok::<(), partprobe_transfer::TransferError>(())
//! ```
//!
//! # What it guarantees
//!
//! - Distances are exact: the nearest triangle is found by its true distance. At equal distances, the lowest index is chosen, so
//!   the result is the same on every machine and for any number of threads.
//! - A point without a label is counted. It never gets the label of another point silently.
//! - Coordinates that are not finite, and indices that point nowhere, give a [`TransferError`].
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, does not match the names of labels, and does not know who made them.

mod box_tree;
mod ceiling;
mod channel;
mod nearest_point;
mod nearest_surface;
mod nearest_vertex;
mod point_triangle;
mod query;
mod surface;
mod triangle_match;

pub use ceiling::{Ceiling, ceiling};
pub use channel::{Channel, Target, TransferredLabels, carry};
pub use nearest_point::NearestPoint;
pub use nearest_surface::NearestSurface;
pub use nearest_vertex::NearestVertex;
pub use point_triangle::distance_to_triangle;
pub use query::{Limits, Nearest, Query, for_all, queries_of};
pub use surface::{LabeledSurface, Surface, TransferError};
pub use triangle_match::{TriangleMatch, match_triangles};

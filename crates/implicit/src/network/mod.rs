//! Defines the networks: their sizes, their weights, and the forward and backward passes for a block of points.

mod activation;
mod block;
mod head;
mod inference;
mod initial;
mod layout;
mod trunk;

pub(crate) use block::{BLOCK, BackwardParts, PreparedNetwork, Workspace};
pub use inference::Network;
pub(crate) use layout::Layout;
pub use trunk::{Trunk, UnknownTrunk};

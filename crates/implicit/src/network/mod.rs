//! The networks: their sizes, their weights, and how a block of points goes through them, forward and back.

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

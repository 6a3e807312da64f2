//! Computes the integer tables that a network reads from sampled points. Nothing here uses tensors.
//!
//! `tokens` groups points into voxels. `hierarchy` computes the levels above them: patches along a space-filling curve,
//! neighborhoods, and clusters for pooling. `pose` and `jitter` change a shape at random for training. `fourier` computes
//! features of tokens without a network.

pub(crate) mod curve;
mod fourier;
pub(crate) mod hierarchy;
pub(crate) mod jitter;
pub(crate) mod level_rows;
pub(crate) mod neighbor_pairs;
pub(crate) mod neighbor_table;
pub(crate) mod neighbors;
pub(crate) mod patches;
pub(crate) mod pose;
pub(crate) mod rows;
pub(crate) mod shape_order;
pub(crate) mod tokens;

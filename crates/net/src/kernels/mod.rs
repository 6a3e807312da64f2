//! Computes the tensor operations of the networks.
//!
//! `ops` composes them from burn's own operations, for every backend. `fused` computes the expensive ones in one pass each, for
//! the default backend. `rotary_axes` defines which channels are rotated with the position. `one_thread` makes the thread pools
//! in which they run.

pub(crate) mod fused;
pub(crate) mod one_thread;
pub(crate) mod ops;
pub(crate) mod rotary_axes;

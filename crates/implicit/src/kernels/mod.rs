//! Computes on rows of numbers: matrix products, outer products, and the functions that neurons apply.
//!
//! Everything is safe Rust that is compiled once per vector unit. The unit is chosen at run time. Each sum has a fixed order and
//! uses fused multiply-add, so all units give the same bits.

mod dispatch;
mod elementary;
mod outer;
mod panels;

pub(crate) use dispatch::{Kernel, vectorized};
pub(crate) use elementary::{exp_of_negative, sigmoid_and_softplus, sine_and_cosine};
pub(crate) use outer::{add_column_sums, add_outer_products};
pub(crate) use panels::{Panels, multiply};

/// The number of adjacent columns in a lane.
pub(crate) const LANES: usize = 16;

/// Sixteen adjacent numbers.
pub(crate) type Lane = [f32; LANES];

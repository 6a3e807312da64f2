//! Compiles loops once for each kind of vector unit, and runs them with the widest that the processor has.
//!
//! Sums run in lanes whose number does not depend on the unit, and no product is fused with a sum, so that all units give the
//! same bits.

use macerator::{AutoArch, Simd, WithSimd};

/// A loop that is worth it. `run` and all that it calls must be `#[inline(always)]`.
pub(crate) trait Kernel {
    /// What it computes.
    type Output;

    /// Computes it.
    fn run(self) -> Self::Output;
}

struct VectorizedKernel<K>(K);

impl<K: Kernel> WithSimd for VectorizedKernel<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self) -> Self::Output {
        self.0.run()
    }
}

/// Runs the loop with the widest vectors.
pub(crate) fn vectorized<K: Kernel>(kernel: K) -> K::Output {
    AutoArch::new().dispatch(VectorizedKernel(kernel))
}

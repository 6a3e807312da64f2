//! Compiles loops once per kind of vector unit, and runs them with the widest unit of the processor.
//!
//! Sums run in lanes whose number does not depend on the unit, and no product is fused with a sum, so all units give the same
//! bits.

use macerator::{AutoArch, Simd, WithSimd};

/// A loop that is compiled in this way. `run` and all functions that it calls must be `#[inline(always)]`.
pub(crate) trait Kernel {
    /// The result.
    type Output;

    /// Runs the loop.
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

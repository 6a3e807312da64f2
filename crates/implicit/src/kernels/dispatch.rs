//! Chooses the vector unit at run time.

use super::LANES;
use macerator::{AutoArch, Scalar, Simd, WithSimd};

/// Work that is compiled once per kind of vector unit. `run` and all functions that it calls must be `#[inline(always)]`.
pub(crate) trait Kernel {
    /// `LANES_AT_ONCE` is the number of [`Lane`](super::Lane)s of columns in a tile. With wide vectors, there are registers for
    /// several.
    fn run<const LANES_AT_ONCE: usize>(self);
}

struct Vectorized<K>(K);

impl<K: Kernel> WithSimd for Vectorized<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self) {
        if f32::lanes::<S>() >= LANES {
            self.0.run::<4>();
        } else {
            self.0.run::<1>();
        }
    }
}

/// Runs the work with the widest vectors that this processor has.
pub(crate) fn vectorized(kernel: impl Kernel) {
    AutoArch::new().dispatch(Vectorized(kernel));
}

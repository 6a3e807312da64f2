//! Converts numbers of 16 bits, NumPy's `float16`. They halve the bytes of embeddings, whose entries are in −1..=1.

/// A number of IEEE 754's binary16, given by its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Half(pub u16);

impl Half {
    /// The nearest half. Of two equally near ones, it is the even one. Numbers that are too large become infinite.
    #[must_use]
    pub fn from_f32(x: f32) -> Self {
        /// 2⁻¹⁴, below which halves have fewer bits.
        const SMALLEST_NORMAL: f32 = 6.103_515_6e-5;
        /// The difference of the exponents' biases, 127 − 15, where a half has its exponent.
        const REBIAS: u32 = 112 << 10;
        let sign = (x.to_bits() >> 16) as u16 & 0x8000;
        let bits = x.abs().to_bits();
        let rest = if x.is_nan() {
            0x7e00
        } else if x.abs() >= 65_536.0 {
            0x7c00
        } else if x.abs() < SMALLEST_NORMAL {
            // Scaling by a power of two is exact, so there is only one rounding. The result may be the smallest normal half.
            (x.abs() * (1u32 << 24) as f32).round_ties_even() as u16
        } else {
            // Thirteen bits are dropped. A carry correctly moves into the exponent.
            let is_odd = bits >> 13 & 1;
            (((bits + 0xfff + is_odd) >> 13) - REBIAS) as u16
        };
        Self(sign | rest)
    }

    /// The same number with more bits.
    #[must_use]
    pub fn to_f32(self) -> f32 {
        let sign = if self.0 & 0x8000 == 0 { 1.0 } else { -1.0 };
        let (exponent, fraction) = (i32::from(self.0 >> 10 & 0x1f), f32::from(self.0 & 0x3ff));
        sign * match exponent {
            0 => fraction * 2.0f32.powi(-24),
            0x1f if fraction == 0.0 => f32::INFINITY,
            0x1f => f32::NAN,
            _ => (1024.0 + fraction) * 2.0f32.powi(exponent - 25),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_round_trips() {
        for bits in 0..=u16::MAX {
            let half = Half(bits);
            let back = Half::from_f32(half.to_f32());
            assert!(
                back == half || half.to_f32().is_nan() && back.to_f32().is_nan(),
                "{bits:#x}"
            );
        }
    }

    #[test]
    fn the_nearest_is_taken_and_ties_go_to_the_even_one() {
        for (x, bits) in [
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (1.0 + 1.0 / 2048.0, 0x3c00),
            (1.0 + 3.0 / 2048.0, 0x3c02),
            (65_519.0, 0x7bff),
            (65_520.0, 0x7c00),
            (1e30, 0x7c00),
            (2.0f32.powi(-25), 0),
            (1.5 * 2.0f32.powi(-24), 2),
            (6.103e-5, 0x3ff + 1),
        ] {
            assert_eq!(Half::from_f32(x), Half(bits), "{x}");
        }
    }
}

//! Computes agreement as a function of the position of a point: its distance from a border, and the thickness of its wall.

use serde::{Deserialize, Serialize};

/// The upper limits of the bins of the distance to the nearest reference border, as fractions of the bounding box's diagonal.
pub const DISTANCE_LIMITS: [f64; 8] = [0.0025, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16, f64::INFINITY];

/// The upper limits of the bins of the local thickness, as fractions of the bounding box's diagonal.
pub const THICKNESS_LIMITS: [f64; 8] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, f64::INFINITY];

/// The points of one shape in one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AgreementBin {
    /// Points that the reference labels.
    pub n_points: u64,
    /// Points whose label is matched to their reference part.
    pub n_agreeing: u64,
}

impl AgreementBin {
    /// The fraction of the points that agree. Returns `None` if the bin has no point.
    #[must_use]
    pub fn accuracy(&self) -> Option<f64> {
        (self.n_points > 0).then(|| self.n_agreeing as f64 / self.n_points as f64)
    }
}

/// Sorts points into bins. A value that is NaN is in no bin.
pub(super) fn binned(values: &[f64], agrees: &[Option<bool>], limits: &[f64]) -> Vec<AgreementBin> {
    let mut bins = vec![AgreementBin::default(); limits.len()];
    for (&value, agrees) in values.iter().zip(agrees) {
        let bin = limits.iter().position(|&limit| value <= limit);
        if let (Some(bin), Some(agrees)) = (bin, *agrees) {
            bins[bin].n_points += 1;
            bins[bin].n_agreeing += u64::from(agrees);
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fall_into_the_bin_of_their_value() {
        let values = [0.1, 0.2, 0.3, f64::NAN, 9.0, 0.1];
        let agrees = [
            Some(true),
            Some(false),
            Some(true),
            Some(true),
            Some(true),
            None,
        ];
        let bins = binned(&values, &agrees, &[0.2, 0.3, f64::INFINITY]);
        let accuracies: Vec<Option<f64>> = bins.iter().map(AgreementBin::accuracy).collect();
        assert_eq!(accuracies, [Some(0.5), Some(1.0), Some(1.0)]);
        assert_eq!(binned(&[], &[], &[1.0])[0].accuracy(), None);
    }
}

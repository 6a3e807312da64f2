//! Counts dihedral angles by degree and by primitive type.

use crate::ShapeAngles;
use partprobe_carrier::FaceType;
use partprobe_sources::ANGLE_TIE_DEG;
use serde::Serialize;

/// The number of bins, of one degree each. The last bin also contains 180°.
pub const N_ANGLE_BINS: usize = 180;
/// Angles below this bound, in degrees, count as seam-like.
const SEAM_LIKE_DEG: f64 = 0.5;
/// The range, in degrees, of angles that count as right angles.
const RIGHT_ANGLE_DEG: std::ops::RangeInclusive<f64> = 85.0..=95.0;

/// The number of angles, and how many of them are undefined, small or right.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AngleCounts {
    /// All angles, including those without a defined φ.
    pub n: u64,
    /// Angles without a defined φ.
    pub n_undefined: u64,
    /// Angles of at most θ.
    pub n_within_theta: u64,
    /// Angles below 0.5°. They occur where one surface was cut into several faces.
    pub n_seam_like: u64,
    /// Angles between 85° and 95°.
    pub n_right: u64,
}

impl AngleCounts {
    /// Counts one more angle.
    pub fn add(&mut self, phi: f64, theta_deg: f64) {
        self.n += 1;
        self.n_undefined += u64::from(phi.is_nan());
        self.n_within_theta += u64::from(phi <= theta_deg + ANGLE_TIE_DEG);
        self.n_seam_like += u64::from(phi < SEAM_LIKE_DEG);
        self.n_right += u64::from(RIGHT_ANGLE_DEG.contains(&phi));
    }

    /// The fraction of the angles that are at most θ. Returns 0 if there are no angles.
    #[must_use]
    pub fn share_within_theta(&self) -> f64 {
        share(self.n_within_theta, self.n)
    }

    /// The fraction of the angles between 85° and 95°. Returns 0 if there are no angles.
    #[must_use]
    pub fn share_right(&self) -> f64 {
        share(self.n_right, self.n)
    }
}

/// The counts of one primitive type.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TypeShare {
    /// The name of the type.
    #[serde(rename = "type")]
    pub face_type: &'static str,
    /// Counts each shared edge once.
    pub edges: AngleCounts,
    /// Counts each pair of faces once, with its smallest angle.
    pub pairs: AngleCounts,
}

/// The distribution of φ over a corpus, for edges and for pairs of faces.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AngleHistogram {
    /// Number of edges in each bin of one degree.
    pub edge_bins: Vec<u64>,
    /// Number of pairs in each bin of one degree.
    pub pair_bins: Vec<u64>,
    /// All edges.
    pub edges: AngleCounts,
    /// All pairs.
    pub pairs: AngleCounts,
    /// The counts of each type, in the order of the types' codes.
    pub types: Vec<TypeShare>,
}

impl AngleHistogram {
    /// A histogram without entries.
    #[must_use]
    pub fn new() -> Self {
        let of_type = |kind: FaceType| TypeShare {
            face_type: kind.name(),
            edges: AngleCounts::default(),
            pairs: AngleCounts::default(),
        };
        Self {
            edge_bins: vec![0; N_ANGLE_BINS],
            pair_bins: vec![0; N_ANGLE_BINS],
            edges: AngleCounts::default(),
            pairs: AngleCounts::default(),
            types: FaceType::ALL.map(of_type).into(),
        }
    }

    /// Counts the angles of one more shape.
    pub fn add(&mut self, angles: &ShapeAngles, theta_deg: f64) {
        for &(kind, phi) in &angles.edges {
            count(&mut self.edge_bins, phi);
            self.edges.add(phi, theta_deg);
            self.types[usize::from(kind.code())]
                .edges
                .add(phi, theta_deg);
        }
        for &(kind, phi) in &angles.pairs {
            count(&mut self.pair_bins, phi);
            self.pairs.add(phi, theta_deg);
            self.types[usize::from(kind.code())]
                .pairs
                .add(phi, theta_deg);
        }
    }
}

impl Default for AngleHistogram {
    fn default() -> Self {
        Self::new()
    }
}

/// Adds an angle to its bin. An undefined angle is not counted.
fn count(bins: &mut [u64], phi: f64) {
    if phi.is_finite() {
        bins[(phi.max(0.0) as usize).min(N_ANGLE_BINS - 1)] += 1;
    }
}

fn share(part: u64, all: u64) -> f64 {
    if all == 0 {
        0.0
    } else {
        part as f64 / all as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_fall_into_their_bins_and_counts() {
        let phis = [0.0, 0.4, 8.0, 8.1, 90.0, 179.9, 180.0, f64::NAN];
        let edges = phis.map(|phi| (FaceType::Plane, phi)).to_vec();
        let mut histogram = AngleHistogram::new();
        histogram.add(
            &ShapeAngles {
                edges,
                pairs: vec![(FaceType::Torus, 1.5)],
                merges: Vec::new(),
            },
            8.0,
        );
        let filled = |bins: &[u64]| {
            bins.iter()
                .enumerate()
                .filter(|(_, n)| **n > 0)
                .map(|(i, &n)| (i, n))
                .collect()
        };
        let edge_bins: Vec<(usize, u64)> = filled(&histogram.edge_bins);
        assert_eq!(edge_bins, [(0, 2), (8, 2), (90, 1), (179, 2)]);
        let expected = AngleCounts {
            n: 8,
            n_undefined: 1,
            n_within_theta: 3,
            n_seam_like: 2,
            n_right: 1,
        };
        assert_eq!(
            (&histogram.edges, &histogram.types[0].edges),
            (&expected, &expected)
        );
        assert_eq!(
            (histogram.pairs.n, histogram.types[4].pairs.n_within_theta),
            (1, 1)
        );
        assert_eq!(AngleCounts::default().share_within_theta(), 0.0);
    }
}

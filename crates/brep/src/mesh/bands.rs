//! Tests points against polygons by the even–odd rule, with the sides of the polygons sorted into bands.

use super::layout::is_crossed;

/// The sides of all boundaries, listed for each band that they reach into.
pub(super) struct Bands {
    low: f64,
    per_unit: f64,
    sides: Vec<Vec<[[f64; 2]; 2]>>,
}

impl Bands {
    pub(super) fn new(polygons: &[Vec<[f64; 2]>]) -> Self {
        let heights = || polygons.iter().flatten().map(|corner| corner[1]);
        let (low, high) = (
            heights().fold(f64::INFINITY, f64::min),
            heights().fold(f64::NEG_INFINITY, f64::max),
        );
        let n_sides: usize = polygons.iter().map(Vec::len).sum();
        let n_bands = n_sides.clamp(1, 4096);
        let per_unit = if high > low {
            n_bands as f64 / (high - low)
        } else {
            0.0
        };
        let mut bands = Self {
            low,
            per_unit,
            sides: vec![Vec::new(); n_bands],
        };
        for polygon in polygons {
            for (i, &corner) in polygon.iter().enumerate() {
                let next = polygon[(i + 1) % polygon.len()];
                let (from, to) = (
                    bands.band(corner[1].min(next[1])),
                    bands.band(corner[1].max(next[1])),
                );
                bands.sides[from..=to]
                    .iter_mut()
                    .for_each(|band| band.push([corner, next]));
            }
        }
        bands
    }

    fn band(&self, height: f64) -> usize {
        // The conversion to an integer saturates, so any height has a band.
        (((height - self.low) * self.per_unit) as usize).min(self.sides.len() - 1)
    }

    /// The even–odd rule over all boundaries.
    pub(super) fn enclose(&self, p: [f64; 2]) -> bool {
        self.sides[self.band(p[1])]
            .iter()
            .filter(|[from, to]| is_crossed(*from, *to, p))
            .count()
            % 2
            == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bands_give_the_same_result_as_all_sides(
            polygons in prop::collection::vec(prop::collection::vec(prop::array::uniform2(-3_i8..4), 3..12), 1..4),
            points in prop::collection::vec(prop::array::uniform2(-4.0_f64..4.0), 20),
        ) {
            let polygons: Vec<Vec<[f64; 2]>> =
                polygons.iter().map(|polygon| polygon.iter().map(|point| point.map(f64::from)).collect()).collect();
            let bands = Bands::new(&polygons);
            for point in points {
                let crossed = |polygon: &Vec<[f64; 2]>| {
                    let next = polygon.iter().cycle().skip(1);
                    polygon.iter().zip(next).filter(|&(&a, &b)| is_crossed(a, b, point)).count()
                };
                prop_assert_eq!(bands.enclose(point), polygons.iter().map(crossed).sum::<usize>() % 2 == 1);
            }
        }
    }
}

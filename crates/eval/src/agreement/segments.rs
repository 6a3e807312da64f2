//! Measures how far points are from the borders between labels.

use super::Border;
use partprobe_carrier::Point;
use rstar::primitives::Line;
use rstar::{PointDistance, RTree};

/// Borders in a tree, so that the border nearest to a point is found quickly.
#[derive(Debug)]
pub struct BorderTree {
    tree: RTree<Line<Point>>,
}

impl BorderTree {
    /// Sorts borders into a tree.
    #[must_use]
    pub fn new(borders: &[Border]) -> Self {
        let line = |&[from, to]: &Border| Line::new(from, to);
        Self {
            tree: RTree::bulk_load(borders.iter().map(line).collect()),
        }
    }

    /// The distance of a point to the nearest border, in millimeters. Returns `None` if there is no border.
    ///
    /// Cost: logarithmic in the number of borders.
    #[must_use]
    pub fn distance(&self, point: Point) -> Option<f64> {
        let nearest = self.tree.nearest_neighbor(&point)?;
        Some(nearest.distance_2(&point).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{dot, norm, subtract};
    use proptest::prelude::*;

    fn by_hand([from, to]: Border, point: Point) -> f64 {
        let along = subtract(to, from);
        let share = (dot(subtract(point, from), along) / dot(along, along)).clamp(0.0, 1.0);
        norm(subtract(
            point,
            [0, 1, 2].map(|axis| from[axis] + share * along[axis]),
        ))
    }

    #[test]
    fn without_a_border_there_is_no_distance() {
        assert_eq!(BorderTree::new(&[]).distance([0.0; 3]), None);
    }

    proptest! {
        #[test]
        fn the_nearest_of_all_is_found(
            ends in proptest::collection::vec(proptest::array::uniform6(-5.0f64..5.0), 1..30),
            point in proptest::array::uniform3(-6.0f64..6.0),
        ) {
            let border = |&[a, b, c, d, e, f]: &[f64; 6]| [[a, b, c], [d, e, f]];
            let borders: Vec<Border> = ends.iter().map(border).collect();
            let expected = borders.iter().map(|&border| by_hand(border, point)).fold(f64::MAX, f64::min);
            let found = BorderTree::new(&borders).distance(point).unwrap();
            prop_assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}

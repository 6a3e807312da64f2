//! Finds the nearest points of a cloud.
//!
//! Points go in, and the numbers of their neighbors come out. The search tree is a k-d tree (Bentley, 1975).

use partprobe_shape::{Point, dot, subtract};

/// The `k` nearest other points of each point, the nearest first, or all others if there are fewer than `k`.
///
/// Coordinates must be finite. Cost: about `O(n (k + log n))` for `n` points.
#[must_use]
pub fn nearest_points(points: &[Point], k: usize) -> Vec<Vec<u32>> {
    let tree = NearestPoints::new(points);
    (0..)
        .take(points.len())
        .map(|own| tree.nearest_of(own, k))
        .collect()
}

/// A range of the tree's order that must still be searched.
struct Branch {
    first: usize,
    end: usize,
    /// The least squared distance that a point of the range can have.
    least: f64,
}

/// A cloud that is prepared for searches of nearest points.
///
/// It is a balanced k-d tree without pointers: the middle of each range divides it.
#[derive(Clone, Debug)]
pub struct NearestPoints<'a> {
    points: &'a [Point],
    order: Vec<u32>,
    /// The axis along which the node at the same position of `order` divides its range.
    axis: Vec<u8>,
}

impl<'a> NearestPoints<'a> {
    /// Prepares a cloud. Coordinates must be finite.
    #[must_use]
    pub fn new(points: &'a [Point]) -> Self {
        let mut order: Vec<u32> = (0..).take(points.len()).collect();
        let mut axes = vec![0; points.len()];
        let mut open = vec![(0, points.len())];
        while let Some((first, end)) = open.pop() {
            if end - first < 2 {
                continue;
            }
            let range = &mut order[first..end];
            let axis = widest_axis(points, range);
            let middle = range.len() / 2;
            let coordinate = |point: u32| points[point as usize][axis];
            range.select_nth_unstable_by(middle, |&a, &b| {
                coordinate(a).total_cmp(&coordinate(b)).then(a.cmp(&b))
            });
            axes[first + middle] = axis as u8;
            open.push((first, first + middle));
            open.push((first + middle + 1, end));
        }
        Self {
            points,
            order,
            axis: axes,
        }
    }

    /// The `k` nearest other points of a point of the cloud, the nearest first, or all others if there are fewer.
    #[must_use]
    pub fn nearest_of(&self, own: u32, k: usize) -> Vec<u32> {
        self.search(self.points[own as usize], k, Some(own))
    }

    /// The nearest point of the cloud to any position, or `None` if the cloud is empty.
    #[must_use]
    pub fn nearest_to(&self, position: Point) -> Option<u32> {
        self.search(position, 1, None).first().copied()
    }

    /// The `k` points nearest to a position, without one of them.
    fn search(&self, center: Point, k: usize, left_out: Option<u32>) -> Vec<u32> {
        let mut found: Vec<(f64, u32)> = Vec::with_capacity(k + 1);
        let mut open = vec![Branch {
            first: 0,
            end: self.order.len(),
            least: 0.0,
        }];
        while let Some(Branch { first, end, least }) = open.pop() {
            let is_full = found.len() == k;
            if first == end || k == 0 || (is_full && found[k - 1].0 <= least) {
                continue;
            }
            let middle = first + (end - first) / 2;
            let point = self.order[middle];
            let offset = subtract(self.points[point as usize], center);
            if Some(point) != left_out {
                insert(&mut found, (dot(offset, offset), point), k);
            }

            let toward = offset[usize::from(self.axis[middle])];
            let far = least.max(toward * toward);
            let [low, high] = if toward >= 0.0 {
                [least, far]
            } else {
                [far, least]
            };
            let low = Branch {
                first,
                end: middle,
                least: low,
            };
            let high = Branch {
                first: middle + 1,
                end,
                least: high,
            };
            // The side of the point itself is searched first.
            if toward >= 0.0 {
                open.extend([high, low]);
            } else {
                open.extend([low, high]);
            }
        }
        found.into_iter().map(|(_, point)| point).collect()
    }
}

fn widest_axis(points: &[Point], range: &[u32]) -> usize {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for &point in range {
        for axis in 0..3 {
            let x = points[point as usize][axis];
            low[axis] = low[axis].min(x);
            high[axis] = high[axis].max(x);
        }
    }
    let width = |axis: usize| high[axis] - low[axis];
    (1..3).fold(0, |best, axis| {
        if width(best) < width(axis) {
            axis
        } else {
            best
        }
    })
}

/// Keeps the `k` nearest in order. At equal distance, the lower number comes first.
fn insert(found: &mut Vec<(f64, u32)>, new: (f64, u32), k: usize) {
    let position =
        found.partition_point(|old| old.0.total_cmp(&new.0).then(old.1.cmp(&new.1)).is_lt());
    if position < k {
        found.insert(position, new);
        found.truncate(k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The distances to the `k` nearest points, found by testing all points.
    fn distances_by_search(points: &[Point], own: usize, k: usize) -> Vec<f64> {
        let squared = |other: usize| {
            let offset = subtract(points[other], points[own]);
            dot(offset, offset)
        };
        let others = (0..points.len()).filter(|&other| other != own);
        let mut all: Vec<f64> = others.map(squared).collect();
        all.sort_by(f64::total_cmp);
        all.truncate(k);
        all
    }

    proptest! {
        #[test]
        fn no_point_that_is_left_out_is_nearer(
            points in proptest::collection::vec([-4i8..4, -4i8..4, -4i8..4], 0..60),
            k in 0usize..9,
        ) {
            let points: Vec<Point> = points.iter().map(|point| point.map(f64::from)).collect();
            let found = nearest_points(&points, k);
            prop_assert_eq!(found.len(), points.len());
            for (own, neighbors) in found.iter().enumerate() {
                let mut distinct = neighbors.clone();
                distinct.sort_unstable();
                distinct.dedup();
                prop_assert!(distinct.len() == neighbors.len() && !distinct.contains(&(own as u32)));

                let squared: Vec<f64> = neighbors
                    .iter()
                    .map(|&other| {
                        let offset = subtract(points[other as usize], points[own]);
                        dot(offset, offset)
                    })
                    .collect();
                prop_assert_eq!(squared, distances_by_search(&points, own, k));
            }
        }
    }

    #[test]
    fn many_equal_points_are_searched_quickly() {
        let found = nearest_points(&vec![[1.0; 3]; 20_000], 8);
        assert!(found.iter().all(|neighbors| neighbors.len() == 8));
    }
}

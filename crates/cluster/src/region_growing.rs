//! Divides a cloud of points by growing regions of similar normals. It is a baseline without a network.
//!
//! Points and unit normals go in, and one cluster per point comes out. Neighbors are joined if their normals differ by little,
//! the `k` largest regions are kept, and every other point is assigned to the region of the nearest point in one of them. Nothing
//! here is random.

use partprobe_carrier::{NearestPoints, Partition, Point, dot};

/// How regions grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionGrowing {
    /// Neighbors are joined if their normals differ by at most this angle, in degrees.
    pub max_angle_deg: f64,
}

/// The regions of a cloud, before the points of small regions are reassigned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Regions {
    /// The region of each point. Regions are numbered from the largest to the smallest. If two are equally large, the one with
    /// the lowest point comes first.
    of_point: Vec<u32>,
    /// How many points each region has.
    sizes: Vec<usize>,
}

impl RegionGrowing {
    /// The regions of a cloud. `neighbors` are the points that each point may be joined with, for example by
    /// [`nearest_points`](partprobe_carrier::nearest_points).
    ///
    /// # Shapes
    /// - neighbors and normals: `[point]`
    #[must_use]
    pub fn regions(&self, neighbors: &[Vec<u32>], normals: &[Point]) -> Regions {
        let least_cosine = self.max_angle_deg.to_radians().cos();
        let agree = |own: u32, other: u32| {
            dot(normals[own as usize], normals[other as usize]) >= least_cosine
        };
        let joined = (0u32..).zip(neighbors).flat_map(|(own, others)| {
            let others = others.iter().filter(move |&&other| agree(own, other));
            others.map(move |&other| [own, other])
        });
        Regions::from_largest(&Partition::from_joined_pairs(neighbors.len(), joined))
    }
}

impl Regions {
    fn from_largest(pieces: &Partition) -> Self {
        let mut sizes = vec![0usize; pieces.n_parts() as usize];
        for &piece in pieces.parts() {
            sizes[piece as usize] += 1;
        }
        let mut by_size: Vec<usize> = (0..sizes.len()).collect();
        by_size.sort_by_key(|&piece| std::cmp::Reverse(sizes[piece]));

        let mut rank = vec![0u32; sizes.len()];
        for (idx, &piece) in (0..).zip(&by_size) {
            rank[piece] = idx;
        }
        Self {
            of_point: pieces
                .parts()
                .iter()
                .map(|&piece| rank[piece as usize])
                .collect(),
            sizes: by_size.iter().map(|&piece| sizes[piece]).collect(),
        }
    }

    /// How many regions have at least this many points.
    #[must_use]
    pub fn n_with_at_least(&self, n_points: usize) -> usize {
        self.sizes.iter().filter(|&&size| size >= n_points).count()
    }

    /// The `k` largest regions. Every other point has the region of the nearest point of one of them.
    #[must_use]
    pub fn largest(&self, points: &[Point], k: usize) -> Vec<u32> {
        let is_kept = |&point: &u32| (self.of_point[point as usize] as usize) < k.max(1);
        let kept: Vec<u32> = (0..).take(points.len()).filter(is_kept).collect();
        let kept_points: Vec<Point> = kept.iter().map(|&point| points[point as usize]).collect();
        let tree = NearestPoints::new(&kept_points);

        let region = |point: u32| {
            if is_kept(&point) {
                return self.of_point[point as usize];
            }
            let nearest = tree.nearest_to(points[point as usize]);
            nearest.map_or(0, |found| self.of_point[kept[found as usize] as usize])
        };
        (0..).take(points.len()).map(region).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::nearest_points;

    fn regions(points: &[Point], normals: &[Point]) -> Regions {
        let growing = RegionGrowing {
            max_angle_deg: 20.0,
        };
        growing.regions(&nearest_points(points, 10), normals)
    }

    /// Two planes that meet at a right angle, on a lattice of `side`² points each, and one point between them whose normal
    /// agrees with neither.
    fn corner(side: usize) -> (Vec<Point>, Vec<Point>) {
        let mut points = Vec::new();
        let mut normals = Vec::new();
        for i in 0..side * side {
            let [u, v] = [i / side, i % side].map(|k| (k as f64 + 0.5) / side as f64);
            points.extend([[u, v, 0.0], [0.0, v, u]]);
            normals.extend([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
        }
        points.push([0.0, 0.5, 0.01]);
        normals.push([0.0, 1.0, 0.0]);
        (points, normals)
    }

    #[test]
    fn planes_are_regions_and_a_single_point_joins_the_nearest() {
        let (points, normals) = corner(12);
        let regions = regions(&points, &normals);
        assert_eq!([20, 1].map(|least| regions.n_with_at_least(least)), [2, 3]);

        let clusters = regions.largest(&points, 2);
        let expected = |point: usize| u32::from(normals[point] == [1.0, 0.0, 0.0]);
        for (point, &cluster) in clusters.iter().enumerate().take(points.len() - 1) {
            assert_eq!(cluster, expected(point));
        }
        assert_eq!(clusters[points.len() - 1], 1, "it lies on the second plane");
        assert!(
            regions
                .largest(&points, 1)
                .iter()
                .all(|&cluster| cluster == 0)
        );
    }

    #[test]
    fn a_cloud_without_points_has_no_regions() {
        assert_eq!(regions(&[], &[]).largest(&[], 3), Vec::<u32>::new());
        assert_eq!(
            regions(&[[0.0; 3]], &[[0.0; 3]]).largest(&[[0.0; 3]], 3),
            [0]
        );
    }
}

//! Finds regions of similar thickness by the shape diameter function: `sdf-<K>`.
//!
//! Only the mesh is used. From each small triangle, rays go inward in a cone, and their lengths give the thickness of the body at
//! this point (Shapira, Shamir, Cohen-Or 2008). The logarithms of the thicknesses are smoothed along the surface and grouped into
//! at most K classes that differ by at least 15 %; a label is a connected piece of one class. So there may be more labels than K.
//!
//! Two choices differ from the publication. The classes come from an exact k-means on one number, not from a mixture of
//! Gaussians, so nothing is random. No graph cut moves the boundaries. Instead, pieces below 0.5 % of the area join the neighbor
//! with the longest common border.
//!
//! A ray that leaves through an opening does not count. If fewer than half of its rays meet the mesh, a triangle takes the
//! thickness of the triangles next to it. If a component has no thickness at all, its thickness is the diagonal of the bounding
//! box.

use crate::basis::across;
use crate::factory::SourceFactory;
use crate::line_kmeans::line_kmeans;
use crate::pieces::{PieceLabels, Pieces};
use crate::ray_tree::RayTree;
use crate::region_merging::{Region, absorb_smaller_than};
use crate::source::SourceLabels;
use crate::surface::Surface;
use crate::triangle_normal::{normal_and_area, size_or_one};
use partprobe_carrier::{Mesh, Partition, Point, ShapeKind, dot};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Number of rays in the cone of one triangle.
const N_RAYS: usize = 25;

/// Half the opening angle of the cone, in degrees.
const HALF_ANGLE_DEG: f64 = 60.0;

/// Triangles in the same cell that face in the same direction share their rays. This is the side of a cell, as a fraction of the
/// diagonal.
const CELL_FRACTION: f64 = 1.0 / 64.0;

/// Triangles that are closer to the origin of a ray than this fraction of the diagonal are ignored.
const LEAST_FRACTION: f64 = 1e-6;

/// Number of rounds of smoothing.
const SMOOTHING_ROUNDS: usize = 4;

/// Logarithms of thicknesses that differ by this much hardly smooth each other.
const SMOOTHING_WIDTH: f64 = 0.15;

/// Classes whose mean logarithms differ by less than this are joined, so that the facets of a ball are not separated.
const LEAST_STEP: f64 = 0.15;

/// Pieces that are smaller than this fraction of the area join a neighbor.
const MIN_PIECE: f64 = 0.005;

/// Classes of thickness, cut into connected pieces.
pub(crate) const SDF: SourceFactory = SourceFactory::numbered_rule(
    "sdf-<K>",
    "connected pieces of K classes of thickness (shape diameter function)",
    1..=20,
    |carrier, n_classes, _| {
        let rule = segmented(carrier.mesh(), n_classes as usize);
        Ok(SourceLabels::on_points(carrier.mesh(), Arc::new(rule)))
    },
)
.needing(ShapeKind::Mesh);

/// The shape diameter at each triangle of a mesh, in millimeters. It is `None` where most rays leave the mesh.
///
/// It is the robust mean length of 25 rays in an inward cone of 120°, before any smoothing.
#[must_use]
pub fn shape_diameters(mesh: &Mesh) -> Vec<Option<f64>> {
    diameters(mesh, mesh)
}

fn segmented(mesh: &Mesh, n_classes: usize) -> PieceLabels {
    let pieces = Pieces::of(mesh);
    let surface = Surface::of(&pieces.fine);
    let known = diameters(mesh, &pieces.fine);
    let mut thickness = filled(&surface, &known, size_or_one(mesh));
    smooth(&surface, &mut thickness);
    let classes = classes_of(&thickness, &surface.areas, n_classes);

    let same_class = surface
        .borders
        .iter()
        .map(|border| border.between)
        .filter(|&[a, b]| classes[a as usize] == classes[b as usize]);
    let connected = Partition::from_joined_pairs(surface.n_triangles(), same_class);
    let regions = Region::of_pieces(&connected, &surface.areas, &surface.borders);
    let total: f64 = surface.areas.iter().sum();
    let ends = absorb_smaller_than(regions, MIN_PIECE * total);
    let keys: Vec<u32> = connected
        .parts()
        .iter()
        .map(|&region| ends[region as usize])
        .collect();
    PieceLabels {
        pieces,
        labels: Partition::from_keys(&keys).parts().to_vec(),
    }
}

/// The diameter at each triangle of `fine`, by rays into `mesh`, which is the same surface.
fn diameters(mesh: &Mesh, fine: &Mesh) -> Vec<Option<f64>> {
    let cone = Cone::new(mesh);
    let groups = Groups::of(fine, size_or_one(mesh) * CELL_FRACTION);
    let of_group: Vec<Option<f64>> = groups
        .origins
        .iter()
        .map(|origin| cone.diameter(origin))
        .collect();
    groups
        .of_triangle
        .iter()
        .map(|&group| of_group[group as usize])
        .collect()
}

/// The origin of a cone of rays.
#[derive(Clone, Copy, Debug)]
struct Origin {
    point: Point,
    normal: Point,
    area: f64,
}

/// Groups of triangles that are close to each other and have similar normals.
struct Groups {
    /// The centroid and normal of the largest triangle in each group.
    origins: Vec<Origin>,
    of_triangle: Vec<u32>,
}

impl Groups {
    fn of(mesh: &Mesh, cell_size: f64) -> Self {
        let mut index_of = BTreeMap::new();
        let mut groups = Self {
            origins: Vec::new(),
            of_triangle: Vec::new(),
        };
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            let point = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
            let (normal, area) = normal_and_area(mesh, triangle);
            let origin = Origin {
                point,
                normal,
                area,
            };
            let cell = point.map(|x| (x / cell_size).floor() as i64);
            let facing = normal.map(|x| (2.0 * x).round() as i64);
            let next = groups.origins.len() as u32;
            let group = *index_of.entry((cell, facing)).or_insert(next);
            match groups.origins.get_mut(group as usize) {
                Some(largest) if largest.area < area => *largest = origin,
                Some(_) => {}
                None => groups.origins.push(origin),
            }
            groups.of_triangle.push(group);
        }
        groups
    }
}

/// Rays into a mesh.
struct Cone {
    tree: RayTree,
    /// The normal of each triangle of the mesh.
    normals: Vec<Point>,
    /// Each ray: its components along two directions of the surface and inward, and the weight of its length.
    rays: Vec<(Point, f64)>,
    least: f64,
}

impl Cone {
    fn new(mesh: &Mesh) -> Self {
        Self {
            tree: RayTree::of(mesh),
            normals: (0..mesh.triangles.len())
                .map(|triangle| normal_and_area(mesh, triangle).0)
                .collect(),
            rays: spiral(),
            least: LEAST_FRACTION * size_or_one(mesh),
        }
    }

    /// The weighted mean of the lengths within one standard deviation of the median. Returns `None` if fewer than half of the
    /// rays have a length.
    fn diameter(&self, origin: &Origin) -> Option<f64> {
        if origin.normal == [0.0; 3] {
            return None;
        }
        let inward = origin.normal.map(|x| -x);
        let [u, v] = across(inward);
        let length = |&([s, t, depth], weight): &(Point, f64)| {
            let direction = [0, 1, 2].map(|axis| s * u[axis] + t * v[axis] + depth * inward[axis]);
            let hit = self
                .tree
                .first_hit(origin.point, direction, self.least, u32::MAX)?;
            // If a ray meets a surface from outside, this is not the far side of the body.
            let is_far_side = dot(self.normals[hit.triangle as usize], direction) > 0.0;
            is_far_side.then_some((hit.distance, weight))
        };
        let lengths: Vec<(f64, f64)> = self.rays.iter().filter_map(length).collect();
        if 2 * lengths.len() < self.rays.len() {
            return None;
        }
        robust_mean(lengths)
    }
}

/// The rays of a cone, evenly spread over its base (Vogel 1979). Rays near the middle have more weight.
fn spiral() -> Vec<(Point, f64)> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let widest = HALF_ANGLE_DEG.to_radians().tan();
    let ray = |idx: usize| {
        let radius = widest * ((idx as f64 + 0.5) / N_RAYS as f64).sqrt();
        let turn = golden_angle * idx as f64;
        let length = (1.0 + radius * radius).sqrt();
        let direction = [radius * turn.cos(), radius * turn.sin(), 1.0].map(|x| x / length);
        // The cosine of the angle to the axis.
        (direction, 1.0 / length)
    };
    (0..N_RAYS).map(ray).collect()
}

/// The weighted mean of the lengths that are within one standard deviation of the median.
fn robust_mean(mut lengths: Vec<(f64, f64)>) -> Option<f64> {
    lengths.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = lengths.get(lengths.len() / 2)?.0;
    let n = lengths.len() as f64;
    let mean = lengths.iter().map(|&(length, _)| length).sum::<f64>() / n;
    let squares = lengths.iter().map(|&(length, _)| (length - mean).powi(2));
    let deviation = (squares.sum::<f64>() / n).sqrt();

    let near = lengths
        .iter()
        .filter(|&&(length, _)| (length - median).abs() <= deviation);
    let (sum, weights) = near.fold((0.0, 0.0), |(sum, weights), &(length, weight)| {
        (sum + weight * length, weights + weight)
    });
    (weights > 0.0).then(|| sum / weights)
}

/// The known diameters, spread ring by ring to triangles without a diameter. Triangles that no ring reaches get `otherwise`.
fn filled(surface: &Surface, known: &[Option<f64>], otherwise: f64) -> Vec<f64> {
    let mut values = known.to_vec();
    let mut ring: Vec<u32> = (0..)
        .take(known.len())
        .filter(|&triangle: &u32| known[triangle as usize].is_some())
        .collect();
    while !ring.is_empty() {
        let mut next: Vec<u32> = ring
            .iter()
            .flat_map(|&triangle| surface.neighbors(triangle))
            .copied()
            .filter(|&other| values[other as usize].is_none())
            .collect();
        next.sort_unstable();
        next.dedup();
        let mean = |&triangle: &u32| {
            let around = surface.neighbors(triangle).iter();
            let found: Vec<f64> = around.filter_map(|&other| values[other as usize]).collect();
            found.iter().sum::<f64>() / found.len() as f64
        };
        let means: Vec<f64> = next.iter().map(mean).collect();
        for (&triangle, mean) in next.iter().zip(means) {
            values[triangle as usize] = Some(mean);
        }
        ring = next;
    }
    values
        .into_iter()
        .map(|value| value.unwrap_or(otherwise))
        .collect()
}

/// Replaces the logarithms by means over neighbors. Neighbors with a similar thickness and a long border have more weight.
fn smooth(surface: &Surface, thickness: &mut [f64]) {
    let mut logs: Vec<f64> = thickness
        .iter()
        .map(|value| value.max(f64::MIN_POSITIVE).ln())
        .collect();
    let mut perimeter = vec![0.0; logs.len()];
    for border in &surface.borders {
        for triangle in border.between {
            perimeter[triangle as usize] += border.length;
        }
    }
    for _ in 0..SMOOTHING_ROUNDS {
        // A triangle's own value counts as much as all its neighbors.
        let mut sums: Vec<(f64, f64)> = logs
            .iter()
            .zip(&perimeter)
            .map(|(&log, &length)| (log * length, length))
            .collect();
        for border in &surface.borders {
            let [a, b] = border.between.map(|triangle| triangle as usize);
            let apart = (logs[a] - logs[b]) / SMOOTHING_WIDTH;
            let weight = border.length * (-0.5 * apart * apart).exp();
            for (into, from) in [(a, b), (b, a)] {
                sums[into].0 += weight * logs[from];
                sums[into].1 += weight;
            }
        }
        for (log, (sum, weight)) in logs.iter_mut().zip(sums) {
            let mean = sum / weight;
            if weight > 0.0 && mean.is_finite() {
                *log = mean;
            }
        }
    }
    for (value, log) in thickness.iter_mut().zip(logs) {
        *value = log.exp();
    }
}

/// The class of each thickness. The thinnest class comes first. There are at most `n_max` classes, and fewer if they would hardly
/// differ.
fn classes_of(thickness: &[f64], areas: &[f64], n_max: usize) -> Vec<u32> {
    let logs: Vec<f64> = thickness
        .iter()
        .map(|value| value.max(f64::MIN_POSITIVE).ln())
        .collect();
    let least = logs.iter().copied().fold(f64::INFINITY, f64::min);
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let range = most - least;
    if range < LEAST_STEP {
        return vec![0; logs.len()];
    }

    let scaled: Vec<f64> = logs.iter().map(|log| (log - least) / range).collect();
    let differ = |classes: &Vec<u32>| range * least_gap(&scaled, areas, classes) >= LEAST_STEP;
    (1..=n_max)
        .rev()
        .map(|k| line_kmeans(&scaled, areas, k))
        .find(differ)
        .unwrap_or_else(|| vec![0; logs.len()])
}

/// The smallest difference between the means of two consecutive classes. It is infinite for a single class.
fn least_gap(values: &[f64], weights: &[f64], classes: &[u32]) -> f64 {
    let n_classes = classes.iter().max().map_or(0, |&last| last as usize + 1);
    let mut sums = vec![(0.0, 0.0); n_classes];
    for ((&value, &weight), &class) in values.iter().zip(weights).zip(classes) {
        let sum = &mut sums[class as usize];
        *sum = (sum.0 + weight * value, sum.1 + weight);
    }
    let means: Vec<f64> = sums
        .into_iter()
        .filter(|&(_, weight)| weight > 0.0)
        .map(|(sum, weight)| sum / weight)
        .collect();
    means
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::{cuboid, mesh_of, rectangle, tube};

    fn labels_of(triangles: &[[Point; 3]], n_classes: usize) -> PieceLabels {
        segmented(&mesh_of(triangles), n_classes)
    }

    fn n_labels(triangles: &[[Point; 3]], n_classes: usize) -> u32 {
        Partition::from_keys(&labels_of(triangles, n_classes).labels).n_parts()
    }

    #[test]
    fn the_diameter_is_the_thickness() {
        // A thin plate. Rays from each large side meet the other one, slightly obliquely.
        let plate = cuboid([0.0; 3], [10.0, 10.0, 0.1]);
        let diameters = shape_diameters(&mesh_of(&plate));
        for found in &diameters[8..12] {
            let thickness = found.unwrap();
            assert!((0.1..0.17).contains(&thickness), "{thickness}");
        }
        // The outer wall of a rod with a thin bore.
        for facet in shape_diameters(&mesh_of(&tube(1e-3, 1.0, 20.0, 40))).chunks(8) {
            assert!((1.7..2.7).contains(&facet[0].unwrap()), "{:?}", facet[0]);
        }
    }

    #[test]
    fn a_thin_and_a_thick_body_are_distinguished() {
        let moved = |[a, b, c]: [Point; 3]| [a, b, c].map(|[x, y, z]| [x + 20.0, y, z]);
        let thick = tube(1e-3, 3.0, 100.0, 24).into_iter().map(moved);
        let rods: Vec<[Point; 3]> = tube(1e-3, 1.0, 100.0, 24)
            .into_iter()
            .chain(thick)
            .collect();
        assert_eq!(n_labels(&rods, 1), 2);
        assert_eq!(n_labels(&rods, 2), 2);
        let mesh = mesh_of(&rods);
        let pieces = Pieces::of(&mesh);
        let known = diameters(&mesh, &pieces.fine);
        let thickness = filled(&Surface::of(&pieces.fine), &known, 100.0);
        let classes = classes_of(&thickness, &pieces.fine.triangle_areas(), 2);
        // Both ends of the list are pieces of outer walls.
        assert_eq!((classes[0], classes[pieces.first_piece[24 * 8]]), (0, 1));
    }

    #[test]
    fn rays_that_leave_do_not_count() {
        let sheet = rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(shape_diameters(&mesh_of(&sheet)), [None, None]);
        assert_eq!(n_labels(&sheet, 5), 1);
        // From the bottom of a flat box without a lid, most rays leave.
        let mut open = cuboid([0.0; 3], [1.0, 1.0, 0.1]);
        open.truncate(10);
        let diameters = shape_diameters(&mesh_of(&open));
        assert_eq!(diameters[8..], [None, None]);
        assert!(diameters[..8].iter().any(Option::is_some));
        let filled = filled(&Surface::of(&mesh_of(&open)), &diameters, 9.0);
        assert!(filled.iter().all(|&value| value < 2.0), "{filled:?}");
    }

    #[test]
    fn meshes_without_area_have_regions_too() {
        assert_eq!(n_labels(&[], 5), 0);
        assert_eq!(n_labels(&[[[0.0; 3]; 3]], 5), 1);
        assert_eq!(n_labels(&[[[f64::NAN; 3]; 3]], 5), 1);
    }

    #[test]
    fn classes_that_hardly_differ_are_one() {
        let check = |values: &[f64], n_max: usize, expected: &[u32]| {
            assert_eq!(
                classes_of(values, &vec![1.0; values.len()], n_max),
                expected
            );
        };
        check(&[], 5, &[]);
        check(&[0.0, 0.0], 5, &[0, 0]);
        check(&[1.0, 1.05, 1.1], 5, &[0, 0, 0]);
        check(&[1.0, 1.05, 3.0, 3.1], 5, &[0, 0, 1, 1]);
        check(&[1.0, 2.0, 4.0], 5, &[0, 1, 2]);
        check(&[1.0, 2.0, 40.0], 2, &[0, 0, 1]);
    }

    #[test]
    fn a_mean_without_outliers() {
        let lengths = [1.0, 1.1, 0.9, 1.0, 50.0].map(|length| (length, 1.0));
        assert_eq!(robust_mean(lengths.to_vec()), Some(1.0));
        assert_eq!(robust_mean(Vec::new()), None);
    }
}

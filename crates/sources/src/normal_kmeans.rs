//! Clusters triangle normals, and cuts the clusters into connected pieces, at most K of them: `normal-kmeans-<K>`.
//!
//! This is a mesh segmentation that does not use the B-Rep. It is an example of cheap supervision that is similar to the parts
//! but not equal to them.

use crate::factory::SourceFactory;
use crate::region_merging::{Region, borders_of, merge_to_at_most};
use crate::source::{SourceError, SourceLabels};
use crate::triangle_normal::{areas_of, normals_and_areas};
use partprobe_carrier::{Carrier, Embeddings, Labels, Mesh, Partition};
use partprobe_cluster::{KMeansSettings, spherical_kmeans};
use std::collections::BTreeMap;

/// Normals are rounded to a grid with this cell size. Normals with the same grid point count as equal, because coplanar triangles
/// differ by rounding only.
const NORMAL_GRID: f64 = 1e-6;

/// The total weight of the surface, so that areas can be rounded to integer multiplicities.
const WEIGHT_OF_SURFACE: f64 = 1e9;

/// Spherical k-means on the area-weighted triangle normals gives `n_labels` clusters. Each connected piece of a cluster is a
/// region. Then the smallest region joins the neighbor with the longest common border, until there are at most `n_labels`
/// regions. A region without neighbors (a separate body) joins the largest region, so the limit is kept.
pub(crate) const NORMAL_KMEANS: SourceFactory = SourceFactory::numbered_rule(
    "normal-kmeans-<K>",
    "connected pieces of k-means clusters of triangle normals, at most K labels",
    1..=1000,
    labels,
);

fn labels(carrier: &Carrier, n_labels: u32, seed: u64) -> Result<SourceLabels, SourceError> {
    let mesh = carrier.mesh();
    let clusters = normal_clusters(mesh, n_labels, &carrier.meta().id, seed);
    let borders = borders_of(mesh);
    let same_cluster = borders.iter().filter(|border| {
        let [a, b] = border.between.map(|triangle| clusters[triangle as usize]);
        a == b
    });

    let pieces =
        Partition::from_joined_pairs(clusters.len(), same_cluster.map(|border| border.between));
    let regions = Region::of_pieces(&pieces, &areas_of(mesh), &borders);
    let merged = merge_to_at_most(regions, n_labels as usize);

    let raw: Vec<i32> = pieces
        .parts()
        .iter()
        .map(|&piece| merged[piece as usize] as i32)
        .collect();
    Ok(SourceLabels::on_plain(Labels::compacted(&raw)))
}

/// The cluster of each triangle's normal.
fn normal_clusters(mesh: &Mesh, n_labels: u32, key: &str, seed: u64) -> Vec<u32> {
    let normals = DistinctNormals::of(mesh);
    let settings = KMeansSettings {
        k: n_labels as usize,
        restarts: 4,
        max_iterations: 100,
        tolerance: 1e-4,
    };

    // Each row has three finite numbers and a weight, and K ≥ 1, so neither step can fail.
    let clusters = Embeddings::new(3, normals.values)
        .ok()
        .and_then(|rows| spherical_kmeans(&rows, &normals.weights, &settings, seed, key).ok())
        .map_or_else(Vec::new, |clusters| clusters.assignment);
    normals
        .of_triangle
        .iter()
        .map(|&row| clusters.get(row).copied().unwrap_or(0))
        .collect()
}

/// The different normals of a mesh, each with its fraction of the surface.
struct DistinctNormals {
    values: Vec<f32>,
    weights: Vec<u32>,
    /// The normal of each triangle, as an index.
    of_triangle: Vec<usize>,
}

impl DistinctNormals {
    fn of(mesh: &Mesh) -> Self {
        let normals = normals_and_areas(mesh);
        let total: f64 = normals.iter().map(|(_, area)| area).sum();
        let mut indices = BTreeMap::new();
        let (mut values, mut areas, mut of_triangle) = (Vec::new(), Vec::new(), Vec::new());
        for (normal, area) in normals {
            let idx = *indices
                .entry(normal.map(|x| (x / NORMAL_GRID).round() as i64))
                .or_insert_with(|| {
                    values.extend(normal.map(|x| x as f32));
                    areas.push(0.0);
                    areas.len() - 1
                });
            areas[idx] += area;
            of_triangle.push(idx);
        }
        let weight = |area: &f64| {
            if total > 0.0 {
                (area / total * WEIGHT_OF_SURFACE).round() as u32
            } else {
                0
            }
        };
        Self {
            weights: areas.iter().map(weight).collect(),
            values,
            of_triangle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::tests::carrier_of;
    use partprobe_carrier::FaceType::Plane;
    use partprobe_carrier::Point;

    /// The unit cube at `x`, with two triangles per side. Each of the twelve triangles has its own vertices.
    fn cube(x: f64) -> Vec<[Point; 3]> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let corner = |u: f64, v: f64| {
                    let mut point = [0.0; 3];
                    (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) = (side, u, v);
                    [point[0] + x, point[1], point[2]]
                };
                let [a, b, c, d] = [
                    corner(0.0, 0.0),
                    corner(1.0, 0.0),
                    corner(1.0, 1.0),
                    corner(0.0, 1.0),
                ];
                triangles.extend(if side > 0.5 {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, c, b], [a, d, c]]
                });
            }
        }
        triangles
    }

    fn labels_of(triangles: &[[Point; 3]], k: u32) -> Labels {
        let mesh = Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            vertex_face: vec![0; 3 * triangles.len()],
            triangles: (0..)
                .take(triangles.len())
                .map(|idx: u32| [3 * idx, 3 * idx + 1, 3 * idx + 2])
                .collect(),
            tri_face: vec![0; triangles.len()],
            vertex_normal: Vec::new(),
        };
        labels(&carrier_of(mesh, &[Plane], &[]), k, 0)
            .unwrap()
            .of_triangles()
            .clone()
    }

    #[test]
    fn the_sides_of_a_cube_are_found() {
        assert_eq!(
            labels_of(&cube(0.0), 20).of_triangle(),
            [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
        );
    }

    #[test]
    fn equal_normals_that_do_not_touch_are_two_labels() {
        let both = [cube(0.0), cube(5.0)].concat();
        assert_eq!(labels_of(&both, 20).n_labels(), 12);
        // Opposite sides of one body have no common border either.
        assert_eq!(labels_of(&both, 12).n_labels(), 12);
    }

    #[test]
    fn there_are_never_more_labels_than_requested() {
        let bodies: Vec<[Point; 3]> = (0..7).flat_map(|n| cube(3.0 * f64::from(n))).collect();
        for k in [1, 2, 5, 11, 41] {
            assert_eq!(labels_of(&bodies, k).n_labels(), k);
        }
    }

    #[test]
    fn triangles_without_area_and_empty_meshes_are_labeled_too() {
        let mut triangles = cube(0.0);
        triangles.push([[0.0; 3]; 3]);
        triangles.push([[f64::NAN; 3]; 3]);
        assert_eq!(
            labels_of(&triangles, 20).of_triangle()[..12],
            [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
        );
        assert_eq!(labels_of(&[], 20).n_labels(), 0);
        assert_eq!(labels_of(&[[[0.0; 3]; 3]], 20).n_labels(), 1);
    }
}

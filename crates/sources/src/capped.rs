//! Merges the smallest labels of a source into their neighbors until there are at most as many as STEP-Parts has.
//!
//! Labels of any source go in, and unions of them come out. The boundaries that remain are those of the source itself.

use crate::degraded::step_parts;
use crate::pieces::Pieces;
use crate::region_merging::{Region, borders_of, merge_to_at_most};
use crate::source::{PointRule, SourceLabels};
use crate::triangle_normal::normals_and_areas;
use partprobe_carrier::{Carrier, Labels, Mesh, Partition, Point, centroid};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The labels, with at most as many different ones as the shape has STEP-Parts.
///
/// The smallest label by area joins the neighbor with the longest common border, or the largest label if it has no neighbor.
/// Points without a label stay without one.
pub(crate) fn capped(carrier: &Carrier, labels: &SourceLabels) -> SourceLabels {
    let n_most = step_parts(carrier).n_parts().max(1) as usize;
    let mesh = carrier.mesh();
    match labels.point_rule() {
        None => {
            let of_triangle = labels.of_triangles().of_triangle();
            let merged = Merged::of(mesh, of_triangle, n_most);
            let of_triangle: Vec<i32> =
                of_triangle.iter().map(|&label| merged.end(label)).collect();
            SourceLabels::on_plain(Labels::compacted(&of_triangle))
        }
        Some(rule) => {
            let pieces = Pieces::of(mesh);
            let merged = Merged::of(
                &pieces.fine,
                &labels_of_pieces(&pieces, rule.as_ref()),
                n_most,
            );
            let rule = CappedRule {
                rule: Arc::clone(rule),
                merged,
            };
            SourceLabels::on_points(mesh, Arc::new(rule))
        }
    }
}

/// The label at the centroid of each piece.
fn labels_of_pieces(pieces: &Pieces, rule: &dyn PointRule) -> Vec<i32> {
    let mut labels = Vec::with_capacity(pieces.fine.triangles.len());
    for (triangle, bounds) in (0..).zip(pieces.first_piece.windows(2)) {
        for piece in bounds[0]..bounds[1] {
            labels.push(rule.label(triangle, centroid(pieces.fine.corners(piece))));
        }
    }
    labels
}

/// The label that each label becomes.
#[derive(Debug)]
struct Merged {
    end_of_label: BTreeMap<i32, i32>,
    /// The label with the largest area. A label that no triangle has becomes this label.
    largest: i32,
}

impl Merged {
    fn of(mesh: &Mesh, label_of_triangle: &[i32], n_most: usize) -> Self {
        let pieces = Partition::from_keys(label_of_triangle);
        let mut label_of_region = vec![0; pieces.n_parts() as usize];
        for (&region, &label) in pieces.parts().iter().zip(label_of_triangle) {
            label_of_region[region as usize] = label;
        }
        let areas: Vec<f64> = normals_and_areas(mesh)
            .into_iter()
            .map(|(_, area)| area)
            .collect();
        let mut regions = Region::of_pieces(&pieces, &areas, &borders_of(mesh));
        // The region without a label is not merged with anything. It is taken out and does not count.
        let unlabeled = label_of_region.iter().position(|&label| label < 0);
        let n_most = n_most + usize::from(unlabeled.is_some());
        if let Some(unlabeled) = unlabeled {
            isolate(&mut regions, unlabeled as u32);
        }

        let largest = regions
            .iter()
            .zip(&label_of_region)
            .filter(|(_, label)| **label >= 0)
            .fold((-1.0, 0), |best, (region, &label)| {
                if best.0 < region.area {
                    (region.area, label)
                } else {
                    best
                }
            });
        if let Some(unlabeled) = unlabeled {
            // It is merged last, because it is larger than all others.
            regions[unlabeled].area = f64::INFINITY;
        }
        let ends = merge_to_at_most(regions, n_most);
        let end =
            |(region, end): (usize, u32)| (label_of_region[region], label_of_region[end as usize]);
        Self {
            end_of_label: ends.into_iter().enumerate().map(end).collect(),
            largest: largest.1,
        }
    }

    fn end(&self, label: i32) -> i32 {
        match self.end_of_label.get(&label) {
            _ if label < 0 => label,
            // Labels without a neighbor join the largest region. That may be the region without a label.
            Some(&end) if end >= 0 => end,
            _ => self.largest,
        }
    }
}

/// Takes a region out of the neighbors of all others.
fn isolate(regions: &mut [Region], region: u32) {
    for other in regions.iter_mut() {
        other.neighbors.remove(&region);
    }
    regions[region as usize].neighbors.clear();
}

#[derive(Debug)]
struct CappedRule {
    rule: Arc<dyn PointRule>,
    merged: Merged,
}

impl PointRule for CappedRule {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        self.merged.end(self.rule.label(triangle, point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` unit triangles.
    fn strip(n: usize) -> Mesh {
        let vertices: Vec<Point> = (0..n + 2)
            .map(|i| [(i / 2) as f64, (i % 2) as f64, 0.0])
            .collect();
        Mesh {
            vertex_face: vec![0; vertices.len()],
            vertices,
            triangles: (0..n as u32).map(|i| [i, i + 1, i + 2]).collect(),
            tri_face: vec![0; n],
            vertex_normal: Vec::new(),
        }
    }

    #[track_caller]
    fn check(labels: &[i32], n_most: usize, expected: &[i32]) {
        let merged = Merged::of(&strip(labels.len()), labels, n_most);
        let found: Vec<i32> = labels.iter().map(|&label| merged.end(label)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn the_smallest_label_joins_its_neighbor() {
        check(&[0, 0, 1, 2, 2, 2], 3, &[0, 0, 1, 2, 2, 2]);
        // The border between the labels 1 and 2 is a diagonal, which is longer than the border between 1 and 0.
        check(&[0, 0, 1, 2, 2, 2], 2, &[0, 0, 2, 2, 2, 2]);
        check(&[7, 7, 7, 4, 4, 9], 2, &[7, 7, 7, 4, 4, 4]);
        check(&[7, 7, 7, 7, 4, 9], 1, &[7; 6]);
    }

    #[test]
    fn triangles_without_a_label_keep_none_and_join_nothing() {
        check(&[0, 0, -1, 2], 2, &[0, 0, -1, 2]);
        // Label 2 has no labeled neighbor, so it joins the largest label.
        check(&[0, 0, -1, 2], 1, &[0, 0, -1, 0]);
        check(&[-1, -1, -1], 1, &[-1, -1, -1]);
        let merged = Merged::of(&strip(3), &[4, 4, 6], 1);
        assert_eq!(merged.end(99), 4);
    }
}

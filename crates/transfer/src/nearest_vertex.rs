//! Takes the label that most triangles at the nearest vertex have: channel `nn-vertex`.
//!
//! This is the paper's way for its comparison at 10⁵ points ("nearest-neighbor query on mesh vertices"), where the labels
//! are those of triangles. On a coarse mesh it loses most of them, because a corner of a box has three faces and one
//! label: see the crate's tests.

use crate::box_tree::{Bounds, BoxTree};
use crate::query::{Limits, Query, normals_agree};
use crate::surface::{LabeledSurface, unit_normal};
use partprobe_carrier::{IGNORE, Point, dot, subtract};
use std::collections::HashMap;

/// A labeled surface that is asked for its nearest vertex.
///
/// Vertices at one position count as one.
#[derive(Clone, Debug)]
pub struct NearestVertex {
    tree: BoxTree,
    /// The positions in the order of the tree.
    positions: Vec<Point>,
    incident: Incident,
    /// The label of each position, by all triangles at it.
    majority: Vec<i32>,
}

/// The triangles at each position, in one list.
#[derive(Clone, Debug)]
struct Incident {
    starts: Vec<u32>,
    normals: Vec<Point>,
    labels: Vec<i32>,
}

impl NearestVertex {
    /// Prepares a surface.
    #[must_use]
    pub fn new(labeled: &LabeledSurface<'_>) -> Self {
        let surface = labeled.surface();
        let (positions, index_of) = distinct_positions(surface.vertices());
        let corners = surface.triangles().iter().enumerate();
        let mut pairs: Vec<(u32, u32)> = corners
            .flat_map(|(triangle, corners)| {
                corners.map(|vertex| (index_of[vertex as usize], triangle as u32))
            })
            .collect();
        pairs.sort_unstable();
        // A needle may have one position twice; it is one triangle there all the same.
        pairs.dedup();

        let incident = Incident::new(positions.len(), &pairs, |triangle| {
            let normal = unit_normal(surface.corners(triangle));
            (normal, labeled.labels()[triangle])
        });
        let majority = (0..positions.len())
            .map(|position| incident.majority(position, |_| true).unwrap_or(IGNORE))
            .collect();
        let bounds: Vec<Bounds> = positions
            .iter()
            .map(|&point| Bounds::around(&[point]))
            .collect();
        let tree = BoxTree::new(&bounds);
        Self {
            positions: tree.arranged(&positions),
            tree,
            incident,
            majority,
        }
    }

    /// The label that most triangles at the nearest vertex have; the lowest of those that are equally frequent. With a
    /// limit on angles, only triangles whose normals agree count, and vertices without such a triangle are passed by.
    ///
    /// Returns `None` if no vertex is within the limits, or no triangle at the vertex has a label.
    #[must_use]
    pub fn label(&self, query: &Query, limits: &Limits) -> Option<i32> {
        let min_cosine = limits.min_cosine();
        let agrees = |normal: Point| normals_agree(query, normal, min_cosine);
        let squared_distance = |slot: usize, vertex: u32| {
            let counts = min_cosine.is_none() || self.incident.any(vertex as usize, agrees);
            counts.then(|| {
                let apart = subtract(query.position, self.positions[slot]);
                dot(apart, apart)
            })
        };
        let max_squared = limits.max_distance * limits.max_distance;
        let found = self
            .tree
            .nearest(query.position, max_squared, squared_distance)?;
        let vertex = found.item as usize;

        let label = if min_cosine.is_some() {
            self.incident.majority(vertex, agrees)
        } else {
            Some(self.majority[vertex])
        };
        label.filter(|&label| label >= 0)
    }
}

/// The positions that are used, each once, and which one each vertex has.
fn distinct_positions(vertices: &[Point]) -> (Vec<Point>, Vec<u32>) {
    let mut index_of_bits: HashMap<[u64; 3], u32> = HashMap::new();
    let mut positions = Vec::new();
    let index_of = vertices
        .iter()
        .map(|&vertex| {
            // Adding 0 turns -0 into 0.
            let bits = vertex.map(|x| (x + 0.0).to_bits());
            *index_of_bits.entry(bits).or_insert_with(|| {
                positions.push(vertex);
                (positions.len() - 1) as u32
            })
        })
        .collect();
    (positions, index_of)
}

impl Incident {
    fn new(
        n_positions: usize,
        sorted_pairs: &[(u32, u32)],
        of_triangle: impl Fn(usize) -> (Point, i32),
    ) -> Self {
        let mut starts = vec![0u32; n_positions + 1];
        for &(position, _) in sorted_pairs {
            starts[position as usize + 1] += 1;
        }
        for position in 0..n_positions {
            starts[position + 1] += starts[position];
        }
        let (normals, labels) = sorted_pairs
            .iter()
            .map(|&(_, triangle)| of_triangle(triangle as usize))
            .unzip();
        Self {
            starts,
            normals,
            labels,
        }
    }

    fn range(&self, position: usize) -> std::ops::Range<usize> {
        self.starts[position] as usize..self.starts[position + 1] as usize
    }

    fn any(&self, position: usize, agrees: impl Fn(Point) -> bool) -> bool {
        self.normals[self.range(position)]
            .iter()
            .any(|&normal| agrees(normal))
    }

    /// The most frequent label among the triangles that agree, the lowest in a tie; triangles without a label do not count.
    fn majority(&self, position: usize, agrees: impl Fn(Point) -> bool) -> Option<i32> {
        let mut labels: Vec<i32> = self
            .range(position)
            .filter(|&entry| self.labels[entry] >= 0 && agrees(self.normals[entry]))
            .map(|entry| self.labels[entry])
            .collect();
        labels.sort_unstable();
        let runs = labels.chunk_by(|a, b| a == b);
        let most = runs.reduce(|best, run| if run.len() > best.len() { run } else { best });
        most.and_then(|run| run.first().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Surface;

    /// Three triangles around the origin, of which one looks up.
    const VERTICES: [Point; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const TRIANGLES: [[u32; 3]; 3] = [[0, 1, 2], [0, 2, 3], [0, 3, 1]];

    #[track_caller]
    fn check(labels: [i32; 3], normal: Option<Point>, expected: Option<i32>) {
        let surface = Surface::new(&VERTICES, &TRIANGLES).unwrap();
        let labeled = LabeledSurface::new(surface, &labels).unwrap();
        let nearest = NearestVertex::new(&labeled);
        let query = Query {
            position: [0.1, 0.1, 0.1],
            normal,
        };
        let limits = match normal {
            Some(_) => Limits::NONE.with_normals_within(30.0),
            None => Limits::NONE,
        };
        assert_eq!(nearest.label(&query, &limits), expected);
    }

    #[test]
    fn the_most_frequent_label_wins_and_the_lowest_in_a_tie() {
        check([5, 2, 5], None, Some(5));
        check([9, 4, 7], None, Some(4));
        check([-1, -1, 7], None, Some(7));
        check([-1, -1, -1], None, None);
    }

    #[test]
    fn only_triangles_with_a_normal_that_agrees_count() {
        check([9, 4, 4], Some([0.0, 0.0, 1.0]), Some(9));
        check([9, 4, 4], Some([0.0, 0.0, -1.0]), None);
    }
}

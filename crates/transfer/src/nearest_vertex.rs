//! Takes the label that most triangles at the nearest vertex have: channel `nn-vertex`.
//!
//! The paper uses this channel for its comparison at 10⁵ points ("nearest-neighbor query on mesh vertices"), with labels of
//! triangles. On a coarse mesh, most labels are lost, because a corner of a box has three faces but only one label: see the
//! crate's tests.

use crate::box_tree::{Bounds, BoxTree};
use crate::query::{Limits, Query, Start, normals_agree};
use crate::surface::LabeledSurface;
use partprobe_carrier::{IGNORE, Point, dot, subtract, unit_normal};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// A vertex with more triangles needs an allocation to count their labels.
const FEW_TRIANGLES: usize = 16;

/// A labeled surface that is prepared for searches of its nearest vertex.
///
/// Vertices at the same position count as one vertex.
#[derive(Clone, Debug)]
pub struct NearestVertex {
    tree: BoxTree,
    /// The positions in the order of the tree.
    positions: Vec<Point>,
    incident: Incident,
    /// The most frequent label at each position, counting all its triangles.
    majority: Vec<i32>,
}

/// The triangles at each position, in one list. Positions are in the order of the tree, so positions that are near in space are
/// near in memory.
#[derive(Clone, Debug)]
struct Incident {
    /// The index of the first triangle of each position in the list, and the length of the list at the end.
    starts: Vec<u32>,
    /// The normal and the label of each triangle at each position.
    normals: Vec<Point>,
    labels: Vec<i32>,
}

impl NearestVertex {
    /// Prepares a surface.
    #[must_use]
    pub fn new(labeled: &LabeledSurface<'_>) -> Self {
        let surface = labeled.surface();
        let (positions, position_of_vertex) = distinct_positions(surface.vertices());
        let bounds: Vec<Bounds> = positions
            .iter()
            .map(|&point| Bounds::around(&[point]))
            .collect();
        let tree = BoxTree::new(&bounds);

        let slot_of_position = tree.slots();
        let slot_of_vertex: Vec<u32> = position_of_vertex
            .iter()
            .map(|&position| slot_of_position[position as usize])
            .collect();
        let incident = Incident::new(labeled, positions.len(), &slot_of_vertex);
        let majority = (0..positions.len())
            .into_par_iter()
            .map(|slot| incident.majority(slot, |_| true).unwrap_or(IGNORE))
            .collect();
        Self {
            positions: tree.arranged(&positions),
            tree,
            incident,
            majority,
        }
    }

    /// The label that most triangles at the nearest vertex have. If several labels are equally frequent, the lowest one is
    /// returned. With a limit on angles, only triangles whose normals agree count, and vertices without such a triangle are
    /// skipped.
    ///
    /// Returns `None` if no vertex is within the limits, or no triangle at the vertex has a label.
    #[must_use]
    pub fn label(&self, query: &Query, limits: &Limits) -> Option<i32> {
        self.label_from(query, limits, &mut Start::default())
    }

    /// The same, but the search starts at the vertex that the previous search found.
    pub(crate) fn label_from(
        &self,
        query: &Query,
        limits: &Limits,
        start: &mut Start,
    ) -> Option<i32> {
        let min_cosine = limits.min_cosine();
        let agrees = |normal: Point| normals_agree(query, normal, min_cosine);
        let squared_distance = |slot: usize, _| {
            let counts = min_cosine.is_none() || self.incident.has_normal(slot, agrees);
            counts.then(|| {
                let apart = subtract(query.position, self.positions[slot]);
                dot(apart, apart)
            })
        };
        let max_squared = limits.max_distance * limits.max_distance;
        let found = self
            .tree
            .nearest(query.position, max_squared, start.0, squared_distance)?;
        start.0 = Some(found.slot);
        let slot = found.slot as usize;

        let label = if min_cosine.is_some() {
            self.incident.majority(slot, agrees)
        } else {
            Some(self.majority[slot])
        };
        label.filter(|&label| label >= 0)
    }
}

/// The distinct positions, and the index of each vertex's position.
fn distinct_positions(vertices: &[Point]) -> (Vec<Point>, Vec<u32>) {
    let mut index_of_bits: HashMap<[u64; 3], u32> = HashMap::with_capacity(vertices.len());
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
    /// The triangles at each of `n_positions` positions. `slot_of_vertex` is the index of each vertex's position.
    fn new(labeled: &LabeledSurface<'_>, n_positions: usize, slot_of_vertex: &[u32]) -> Self {
        let surface = labeled.surface();
        let mut starts = vec![0u32; n_positions + 1];
        for corners in surface.triangles() {
            for slot in slots_of(corners, slot_of_vertex) {
                starts[slot + 1] += 1;
            }
        }
        for slot in 0..n_positions {
            starts[slot + 1] += starts[slot];
        }

        let n_incident = starts[n_positions] as usize;
        let mut normals = vec![[0.0; 3]; n_incident];
        let mut labels = vec![IGNORE; n_incident];
        let mut ends = starts.clone();
        for (triangle, corners) in surface.triangles().iter().enumerate() {
            let normal = unit_normal(surface.corners(triangle));
            for slot in slots_of(corners, slot_of_vertex) {
                let end = ends[slot] as usize;
                normals[end] = normal;
                labels[end] = labeled.labels()[triangle];
                ends[slot] += 1;
            }
        }
        Self {
            starts,
            normals,
            labels,
        }
    }

    fn range(&self, slot: usize) -> Range<usize> {
        self.starts[slot] as usize..self.starts[slot + 1] as usize
    }

    fn has_normal(&self, slot: usize, agrees: impl Fn(Point) -> bool) -> bool {
        self.normals[self.range(slot)].iter().copied().any(agrees)
    }

    /// The most frequent label among the triangles that agree, or the lowest of several equally frequent ones. Triangles without
    /// a label do not count.
    fn majority(&self, slot: usize, agrees: impl Fn(Point) -> bool) -> Option<i32> {
        let labels = self.labels[self.range(slot)].iter();
        let normals = self.normals[self.range(slot)].iter();
        let counting = labels
            .zip(normals)
            .filter(|&(&label, &normal)| label >= 0 && agrees(normal))
            .map(|(&label, _)| label);

        // Hardly any vertex has so many triangles that an allocation is needed.
        let mut few = [0; FEW_TRIANGLES];
        let mut many = Vec::new();
        let counted = if self.range(slot).len() <= FEW_TRIANGLES {
            let mut n = 0;
            for label in counting {
                few[n] = label;
                n += 1;
            }
            &mut few[..n]
        } else {
            many.extend(counting);
            &mut many[..]
        };
        counted.sort_unstable();
        let runs = counted.chunk_by(|a, b| a == b);
        let most = runs.reduce(|best, run| if run.len() > best.len() { run } else { best });
        most.and_then(|run| run.first().copied())
    }
}

/// The distinct slots of a triangle's corners. A needle may have the same position twice, but counts only once there.
fn slots_of(corners: &[u32; 3], slot_of_vertex: &[u32]) -> impl Iterator<Item = usize> {
    let [a, b, c] = corners.map(|vertex| slot_of_vertex[vertex as usize] as usize);
    let second = (b != a).then_some(b);
    let third = (c != a && c != b).then_some(c);
    [Some(a), second, third].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Surface;

    /// Three triangles around the origin. One of them faces up.
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

//! Finds vertices of a face's boundary that are nearer to another of its curves than that curve's chord is, and divides that
//! curve next to them.
//!
//! The two circles of a ring that is thinner than the sag of their chords must be divided at the same angles. Otherwise a
//! triangle between a vertex of one circle and a chord of the other would be as high as the sag, whatever the ring's width.

use super::contacts::{AT_END, Division, foot_on};
use super::triangulated::Triangulated;
use crate::model::BrepEdge;
use partprobe_shape::{Point, cross, distance, norm, subtract};

/// Sides of a boundary beyond which nothing is looked for.
const MOST_SIDES: usize = 20_000;
/// A chord that sags by less than this fraction of the chord tolerance is straight.
const STRAIGHT: f64 = 1e-6;

/// The divisions that bring the chords of neighboring curves together; `chord` is the shape's chord tolerance, in millimeters.
pub(crate) fn near_chords(mesh: &Triangulated, edges: &[BrepEdge], chord: f64) -> Vec<Division> {
    if mesh.sides.len() > MOST_SIDES {
        return Vec::new();
    }
    let mut nodes: Vec<(Point, u32)> = mesh
        .sides
        .iter()
        .map(|side| (mesh.nodes[side.from].point, side.segment.edge))
        .collect();
    nodes.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    let mut divisions = Vec::new();
    for side in &mesh.sides {
        let Some(edge) = edges.get(side.segment.edge as usize) else {
            continue;
        };
        let [a, b] = [side.from, side.to].map(|node| mesh.nodes[node].point);
        let tip = edge
            .curve
            .point(0.5 * (side.segment.from + side.segment.to));
        let sag = distance(tip, [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis])));
        if sag <= STRAIGHT * chord {
            continue;
        }
        let low = [0, 1, 2].map(|axis| a[axis].min(b[axis]).min(tip[axis]) - sag);
        let high = [0, 1, 2].map(|axis| a[axis].max(b[axis]).max(tip[axis]) + sag);
        let first = nodes.partition_point(|(point, _)| point[0] < low[0]);
        let within = nodes[first..]
            .iter()
            .take_while(|(point, _)| point[0] <= high[0]);
        let is_other = |(point, other): &&(Point, u32)| {
            *other != side.segment.edge
                && *point != a
                && *point != b
                && (1..3).all(|axis| point[axis] >= low[axis] && point[axis] <= high[axis])
        };
        for &(vertex, _) in within.filter(is_other) {
            let foot = foot_on(edge, side.segment, vertex);
            let foot_point = edge.curve.point(foot.parameter);
            let is_end = [a, b]
                .into_iter()
                .any(|end| distance(end, foot_point) <= AT_END * chord);
            if !is_end && distance(vertex, foot_point) < from_chord(foot_point, a, b) {
                divisions.push(foot);
            }
        }
    }
    divisions
}

/// How far a point lies from the line through two others.
fn from_chord(point: Point, a: Point, b: Point) -> f64 {
    let along = subtract(b, a);
    norm(cross(subtract(point, a), along)) / norm(along)
}

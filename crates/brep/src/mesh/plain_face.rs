//! Triangulates a laid-out face if its boundary is plain, and adds the points inside that its surface needs.

use super::grid::{candidates, pole_node};
use super::layout::Layout;
use super::plain::PlainFace;
use super::triangulated::{ChartTriangulation, Node, boundary_sides, without_tiny_coordinates};
use crate::geometry::Surface;

/// Triangulates a face whose boundary is plain. `nodes` are the nodes of the boundary.
pub(super) fn plain_triangulation(
    surface: &Surface,
    layout: &Layout,
    nodes: &[Node],
) -> Option<ChartTriangulation> {
    let lengths: Vec<usize> = layout
        .loops
        .iter()
        .map(|bound| bound.corners.len())
        .collect();
    let points: Vec<[f64; 2]> = nodes
        .iter()
        .map(|node| without_tiny_coordinates(node.x))
        .collect();
    let mut face = PlainFace::new(&points, &lengths)?;
    let mut nodes = nodes.to_vec();
    let n_bounding = nodes.len();
    if !matches!(surface, Surface::Plane(_)) {
        for node in inner_nodes(surface, layout, &face) {
            face.insert(without_tiny_coordinates(node.x))?;
            nodes.push(node);
        }
    }
    let of_walk = |(bound, &hand)| std::iter::repeat_n(hand, Vec::len(bound));
    let corners = layout.loops.iter().map(|bound| &bound.corners);
    let hands: Vec<f64> = corners.zip(&face.hands).flat_map(of_walk).collect();
    let sides = boundary_sides(layout, |from, _| hands[from]);
    let triangles = face.triangles().to_vec();
    Some(ChartTriangulation {
        nodes,
        n_bounding,
        triangles,
        sides,
        has_crossings: false,
        is_ragged: false,
    })
}

/// The vertices inside the face, as dense as the surface needs, away from the boundary.
fn inner_nodes(surface: &Surface, layout: &Layout, face: &PlainFace) -> Vec<Node> {
    let mut nodes: Vec<Node> = pole_node(surface, layout).into_iter().collect();
    let candidates = candidates(layout);
    if candidates.is_empty() {
        return nodes;
    }
    let points: Vec<[f64; 2]> = candidates
        .iter()
        .map(|candidate| without_tiny_coordinates(candidate.x))
        .collect();
    for (candidate, holder) in candidates.iter().zip(face.holders(&points)) {
        if holder.is_some_and(|holder| !candidate.is_crowded(holder.corners, holder.is_bounding)) {
            nodes.push(candidate.node(surface));
        }
    }
    nodes
}

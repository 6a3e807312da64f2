//! Triangulates a laid-out face: a constrained Delaunay triangulation of its boundary and of the points inside that its surface
//! needs.
//!
//! Plain boundaries are left to `plain`. The crate `spade` triangulates the others. The even–odd rule decides which triangles are
//! inside. Boundaries that cross are not an error: sides that cannot be kept are left out, and `has_crossings` is set.

use super::bands::Bands;
use super::grid::{Candidate, candidates, pole_node};
use super::layout::Layout;
use super::plain_face::plain_triangulation;
use super::triangulated::{ChartTriangulation, Node, boundary_sides, without_tiny_coordinates};
use super::unwrap::{UvLoop, UvPoint};
use crate::geometry::Surface;
use spade::handles::{
    DirectedEdgeHandle, FaceHandle, FixedFaceHandle, FixedVertexHandle, InnerTag,
};
use spade::{
    CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Point2, PositionInTriangulation,
    Triangulation,
};

#[derive(Clone, Copy)]
struct ChartVertex {
    position: Point2<f64>,
    node: u32,
}

impl HasPosition for ChartVertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Whether the boundary runs along an edge an odd number of times.
type IsOdd = bool;

type Cdt = ConstrainedDelaunayTriangulation<ChartVertex, (), IsOdd>;

type ChartEdge<'a> = DirectedEdgeHandle<'a, ChartVertex, (), CdtEdge<IsOdd>, ()>;

/// Triangulates a face. Returns `None` if a coordinate of the chart is not finite.
pub(crate) fn triangulate(surface: &Surface, layout: &Layout) -> Option<ChartTriangulation> {
    let nodes = boundary_nodes(layout);
    if let Some((triangles, hand)) = convex(surface, layout, &nodes) {
        return Some(ChartTriangulation {
            n_bounding: nodes.len(),
            nodes,
            triangles,
            sides: boundary_sides(layout, |_, _| hand),
            ..ChartTriangulation::default()
        });
    }
    plain_triangulation(surface, layout, &nodes).or_else(|| constrained(surface, layout, nodes))
}

/// The constrained Delaunay triangulation of the boundary's nodes and of the nodes that the surface needs inside.
fn constrained(
    surface: &Surface,
    layout: &Layout,
    mut nodes: Vec<Node>,
) -> Option<ChartTriangulation> {
    let n_bounding = nodes.len();
    let mut cdt = Cdt::new();
    let handles = insert_boundary(&mut cdt, &nodes, layout)?;
    let has_crossings = constrain(&mut cdt, layout, &handles);
    let polygons = polygons(layout);
    if !matches!(surface, Surface::Plane(_)) {
        let inside = inside_flags(&cdt, &polygons, has_crossings);
        for node in interior_nodes(surface, layout, &cdt, &inside) {
            let vertex = chart_vertex(node.x, nodes.len());
            nodes.push(node);
            cdt.insert(vertex).ok()?;
        }
    }
    let inside = inside_flags(&cdt, &polygons, has_crossings);
    let triangles = inner_triangles(&cdt, &inside);
    let sides = boundary_sides(layout, |from, to| {
        hand_of_face(&cdt, &inside, handles[from], handles[to])
    });
    let is_ragged = has_crossings || has_coinciding_nodes(&cdt, &nodes, &handles);
    Some(ChartTriangulation {
        nodes,
        n_bounding,
        triangles,
        sides,
        has_crossings,
        is_ragged,
    })
}

fn inner_triangles(cdt: &Cdt, inside: &[bool]) -> Vec<[u32; 3]> {
    cdt.inner_faces()
        .filter(|face| inside[face.fix().index()])
        .map(|face| face.vertices().map(|vertex| vertex.data().node))
        .collect()
}

/// On which side of a boundary side the face lies: 1 for left, -1 for right, 0 for both or neither.
fn hand_of_face(cdt: &Cdt, inside: &[bool], from: FixedVertexHandle, to: FixedVertexHandle) -> f64 {
    let Some(edge) = cdt.get_edge_from_neighbors(from, to) else {
        return 0.0;
    };
    let is_inside = |edge: ChartEdge<'_>| {
        let face = edge.face().as_inner().map(|face| face.fix().index());
        face.is_some_and(|face| inside[face])
    };
    f64::from(i8::from(is_inside(edge)) - i8::from(is_inside(edge.rev())))
}

/// Whether boundary nodes with different points in space have the same point in the chart.
fn has_coinciding_nodes(cdt: &Cdt, nodes: &[Node], handles: &[FixedVertexHandle]) -> bool {
    let kept = |handle: &FixedVertexHandle| nodes[cdt.vertex(*handle).data().node as usize].point;
    handles
        .iter()
        .zip(nodes)
        .any(|(handle, node)| kept(handle) != node.point)
}

fn boundary_nodes(layout: &Layout) -> Vec<Node> {
    let corners = layout.loops.iter().flat_map(|bound| &bound.corners);
    let node = |&UvPoint {
                    uv,
                    point,
                    tangents,
                    ..
                }: &UvPoint| Node {
        x: layout.chart.to_plane(uv),
        uv,
        point,
        tangents,
    };
    corners.map(node).collect()
}

/// The boundaries in the chart.
fn polygons(layout: &Layout) -> Vec<Vec<[f64; 2]>> {
    let polygon = |bound: &UvLoop| {
        bound
            .corners
            .iter()
            .map(|corner| layout.chart.to_plane(corner.uv))
            .collect()
    };
    layout.loops.iter().map(polygon).collect()
}

/// Triangulates a convex triangle or quadrilateral of a plane without a search. Most faces of machined parts are of this kind.
/// Returns the triangles, and on which side of its boundary the face lies.
fn convex(surface: &Surface, layout: &Layout, nodes: &[Node]) -> Option<(Vec<[u32; 3]>, f64)> {
    let n = nodes.len();
    if !matches!(surface, Surface::Plane(_)) || layout.loops.len() != 1 || !(3..=4).contains(&n) {
        return None;
    }
    let turn = |i: usize| turn_of(nodes[i].x, nodes[(i + 1) % n].x, nodes[(i + 2) % n].x);
    let hand = turn(0).signum();
    if !(0..n).all(|i| turn(i) * hand > 1e-9) {
        return None;
    }
    let fan = if n == 3 {
        vec![[0, 1, 2]]
    } else {
        vec![[0, 1, 2], [0, 2, 3]]
    };
    let oriented = |[a, b, c]: [u32; 3]| if hand > 0.0 { [a, b, c] } else { [a, c, b] };
    Some((fan.into_iter().map(oriented).collect(), hand))
}

fn turn_of(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
}

fn chart_vertex([x, y]: [f64; 2], node: usize) -> ChartVertex {
    let [x, y] = without_tiny_coordinates([x, y]);
    ChartVertex {
        position: Point2::new(x, y),
        node: node as u32,
    }
}

/// Inserts the boundary. If several nodes are at one point, the first one is kept.
///
/// Each loop is inserted from coarse to fine: every point halves a gap. In the order of the walk, each point on the second side
/// of a strip would flip all triangles of the first side, and the cost would grow with the square of the number of points.
fn insert_boundary(
    cdt: &mut Cdt,
    nodes: &[Node],
    layout: &Layout,
) -> Option<Vec<FixedVertexHandle>> {
    let mut handles = vec![FixedVertexHandle::from_index(0); nodes.len()];
    let mut owner: Vec<u32> = Vec::with_capacity(nodes.len());
    let mut first = 0;
    for bound in &layout.loops {
        for (i, before) in coarse_to_fine(bound.corners.len()) {
            let node = first + i;
            let vertex = chart_vertex(nodes[node].x, node);
            let hint = if i == 0 {
                first.checked_sub(1)
            } else {
                Some(first + before)
            };
            let handle = match hint {
                Some(hint) => cdt.insert_with_hint(vertex, handles[hint]),
                None => cdt.insert(vertex),
            }
            .ok()?;
            match owner.get_mut(handle.index()) {
                Some(owner) => {
                    *owner = (*owner).min(node as u32);
                    cdt.vertex_data_mut(handle).node = *owner;
                }
                None => owner.push(node as u32),
            }
            handles[node] = handle;
        }
        first += bound.corners.len();
    }
    Some(handles)
}

/// The numbers below `n`: 0, then the middle, then the quarters, and so on. Each comes with a smaller number that came before it.
fn coarse_to_fine(n: usize) -> impl Iterator<Item = (usize, usize)> {
    let strides = std::iter::successors(Some(n.next_power_of_two() / 2), |stride| Some(stride / 2));
    let odd = strides.take_while(|&stride| stride > 0);
    std::iter::once((0, 0)).chain(odd.flat_map(move |stride| {
        (stride..n)
            .step_by(2 * stride)
            .map(move |i| (i, i - stride))
    }))
}

/// Makes the boundary's sides edges of the triangulation. Returns whether this failed for some of them.
fn constrain(cdt: &mut Cdt, layout: &Layout, handles: &[FixedVertexHandle]) -> bool {
    let mut has_crossings = false;
    let mut first = 0;
    for bound in &layout.loops {
        let n = bound.corners.len();
        for i in 0..n {
            let (from, to) = (handles[first + i], handles[first + (i + 1) % n]);
            if from == to {
                continue;
            }
            // A side that runs through other vertices becomes several edges.
            let edges = cdt.try_add_constraint(from, to);
            has_crossings |= edges.is_empty();
            for edge in edges {
                let is_odd = cdt
                    .undirected_edge_data_mut(edge.as_undirected())
                    .data_mut();
                *is_odd = !*is_odd;
            }
        }
        first += n;
    }
    has_crossings
}

/// For each triangle, whether it belongs to the face.
///
/// The triangles are visited from outside. The answer changes at every side with an odd number of walks, so rounding has no
/// influence. If boundaries cross each other, some of their sides are missing, and each triangle is tested alone.
fn inside_flags(cdt: &Cdt, polygons: &[Vec<[f64; 2]>], has_crossings: bool) -> Vec<bool> {
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    if has_crossings {
        let bands = Bands::new(polygons);
        for face in cdt.inner_faces() {
            inside[face.fix().index()] = Some(bands.enclose(face.center().into()));
        }
        return inside.into_iter().map(|flag| flag == Some(true)).collect();
    }
    let mut open: Vec<FixedFaceHandle<InnerTag>> = Vec::new();
    for edge in cdt.convex_hull() {
        enter(edge, false, &mut inside, &mut open);
        enter(edge.rev(), false, &mut inside, &mut open);
    }
    while let Some(handle) = open.pop() {
        let here = inside[handle.index()] == Some(true);
        for edge in cdt.face(handle).adjacent_edges() {
            enter(edge.rev(), here, &mut inside, &mut open);
        }
    }
    inside.into_iter().map(|flag| flag == Some(true)).collect()
}

/// Decides whether the triangle behind an edge is inside. `from` says whether the triangle in front of the edge is inside.
fn enter(
    edge: ChartEdge<'_>,
    from: bool,
    inside: &mut [Option<bool>],
    open: &mut Vec<FixedFaceHandle<InnerTag>>,
) {
    let Some(neighbor) = edge.face().as_inner() else {
        return;
    };
    let flag = &mut inside[neighbor.fix().index()];
    if flag.is_none() {
        *flag = Some(from ^ *edge.as_undirected().data().data());
        open.push(neighbor.fix());
    }
}

/// The vertices inside the face. They form a grid that is as dense as the surface needs and keeps away from the boundary.
fn interior_nodes(surface: &Surface, layout: &Layout, cdt: &Cdt, inside: &[bool]) -> Vec<Node> {
    let mut nodes: Vec<Node> = pole_node(surface, layout).into_iter().collect();
    let mut hint = None;
    for candidate in candidates(layout) {
        let position = chart_vertex(candidate.x, 0).position;
        let found = hint.map_or_else(
            || cdt.locate(position),
            |hint| cdt.locate_with_hint(position, hint),
        );
        let PositionInTriangulation::OnFace(face) = found else {
            continue;
        };
        let face = cdt.face(face);
        hint = Some(face.vertices()[0].fix());
        if inside[face.fix().index()] && !is_crowded(&face, &candidate) {
            nodes.push(candidate.node(surface));
        }
    }
    nodes
}

/// Whether a boundary is so near that another vertex would only make slivers.
fn is_crowded(
    face: &FaceHandle<'_, InnerTag, ChartVertex, (), CdtEdge<IsOdd>, ()>,
    candidate: &Candidate,
) -> bool {
    let edges = face.adjacent_edges();
    let corners = edges.map(|edge| edge.from().position().into());
    candidate.is_crowded(corners, edges.map(|edge| edge.is_constraint_edge()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_levels_come_first_and_each_point_once() {
        assert_eq!(
            coarse_to_fine(6).map(|(i, _)| i).collect::<Vec<_>>(),
            [0, 4, 2, 1, 3, 5]
        );
        for n in 1..70 {
            let mut met = vec![false; n];
            for (i, before) in coarse_to_fine(n) {
                assert!(!met[i] && (i == 0 || met[before]), "{i} of {n}");
                met[i] = true;
            }
            assert!(met.iter().all(|&met| met), "{n}");
        }
    }
}

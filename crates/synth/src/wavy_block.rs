//! Builds a block whose top consists of one or more height-field patches in a row. Its walls are planar, and their upper
//! edges are splines.

use crate::frame::{Frame, Planar, unit};
use crate::geometry::{Curve, Surface};
use crate::patch::Patch;
use crate::shell::{Direction, Face, Loop, Ring, Shell, Walk};
use crate::spline;
use partprobe_carrier::{Point, cross, subtract};

/// Adds four planar walls, a bottom, and the patches in a row along x. Returns the bottom face.
pub(crate) fn add_wavy_block(shell: &mut Shell, patches: &[Patch]) -> usize {
    let (Some(first), Some(last)) = (patches.first(), patches.last()) else {
        return 0;
    };
    let frame = first.frame;
    let [low, high] = [first.low, last.high];
    let ground = [low, [high[0], low[1]], high, [low[0], high[1]]]
        .map(|p| shell.vertex(frame.point(p, 0.0)));
    let base = [0, 1, 2, 3].map(|i| shell.edge(ground[i], ground[(i + 1) % 4], Curve::Line));

    let tops = add_patches(shell, patches);
    let corners = tops.corners();
    let rails = [0, 1, 2, 3].map(|i| shell.edge(ground[i], corners[i], Curve::Line));
    for (i, top) in tops.walks().into_iter().enumerate() {
        let edges = [base[i], rails[(i + 1) % 4], rails[i]];
        add_wall(shell, &frame, edges, top, area_of_wall(patches, i));
    }

    for patch in patches {
        let [width, depth] = size(patch);
        shell.volume += patch.mean_height() * width * depth;
    }
    let ring = Ring {
        corners: ground.to_vec(),
        edges: base.to_vec(),
        area: (high[0] - low[0]) * (high[1] - low[1]),
    };
    shell.cap(&frame.flipped(), &ring, Direction::Backward)
}

/// An upper edge with its vertices.
struct TopEdge {
    start: usize,
    end: usize,
    edge: usize,
}

/// The upper edges of the block: those at the front and back, which run along x, and those of the two sides.
struct Tops {
    front: Vec<TopEdge>,
    back: Vec<TopEdge>,
    sides: [usize; 2],
}

impl Tops {
    /// The vertices above the corners of the ground, counterclockwise from the low corner.
    fn corners(&self) -> [usize; 4] {
        let n = self.front.len();
        [
            self.front[0].start,
            self.front[n - 1].end,
            self.back[n - 1].end,
            self.back[0].start,
        ]
    }

    /// The upper edges of the front, right, back and left wall, in the direction in which each wall walks them.
    fn walks(&self) -> [Vec<Walk>; 4] {
        let front = self.front.iter().rev().map(|top| walk(top.edge, false));
        let back = self.back.iter().map(|top| walk(top.edge, true));
        [
            front.collect(),
            vec![walk(self.sides[1], false)],
            back.collect(),
            vec![walk(self.sides[0], true)],
        ]
    }
}

fn walk(edge: usize, forward: bool) -> Walk {
    Walk { edge, forward }
}

/// An edge across the block, where a patch starts or ends, with its vertices at the front and at the back.
#[derive(Clone, Copy)]
struct CrossEdge {
    front: usize,
    back: usize,
    edge: usize,
}

fn add_patches(shell: &mut Shell, patches: &[Patch]) -> Tops {
    let first_row = patches[0].controls()[0].clone();
    let first = add_cross_edge(shell, first_row);
    let mut tops = Tops {
        front: Vec::new(),
        back: Vec::new(),
        sides: [first.edge; 2],
    };
    let mut before = first;
    for patch in patches {
        before = add_patch(shell, &mut tops, patch, before);
    }
    tops.sides[1] = before.edge;
    tops
}

/// Adds the edge with these control points, from front to back.
fn add_cross_edge(shell: &mut Shell, controls: Vec<Point>) -> CrossEdge {
    let front = shell.vertex(controls[0]);
    let back = shell.vertex(controls[controls.len() - 1]);
    let edge = shell.edge(front, back, Curve::Spline(controls));
    CrossEdge { front, back, edge }
}

/// Adds the face of a patch that starts at the edge `before`. Returns the edge at which it ends.
fn add_patch(shell: &mut Shell, tops: &mut Tops, patch: &Patch, before: CrossEdge) -> CrossEdge {
    let controls = patch.controls();
    let last_row = controls[controls.len() - 1].clone();
    let n_columns = last_row.len();
    let column = |j: usize| Curve::Spline(controls.iter().map(|row| row[j]).collect());

    let front = shell.vertex(last_row[0]);
    let back = shell.vertex(last_row[n_columns - 1]);
    let front_edge = shell.edge(before.front, front, column(0));
    let back_edge = shell.edge(before.back, back, column(n_columns - 1));
    let edge = shell.edge(front, back, Curve::Spline(last_row));

    let walks = vec![
        walk(front_edge, true),
        walk(edge, true),
        walk(back_edge, false),
        walk(before.edge, false),
    ];
    shell.face(Face {
        surface: Surface::Patch(patch.clone()),
        same_sense: true,
        loops: vec![Loop::Edges(walks)],
        area: None,
    });
    tops.front.push(TopEdge {
        start: before.front,
        end: front,
        edge: front_edge,
    });
    tops.back.push(TopEdge {
        start: before.back,
        end: back,
        edge: back_edge,
    });
    CrossEdge { front, back, edge }
}

/// Adds a wall over one side of the ground. Its upper edge consists of splines.
fn add_wall(
    shell: &mut Shell,
    frame: &Frame,
    [base, next_rail, rail]: [usize; 3],
    top: Vec<Walk>,
    area: f64,
) {
    let edge = &shell.edges[base];
    let start = shell.vertices[edge.start];
    let end = shell.vertices[edge.end];
    let along = unit(subtract(end, start));
    let plane = Frame::new(start, cross(along, frame.z), along);

    let mut walks = vec![walk(base, true), walk(next_rail, true)];
    walks.extend(top);
    walks.push(walk(rail, false));
    shell.face(Face {
        surface: Surface::Plane(plane),
        same_sense: true,
        loops: vec![Loop::Edges(walks)],
        area: Some(area),
    });
}

/// The area of the front (0), right (1), back (2) or left (3) wall.
fn area_of_wall(patches: &[Patch], wall: usize) -> f64 {
    let first = &patches[0];
    let last = &patches[patches.len() - 1];
    match wall {
        0 => patches.iter().map(|patch| area_along_x(patch, 0)).sum(),
        1 => size(last)[1] * mean_height(&last.heights[last.heights.len() - 1]),
        2 => {
            let n_columns = |patch: &Patch| patch.heights[0].len();
            patches
                .iter()
                .map(|patch| area_along_x(patch, n_columns(patch) - 1))
                .sum()
        }
        _ => size(first)[1] * mean_height(&first.heights[0]),
    }
}

/// The area below the boundary curve that has column `j` of the patch's control heights.
fn area_along_x(patch: &Patch, j: usize) -> f64 {
    let heights: Vec<f64> = patch.heights.iter().map(|row| row[j]).collect();
    size(patch)[0] * mean_height(&heights)
}

/// The mean height of a spline with these control heights.
fn mean_height(heights: &[f64]) -> f64 {
    heights
        .iter()
        .zip(spline::basis_integrals(heights.len()))
        .map(|(height, weight)| height * weight)
        .sum()
}

fn size(patch: &Patch) -> Planar {
    [patch.high[0] - patch.low[0], patch.high[1] - patch.low[1]]
}

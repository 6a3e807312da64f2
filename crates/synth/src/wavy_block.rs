//! A block whose top is one or more height-field patches side by side: planar walls with splines for upper edges.

use crate::frame::{Frame, Planar};
use crate::geometry::{Curve, Surface};
use crate::patch::Patch;
use crate::shell::{Direction, Face, Loop, Ring, Shell, Walk};
use crate::spline;

/// Builds four planar walls, a bottom, and the patches side by side along x; gives the bottom face.
pub(crate) fn add_wavy_block(shell: &mut Shell, patches: &[Patch]) -> usize {
    let (Some(first), Some(last)) = (patches.first(), patches.last()) else {
        return 0;
    };
    let (frame, low, high) = (first.frame, first.low, last.high);
    let ground = [low, [high[0], low[1]], high, [low[0], high[1]]]
        .map(|p| shell.vertex(frame.point(p, 0.0)));
    let base: Vec<usize> = (0..4)
        .map(|i| shell.edge(ground[i], ground[(i + 1) % 4], Curve::Line))
        .collect();
    let tops = add_patches(shell, patches);
    let (front, back) = (&tops.front, &tops.back);
    let n = front.len();
    let corners = [
        front[0].start,
        front[n - 1].end,
        back[n - 1].end,
        back[0].start,
    ];
    let rails: Vec<usize> = (0..4)
        .map(|i| shell.edge(ground[i], corners[i], Curve::Line))
        .collect();
    let backward = |edges: Vec<usize>| {
        edges
            .into_iter()
            .map(|edge| Walk {
                edge,
                forward: false,
            })
            .collect()
    };
    let forward = |edges: Vec<usize>| {
        edges
            .into_iter()
            .map(|edge| Walk {
                edge,
                forward: true,
            })
            .collect()
    };
    let walls: [Vec<Walk>; 4] = [
        backward(tops.front.iter().rev().map(|top| top.edge).collect()),
        backward(vec![tops.sides[1]]),
        forward(tops.back.iter().map(|top| top.edge).collect()),
        forward(vec![tops.sides[0]]),
    ];
    for (i, top) in walls.into_iter().enumerate() {
        add_wall(
            shell,
            &frame,
            [base[i], rails[(i + 1) % 4], rails[i]],
            top,
            areas_of_wall(patches, i),
        );
    }
    let ring = Ring {
        corners: ground.to_vec(),
        edges: base,
        area: (high[0] - low[0]) * (high[1] - low[1]),
    };
    for patch in patches {
        shell.volume +=
            patch.mean_height() * (patch.high[0] - patch.low[0]) * (patch.high[1] - patch.low[1]);
    }
    shell.cap(&frame.flipped(), &ring, Direction::Backward)
}

/// An upper edge with its vertices.
struct TopEdge {
    start: usize,
    end: usize,
    edge: usize,
}

/// The upper edges of the block: those along front and back, which run along x, and the two sides.
struct Tops {
    front: Vec<TopEdge>,
    back: Vec<TopEdge>,
    sides: [usize; 2],
}

fn add_patches(shell: &mut Shell, patches: &[Patch]) -> Tops {
    let (mut front, mut back) = (Vec::new(), Vec::new());
    let controls = patches[0].controls();
    let (mut low, mut high) = (
        shell.vertex(controls[0][0]),
        shell.vertex(controls[0][controls[0].len() - 1]),
    );
    let first_side = shell.edge(low, high, Curve::Spline(controls[0].clone()));
    let mut side = first_side;
    for patch in patches {
        let controls = patch.controls();
        let end = controls[controls.len() - 1].clone();
        let (next_low, next_high) = (shell.vertex(end[0]), shell.vertex(end[end.len() - 1]));
        let along = |j: usize| Curve::Spline(controls.iter().map(|row| row[j]).collect());
        let front_edge = shell.edge(low, next_low, along(0));
        let back_edge = shell.edge(high, next_high, along(end.len() - 1));
        let next_side = shell.edge(next_low, next_high, Curve::Spline(end));
        let walk = |edge, forward| Walk { edge, forward };
        let walks = vec![
            walk(front_edge, true),
            walk(next_side, true),
            walk(back_edge, false),
            walk(side, false),
        ];
        let surface = Surface::Patch(patch.clone());
        shell.face(Face {
            surface,
            same_sense: true,
            loops: vec![Loop::Edges(walks)],
            area: None,
        });
        front.push(TopEdge {
            start: low,
            end: next_low,
            edge: front_edge,
        });
        back.push(TopEdge {
            start: high,
            end: next_high,
            edge: back_edge,
        });
        (low, high, side) = (next_low, next_high, next_side);
    }
    Tops {
        front,
        back,
        sides: [first_side, side],
    }
}

/// A wall over one side of the ground, with a spline for its upper edge.
fn add_wall(
    shell: &mut Shell,
    frame: &Frame,
    [base, next_rail, rail]: [usize; 3],
    top: Vec<Walk>,
    area: f64,
) {
    let edge = &shell.edges[base];
    let (start, end) = (shell.vertices[edge.start], shell.vertices[edge.end]);
    let along = crate::frame::unit(partprobe_carrier::subtract(end, start));
    let plane = Frame::new(start, partprobe_carrier::cross(along, frame.z), along);
    let walk = |edge, forward| Walk { edge, forward };
    let walks = [walk(base, true), walk(next_rail, true)]
        .into_iter()
        .chain(top)
        .chain([walk(rail, false)]);
    let loops = vec![Loop::Edges(walks.collect())];
    shell.face(Face {
        surface: Surface::Plane(plane),
        same_sense: true,
        loops,
        area: Some(area),
    });
}

/// The area of the wall in front, on the right, at the back or on the left.
fn areas_of_wall(patches: &[Patch], wall: usize) -> f64 {
    let mean = |heights: &[f64]| {
        heights
            .iter()
            .zip(spline::basis_integrals(heights.len()))
            .map(|(height, weight)| height * weight)
            .sum::<f64>()
    };
    let size =
        |patch: &Patch| -> Planar { [patch.high[0] - patch.low[0], patch.high[1] - patch.low[1]] };
    let row =
        |patch: &Patch, j: usize| patch.heights.iter().map(|row| row[j]).collect::<Vec<f64>>();
    let (first, last) = (&patches[0], &patches[patches.len() - 1]);
    match wall {
        0 => patches
            .iter()
            .map(|patch| size(patch)[0] * mean(&row(patch, 0)))
            .sum(),
        1 => size(last)[1] * mean(&last.heights[last.heights.len() - 1]),
        2 => patches
            .iter()
            .map(|patch| size(patch)[0] * mean(&row(patch, patch.heights[0].len() - 1)))
            .sum(),
        _ => size(first)[1] * mean(&first.heights[0]),
    }
}

//! Parts with gently bent tops: facets at shallow angles, and B-spline surfaces.

use super::plates::furnish;
use crate::draft::{Draft, Host, cells};
use crate::feature::{Feature, Rim, draw_hole};
use crate::frame::{Frame, Planar};
use crate::geometry::{Curve, Surface};
use crate::outline::Outline;
use crate::patch::Patch;
use crate::path::Path;
use crate::shell::{Direction, Face, Loop, Ring, Shell, Walk};
use crate::spline;

/// A bar whose top is a chain of facets: some meet at angles below the threshold, some above it.
pub(super) fn dome(draft: &mut Draft) {
    let n_facets = draft.count(2, 9);
    let (width, base) = (draft.length(15.0, 60.0), draft.length(6.0, 15.0));
    let mut slope = draft.fraction(0.1, 0.6);
    let (mut x, mut y) = (0.0, base);
    let mut corners = vec![[0.0, 0.0], [0.0, base]];
    for _ in 0..n_facets {
        let run = draft.length(5.0, 15.0);
        (x, y) = (x + run * libm::cos(slope), (y + run * libm::sin(slope)).max(2.0));
        corners.push([x, y]);
        // Bends of 3° to 7° join facets, bends of 11° to 30° part them.
        let bend = if draft.chance(0.5) { draft.fraction(3.0, 7.0) } else { draft.fraction(11.0, 30.0) };
        slope = (slope - bend.to_radians()).max(-0.9);
    }
    corners.push([x, 0.0]);
    corners.reverse();
    let outline = Outline::polygon(corners);
    let plane = draft.plane;
    let lean = draft.fraction(0.05, 0.12) * width.min(base) * 0.5;
    let path = match draft.chance(0.3) {
        true => Path::at(0.0).by(0.0, 0.6 * width).by(-lean, 0.4 * width),
        false => Path::at(0.0).by(0.0, width),
    };
    let block = draft.block(&plane, &outline, &path);
    let Some(top) = block.top_host(&plane) else { return };
    if draft.wanted() > 2 {
        // Near the end wall the bar is at least as high as 2 mm; the first corner region is the base.
        let host = Host { plane: top.plane, depth: 0.4 * width, through: None, ..top };
        let hole = draw_hole(draft, &host, 0.2 * base);
        hole.place(&mut draft.shell, &host, [0.55 * base, 0.5 * base]);
    }
}

/// A block with a wavy top of one or two B-spline surfaces, and features on its bottom.
pub(super) fn wave(draft: &mut Draft) {
    let (width, depth, height) = (draft.length(30.0, 90.0), draft.length(25.0, 70.0), draft.length(12.0, 35.0));
    let two = draft.chance(0.5);
    let middle = if two { draft.fraction(0.35, 0.65) * width } else { width };
    let frame = draft.plane;
    let heights = draw_heights(draft, height);
    let first = Patch { frame, low: [0.0; 2], high: [middle, depth], heights };
    let patches = match two {
        true => {
            let second = continued(draft, &first, width);
            vec![first, second]
        }
        false => vec![first],
    };
    let bottom = add_wavy_block(&mut draft.shell, &patches);
    // The bottom's y axis runs against the block's.
    let host = Host { plane: frame.flipped(), face: bottom, depth: 0.45 * height, through: None };
    let margin = 0.1 * width.min(depth);
    if draft.chance(0.5) {
        let (centers, room) = cells([margin, margin - depth], [width - margin, -margin], [2, draft.count(1, 2)]);
        let foot = Feature::boss(&draft.round(0.5 * room), draft.length(2.0, 8.0), Rim::Sharp, 0.0);
        for center in centers {
            foot.place(&mut draft.shell, &host, center);
        }
    } else {
        furnish(draft, &host, [margin, margin - depth], [width - margin, -margin]);
    }
}

fn draw_heights(draft: &mut Draft, height: f64) -> Vec<Vec<f64>> {
    let (nx, ny) = (draft.count(4, 6), draft.count(4, 6));
    (0..nx).map(|_| (0..ny).map(|_| height * draft.fraction(0.7, 1.3)).collect()).collect()
}

/// A neighbour that shares the first patch's last row, either smoothly or with a crease.
fn continued(draft: &mut Draft, first: &Patch, width: f64) -> Patch {
    let n = first.heights.len();
    let (edge, before) = (&first.heights[n - 1], &first.heights[n - 2]);
    let span = |patch_width: f64, n: usize| patch_width * (spline::greville(n)[1] - spline::greville(n)[0]);
    let ratio = span(width - first.high[0], 4) / span(first.high[0] - first.low[0], n);
    let crease = if draft.chance(0.5) { 0.0 } else { draft.fraction(0.3, 0.8) * ratio };
    let mean = edge.iter().sum::<f64>() / edge.len() as f64;
    // The second row continues the slope across the border; a crease bends it by the same amount everywhere.
    let second: Vec<f64> = edge
        .iter()
        .zip(before)
        .map(|(at, before)| (at + ratio * (at - before) + crease * 0.3 * mean).clamp(0.3 * mean, 2.0 * mean))
        .collect();
    let mut row = || edge.iter().map(|_| mean * draft.fraction(0.7, 1.3)).collect();
    let heights = vec![edge.clone(), second, row(), row()];
    Patch { frame: first.frame, low: [first.high[0], first.low[1]], high: [width, first.high[1]], heights }
}

/// Builds four planar walls, a bottom, and the patches side by side along x; gives the bottom face.
pub(crate) fn add_wavy_block(shell: &mut Shell, patches: &[Patch]) -> usize {
    let (Some(first), Some(last)) = (patches.first(), patches.last()) else { return 0 };
    let (frame, low, high) = (first.frame, first.low, last.high);
    let ground = [low, [high[0], low[1]], high, [low[0], high[1]]].map(|p| shell.vertex(frame.point(p, 0.0)));
    let base: Vec<usize> = (0..4).map(|i| shell.edge(ground[i], ground[(i + 1) % 4], Curve::Line)).collect();
    let tops = add_patches(shell, patches);
    let corners =
        [tops.front[0].0, tops.front[tops.front.len() - 1].1, tops.back[tops.back.len() - 1].1, tops.back[0].0];
    let rails: Vec<usize> = (0..4).map(|i| shell.edge(ground[i], corners[i], Curve::Line)).collect();
    let backward = |edges: Vec<usize>| edges.into_iter().map(|edge| Walk { edge, forward: false }).collect();
    let forward = |edges: Vec<usize>| edges.into_iter().map(|edge| Walk { edge, forward: true }).collect();
    let walls: [Vec<Walk>; 4] = [
        backward(tops.front.iter().rev().map(|top| top.2).collect()),
        backward(vec![tops.sides[1]]),
        forward(tops.back.iter().map(|top| top.2).collect()),
        forward(vec![tops.sides[0]]),
    ];
    for (i, top) in walls.into_iter().enumerate() {
        add_wall(shell, &frame, [base[i], rails[(i + 1) % 4], rails[i]], top, areas_of_wall(patches, i));
    }
    let ring = Ring { corners: ground.to_vec(), edges: base, area: (high[0] - low[0]) * (high[1] - low[1]) };
    for patch in patches {
        shell.volume += patch.mean_height() * (patch.high[0] - patch.low[0]) * (patch.high[1] - patch.low[1]);
    }
    shell.cap(&frame.flipped(), &ring, Direction::Backward)
}

/// The upper edges of the block: start, end and edge of each along front and back, and the two sides.
struct Tops {
    front: Vec<(usize, usize, usize)>,
    back: Vec<(usize, usize, usize)>,
    sides: [usize; 2],
}

fn add_patches(shell: &mut Shell, patches: &[Patch]) -> Tops {
    let (mut front, mut back): (Vec<(usize, usize, usize)>, Vec<(usize, usize, usize)>) = (Vec::new(), Vec::new());
    let controls = patches[0].controls();
    let (mut low, mut high) = (shell.vertex(controls[0][0]), shell.vertex(controls[0][controls[0].len() - 1]));
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
        let walks = vec![walk(front_edge, true), walk(next_side, true), walk(back_edge, false), walk(side, false)];
        let surface = Surface::Patch(patch.clone());
        shell.face(Face { surface, same_sense: true, loops: vec![Loop::Edges(walks)], area: None });
        front.push((low, next_low, front_edge));
        back.push((high, next_high, back_edge));
        (low, high, side) = (next_low, next_high, next_side);
    }
    Tops { front, back, sides: [first_side, side] }
}

/// A wall over one side of the ground, with a spline for its upper edge.
fn add_wall(shell: &mut Shell, frame: &Frame, [base, next_rail, rail]: [usize; 3], top: Vec<Walk>, area: f64) {
    let edge = &shell.edges[base];
    let (start, end) = (shell.vertices[edge.start], shell.vertices[edge.end]);
    let along = crate::frame::unit(carrier::subtract(end, start));
    let plane = Frame::new(start, carrier::cross(along, frame.z), along);
    let walk = |edge, forward| Walk { edge, forward };
    let walks = [walk(base, true), walk(next_rail, true)].into_iter().chain(top).chain([walk(rail, false)]);
    let loops = vec![Loop::Edges(walks.collect())];
    shell.face(Face { surface: Surface::Plane(plane), same_sense: true, loops, area: Some(area) });
}

/// The area of the wall in front, on the right, at the back or on the left.
fn areas_of_wall(patches: &[Patch], wall: usize) -> f64 {
    let mean = |heights: &[f64]| {
        heights.iter().zip(spline::basis_integrals(heights.len())).map(|(height, weight)| height * weight).sum::<f64>()
    };
    let size = |patch: &Patch| -> Planar { [patch.high[0] - patch.low[0], patch.high[1] - patch.low[1]] };
    let row = |patch: &Patch, j: usize| patch.heights.iter().map(|row| row[j]).collect::<Vec<f64>>();
    let (first, last) = (&patches[0], &patches[patches.len() - 1]);
    match wall {
        0 => patches.iter().map(|patch| size(patch)[0] * mean(&row(patch, 0))).sum(),
        1 => size(last)[1] * mean(&last.heights[last.heights.len() - 1]),
        2 => patches.iter().map(|patch| size(patch)[0] * mean(&row(patch, patch.heights[0].len() - 1))).sum(),
        _ => size(first)[1] * mean(&first.heights[0]),
    }
}

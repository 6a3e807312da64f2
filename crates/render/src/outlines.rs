//! Finds the visible lines of a surface: between labels, between faces of one label, and at ends and silhouettes of the surface.

use crate::Rgb;
use crate::areas::{is_between, lit};
use crate::drawing::{Item, Spot};
use crate::sight::{NOTHING, SIDE, Sight};
use partprobe_carrier::Point;
use std::collections::BTreeMap;

/// The color of lines between labels and at the outline.
const LINE: Rgb = [33; 3];
/// Lines between faces of one label have the color of the label times this factor.
const SEAM: f64 = 0.72;
/// The width of lines relative to the side of the picture, and its bounds.
const WIDTH: f64 = 1.0 / 520.0;
const WIDTHS: [f64; 2] = [0.6, 3.0];
/// The factor by which lines between faces are narrower.
const SEAM_WIDTH: f64 = 0.7;
/// A surface hides a line only if it is nearer to the camera by more than this distance, in samples.
const IN_FRONT: f64 = 6.0;
/// The number of visibility tests along a line per sample.
const LOOKS: f64 = 2.0;
/// Up to this many consecutive tests that find a line hidden, between tests that find it visible, are considered rounding errors.
const SHORT_GAP: usize = 3;
/// Ends of lines meet if their distance is less than about the inverse of this number, in samples.
const MEETING: f64 = 64.0;

/// The kind of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// Between faces of one label, in this color.
    Seam(Rgb),
    /// Between labels, or an outline.
    Line,
}

/// The visible lines in a picture of `size`. The faint ones come first.
pub(crate) fn outlines(
    sight: &Sight,
    label_of_face: &[i32],
    color_of_face: &[Rgb],
    size: f64,
) -> Vec<Item> {
    if sight.is_cloud {
        return Vec::new();
    }
    let mut parts: BTreeMap<Kind, Vec<[Spot; 2]>> = BTreeMap::new();
    for (edge, pieces) in edges(sight) {
        let Some(kind) = kind_of(sight, edge, &pieces, label_of_face, color_of_face) else {
            continue;
        };
        let ends = edge.map(|corner| sight.positions[corner as usize]);
        let faces: Vec<u32> = pieces
            .iter()
            .map(|&piece| sight.pieces[piece as usize].face)
            .collect();
        parts
            .entry(kind)
            .or_default()
            .extend(visible_parts(sight, ends, &faces));
    }
    let scale = size / SIDE as f64;
    let width = (size * WIDTH).clamp(WIDTHS[0], WIDTHS[1]);
    let item = |(kind, parts): (Kind, Vec<[Spot; 2]>)| {
        let scaled = |[x, y]: Spot| [x * scale, y * scale];
        let (color, width) = match kind {
            Kind::Seam(color) => (color, width * SEAM_WIDTH),
            Kind::Line => (LINE, width),
        };
        let joined = joined(&parts).into_iter();
        Item::Lines {
            color,
            width,
            lines: joined
                .map(|line| line.into_iter().map(scaled).collect())
                .collect(),
        }
    };
    parts.into_iter().map(item).collect()
}

/// Each edge of the mesh by its two corners, with its pieces.
fn edges(sight: &Sight) -> BTreeMap<[u32; 2], Vec<u32>> {
    let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for (number, piece) in (0..).zip(&sight.pieces) {
        let [a, b, c] = piece.corners;
        for [from, to] in [[a, b], [b, c], [c, a]] {
            if from != to {
                let edge = [from.min(to), from.max(to)];
                edges.entry(edge).or_default().push(number);
            }
        }
    }
    edges
}

/// The kind of the line along an edge, if there is one.
fn kind_of(
    sight: &Sight,
    edge: [u32; 2],
    pieces: &[u32],
    label: &[i32],
    color: &[Rgb],
) -> Option<Kind> {
    let &[first, second] = pieces else {
        // The surface ends here, or touches itself.
        return Some(Kind::Line);
    };
    let [a, b] = [first, second].map(|piece| &sight.pieces[piece as usize]);
    let [face_a, face_b] = [a, b].map(|piece| piece.face as usize);
    if label[face_a] != label[face_b] || shows_front_and_back(sight, edge, [first, second]) {
        return Some(Kind::Line);
    }
    if face_a == face_b {
        return None;
    }
    let darker = lit(color[face_a], a.shade).map(|channel| (f64::from(channel) * SEAM) as u8);
    Some(Kind::Seam(darker))
}

/// Whether the front of one piece and the back of the other one are seen.
fn shows_front_and_back(sight: &Sight, [from, to]: [u32; 2], pieces: [u32; 2]) -> bool {
    let goes_forward = |piece: u32| {
        let [a, b, c] = sight.pieces[piece as usize].corners;
        [[a, b], [b, c], [c, a]].contains(&[from, to])
    };
    let shows_front = |piece: u32| sight.signed_area(piece as usize) > 0.0;
    let [a, b] = pieces;
    // Neighbors with the same orientation use their common edge in opposite directions.
    let look_alike = goes_forward(a) != goes_forward(b);
    (shows_front(a) != shows_front(b)) == look_alike
}

/// The parts of an edge that are not hidden by a surface.
fn visible_parts(sight: &Sight, [from, to]: [Point; 2], faces: &[u32]) -> Vec<[Spot; 2]> {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    if !length.is_finite() || !(to[2] - from[2]).is_finite() {
        return Vec::new();
    }
    let n_steps = ((length * LOOKS).ceil() as usize).max(1);
    let at = |step: usize| {
        let along = step as f64 / n_steps as f64;
        [0, 1, 2].map(|axis| from[axis] + along * (to[axis] - from[axis]))
    };
    let mut seen: Vec<bool> = (0..=n_steps)
        .map(|step| is_visible(sight, at(step), faces))
        .collect();
    close_short_gaps(&mut seen);

    let mut parts = Vec::new();
    let mut step = 0;
    for run in seen.chunk_by(|a, b| a == b) {
        let end = step + run.len() - 1;
        // A part that is shorter than a sample is not seen, unless it is the whole edge.
        let is_long = run.len() > LOOKS as usize || run.len() == seen.len();
        if run[0] && is_long {
            let [start, end] = [at(step), at(end)];
            parts.push([[start[0], start[1]], [end[0], end[1]]]);
        }
        step = end + 1;
    }
    parts
}

fn close_short_gaps(seen: &mut [bool]) {
    let mut last_seen: Option<usize> = None;
    for step in 0..seen.len() {
        if seen[step] {
            if let Some(last) = last_seen
                && step - last <= SHORT_GAP + 1
            {
                seen[last..step].fill(true);
            }
            last_seen = Some(step);
        }
    }
}

/// Whether a sample around a point of an edge sees no surface, one of the edge's faces near the point, or a surface behind the
/// point.
fn is_visible(sight: &Sight, [x, y, depth]: Point, faces: &[u32]) -> bool {
    let around = |value: f64| (-1..=1).map(move |step| value.floor() as i64 + step);
    let samples = around(y).flat_map(|row| around(x).map(move |column| [row, column]));
    samples.into_iter().any(|sample| {
        let [Ok(row), Ok(column)] = sample.map(usize::try_from) else {
            return true;
        };
        if row >= SIDE || column >= SIDE {
            return true;
        }
        let sample = row * SIDE + column;
        let piece = sight.piece[sample];
        if piece == NOTHING {
            return true;
        }
        let in_front = f64::from(sight.depth[sample]) - depth;
        let is_own = faces.contains(&sight.pieces[piece as usize].face);
        in_front < -IN_FRONT || (is_own && in_front <= IN_FRONT)
    })
}

/// Joins parts to lines at points where exactly two of them meet.
fn joined(parts: &[[Spot; 2]]) -> Vec<Vec<Spot>> {
    let key = |[x, y]: Spot| [x, y].map(|value| (value * MEETING).round() as i64);
    let mut ending: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for (part, ends) in parts.iter().enumerate() {
        for &end in ends {
            ending.entry(key(end)).or_default().push(part);
        }
    }
    let mut is_used = vec![false; parts.len()];
    let walk = |start: usize, from: Spot, is_used: &mut Vec<bool>| {
        let mut line = vec![from];
        let mut part = start;
        loop {
            is_used[part] = true;
            let [a, b] = parts[part];
            let last = line[line.len() - 1];
            let next = if key(a) == key(last) { b } else { a };
            if let [.., before, here] = line.as_slice()
                && is_between(*here, *before, next)
            {
                line.pop();
            }
            line.push(next);
            let following = match ending.get(&key(next)).map(Vec::as_slice) {
                Some(&[a, b]) => [a, b].into_iter().find(|&part| !is_used[part]),
                _ => None,
            };
            match following {
                Some(following) => part = following,
                None => return line,
            }
        }
    };
    let mut lines = Vec::new();
    // Open lines are followed from an end, and closed lines from any point.
    for from_end in [true, false] {
        for part in 0..parts.len() {
            let free_end = parts[part]
                .into_iter()
                .find(|&end| ending.get(&key(end)).is_none_or(|parts| parts.len() != 2));
            let from = if from_end {
                free_end
            } else {
                Some(parts[part][0])
            };
            if let Some(from) = from.filter(|_| !is_used[part]) {
                lines.push(walk(part, from, &mut is_used));
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Look;
    use partprobe_carrier::Mesh;

    /// A square in front of a larger one that has two faces. All are seen from the front.
    fn squares() -> Mesh {
        let mut mesh = Mesh::default();
        let mut add = |corners: [[f64; 2]; 4], y: f64, face: u32| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners.map(|[x, z]| [x, y, z]));
            mesh.vertex_face.extend([face; 4]);
            mesh.triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|corner| first + corner)));
            mesh.tri_face.extend([face; 2]);
        };
        add([[0.0, 0.0], [2.0, 0.0], [2.0, 4.0], [0.0, 4.0]], 0.0, 0);
        add([[2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 4.0]], 0.0, 1);
        add([[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]], -1.0, 2);
        mesh
    }

    fn lengths(labels: [i32; 3]) -> Vec<(Rgb, f64)> {
        let sight = Sight::of(&squares(), Look::upright([0.0, -1.0, 0.0]));
        let items = outlines(&sight, &labels, &[[200; 3]; 3], 100.0);
        let length = |item: &Item| match item {
            Item::Lines { color, lines, .. } => {
                let of_line = |line: &Vec<Spot>| -> f64 {
                    let parts = line.windows(2);
                    parts
                        .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
                        .sum()
                };
                (*color, lines.iter().map(of_line).sum::<f64>() / 23.0)
            }
            _ => panic!("not lines"),
        };
        items.iter().map(length).collect()
    }

    #[test]
    fn hidden_lines_are_not_drawn() {
        // The side of the large square is 92 of 100. Around it 16, around the small one 8, and 2 of 4 between the two faces.
        let [(color, length)] = lengths([0, 1, 2])[..] else {
            panic!("one kind of line");
        };
        assert!(color == LINE && (length - 26.0).abs() < 0.1, "{length}");
        let [(seam, faint), (_, strong)] = lengths([0, 0, 2])[..] else {
            panic!("two kinds of lines");
        };
        assert!(seam != LINE && (faint - 2.0).abs() < 0.1, "{faint}");
        assert!((strong - 24.0).abs() < 0.1, "{strong}");
    }

    #[test]
    fn parts_are_joined_where_two_meet() {
        let parts = [
            [[0.0, 0.0], [1.0, 0.0]],
            [[2.0, 0.0], [1.0, 0.0]],
            [[2.0, 0.0], [2.0, 1.0]],
            [[5.0, 5.0], [6.0, 5.0]],
            [[6.0, 5.0], [5.0, 6.0]],
            [[5.0, 6.0], [5.0, 5.0]],
        ];
        let lines = joined(&parts);
        let first = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
        assert_eq!((lines.len(), &lines[0]), (2, &first));
        assert_eq!((lines[1].len(), lines[1][0]), (4, lines[1][3]));
    }
}

//! Joins the visible pieces of a surface to areas of one color, in painting order.

use crate::Rgb;
use crate::drawing::{Item, Spot};
use crate::sight::{SIDE, Sight};
use std::collections::BTreeMap;

/// Brightness is rounded to this many levels, so that neighboring pieces of a curved face are joined.
const LEVELS: f64 = 40.0;
/// A corner is left out if it is nearer than this distance (in samples) to the line between its neighbors.
const STRAIGHT: f64 = 0.05;

/// The color of a piece with its shading.
pub(crate) fn lit(color: Rgb, shade: f64) -> Rgb {
    let level = (shade * LEVELS).round() / LEVELS;
    color.map(|channel| (f64::from(channel) * level).round() as u8)
}

/// The visible areas in a picture of `size`, from back to front.
pub(crate) fn areas(sight: &Sight, color_of_face: &[Rgb], size: f64) -> Vec<Item> {
    let color = |piece: usize| {
        let piece = &sight.pieces[piece];
        lit(color_of_face[piece.face as usize], piece.shade)
    };
    let order = sight.painting_order(color);
    let of_one_color = order.chunk_by(|&a, &b| color(a as usize) == color(b as usize));
    let item = |pieces: &[u32]| Item::Fill {
        color: color(pieces[0] as usize),
        borders: borders(sight, pieces, size / SIDE as f64),
    };
    of_one_color.map(item).collect()
}

/// The borders of the union of pieces. Sides between two of them are left out.
fn borders(sight: &Sight, pieces: &[u32], scale: f64) -> Vec<Vec<Spot>> {
    let mut sides: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for &piece in pieces {
        let [a, b, c] = sight.pieces[piece as usize].corners;
        // The corners of all pieces are in the same rotational direction, also if the back of a piece is seen.
        let [a, b, c] = if sight.signed_area(piece as usize) < 0.0 {
            [a, c, b]
        } else {
            [a, b, c]
        };
        for [from, to] in [[a, b], [b, c], [c, a]] {
            if let Some(n) = sides.get_mut(&[to, from]) {
                *n -= 1;
                if *n == 0 {
                    sides.remove(&[to, from]);
                }
            } else {
                *sides.entry([from, to]).or_default() += 1;
            }
        }
    }
    let at = |corner: u32| {
        let [x, y, _] = sight.positions[corner as usize];
        [x, y]
    };
    let mut borders = Vec::new();
    while let Some((&[start, _], _)) = sides.first_key_value() {
        let mut border = Vec::new();
        let mut here = start;
        // The number of sides that end at a corner equals the number of sides that begin there, so a walk ends at its first
        // corner.
        while let Some(next) = next_side(&mut sides, here) {
            border.push(at(here));
            here = next;
        }
        let border = without_straight_corners(&border);
        if border.len() > 2 {
            let scaled = |[x, y]: Spot| [x * scale, y * scale];
            borders.push(border.into_iter().map(scaled).collect());
        }
    }
    borders
}

/// Removes a side that begins at a corner, and returns its other end.
fn next_side(sides: &mut BTreeMap<[u32; 2], u32>, from: u32) -> Option<u32> {
    let (&side, n) = sides.range_mut([from, 0]..=[from, u32::MAX]).next()?;
    *n -= 1;
    if *n == 0 {
        sides.remove(&side);
    }
    Some(side[1])
}

/// A border without the corners that lie on the line between their neighbors.
fn without_straight_corners(border: &[Spot]) -> Vec<Spot> {
    let mut kept: Vec<Spot> = Vec::with_capacity(border.len());
    for (corner, &at) in border.iter().enumerate() {
        let before = kept.last().copied().or(border.last().copied());
        let after = border[(corner + 1) % border.len()];
        if before.is_none_or(|before| !is_between(at, before, after)) {
            kept.push(at);
        }
    }
    kept
}

/// Whether a point is on the line between two others, and between them.
pub(crate) fn is_between(at: Spot, before: Spot, after: Spot) -> bool {
    let [u, v] = [after[0] - before[0], after[1] - before[1]];
    let [x, y] = [at[0] - before[0], at[1] - before[1]];
    let length = u.hypot(v);
    let along = x * u + y * v;
    (x * v - y * u).abs() <= STRAIGHT * length && (0.0..=length * length).contains(&along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Look;
    use partprobe_carrier::Mesh;

    /// A square of four triangles around its center, in the plane y = 0. The last triangle belongs to another face.
    fn square() -> Mesh {
        let at = |x: f64, z: f64| [x, 0.0, z];
        Mesh {
            vertices: vec![
                at(0.0, 0.0),
                at(1.0, 0.0),
                at(1.0, 1.0),
                at(0.0, 1.0),
                at(0.5, 0.5),
            ],
            vertex_face: vec![0; 5],
            triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
            tri_face: vec![0, 0, 0, 1],
            vertex_normal: Vec::new(),
        }
    }

    fn areas_of(colors: [Rgb; 2], toward: f64) -> Vec<(Rgb, usize)> {
        let sight = Sight::of(&square(), Look::upright([0.0, toward, 0.0]));
        let items = areas(&sight, &colors, 100.0);
        let corners = |item: &Item| match item {
            Item::Fill { color, borders } => {
                assert_eq!(borders.len(), 1);
                (*color, borders[0].len())
            }
            _ => panic!("not an area"),
        };
        items.iter().map(corners).collect()
    }

    #[test]
    fn pieces_of_one_color_are_one_area() {
        for toward in [-1.0, 1.0] {
            let whole = areas_of([[200; 3]; 2], toward);
            assert!(matches!(whole.as_slice(), [(_, 4)]), "{whole:?}");
            let mut parts = areas_of([[200, 0, 0], [0, 200, 0]], toward);
            parts.sort_unstable();
            assert!(matches!(parts.as_slice(), [(_, 3), (_, 5)]), "{parts:?}");
        }
    }

    #[test]
    fn a_hidden_surface_is_not_drawn() {
        let mut mesh = square();
        mesh.vertices
            .extend([[0.2, 1.0, 0.2], [0.8, 1.0, 0.2], [0.5, 1.0, 0.8]]);
        mesh.vertex_face.extend([1; 3]);
        mesh.triangles.push([5, 6, 7]);
        mesh.tri_face = vec![0, 0, 0, 0, 1];
        let sight = Sight::of(&mesh, Look::upright([0.0, -1.0, 0.0]));
        assert_eq!(areas(&sight, &[[200; 3], [100; 3]], 50.0).len(), 1);
    }
}

//! Finds the pieces of a mesh or a cloud that a camera sees, and the order in which they are painted.
//!
//! A piece is a triangle. A point of a cloud is a square of two pieces. The picture is divided into samples. Details that are
//! smaller than a sample may be visible or not.

use crate::Rgb;
use crate::camera::{Camera, Look};
use crate::view::{corner_shades, for_each_sample, point_square};
use partprobe_carrier::{Mesh, Point, dot, smooth_normals, weld};
use std::collections::{BTreeMap, BTreeSet};

/// Samples along each side of a picture.
pub(crate) const SIDE: usize = 1536;
/// The value of a sample that sees no surface.
pub(crate) const NOTHING: u32 = u32::MAX;
/// Surfaces with a smaller distance than this, in samples, touch. Either may be painted first.
const TOUCHING: f32 = 0.02;

/// A part of the surface, projected onto the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Its corners, as indices of positions.
    pub(crate) corners: [u32; 3],
    pub(crate) face: u32,
    /// Its brightness, from 0 to 1.
    pub(crate) shade: f64,
}

/// All pieces, and the nearest one at each sample.
#[derive(Debug)]
pub(crate) struct Sight {
    /// Column, row and nearness of each corner, in samples. Neighbors share their corners.
    pub(crate) positions: Vec<Point>,
    pub(crate) pieces: Vec<Piece>,
    /// The piece that each sample sees.
    pub(crate) piece: Vec<u32>,
    /// Its nearness.
    pub(crate) depth: Vec<f32>,
    /// Whether it is a cloud, which has no edges.
    pub(crate) is_cloud: bool,
}

impl Sight {
    /// Looks at a mesh or a cloud.
    pub(crate) fn of(mesh: &Mesh, look: Look) -> Self {
        let camera = Camera::fitted(&mesh.vertices, look, SIDE);
        let (positions, pieces) = if mesh.is_cloud() {
            squares(mesh, &camera)
        } else {
            triangles(mesh, &camera)
        };
        let mut sight = Self {
            positions,
            pieces,
            piece: vec![NOTHING; SIDE * SIDE],
            depth: vec![f32::MIN; SIDE * SIDE],
            is_cloud: mesh.is_cloud(),
        };
        for piece in 0..sight.pieces.len() {
            let corners = sight.corners(piece);
            for_each_sample(corners, SIDE, |row, column, weights| {
                let depth = dot(weights, corners.map(|corner| corner[2])) as f32;
                let sample = row * SIDE + column;
                if sight.depth[sample] < depth {
                    sight.depth[sample] = depth;
                    sight.piece[sample] = piece as u32;
                }
            });
        }
        sight
    }

    pub(crate) fn corners(&self, piece: usize) -> [Point; 3] {
        self.pieces[piece]
            .corners
            .map(|corner| self.positions[corner as usize])
    }

    /// Twice the area of a piece in the picture. It is negative if the back of the piece is seen.
    pub(crate) fn signed_area(&self, piece: usize) -> f64 {
        let [a, b, c] = self.corners(piece);
        // Rows count downward. So the front is seen if the corners are counterclockwise in space.
        (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
    }

    /// The pieces that a sample sees, in an order in which the nearer one of two is painted later. If possible, pieces of the
    /// same color are consecutive.
    pub(crate) fn painting_order(&self, color_of_piece: impl Fn(usize) -> Rgb) -> Vec<u32> {
        let seen = self.seen();
        let pairs = self.hidden_behind(&seen);
        let mut n_before = vec![0_u32; self.pieces.len()];
        pairs
            .iter()
            .for_each(|&[_, front]| n_before[front as usize] += 1);
        let mut order = ReadyPieces::default();
        let ready = seen.iter().filter(|&&piece| n_before[piece as usize] == 0);
        ready.for_each(|&piece| order.add(color_of_piece(piece as usize), piece));

        let mut by_depth = seen.clone();
        by_depth.sort_by(|&a, &b| self.mean_depth(a).total_cmp(&self.mean_depth(b)));
        let mut farthest = by_depth.into_iter();
        let mut is_painted = vec![false; self.pieces.len()];
        let mut painted = Vec::with_capacity(seen.len());
        while painted.len() < seen.len() {
            // Pieces that hide each other in a cycle are painted from the back.
            let next = order
                .take()
                .or_else(|| farthest.find(|&piece| !is_painted[piece as usize]));
            let Some(piece) = next else { break };
            if std::mem::replace(&mut is_painted[piece as usize], true) {
                continue;
            }
            painted.push(piece);
            let start = pairs.partition_point(|&[behind, _]| behind < piece);
            for &[_, front] in pairs[start..].iter().take_while(|pair| pair[0] == piece) {
                n_before[front as usize] -= 1;
                if n_before[front as usize] == 0 && !is_painted[front as usize] {
                    order.add(color_of_piece(front as usize), front);
                }
            }
        }
        painted
    }

    /// The pieces that a sample sees, sorted. If no sample around a sample sees the same face, the sample looks through a gap
    /// between two pieces that is caused by rounding.
    fn seen(&self) -> Vec<u32> {
        let face = |sample: usize| match self.piece[sample] {
            NOTHING => None,
            piece => Some(self.pieces[piece as usize].face),
        };
        let is_alone = |sample: usize| {
            let (row, column) = (sample / SIDE, sample % SIDE);
            let near = |at: usize| at.saturating_sub(1)..(at + 2).min(SIDE);
            let mut around =
                near(row).flat_map(|row| near(column).map(move |column| row * SIDE + column));
            !around.any(|other| other != sample && face(other) == face(sample))
        };
        let mut is_seen = vec![false; self.pieces.len()];
        for sample in 0..self.piece.len() {
            let piece = self.piece[sample] as usize;
            if face(sample).is_some() && !is_seen[piece] && !is_alone(sample) {
                is_seen[piece] = true;
            }
        }
        (0..self.pieces.len() as u32)
            .filter(|&piece| is_seen[piece as usize])
            .collect()
    }

    /// Pairs of pieces, of which the first one is directly behind the second one at a sample. They are sorted, and each pair is
    /// listed once.
    fn hidden_behind(&self, seen: &[u32]) -> Vec<[u32; 2]> {
        let mut crossings: Vec<(u32, f32, u32)> = Vec::new();
        for &piece in seen {
            let corners = self.corners(piece as usize);
            for_each_sample(corners, SIDE, |row, column, weights| {
                let depth = dot(weights, corners.map(|corner| corner[2])) as f32;
                crossings.push(((row * SIDE + column) as u32, depth, piece));
            });
        }
        crossings.sort_unstable_by(|a, b| {
            let by_depth = a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
            by_depth.then(a.2.cmp(&b.2))
        });
        let mut pairs: Vec<[u32; 2]> = crossings
            .windows(2)
            .filter(|pair| pair[0].0 == pair[1].0 && pair[1].1 - pair[0].1 > TOUCHING)
            .map(|pair| [pair[0].2, pair[1].2])
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    fn mean_depth(&self, piece: u32) -> f64 {
        self.corners(piece as usize)
            .iter()
            .map(|corner| corner[2])
            .sum()
    }
}

/// The pieces that can be painted next, because all pieces behind them are painted. They are grouped by color.
#[derive(Default)]
struct ReadyPieces {
    by_color: BTreeMap<Rgb, BTreeSet<u32>>,
    current: Rgb,
}

impl ReadyPieces {
    fn add(&mut self, color: Rgb, piece: u32) {
        self.by_color.entry(color).or_default().insert(piece);
    }

    /// Takes a piece of the color that was taken last, or otherwise of the color with the most pieces.
    fn take(&mut self) -> Option<u32> {
        if !self.by_color.contains_key(&self.current) {
            let most = self.by_color.iter().max_by_key(|(_, pieces)| pieces.len());
            self.current = *most?.0;
        }
        let pieces = self.by_color.get_mut(&self.current)?;
        let piece = pieces.pop_first();
        if pieces.is_empty() {
            self.by_color.remove(&self.current);
        }
        piece
    }
}

fn triangles(mesh: &Mesh, camera: &Camera) -> (Vec<Point>, Vec<Piece>) {
    let normals = smooth_normals(mesh);
    let welded = weld(mesh);
    let piece = |(triangle, &corners): (usize, &[u32; 3])| {
        let shades = corner_shades(mesh, &normals, camera, triangle);
        Piece {
            corners,
            face: mesh.tri_face[triangle],
            shade: shades.iter().sum::<f64>() / 3.0,
        }
    };
    let positions = welded.vertices.iter().map(|&at| camera.project(at));
    let pieces = welded.triangles.iter().enumerate().map(piece);
    (positions.collect(), pieces.collect())
}

fn squares(cloud: &Mesh, camera: &Camera) -> (Vec<Point>, Vec<Piece>) {
    let (mut positions, mut pieces) = (Vec::new(), Vec::new());
    for (point, &face) in cloud.tri_face.iter().enumerate() {
        let (corners, shade) = point_square(cloud, camera, point, SIDE);
        let first = positions.len() as u32;
        positions.extend(corners);
        let halves = [[0, 1, 2], [0, 2, 3]].map(|half| half.map(|corner| first + corner));
        pieces.extend(halves.map(|corners| Piece {
            corners,
            face,
            shade,
        }));
    }
    (positions, pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three shifted squares, one behind the other, the nearest first. Each has two triangles.
    fn stack() -> Mesh {
        let mut mesh = Mesh::default();
        for square in 0..3_u32 {
            let (shift, y) = (0.3 * f64::from(square), f64::from(square));
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            mesh.vertices
                .extend(corners.map(|[x, z]| [x + shift, y, z + shift]));
            mesh.vertex_face.extend([square; 4]);
            mesh.triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|corner| 4 * square + corner)));
            mesh.tri_face.extend([square; 2]);
        }
        mesh
    }

    #[test]
    fn nearer_pieces_are_painted_later() {
        let sight = Sight::of(&stack(), Look::upright([0.0, -1.0, 0.0]));
        for colors in [[[1; 3], [1; 3], [1; 3]], [[1; 3], [2; 3], [1; 3]]] {
            let order = sight.painting_order(|piece| colors[sight.pieces[piece].face as usize]);
            assert_eq!(order.len(), 6);
            let place = |face: u32| {
                let of_face = |&piece: &u32| sight.pieces[piece as usize].face == face;
                order.iter().position(of_face).unwrap()
            };
            assert!(place(2) < place(1) && place(1) < place(0), "{order:?}");
        }
    }

    #[test]
    fn the_front_is_seen_from_the_front() {
        for (toward, sign) in [(-1.0, 1.0), (1.0, -1.0)] {
            let sight = Sight::of(&stack(), Look::upright([0.0, toward, 0.0]));
            assert_eq!(sight.signed_area(0).signum(), sign);
        }
    }
}

//! Divides sides of triangles that coincide with sides of another face.
//!
//! A side between two boundary vertices may join the same two points as a side of another face, although the faces are not
//! neighbors there. After welding, the two would be one edge of four triangles. Dividing one of them moves nothing and keeps
//! them apart.

use super::attributes::push_undefined;
use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use crate::geometry::linear::{along, sum, unit};
use partprobe_shape::{Point, distance, subtract};

/// Sides shorter than this fraction of their coordinates are left alone: there is no room for a point between their ends.
const SHORTEST: f64 = 1e-12;

/// A side of a triangle, in the direction in which the triangle walks along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TriangleSide {
    /// A hash of the two points that it joins. It is the same in both directions.
    points: u64,
    face: u32,
    /// From the point with the lower hash to the other one.
    forward: bool,
    triangle: u32,
    corner: u8,
}

/// Factors that shift the dividing point of a side. If a corner lies at the point, the next factor is tried.
const SHARES: [f64; 3] = [1.0, 0.8, 0.6];

/// Number of passes. A division changes triangles, so another division of the same triangle has to wait for the next pass.
const ROUNDS: usize = 4;

/// An odd number whose bits look random. The hash multiplies by it.
const MIXER: u64 = 0x9e37_79b9_7f4a_7c15;

/// Divides the sides that would be welded to a side of another face.
pub(crate) fn divide_shared_chords(meshes: &mut [Result<FaceMesh, FaceMeshError>]) {
    for _ in 0..ROUNDS {
        if !divide_once(meshes) {
            return;
        }
    }
}

/// Makes one pass. Returns whether it divided any side.
fn divide_once(meshes: &mut [Result<FaceMesh, FaceMeshError>]) -> bool {
    let mut has_divided = false;
    for shared in crowded_sides(meshes)
        .chunk_by(|a, b| a.points == b.points)
        .filter(|sides| sides.len() > 2)
    {
        let pairs = inner_pairs(shared);
        let n_bounding = shared.len() - 2 * pairs.len();
        let kept = usize::from(n_bounding == 0);
        for (i, [there, back]) in pairs.into_iter().enumerate().skip(kept) {
            if let Ok(mesh) = &mut meshes[there.face as usize] {
                has_divided |= divide(mesh, there, back, 1.0 / (i + 2) as f64);
            }
        }
    }
    has_divided
}

/// The sides whose two points may be joined by more than two sides, sorted.
///
/// Nearly every pair of points is joined by exactly two sides. A table of counters finds the other pairs, and only their sides
/// are sorted.
fn crowded_sides(meshes: &[Result<FaceMesh, FaceMeshError>]) -> Vec<TriangleSide> {
    let mut sides = Vec::new();
    for (face, mesh) in (0..).zip(meshes) {
        if let Ok(mesh) = mesh {
            add_sides(face, mesh, &mut sides);
        }
    }
    let shift = 64
        - (2 * sides.len())
            .next_power_of_two()
            .trailing_zeros()
            .max(1);
    let slot = |side: &TriangleSide| (side.points.wrapping_mul(MIXER) >> shift) as usize;
    let mut met = vec![0_u8; 1 << (64 - shift)];
    for side in &sides {
        let met = &mut met[slot(side)];
        *met = met.saturating_add(1);
    }
    sides.retain(|side| met[slot(side)] > 2);
    sides.sort_unstable();
    sides
}

/// The sides of a mesh that join boundary vertices.
fn add_sides(face: u32, mesh: &FaceMesh, sides: &mut Vec<TriangleSide>) {
    let numbers: Vec<u64> = mesh.points.iter().map(|&point| number(point)).collect();
    for (triangle, corners) in (0..).zip(&mesh.triangles) {
        for corner in 0..3_u8 {
            let (a, b) = side(*corners, corner);
            if mesh.on_boundary[a as usize] && mesh.on_boundary[b as usize] {
                let (a, b) = (numbers[a as usize], numbers[b as usize]);
                let points = a.min(b).rotate_left(21) ^ a.max(b);
                sides.push(TriangleSide {
                    points,
                    face,
                    forward: a < b,
                    triangle,
                    corner,
                });
            }
        }
    }
}

/// The vertices of a triangle's side.
fn side(corners: [u32; 3], corner: u8) -> (u32, u32) {
    let first = usize::from(corner);
    (corners[first], corners[(first + 1) % 3])
}

/// The vertex opposite a triangle's side.
fn opposite(corners: [u32; 3], corner: u8) -> u32 {
    corners[(usize::from(corner) + 2) % 3]
}

/// A hash of a point. If two points have the same hash, a side may be divided needlessly, but nothing breaks.
fn number(point: Point) -> u64 {
    point.iter().fold(0, |number: u64, &x| {
        let mixed = (number ^ (x + 0.0).to_bits()).wrapping_mul(MIXER);
        mixed ^ (mixed >> 29)
    })
}

/// The pairs of opposite sides within one face. Such sides lie inside the face.
fn inner_pairs(shared: &[TriangleSide]) -> Vec<[TriangleSide; 2]> {
    let of_face = shared.chunk_by(|a, b| a.face == b.face);
    let pairs = of_face.flat_map(|walks| {
        let n_back = walks.iter().filter(|walk| !walk.forward).count();
        let (back, there) = walks.split_at(n_back);
        there.iter().zip(back).map(|(&there, &back)| [there, back])
    });
    pairs.collect()
}

/// Puts a vertex at this fraction of a side and divides both its triangles. Does nothing if an earlier division has taken the
/// side from one of them.
fn divide(mesh: &mut FaceMesh, there: TriangleSide, back: TriangleSide, fraction: f64) -> bool {
    let sides = [there, back].map(|walk| side(mesh.triangles[walk.triangle as usize], walk.corner));
    let (from, to) = sides[0];
    let point = |vertex: u32| mesh.points[vertex as usize];
    let ends = [point(from), point(to)];
    if [point(sides[1].1), point(sides[1].0)] != ends {
        return false;
    }
    let opposites = [there, back].map(|walk| {
        let corners = mesh.triangles[walk.triangle as usize];
        point(opposite(corners, walk.corner))
    });
    let Some(new) = dividing_point(ends, opposites, fraction) else {
        return false;
    };
    let middle = push_between(mesh, new, [from, to]);
    for (walk, (_, to)) in [there, back].into_iter().zip(sides) {
        let corners = &mut mesh.triangles[walk.triangle as usize];
        let opposite = opposite(*corners, walk.corner);
        corners[(usize::from(walk.corner) + 1) % 3] = middle;
        mesh.triangles.push([middle, to, opposite]);
    }
    true
}

/// The point that divides a side. Returns `None` if the side is too short. If a triangle has no width, its third corner may lie
/// at that point, and then the next factor of [`SHARES`] is taken.
fn dividing_point([start, end]: [Point; 2], opposites: [Point; 2], fraction: f64) -> Option<Point> {
    let extent = start
        .iter()
        .chain(&end)
        .fold(0.0_f64, |extent, x| extent.max(x.abs()));
    if distance(start, end) <= SHORTEST * extent {
        return None;
    }
    SHARES
        .into_iter()
        .map(|share| along(start, subtract(end, start), share * fraction))
        .find(|new| !opposites.contains(new))
}

/// Adds a vertex between two others, with their mean normal if the mesh has normals. Its other attributes are not defined, because it
/// lies on a chord and not on the surface. Returns its index.
fn push_between(mesh: &mut FaceMesh, point: Point, ends: [u32; 2]) -> u32 {
    let middle = mesh.points.len() as u32;
    mesh.points.push(point);
    mesh.on_boundary.push(true);
    if let [Some(a), Some(b)] = ends.map(|vertex| mesh.normals.get(vertex as usize)) {
        let mean = unit(sum(a.map(f64::from), b.map(f64::from))).unwrap_or(a.map(f64::from));
        mesh.normals.push(mean.map(|x| x as f32));
    }
    push_undefined(&mut mesh.attributes);
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::{SurfaceAttributes, cross};

    /// A square of two triangles that share the diagonal from the first corner. `lift` bends the square along the diagonal. It has
    /// all attributes.
    fn square(lift: f64) -> FaceMesh {
        FaceMesh {
            attributes: SurfaceAttributes {
                uv: vec![[0.5; 2]; 4],
                curvature: vec![[0.0; 2]; 4],
                direction: vec![[[1.0, 0.0, 0.0]; 2]; 4],
            },
            points: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, lift],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, lift],
            ],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            on_boundary: vec![true; 4],
            ..FaceMesh::default()
        }
    }

    #[track_caller]
    fn check(lifts: &[f64], expected: &[usize]) {
        let mut meshes: Vec<_> = lifts.iter().map(|&lift| Ok(square(lift))).collect();
        divide_shared_chords(&mut meshes);
        for (mesh, &expected) in meshes.iter().flatten().zip(expected) {
            assert_eq!(mesh.triangles.len(), expected);
            let SurfaceAttributes {
                uv,
                curvature,
                direction,
            } = &mesh.attributes;
            let lengths = [uv.len(), curvature.len(), direction.len()];
            assert_eq!(lengths, [mesh.points.len(); 3]);
            let lengths = [mesh.normals.len(), mesh.on_boundary.len()];
            assert_eq!(lengths, [mesh.points.len(); 2]);
            let up = mesh.triangles.iter().map(|corners| {
                let [a, b, c] = corners.map(|corner| mesh.points[corner as usize]);
                cross(subtract(b, a), subtract(c, a))[2]
            });
            assert!(up.clone().all(|up| up > 0.0) && (up.sum::<f64>() - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_corner_in_the_middle_of_the_side_is_not_met() {
        let flat = || {
            let mut mesh = square(0.0);
            mesh.points[1] = [0.5, 0.5, 0.0];
            Ok(mesh)
        };
        let mut meshes = [flat(), flat()];
        divide_shared_chords(&mut meshes);
        let divided = meshes[1].as_ref().unwrap();
        assert_eq!(divided.triangles.len(), 4);
        for corners in &divided.triangles {
            let [a, b, c] = corners.map(|corner| divided.points[corner as usize]);
            assert!(a != b && b != c && c != a);
        }
    }

    #[test]
    fn of_sides_on_one_another_all_but_one_are_divided() {
        check(&[0.0], &[2]);
        check(&[0.0, 1.0], &[2, 4]);
        check(&[0.0, 1.0, 2.0], &[2, 4, 4]);
    }
}

//! Joins triangles across sides at which the mesh bends by at most DEG degrees: `dihedral-grow-<DEG>`.
//!
//! It uses only the welded mesh and not the B-Rep. On a coarse tessellation, a cylinder is divided into strips if its facets meet
//! at more than DEG degrees. A tangent fillet joins the planes next to it.

use crate::factory::SourceFactory;
use crate::region_merging::{Border, borders_of};
use crate::source::SourceLabels;
use crate::step_parts::rule::ANGLE_TIE_DEG;
use crate::triangle_normal::normals_and_areas;
use partprobe_carrier::{Labels, Mesh, Partition, Point, dot};

/// The angle is that between the outward normals of the two triangles, as for `smooth-<DEG>`.
pub(crate) const DIHEDRAL_GROW: SourceFactory = SourceFactory::numbered_rule(
    "dihedral-grow-<DEG>",
    "triangles of the mesh joined across sides that bend by at most DEG degrees",
    1..=180,
    |carrier, degrees, _| {
        let regions = grown(carrier.mesh(), f64::from(degrees));
        let raw: Vec<i32> = regions
            .parts()
            .iter()
            .map(|&region| region as i32)
            .collect();
        Ok(SourceLabels::on_plain(Labels::compacted(&raw)))
    },
);

/// The region of each triangle.
fn grown(mesh: &Mesh, degrees: f64) -> Partition {
    let n_triangles = mesh.triangles.len();
    let normals: Vec<Point> = normals_and_areas(mesh)
        .into_iter()
        .map(|(normal, _)| normal)
        .collect();
    let has_normal = |triangle: u32| normals[triangle as usize] != [0.0; 3];
    let least_cosine = (degrees + ANGLE_TIE_DEG).to_radians().cos();
    let borders = borders_of(mesh);

    let smooth = borders
        .iter()
        .map(|border| border.between)
        .filter(|&[a, b]| {
            let cosine = dot(normals[a as usize], normals[b as usize]);
            // Because of rounding, the cosine of opposite normals may be below -1.
            has_normal(a) && has_normal(b) && (least_cosine <= cosine || degrees >= 180.0)
        });
    let without_area = longest_borders(&borders, n_triangles);
    let needles = (0..)
        .zip(&without_area)
        .filter(|&(triangle, _)| !has_normal(triangle));
    let joins_of_needles = needles.filter_map(|(_, border)| border.map(|border| border.between));
    Partition::from_joined_pairs(n_triangles, smooth.chain(joins_of_needles))
}

/// The longest border of each triangle. A triangle without an area belongs to its neighbor across this border.
fn longest_borders(borders: &[Border], n_triangles: usize) -> Vec<Option<Border>> {
    let mut longest: Vec<Option<Border>> = vec![None; n_triangles];
    for border in borders {
        for triangle in border.between {
            let best = &mut longest[triangle as usize];
            if best.is_none_or(|best| best.length < border.length) {
                *best = Some(*border);
            }
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of rectangles that bends by these angles, with two triangles per rectangle.
    fn strip(bends_deg: &[f64]) -> Mesh {
        let mut profile = vec![[0.0, 0.0]];
        let mut direction: f64 = 0.0;
        for bend in [0.0].iter().chain(bends_deg) {
            direction += bend.to_radians();
            let [x, y] = profile[profile.len() - 1];
            profile.push([x + direction.cos(), y + direction.sin()]);
        }
        let vertices = profile
            .iter()
            .flat_map(|&[x, y]| [[x, y, 0.0], [x, y, 1.0]])
            .collect();
        let rectangle = |n: u32| {
            [
                [2 * n, 2 * n + 2, 2 * n + 1],
                [2 * n + 1, 2 * n + 2, 2 * n + 3],
            ]
        };
        let triangles: Vec<[u32; 3]> = (0..)
            .take(bends_deg.len() + 1)
            .flat_map(rectangle)
            .collect();
        let tri_face = vec![0; triangles.len()];
        Mesh {
            vertex_face: vec![0; profile.len() * 2],
            vertices,
            triangles,
            tri_face,
            vertex_normal: Vec::new(),
        }
    }

    #[track_caller]
    fn check(bends_deg: &[f64], degrees: f64, expected: &[u32]) {
        let found = grown(&strip(bends_deg), degrees);
        let of_rectangles: Vec<u32> = found.parts().iter().copied().step_by(2).collect();
        assert_eq!(of_rectangles, expected, "{bends_deg:?} at {degrees}");
        assert!(
            found.parts().chunks(2).all(|pair| pair[0] == pair[1]),
            "a rectangle is flat"
        );
    }

    #[test]
    fn regions_end_where_the_mesh_bends() {
        check(&[], 1.0, &[0]);
        check(&[8.0, 20.0, 0.0], 7.0, &[0, 1, 2, 2]);
        check(&[8.0, 20.0, 0.0], 8.0, &[0, 0, 1, 1]);
        check(&[8.0, 20.0, 0.0], 20.0, &[0, 0, 0, 0]);
        check(&[-8.0, -20.0, 90.0], 10.0, &[0, 0, 1, 2]);
        check(&[90.0], 89.0, &[0, 1]);
        check(&[90.0], 90.0, &[0, 0]);
    }

    #[test]
    fn a_triangle_without_area_follows_its_longest_side() {
        let mut mesh = strip(&[90.0]);
        // A needle on the far side of the second rectangle, between its two corners and their middle.
        mesh.vertices.push([1.0, 1.0, 0.5]);
        mesh.vertex_face.push(0);
        mesh.triangles.push([4, 6, 5]);
        mesh.tri_face.push(0);
        assert_eq!(grown(&mesh, 10.0).parts(), [0, 0, 1, 1, 1]);
        assert_eq!(grown(&Mesh::default(), 10.0).n_parts(), 0);
    }
}

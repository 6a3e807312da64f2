//! Draws labels of triangles from one viewpoint, so that pictures of one shape by several sources can be compared.

use crate::camera::{CORNERS, Look};
use crate::palette::{UNLABELED, chosen_colors};
use crate::view::View;
use crate::{Background, Image, Rgb};
use partprobe_carrier::{Mesh, Point, weld};
use std::collections::BTreeSet;

/// The side of the small pictures by which corners are compared.
const TRIAL_SIDE: usize = 160;
/// Samples along each side of a pixel.
const FINENESS: usize = 3;

/// A camera for pictures of one shape. The tessellation and the labels may differ between the pictures.
#[derive(Clone, Copy, Debug)]
pub struct LabelView {
    toward: Point,
    size: usize,
}

impl LabelView {
    /// The corner, of eight, from which most labels are seen. Pictures have sides of `size` pixels.
    ///
    /// `labels` has one label per triangle; a negative label means that the triangle has none.
    #[must_use]
    pub fn seeing_most(mesh: &Mesh, labels: &[i32], size: usize) -> Self {
        let labeled = with_labels_as_faces(mesh, labels);
        let of_face = faces_of(labels);
        let n_visible = |corner: usize| {
            View::of(&labeled, Look::upright(CORNERS[corner]), TRIAL_SIDE).n_visible(&of_face)
        };
        let best =
            (0..CORNERS.len()).max_by_key(|&corner| (n_visible(corner), std::cmp::Reverse(corner)));
        Self {
            toward: CORNERS[best.unwrap_or(0)],
            size,
        }
    }

    /// The picture in these colors, one per label, with lines between labels. Triangles without a label are gray.
    #[must_use]
    pub fn picture(&self, mesh: &Mesh, labels: &[i32], color_of_label: &[Rgb]) -> Image {
        let of_face = faces_of(labels);
        let color = |&label: &i32| {
            let color = usize::try_from(label)
                .ok()
                .and_then(|label| color_of_label.get(label));
            color.copied().unwrap_or(UNLABELED)
        };
        let colors: Vec<Rgb> = of_face.iter().map(color).collect();
        View::of(
            &with_labels_as_faces(mesh, labels),
            Look::upright(self.toward),
            self.size * FINENESS,
        )
        .painted(&of_face, &colors, FINENESS, Background::White)
    }
}

/// One color per label of a mesh, such that labels that touch look different.
///
/// `labels` has one label per triangle. `fixed` gives the colors that are already determined, by label: those of labels that
/// correspond to labels of another picture. It may be shorter than the list of labels.
#[must_use]
pub fn colors_of_triangle_labels(mesh: &Mesh, labels: &[i32], fixed: &[Option<Rgb>]) -> Vec<Rgb> {
    let mut neighbors = vec![BTreeSet::new(); n_labels(labels)];
    let mut sides: Vec<([u32; 2], i32)> = Vec::with_capacity(3 * labels.len());
    for (&[a, b, c], &label) in weld(mesh).triangles.iter().zip(labels) {
        let around = [[a, b], [b, c], [c, a]];
        sides.extend(around.map(|[from, to]| ([from.min(to), from.max(to)], label)));
    }
    sides.sort_unstable();
    for around in sides.chunk_by(|a, b| a.0 == b.0) {
        for pair in around.windows(2) {
            if let [Ok(a), Ok(b)] = [pair[0].1, pair[1].1].map(usize::try_from)
                && a != b
            {
                neighbors[a].insert(b);
                neighbors[b].insert(a);
            }
        }
    }
    chosen_colors(&neighbors, fixed)
}

/// The mesh with labels instead of faces, so that lines are drawn only between labels.
fn with_labels_as_faces(mesh: &Mesh, labels: &[i32]) -> Mesh {
    let unlabeled = n_labels(labels) as u32;
    let face = |&label: &i32| u32::try_from(label).unwrap_or(unlabeled);
    Mesh {
        tri_face: labels.iter().map(face).collect(),
        ..mesh.clone()
    }
}

/// The label of each face of [`with_labels_as_faces`].
fn faces_of(labels: &[i32]) -> Vec<i32> {
    (0..n_labels(labels) as i32).chain([-1]).collect()
}

fn n_labels(labels: &[i32]) -> usize {
    let most = labels.iter().max().copied().unwrap_or(-1);
    usize::try_from(most + 1).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a square in the plane y = 0.
    fn square() -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0],
            ],
            vertex_face: vec![0; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            tri_face: vec![0, 0],
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn labels_that_touch_get_different_colors_and_fixed_ones_stay() {
        let colors = colors_of_triangle_labels(&square(), &[0, 1], &[]);
        assert!(colors.len() == 2 && colors[0] != colors[1]);
        let fixed = [None, Some(colors[0])];
        let found = colors_of_triangle_labels(&square(), &[0, 1], &fixed);
        assert!(found[1] == colors[0] && found[0] != colors[0]);
        assert_eq!(
            colors_of_triangle_labels(&square(), &[-1, -1], &[]),
            Vec::<Rgb>::new()
        );
    }

    #[test]
    fn a_picture_shows_the_colors_of_its_labels() {
        let view = LabelView::seeing_most(&square(), &[0, -1], 64);
        let image = view.picture(&square(), &[0, -1], &[[250, 0, 0]]);
        let has = |is_wanted: fn(&[u8]) -> bool| image.rgba.chunks_exact(4).any(is_wanted);
        assert!(has(|pixel| pixel[0] > 140 && pixel[1] == 0));
        assert!(has(
            |pixel| pixel[0] == pixel[1] && (80..170).contains(&pixel[0])
        ));
    }
}

//! Fills the z-buffer: the face that each sample of a picture sees.

use crate::Background;
use crate::camera::{Camera, Look, facet_normal};
use crate::image::Image;
use partprobe_carrier::{Mesh, Point, dot, smooth_normals};
use std::collections::BTreeMap;

/// The value of a sample that sees no surface.
const NOTHING: u32 = u32::MAX;
/// A depth step between neighboring samples that is larger than this is an edge of the surface in front of itself.
const CLIFF: f32 = 25.0;
/// Half the side of the square of a point, if the picture had one point.
const POINT_SIZE: f64 = 0.6;
/// A label counts as visible if this many samples see it.
const VISIBLE_SAMPLES: usize = 4;
/// Brightness of lines between labels, and against the background.
const LINE: f64 = 0.13;
/// Lines between faces of one label have the color of the label times this factor.
const SEAM: f64 = 0.8;

/// A picture before it has colors.
#[derive(Clone, Debug)]
pub(crate) struct View {
    side: usize,
    face: Vec<u32>,
    depth: Vec<f32>,
    shade: Vec<f32>,
}

impl View {
    /// The visible surface of the mesh, in a square of `side` samples.
    pub(crate) fn of(mesh: &Mesh, look: Look, side: usize) -> Self {
        let camera = Camera::fitted(&mesh.vertices, look, side);
        let n_samples = side * side;
        let mut view = Self {
            side,
            face: vec![NOTHING; n_samples],
            depth: vec![f32::MIN; n_samples],
            shade: vec![0.0; n_samples],
        };
        if mesh.is_cloud() {
            view.fill_points(mesh, &camera);
            return view;
        }
        let normals = smooth_normals(mesh);
        for triangle in 0..mesh.triangles.len() {
            view.fill(
                mesh.corners(triangle).map(|place| camera.project(place)),
                corner_shades(mesh, &normals, &camera, triangle),
                mesh.tri_face[triangle],
            );
        }
        view
    }

    /// Fills a square for each point of a cloud.
    fn fill_points(&mut self, cloud: &Mesh, camera: &Camera) {
        for (point, &face) in cloud.tri_face.iter().enumerate() {
            let ([a, b, c, d], shade) = point_square(cloud, camera, point, self.side);
            self.fill([a, b, c], [shade; 3], face);
            self.fill([a, c, d], [shade; 3], face);
        }
    }

    /// Fills the samples of one projected triangle that do not already have a nearer surface.
    fn fill(&mut self, corners: [Point; 3], shades: [f64; 3], face: u32) {
        let side = self.side;
        for_each_sample(corners, side, |row, column, weights| {
            let depth = dot(weights, corners.map(|corner| corner[2])) as f32;
            let sample = row * side + column;
            if self.depth[sample] < depth {
                self.depth[sample] = depth;
                self.face[sample] = face;
                self.shade[sample] = dot(weights, shades) as f32;
            }
        });
    }

    /// The number of visible labels.
    pub(crate) fn n_visible(&self, label_of_face: &[i32]) -> usize {
        let mut n_samples: BTreeMap<i32, usize> = BTreeMap::new();
        for &face in self.face.iter().filter(|&&face| face != NOTHING) {
            *n_samples.entry(label_of_face[face as usize]).or_default() += 1;
        }
        n_samples
            .values()
            .filter(|&&n| n >= VISIBLE_SAMPLES)
            .count()
    }

    /// The picture in colors, with `supersample` samples per side of a pixel, and with lines between labels.
    ///
    /// The background is visible at samples without a surface.
    pub(crate) fn painted(
        &self,
        label_of_face: &[i32],
        color_of_face: &[[u8; 3]],
        supersample: usize,
        background: Background,
    ) -> Image {
        let size = self.side / supersample;
        let per_pixel = (supersample * supersample) as f64;
        let mut image = Image::blank(size, size, background);
        for row in 0..size {
            for column in 0..size {
                let (mut sum, mut n_covered) = ([0.0; 3], 0.0);
                for sample in 0..supersample * supersample {
                    let at = [
                        row * supersample + sample / supersample,
                        column * supersample + sample % supersample,
                    ];
                    let color =
                        self.color_at(at, supersample.max(2) - 1, label_of_face, color_of_face);
                    if let Some(color) = color {
                        sum = [0, 1, 2].map(|channel| sum[channel] + color[channel]);
                        n_covered += 1.0;
                    }
                }
                image.set(row, column, mixed(sum, n_covered, per_pixel, background));
            }
        }
        image
    }

    /// The color of a sample, 0 to 255, or `None` for the background. Lines are `reach` samples wide.
    fn color_at(
        &self,
        [row, column]: [usize; 2],
        reach: usize,
        label: &[i32],
        color: &[[u8; 3]],
    ) -> Option<[f64; 3]> {
        let own = row * self.side + column;
        let others = [(row, column + reach), (row + reach, column)]
            .into_iter()
            .filter(|&(row, column)| row < self.side && column < self.side)
            .map(|(row, column)| row * self.side + column);
        let border = others
            .map(|other| self.border(own, other, reach, label))
            .max()
            .unwrap_or(Border::None);
        match (self.face[own], border) {
            (_, Border::Line) => Some([255.0 * LINE; 3]),
            (NOTHING, _) => None,
            (face, border) => {
                let seam = if border == Border::Seam { SEAM } else { 1.0 };
                let shaded = |channel| f64::from(channel) * f64::from(self.shade[own]) * seam;
                Some(color[face as usize].map(shaded))
            }
        }
    }

    fn border(&self, own: usize, other: usize, reach: usize, label: &[i32]) -> Border {
        let [a, b] = [own, other].map(|sample| self.face[sample]);
        if a == NOTHING || b == NOTHING {
            return if a == b { Border::None } else { Border::Line };
        }
        let is_cliff = (self.depth[own] - self.depth[other]).abs() > CLIFF * reach as f32;
        if label[a as usize] != label[b as usize] || (a == b && is_cliff) {
            Border::Line
        } else if a != b {
            Border::Seam
        } else {
            Border::None
        }
    }
}

/// The mean of the samples of a pixel, of which `n_covered` show a surface with these colors in sum.
fn mixed(sum: [f64; 3], n_covered: f64, n_samples: f64, background: Background) -> [u8; 4] {
    let opaque = |[r, g, b]: [u8; 3]| [r, g, b, 255];
    match background.color() {
        Some(color) => opaque([0, 1, 2].map(|channel| {
            let behind = (n_samples - n_covered) * f64::from(color[channel]);
            ((sum[channel] + behind) / n_samples).round() as u8
        })),
        None if n_covered == 0.0 => [0; 4],
        None => {
            let [r, g, b] = sum.map(|total| (total / n_covered).round() as u8);
            [r, g, b, (255.0 * n_covered / n_samples).round() as u8]
        }
    }
}

/// The brightness at the corners of a triangle.
pub(crate) fn corner_shades(
    mesh: &Mesh,
    normals: &[[f32; 3]],
    camera: &Camera,
    triangle: usize,
) -> [f64; 3] {
    let facet = facet_normal(mesh.corners(triangle));
    mesh.triangles[triangle].map(|vertex| {
        let normal = normals[vertex as usize].map(f64::from);
        // If a mean normal points to the other side, the facet's own normal is used.
        camera.brightness(if dot(normal, facet) > 0.0 {
            normal
        } else {
            facet
        })
    })
}

/// The projected corners of the square that shows a point of a cloud, and its brightness. The size of the squares is such that a
/// closed surface of this many points has few holes.
pub(crate) fn point_square(
    cloud: &Mesh,
    camera: &Camera,
    point: usize,
    side: usize,
) -> ([Point; 4], f64) {
    let n_points = cloud.triangles.len() as f64;
    let half = (POINT_SIZE * side as f64 / n_points.sqrt()).max(0.5);
    let [vertex, ..] = cloud.triangles[point];
    let [x, y, depth] = camera.project(cloud.vertices[vertex as usize]);
    let normal = cloud.vertex_normal[vertex as usize].map(f64::from);
    let corner = |u: f64, v: f64| [x + u * half, y + v * half, depth];
    let corners = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    (corners, camera.brightness(normal))
}

/// Visits each sample of a square of `side` samples whose center is inside of a projected triangle, with its row, its column and
/// the weights of the three corners.
pub(crate) fn for_each_sample(
    [a, b, c]: [Point; 3],
    side: usize,
    mut visit: impl FnMut(usize, usize, [f64; 3]),
) {
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 || !area.is_finite() {
        return;
    }
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
        let high = a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize;
        low..high.min(side)
    };
    let (columns, rows) = (range(0), range(1));
    for row in rows {
        for column in columns.clone() {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let p = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area;
            let q = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area;
            let weights = [p, q, 1.0 - p - q];
            if weights.iter().all(|&weight| weight >= 0.0) {
                visit(row, column, weights);
            }
        }
    }
}

/// The kind of the line between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Border {
    None,
    /// Two faces of one label.
    Seam,
    /// Two labels, or the end of a surface.
    Line,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that make a square, seen from the front: faces 0 and 1.
    fn square() -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 0.0, 1.0],
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0],
            ],
            vertex_face: vec![0, 0, 0, 1, 1, 1],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            tri_face: vec![0, 1],
            vertex_normal: Vec::new(),
        }
    }

    const FRONT: Look = Look {
        toward: [0.0, -1.0, 0.0],
        up: [0.0, 0.0, 1.0],
    };
    const WHITE: Background = Background::White;
    const COLORS: [[u8; 3]; 2] = [[200, 0, 0], [0, 200, 0]];

    fn n_dark(image: &Image) -> usize {
        image
            .rgba
            .chunks_exact(4)
            .filter(|pixel| pixel[..3].iter().all(|&channel| channel < 130))
            .count()
    }

    #[test]
    fn a_face_is_seen_in_its_color_and_the_rest_is_white() {
        let view = View::of(&square(), FRONT, 96);
        let image = view.painted(&[0, 1], &COLORS, 3, WHITE);
        assert_eq!((image.width, image.rgba.len()), (32, 32 * 32 * 4));
        let pixel = |row: usize, column: usize| &image.rgba[(row * 32 + column) * 4..][..4];
        assert_eq!(pixel(0, 0), [255; 4]);
        let [lower, upper] = [pixel(24, 20), pixel(8, 12)];
        assert!(
            lower[0] > 150 && lower[1] == 0 && upper[1] > 150 && upper[0] == 0,
            "{lower:?} {upper:?}"
        );
    }

    #[test]
    fn a_background_is_seen_where_there_is_no_surface() {
        let view = View::of(&square(), FRONT, 96);
        let corner = |background| view.painted(&[0, 1], &COLORS, 3, background).rgba[..4].to_vec();
        assert_eq!(corner(Background::Transparent), [0; 4]);
        assert_eq!(corner(Background::Color([1, 2, 3])), [1, 2, 3, 255]);
        let image = view.painted(&[0, 1], &COLORS, 3, Background::Transparent);
        let alphas = || image.rgba.chunks_exact(4).map(|pixel| pixel[3]);
        assert!(alphas().any(|alpha| alpha == 255));
        assert!(alphas().any(|alpha| 0 < alpha && alpha < 255));
    }

    #[test]
    fn lines_separate_labels_and_seams_separate_faces() {
        let view = View::of(&square(), FRONT, 96);
        let (two, one) = (
            view.painted(&[0, 1], &COLORS, 3, WHITE),
            view.painted(&[0, 0], &[COLORS[0]; 2], 3, WHITE),
        );
        assert!(
            n_dark(&two) > n_dark(&one) + 20,
            "{} {}",
            n_dark(&two),
            n_dark(&one)
        );
        assert_eq!((view.n_visible(&[0, 1]), view.n_visible(&[5, 5])), (2, 1));
    }

    #[test]
    fn the_nearer_surface_hides_the_other_in_any_order() {
        let mut mesh = square();
        for corner in 3..6 {
            mesh.vertices[corner] = [
                mesh.vertices[corner - 3][0],
                1.0,
                mesh.vertices[corner - 3][2],
            ];
        }
        let front = View::of(&mesh, FRONT, 64);
        mesh.triangles.reverse();
        mesh.tri_face.reverse();
        for view in [front, View::of(&mesh, FRONT, 64)] {
            assert_eq!(view.n_visible(&[0, 1]), 1);
            assert!(view.face.contains(&0) && !view.face.contains(&1));
        }
    }

    #[test]
    fn points_of_a_cloud_are_seen_as_squares() {
        let at = |i: u32, j: u32| [f64::from(i) / 9.0, 0.0, f64::from(j) / 9.0];
        let points: Vec<Point> = (0..10)
            .flat_map(|i| (0..10).map(move |j| at(i, j)))
            .collect();
        let mut cloud = Mesh::cloud(points, vec![[0.0, -1.0, 0.0]; 100]);
        cloud.tri_face = (0..100).map(|point| u32::from(50 <= point)).collect();
        let view = View::of(&cloud, FRONT, 96);
        assert_eq!(view.n_visible(&[0, 1]), 2);
        let image = view.painted(&[0, 1], &COLORS, 3, WHITE);
        let n_red = image
            .rgba
            .chunks_exact(4)
            .filter(|pixel| pixel[0] > 100 && pixel[1] == 0);
        assert!(n_red.count() > 200);
    }

    #[test]
    fn empty_shapes_and_invalid_numbers_are_drawn_as_nothing() {
        let empty = View::of(&Mesh::default(), FRONT, 32);
        assert!(
            empty
                .painted(&[], &[], 2, WHITE)
                .rgba
                .iter()
                .all(|&channel| channel == 255)
        );
        let mut mesh = square();
        mesh.vertices[0][0] = f64::NAN;
        assert_eq!(View::of(&mesh, FRONT, 32).n_visible(&[0, 1]), 1);
    }
}

//! The z-buffer.

use super::camera::Camera;
use super::palette::color_of_group;
use anyhow::Result;
use carrier::Mesh;

/// Samples along each side of a pixel: edges are smoothed by averaging them.
const SUPERSAMPLE: usize = 3;

/// An RGB image, three bytes a pixel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height * 3` bytes.
    pub rgb: Vec<u8>,
}

/// What to draw: a mesh, and the group that colours each triangle.
pub struct Picture<'a> {
    /// The triangles.
    pub mesh: &'a Mesh,
    /// One group for each triangle; lines are drawn where groups meet.
    pub groups: &'a [i32],
    /// Side of the square image, in pixels.
    pub size: usize,
}

/// What the nearest surface of each sample is; `None` where there is background.
struct Buffer {
    side: usize,
    nearest: Vec<f64>,
    seen: Vec<Option<(i32, f32)>>,
}

/// Draws the picture on a white ground.
#[must_use]
pub fn draw(picture: &Picture<'_>) -> Image {
    let side = picture.size * SUPERSAMPLE;
    let camera = Camera::fitted(&picture.mesh.vertices, side);
    let mut buffer = Buffer { side, nearest: vec![f64::MIN; side * side], seen: vec![None; side * side] };
    for (triangle, &group) in picture.groups.iter().enumerate() {
        let corners = picture.mesh.corners(triangle);
        let shade = camera.brightness(corners) as f32;
        buffer.fill(corners.map(|corner| camera.project(corner)), (group, shade));
    }
    buffer.averaged(picture.size)
}

impl Buffer {
    /// Fills one projected triangle where nothing nearer has been drawn.
    fn fill(&mut self, [a, b, c]: [[f64; 3]; 3], seen: (i32, f32)) {
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |axis: usize| {
            let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
            let high = a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize;
            low..high.min(self.side)
        };
        let (columns, rows) = (range(0), range(1));
        for row in rows {
            for column in columns.clone() {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let p = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area;
                let q = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area;
                let r = 1.0 - p - q;
                let depth = p * a[2] + q * b[2] + r * c[2];
                let sample = row * self.side + column;
                if p >= 0.0 && q >= 0.0 && r >= 0.0 && self.nearest[sample] < depth {
                    self.nearest[sample] = depth;
                    self.seen[sample] = Some(seen);
                }
            }
        }
    }

    fn color_at(&self, row: usize, column: usize) -> [f64; 3] {
        let own = self.seen[row * self.side + column];
        let reach = SUPERSAMPLE - 1;
        let is_border = [(row, column + reach), (row + reach, column)]
            .into_iter()
            .filter(|&(row, column)| row < self.side && column < self.side)
            .any(|(row, column)| self.seen[row * self.side + column].map(|seen| seen.0) != own.map(|seen| seen.0));
        match own {
            _ if is_border => [0.12; 3],
            Some((group, shade)) => color_of_group(group).map(|channel| channel * f64::from(shade)),
            None => [1.0; 3],
        }
    }

    fn averaged(&self, size: usize) -> Image {
        let mut rgb = Vec::with_capacity(size * size * 3);
        for row in 0..size {
            for column in 0..size {
                let mut sum = [0.0; 3];
                for sample in 0..SUPERSAMPLE * SUPERSAMPLE {
                    let color = self.color_at(
                        row * SUPERSAMPLE + sample / SUPERSAMPLE,
                        column * SUPERSAMPLE + sample % SUPERSAMPLE,
                    );
                    for channel in 0..3 {
                        sum[channel] += color[channel];
                    }
                }
                rgb.extend(sum.map(|total| (255.0 * total / (SUPERSAMPLE * SUPERSAMPLE) as f64).round() as u8));
            }
        }
        Image { width: size, height: size, rgb }
    }
}

impl Image {
    /// Images in rows of `columns`, on a white sheet.
    #[must_use]
    pub fn sheet(images: &[Image], columns: usize) -> Image {
        let (cell_width, cell_height) = images.first().map_or((0, 0), |image| (image.width, image.height));
        let columns = columns.clamp(1, images.len().max(1));
        let (width, height) = (cell_width * columns, cell_height * images.len().div_ceil(columns));
        let mut rgb = vec![255; width * height * 3];
        for (cell, image) in images.iter().enumerate() {
            let (left, top) = (cell % columns * cell_width, cell / columns * cell_height);
            for (row, line) in image.rgb.chunks_exact(image.width.max(1) * 3).enumerate() {
                let start = ((top + row) * width + left) * 3;
                rgb[start..start + line.len()].copy_from_slice(line);
            }
        }
        Image { width, height, rgb }
    }

    /// The image as a PNG file.
    ///
    /// # Errors
    /// If the image is empty or too large for the format.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, u32::try_from(self.width)?, u32::try_from(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_seen_in_its_colour_and_the_rest_is_white() {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]],
            tri_face: vec![0],
            vertex_normal: Vec::new(),
        };
        let image = draw(&Picture { mesh: &mesh, groups: &[0], size: 32 });
        assert_eq!(image.rgb.len(), 32 * 32 * 3);
        assert_eq!(image.rgb[..3], [255, 255, 255]);
        let colored = image.rgb.chunks_exact(3).filter(|pixel| pixel.iter().max() != pixel.iter().min()).count();
        assert!(colored > 50, "{colored}");
        assert!(image.to_png().unwrap().starts_with(b"\x89PNG"));
    }
}

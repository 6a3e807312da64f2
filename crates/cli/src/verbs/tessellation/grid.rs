//! Draws pictures of one shape: one row per source, and one column per tessellation. Matched labels have the same color.

use super::carriers::{TESSELLATIONS, TessellatedShape};
use super::measure::Consistency;
use crate::verbs::sources::matched_colors;
use anyhow::Result;
use partprobe_render::{Image, LabelView, Rgb, colors_of_triangle_labels};

/// Side of one picture, in pixels.
const PICTURE_SIZE: usize = 320;

/// Draws the grid of a shape. A source that refuses the shape has no row.
///
/// # Errors
/// If the shape has no area, or its carriers contradict themselves.
pub(super) fn grid(
    consistency: &Consistency,
    tessellated: &TessellatedShape,
    title: &str,
) -> Result<Image> {
    let carriers = tessellated.at_tau_min(consistency.tau_min)?;
    let points = consistency.points(&carriers[0])?;
    let mut cells = Vec::new();
    let mut view: Option<LabelView> = None;
    for source in &consistency.sources {
        let mut first: Option<(Vec<i32>, Vec<Rgb>)> = None;
        let mut row = Vec::new();
        for ((name, _), carrier) in TESSELLATIONS.into_iter().zip(&carriers) {
            let Ok(labels) = source.labels(carrier, consistency.seed) else {
                break;
            };
            let of_triangle = labels.of_triangles().of_triangle();
            let mesh = carrier.mesh();
            let on_points = points.labels_on(carrier, &labels)?;
            let fixed = match &first {
                Some((reference, colors)) => matched_colors(&on_points, reference, colors),
                None => Vec::new(),
            };
            let colors = colors_of_triangle_labels(mesh, of_triangle, &fixed);
            let view = *view
                .get_or_insert_with(|| LabelView::seeing_most(mesh, of_triangle, PICTURE_SIZE));
            let caption = format!("{name} {}: {}", source.name(), labels.n_labels());
            row.push(
                view.picture(mesh, of_triangle, &colors)
                    .with_caption("", &caption, 1.0),
            );
            if first.is_none() {
                first = Some((on_points, colors));
            }
        }
        if row.len() == TESSELLATIONS.len() {
            cells.extend(row);
        }
    }
    Ok(Image::sheet(&cells, TESSELLATIONS.len()).with_caption(title, "", 1.0))
}

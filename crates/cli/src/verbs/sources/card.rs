//! Makes the card of a set of label sources on a data set: measures of their labels, their agreement, and pictures of the shapes
//! on which two of them differ most.
//!
//! Shapes and names of sources go in. A table comes out on stdout, and with `--out` as Markdown and JSON with one PNG per
//! picture. `partprobe_eval` makes every number, and `partprobe_render` every picture.

use crate::config::{NormalConfig, SampleConfig};
use crate::damaged_carriers::{is_damaged_carrier, refuse_damaged_carriers};
use crate::interrupt::Interrupt;
use crate::label_sources::listed_sources;
use crate::own_output::OwnOutput;
use crate::points::points_of;
use crate::shape_choice::ChoiceArgs;
use crate::shape_input::{DataArgs, ShapeInput, ShapeInputs};
use crate::source_rows::{MeasuredSurface, pair_rows};
use crate::stderr;
use crate::stdout::{print_line, print_tables};
use anyhow::{Result, ensure};
use partprobe_carrier::{Carrier, PointSample};
use partprobe_dataset::write_atomically;
use partprobe_eval::{
    Bootstrap, CardRow, CardTables, Confusion, PairRow, RefusedShape, card_tables, match_clusters,
};
use partprobe_render::{Image, LabelView, Rgb, colors_of_triangle_labels};
use partprobe_sources::{BoxedSource, SourceLabels};
use std::path::{Path, PathBuf};

/// The number of shapes that are measured between two checks for Ctrl-C. It has no other effect.
const SHAPES_AT_ONCE: usize = 16;
/// Bootstrap draws of the intervals.
const DRAWS: usize = 2000;
/// The number of shapes of which pictures are made.
const N_PICTURES: usize = 5;
/// Side of one picture, in pixels.
const PICTURE_SIZE: usize = 360;

/// The files of a card.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "sources",
    marker: Some("sources.md"),
    is_own: |name| {
        ["sources.md", "sources.json"].contains(&name)
            || (name.starts_with("different-") && name.ends_with(".png"))
    },
};

/// The input of a card.
pub(crate) struct CardRequest<'a> {
    pub(crate) sources: &'a [String],
    pub(crate) data: &'a DataArgs,
    pub(crate) choice: &'a ChoiceArgs,
    pub(crate) n_points: usize,
    pub(crate) out: Option<&'a PathBuf>,
    /// Whether the output of an earlier call is replaced.
    pub(crate) force: bool,
    pub(crate) is_json: bool,
}

/// Measures the sources on every shape, prints the card, and writes it with its pictures.
///
/// # Errors
/// If an argument is invalid, no shape could be labeled, or a file cannot be written.
pub(crate) fn source_card(request: &CardRequest<'_>) -> Result<()> {
    let sources = listed_sources(&request.data.settings()?, request.sources)?;
    request.choice.check()?;
    if let Some(out) = request.out {
        OUTPUT.ensure_free(out, request.force, &request.data.paths)?;
    }
    request.data.check()?;
    let shape_args = request.data.shape_args();

    let interrupt = Interrupt::listen()?;
    let shapes = shape_args.open_for("card", &interrupt)?;
    let pool = shape_args.thread_pool()?;
    let card = Card { request, sources };
    let (tables, n_damaged) = pool.install(|| card.measure(&shapes, &interrupt))?;
    ensure!(
        !tables.sources.is_empty(),
        "no shape could be labeled by any of the sources"
    );
    if let Some(out) = request.out {
        let _lock = OUTPUT.take(
            out,
            "writing a card into",
            request.force,
            &request.data.paths,
        )?;
        pool.install(|| card.write(out, &tables, &shapes))?;
    }
    if request.is_json {
        print_line(tables.to_json().trim_end())?;
    } else {
        print_tables(tables.to_markdown().trim_end())?;
    }
    refuse_damaged_carriers(n_damaged)
}

/// The sources of a card.
struct Card<'a> {
    request: &'a CardRequest<'a>,
    sources: Vec<BoxedSource>,
}

/// The measurements of one shape.
#[derive(Default)]
struct MeasuredShape {
    rows: Vec<CardRow>,
    pairs: Vec<PairRow>,
    refused: Vec<RefusedShape>,
    /// 1 if the carrier was damaged; their number for all shapes together.
    n_damaged: usize,
}

impl Card<'_> {
    /// The tables, and the number of damaged carriers.
    fn measure(&self, shapes: &ShapeInputs, interrupt: &Interrupt) -> Result<(CardTables, usize)> {
        let mut all = MeasuredShape::default();
        all.refused.extend(shapes.failed.iter().map(|failed| {
            self.refused_by_all(&failed.id, format!("it has no carrier: {}", failed.reason))
        }));
        let chosen = self.request.choice.choose(&shapes.shapes);
        let found = chosen.measured("label", SHAPES_AT_ONCE, interrupt, |shape| {
            self.measured_shape(shape)
        })?;
        for shape in found {
            all.rows.extend(shape.rows);
            all.pairs.extend(shape.pairs);
            all.refused.extend(shape.refused);
            all.n_damaged += shape.n_damaged;
        }
        let bootstrap = Bootstrap {
            draws: DRAWS,
            seed: self.request.choice.seed,
            least_groups: Bootstrap::LEAST_GROUPS,
        };
        let names = self.request.sources;
        let tables = card_tables(
            all.rows,
            all.pairs,
            all.refused,
            names,
            N_PICTURES,
            bootstrap,
        );
        Ok((tables, all.n_damaged))
    }

    fn measured_shape(&self, shape: &ShapeInput) -> MeasuredShape {
        let labeled = shape
            .carrier()
            .and_then(|carrier| self.labeled(&carrier, &shape.source));
        labeled.unwrap_or_else(|error| MeasuredShape {
            n_damaged: usize::from(is_damaged_carrier(&error)),
            refused: vec![self.refused_by_all(&shape.id, format!("{error:#}"))],
            ..MeasuredShape::default()
        })
    }

    fn refused_by_all(&self, shape: &str, reason: String) -> RefusedShape {
        RefusedShape {
            source: "all sources".to_owned(),
            shape: shape.to_owned(),
            reason,
        }
    }

    fn labeled(&self, carrier: &Carrier, group: &str) -> Result<MeasuredShape> {
        let sample = self.sample(carrier)?;
        let surface = MeasuredSurface::of(carrier);
        let mut measured = MeasuredShape::default();
        let mut of_points: Vec<(&str, Vec<i32>)> = Vec::new();
        for source in &self.sources {
            let found = self.labels(source, carrier).and_then(|labels| {
                let points = labels.label_of_points(&sample)?;
                Ok((labels, points))
            });
            match found {
                Err(error) => measured.refused.push(RefusedShape {
                    source: source.name().to_owned(),
                    shape: carrier.meta().id.clone(),
                    reason: format!("{error:#}"),
                }),
                Ok((labels, points)) => {
                    measured
                        .rows
                        .push(surface.row(source.name(), &labels, group));
                    of_points.push((source.name(), points));
                }
            }
        }
        let of_points: Vec<(&str, &[i32])> = of_points
            .iter()
            .map(|(source, labels)| (*source, labels.as_slice()))
            .collect();
        measured.pairs = pair_rows(&of_points, &carrier.meta().id, group);
        Ok(measured)
    }

    fn labels(&self, source: &BoxedSource, carrier: &Carrier) -> Result<SourceLabels> {
        Ok(source.labels(carrier, self.request.choice.seed)?)
    }

    fn sample(&self, carrier: &Carrier) -> Result<PointSample> {
        let config = SampleConfig {
            n_points: self.request.n_points,
            normals: NormalConfig::Triangle,
            seed: self.request.choice.seed,
        };
        Ok(points_of(&carrier.meta().id, carrier, &config)?)
    }

    fn write(&self, out: &Path, tables: &CardTables, shapes: &ShapeInputs) -> Result<()> {
        write_atomically(&out.join("sources.md"), tables.to_markdown().as_bytes())?;
        write_atomically(&out.join("sources.json"), tables.to_json().as_bytes())?;
        for (number, pair) in (1..).zip(&tables.most_different) {
            let shape = shapes.shapes.iter().find(|shape| shape.id == pair.shape);
            let Some(shape) = shape else { continue };
            let picture = self.picture(&shape.carrier()?, pair)?;
            write_atomically(
                &out.join(format!("different-{number}.png")),
                &picture.to_png()?,
            )?;
        }
        stderr::print_line(format_args!("{}: the card and its pictures", out.display()));
        Ok(())
    }

    /// The pictures of one shape by all sources that label it, in a row. Labels that are matched to a label of the first picture
    /// have its color.
    fn picture(&self, carrier: &Carrier, pair: &PairRow) -> Result<Image> {
        let mesh = carrier.mesh();
        let sample = self.sample(carrier)?;
        let mut first: Option<(LabelView, Vec<i32>, Vec<Rgb>)> = None;
        let mut images = Vec::new();
        for source in &self.sources {
            let Ok(labels) = self.labels(source, carrier) else {
                continue;
            };
            let of_triangle = labels.of_triangles().of_triangle();
            let on_points: Vec<i32> = sample
                .triangles
                .iter()
                .map(|&triangle| of_triangle[triangle as usize])
                .collect();
            let (view, fixed) = match &first {
                Some((view, reference, colors)) => {
                    (*view, matched_colors(&on_points, reference, colors))
                }
                None => (
                    LabelView::seeing_most(mesh, of_triangle, PICTURE_SIZE),
                    Vec::new(),
                ),
            };
            let colors = colors_of_triangle_labels(mesh, of_triangle, &fixed);
            let caption = format!("{}: {}", source.name(), labels.n_labels());
            images.push(
                view.picture(mesh, of_triangle, &colors)
                    .with_caption("", &caption, 1.0),
            );
            if first.is_none() {
                first = Some((view, on_points, colors));
            }
        }
        let sheet = Image::sheet(&images, images.len());
        let [a, b] = &pair.sources;
        Ok(sheet.with_caption(
            &pair.shape,
            &format!(": ARI of {a} and {b} {:.3}", pair.ari),
            1.0,
        ))
    }
}

/// The colors of the labels that are matched to a label of the reference, by label.
pub(crate) fn matched_colors(
    labels: &[i32],
    reference: &[i32],
    color_of_reference: &[Rgb],
) -> Vec<Option<Rgb>> {
    let Ok(confusion) = Confusion::of_labels(labels, reference) else {
        return Vec::new();
    };
    let n_labels = confusion
        .predicted_ids()
        .last()
        .map_or(0, |&last| last as usize + 1);
    let mut fixed = vec![None; n_labels];
    let matching = match_clusters(&confusion);
    for (&part, column) in confusion
        .reference_ids()
        .iter()
        .zip(matching.cluster_of_part)
    {
        if let (Some(column), Ok(part)) = (column, usize::try_from(part)) {
            let label = confusion.predicted_ids()[column] as usize;
            fixed[label] = color_of_reference.get(part).copied();
        }
    }
    fixed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matched_labels_take_the_color_of_their_part() {
        let colors = [[1; 3], [2; 3]];
        let fixed = matched_colors(&[3, 3, 0, 0, 1], &[0, 0, 1, 1, 1], &colors);
        assert_eq!(fixed, [Some([2; 3]), None, None, Some([1; 3])]);
        assert!(matched_colors(&[0], &[-1], &colors).is_empty());
    }
}

//! Draws one carrier as one cell of a sheet.

use crate::camera::CORNERS;
use crate::view::View;
use crate::{FaceLabel, Image, MissingLayer};
use partprobe_carrier::{Carrier, Point};
use std::collections::BTreeSet;

/// Where the camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Viewpoint {
    /// The corner, of eight, from which most labels are seen.
    Best,
    /// Always the upper front right.
    Corner,
}

/// Side of the small pictures by which corners are compared.
const TRIAL_SIDE: usize = 160;
/// Pictures with longer sides are smoothed less, so that memory stays in bounds.
const FINE_SIZE: usize = 1024;

/// How a carrier is drawn.
#[derive(Clone, Debug)]
pub struct PictureStyle {
    /// What gives a face its color.
    pub label: FaceLabel,
    /// Side of the picture, in pixels.
    pub size: usize,
    /// Where the camera stands.
    pub viewpoint: Viewpoint,
}

impl PictureStyle {
    /// The picture of a carrier.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn picture(&self, carrier: &Carrier) -> Result<Image, MissingLayer> {
        let labels = self.label.of_faces(carrier)?;
        let colors = self.label.colors_of_faces(carrier)?;
        Ok(self
            .view(carrier)
            .painted(&labels, &colors, self.fineness()))
    }

    /// Faces, types and parts side by side, each with its count; parts are those of the style's label, or the labels of its layer.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn stages(&self, carrier: &Carrier) -> Result<Image, MissingLayer> {
        let view = self.view(carrier);
        let parts = match &self.label {
            FaceLabel::Type | FaceLabel::Face => FaceLabel::Part,
            parts => parts.clone(),
        };
        let mut stages = Vec::new();
        for label in [FaceLabel::Face, FaceLabel::Type, parts] {
            let labels = label.of_faces(carrier)?;
            let colors = label.colors_of_faces(carrier)?;
            let count = labels
                .iter()
                .filter(|&&label| label >= 0)
                .collect::<BTreeSet<_>>()
                .len();
            let image = view.painted(&labels, &colors, self.fineness());
            let plural = if count == 1 { "" } else { "s" };
            let caption = format!("{count} {}{plural}", label.noun());
            stages.push(image.with_caption("", &caption, self.text_scale()));
        }
        Ok(Image::sheet(&stages, stages.len()))
    }

    /// Pixels of a dot of the captions.
    #[must_use]
    pub fn text_scale(&self) -> usize {
        (self.size / 200).clamp(1, 3)
    }

    fn view(&self, carrier: &Carrier) -> View {
        View::of(
            carrier.mesh(),
            self.toward(carrier),
            self.size * self.fineness(),
        )
    }

    /// Samples along each side of a pixel; edges are smoothed by averaging them.
    fn fineness(&self) -> usize {
        if self.size > FINE_SIZE { 2 } else { 3 }
    }

    fn toward(&self, carrier: &Carrier) -> Point {
        if self.viewpoint == Viewpoint::Corner {
            return CORNERS[0];
        }
        // A picture by type or face is taken from where the parts are seen, so that pictures can be compared.
        let parts = carrier.part_of_face();
        let n_visible =
            |corner: usize| View::of(carrier.mesh(), CORNERS[corner], TRIAL_SIDE).n_visible(parts);
        let best =
            (0..CORNERS.len()).max_by_key(|&corner| (n_visible(corner), std::cmp::Reverse(corner)));
        CORNERS[best.unwrap_or(0)]
    }
}

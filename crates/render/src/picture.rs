//! Draws one carrier as one cell of a sheet.

use crate::areas::areas;
use crate::camera::Look;
use crate::outlines::outlines;
use crate::sight::Sight;
use crate::view::View;
use crate::{Background, Drawing, FaceLabel, Image, Legend, MissingLayer, UpAxis, Viewpoint};
use partprobe_carrier::Carrier;
use std::collections::BTreeSet;

/// The side of the small pictures by which corners are compared.
const TRIAL_SIDE: usize = 160;
/// Pictures with longer sides are smoothed less, to limit the memory.
const FINE_SIZE: usize = 1024;

/// The settings for drawing a carrier.
#[derive(Clone, Debug)]
pub struct PictureStyle {
    /// The label that determines the color of a face.
    pub label: FaceLabel,
    /// Side of the picture, in pixels.
    pub size: usize,
    /// The position of the camera.
    pub viewpoint: Viewpoint,
    /// The axis that points up.
    pub up: UpAxis,
    /// The background of the shape.
    pub background: Background,
    /// Whether there is a legend of the colors at the right side.
    pub legend: bool,
}

impl Default for PictureStyle {
    /// Parts on white, from the corner that shows most of them.
    fn default() -> Self {
        Self {
            label: FaceLabel::Part,
            size: 480,
            viewpoint: Viewpoint::Best,
            up: UpAxis::default(),
            background: Background::White,
            legend: false,
        }
    }
}

impl PictureStyle {
    /// The picture of a carrier.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn picture(&self, carrier: &Carrier) -> Result<Image, MissingLayer> {
        self.painted(&self.view(carrier), &self.label, carrier)
    }

    /// The picture by a label, with its legend.
    fn painted(
        &self,
        view: &View,
        label: &FaceLabel,
        carrier: &Carrier,
    ) -> Result<Image, MissingLayer> {
        let labels = label.of_faces(carrier)?;
        let colors = label.colors_of_faces(carrier)?;
        let image = view.painted(&labels, &colors, self.fineness(), self.background);
        if !self.legend {
            return Ok(image);
        }
        let legend = Legend::of(label, carrier)?;
        Ok(image.with_legend(&legend, self.text_scale()))
    }

    /// Faces, types and parts in a row, each with its count. Parts are those of the style's label, or the labels of its layer.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn stages(&self, carrier: &Carrier) -> Result<Image, MissingLayer> {
        let view = self.view(carrier);
        let mut stages = Vec::new();
        for label in self.stage_labels() {
            let caption = stage_caption(&label, carrier)?;
            let image = self.painted(&view, &label, carrier)?;
            stages.push(image.with_caption("", &caption, self.text_scale()));
        }
        Ok(Image::sheet(&stages, stages.len()))
    }

    /// The same picture as [`picture`](Self::picture), made of areas and lines. Hidden lines are left out.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn drawing(&self, carrier: &Carrier) -> Result<Drawing, MissingLayer> {
        self.drawn(&self.sight(carrier), &self.label, carrier)
    }

    /// The same pictures as [`stages`](Self::stages), of areas and lines.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub fn drawn_stages(&self, carrier: &Carrier) -> Result<Drawing, MissingLayer> {
        let sight = self.sight(carrier);
        let mut stages = Vec::new();
        for label in self.stage_labels() {
            let caption = stage_caption(&label, carrier)?;
            let drawing = self.drawn(&sight, &label, carrier)?;
            stages.push(drawing.with_caption("", &caption, self.text_scale()));
        }
        Ok(Drawing::sheet(&stages, stages.len()))
    }

    fn sight(&self, carrier: &Carrier) -> Sight {
        Sight::of(carrier.mesh(), self.look(carrier))
    }

    /// The drawing by a label, with its legend.
    fn drawn(
        &self,
        sight: &Sight,
        label: &FaceLabel,
        carrier: &Carrier,
    ) -> Result<Drawing, MissingLayer> {
        let labels = label.of_faces(carrier)?;
        let colors = label.colors_of_faces(carrier)?;
        let side = self.size as f64;
        let mut drawing = Drawing::blank(side, side, self.background);
        drawing.items = areas(sight, &colors, side);
        drawing
            .items
            .extend(outlines(sight, &labels, &colors, side));
        if !self.legend {
            return Ok(drawing);
        }
        let legend = Legend::of(label, carrier)?;
        Ok(drawing.with_legend(&legend, self.text_scale()))
    }

    /// The labels of the three stages.
    fn stage_labels(&self) -> [FaceLabel; 3] {
        let parts = match &self.label {
            FaceLabel::Type | FaceLabel::Face => FaceLabel::Part,
            parts => parts.clone(),
        };
        [FaceLabel::Face, FaceLabel::Type, parts]
    }

    /// Pixels per dot of the letters.
    #[must_use]
    pub fn text_scale(&self) -> f64 {
        (self.size as f64 / 240.0).clamp(1.0, 6.0)
    }

    fn view(&self, carrier: &Carrier) -> View {
        View::of(
            carrier.mesh(),
            self.look(carrier),
            self.size * self.fineness(),
        )
    }

    /// Samples along each side of a pixel. Edges are smoothed by averaging the samples.
    fn fineness(&self) -> usize {
        if self.size > FINE_SIZE { 2 } else { 3 }
    }

    /// The direction from which the carrier is seen.
    fn look(&self, carrier: &Carrier) -> Look {
        let corners = self.up.corners();
        match self.viewpoint {
            Viewpoint::Corner => return corners[0],
            Viewpoint::Angles {
                azimuth_deg,
                elevation_deg,
            } => return self.up.at_angles(azimuth_deg, elevation_deg),
            Viewpoint::From(direction) => return self.up.from(direction),
            Viewpoint::Best => {}
        }
        // Pictures by type or face use the viewpoint of the picture by parts, so that they can be compared.
        let parts = carrier.part_of_face();
        let n_visible =
            |corner: usize| View::of(carrier.mesh(), corners[corner], TRIAL_SIDE).n_visible(parts);
        let best =
            (0..corners.len()).max_by_key(|&corner| (n_visible(corner), std::cmp::Reverse(corner)));
        corners[best.unwrap_or(0)]
    }
}

/// The number of labels of a stage, in words.
fn stage_caption(label: &FaceLabel, carrier: &Carrier) -> Result<String, MissingLayer> {
    let labels = label.of_faces(carrier)?;
    let distinct: BTreeSet<i32> = labels.into_iter().filter(|&label| label >= 0).collect();
    let plural = if distinct.len() == 1 { "" } else { "s" };
    Ok(format!("{} {}{plural}", distinct.len(), label.noun()))
}

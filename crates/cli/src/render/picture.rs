//! One carrier as one cell of a sheet.

use super::camera::CORNERS;
use super::image::Image;
use super::view::View;
use crate::counted::counted;
use crate::face_label::FaceLabel;
use partprobe_carrier::{Carrier, Point};
use std::collections::BTreeSet;

/// Where the camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Standpoint {
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
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub(super) label: FaceLabel,
    pub(super) size: usize,
    pub(super) standpoint: Standpoint,
}

impl Style {
    /// The picture.
    pub(super) fn picture(&self, carrier: &Carrier) -> Image {
        self.view(carrier).painted(
            &self.label.of_faces(carrier),
            &self.label.colors_of_faces(carrier),
            self.fineness(),
        )
    }

    /// Faces, types and parts side by side, each with its count; parts are those of the style's label.
    pub(super) fn stages(&self, carrier: &Carrier) -> Image {
        let view = self.view(carrier);
        let parts = if self.label == FaceLabel::RawPart {
            FaceLabel::RawPart
        } else {
            FaceLabel::Part
        };
        let stages = [FaceLabel::Face, FaceLabel::Type, parts].map(|label| {
            let labels = label.of_faces(carrier);
            let count = labels
                .iter()
                .filter(|&&label| label >= 0)
                .collect::<BTreeSet<_>>()
                .len();
            let image = view.painted(&labels, &label.colors_of_faces(carrier), self.fineness());
            image.with_caption(
                "",
                &counted(count, label.noun(), &format!("{}s", label.noun())),
                self.text_scale(),
            )
        });
        Image::sheet(&stages, stages.len())
    }

    /// Pixels of a dot of the captions.
    pub(super) fn text_scale(&self) -> usize {
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
        if self.standpoint == Standpoint::Corner {
            return CORNERS[0];
        }
        // A picture by type or face is taken from where the parts are seen, so that pictures can be compared.
        let parts = carrier.face_label();
        let n_visible =
            |corner: usize| View::of(carrier.mesh(), CORNERS[corner], TRIAL_SIDE).n_visible(parts);
        let best =
            (0..CORNERS.len()).max_by_key(|&corner| (n_visible(corner), std::cmp::Reverse(corner)));
        CORNERS[best.unwrap_or(0)]
    }
}

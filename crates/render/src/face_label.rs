//! Tells which number of a face is shown or exported: its part, its primitive type or its own index.

use crate::{color_of_type, colors_of_labels};
use partprobe_carrier::Carrier;
use serde::Serialize;

/// What gives a face its label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum FaceLabel {
    /// The part after small ones were absorbed: `face_label` of the carrier, what networks are trained on.
    Part,
    /// The part by type and dihedral angle alone: `face_part` of the carrier.
    RawPart,
    /// The primitive type: 0 plane, 1 cylinder, 2 cone, 3 sphere, 4 torus, 5 bezier, 6 bspline, …
    Type,
    /// The face itself.
    Face,
}

impl FaceLabel {
    /// The label of each face.
    #[must_use]
    pub fn of_faces(self, carrier: &Carrier) -> Vec<i32> {
        match self {
            Self::Part => carrier.part_of_face().to_vec(),
            Self::RawPart => carrier.raw_part_of_face().to_vec(),
            Self::Type => carrier
                .graph()
                .faces
                .iter()
                .map(|face| i32::from(face.face_type.code()))
                .collect(),
            Self::Face => (0..).take(carrier.graph().faces.len()).collect(),
        }
    }

    /// The part of each face, for files that hold part, face and type beside each other.
    #[must_use]
    pub fn parts_of_faces(self, carrier: &Carrier) -> Vec<i32> {
        if self == Self::RawPart {
            carrier.raw_part_of_face().to_vec()
        } else {
            carrier.part_of_face().to_vec()
        }
    }

    /// The color of each face, different where labels touch; types have the same colors everywhere.
    #[must_use]
    pub fn colors_of_faces(self, carrier: &Carrier) -> Vec<[u8; 3]> {
        match self {
            Self::Type => carrier
                .graph()
                .faces
                .iter()
                .map(|face| color_of_type(face.face_type))
                .collect(),
            _ => colors_of_labels(
                &self.of_faces(carrier),
                carrier.graph().edges.iter().map(|edge| edge.faces),
            ),
        }
    }

    /// The word that stands for the label in file names.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Self::Part | Self::RawPart => "part",
            Self::Type => "type",
            Self::Face => "face",
        }
    }
}

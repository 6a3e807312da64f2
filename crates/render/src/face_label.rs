//! Defines which number of a face is shown or exported: its part, its primitive type, its own index, its color in the CAD file,
//! or its label in a stored layer.

use crate::palette::UNLABELED;
use crate::{Rgb, color_of_type, colors_of_labels};
use partprobe_carrier::{Carrier, Color, Face};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

/// The source of a face's label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FaceLabel {
    /// The part after small parts were absorbed: `face_label` of the carrier. Networks are trained on it.
    Part,
    /// The part by only type and dihedral angle: `face_part` of the carrier.
    RawPart,
    /// The primitive type: 0 plane, 1 cylinder, 2 cone, 3 sphere, 4 torus, 5 bezier, 6 bspline, …
    Type,
    /// The face itself.
    Face,
    /// The color of the face in the STEP file: 0 for the first color, 1 for the second, and so on, and -1 for a face without a
    /// color.
    Cad,
    /// A label layer that the carrier stores, by its name.
    Layer(String),
}

/// A carrier does not store the requested label layer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "it has no label layer `{name}`, only {known}; choose part, raw-part, type, face, cad or one of these layers (`label --layers` stores more)"
)]
pub struct MissingLayer {
    name: String,
    /// The layers that it stores, separated by commas.
    known: String,
}

/// The labels that need no layer, with their names on a command line.
const BUILT_IN: [(&str, FaceLabel); 5] = [
    ("part", FaceLabel::Part),
    ("raw-part", FaceLabel::RawPart),
    ("type", FaceLabel::Type),
    ("face", FaceLabel::Face),
    ("cad", FaceLabel::Cad),
];

impl FromStr for FaceLabel {
    type Err = Infallible;

    /// Any other word is the name of a layer.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        let built_in = BUILT_IN.into_iter().find(|(name, _)| *name == text);
        Ok(built_in.map_or_else(|| Self::Layer(text.to_owned()), |(_, label)| label))
    }
}

impl fmt::Display for FaceLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Layer(name) => f.write_str(name),
            built_in => {
                let named = BUILT_IN.iter().find(|(_, label)| label == built_in);
                f.write_str(named.map_or("", |(name, _)| name))
            }
        }
    }
}

impl Serialize for FaceLabel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl FaceLabel {
    /// The label of each face.
    ///
    /// # Errors
    /// If the carrier does not have the layer.
    pub fn of_faces(&self, carrier: &Carrier) -> Result<Vec<i32>, MissingLayer> {
        let faces = &carrier.graph().faces;
        match self {
            Self::Part => Ok(carrier.part_of_face().to_vec()),
            Self::RawPart => Ok(carrier.raw_part_of_face().to_vec()),
            Self::Type => Ok(faces
                .iter()
                .map(|face| i32::from(face.face_type.code()))
                .collect()),
            Self::Face => Ok((0..).take(faces.len()).collect()),
            Self::Cad => Ok(color_numbers(carrier)),
            Self::Layer(name) => match carrier.layer(name) {
                Some(layer) => Ok(layer.of_face().to_vec()),
                None => Err(missing(name, carrier)),
            },
        }
    }

    /// The part of each face, for files with part, face and type. A layer replaces the parts.
    ///
    /// # Errors
    /// If the carrier does not have the layer.
    pub fn parts_of_faces(&self, carrier: &Carrier) -> Result<Vec<i32>, MissingLayer> {
        match self {
            Self::RawPart | Self::Layer(_) => self.of_faces(carrier),
            Self::Part | Self::Type | Self::Face | Self::Cad => Self::Part.of_faces(carrier),
        }
    }

    /// The color of each face. Labels that touch have different colors, and types have the same colors in all pictures. Colors of
    /// the CAD file are shown without changes, and a face without a color is gray.
    ///
    /// # Errors
    /// If the carrier does not have the layer.
    pub fn colors_of_faces(&self, carrier: &Carrier) -> Result<Vec<[u8; 3]>, MissingLayer> {
        if *self == Self::Type {
            let faces = carrier.graph().faces.iter();
            return Ok(faces.map(|face| color_of_type(face.face_type)).collect());
        }
        if *self == Self::Cad {
            let faces = carrier.graph().faces.iter();
            return Ok(faces
                .map(|face| face.color.map_or(UNLABELED, rgb))
                .collect());
        }
        Ok(colors_of_labels(
            &self.of_faces(carrier)?,
            carrier.graph().edges.iter().map(|edge| edge.faces),
        ))
    }

    /// The word for the label in file names.
    #[must_use]
    pub fn noun(&self) -> &'static str {
        match self {
            Self::Part | Self::RawPart => "part",
            Self::Type => "type",
            Self::Face => "face",
            Self::Cad => "color",
            Self::Layer(_) => "label",
        }
    }
}

/// Red, green and blue without the opacity.
fn rgb(Color(rgba): Color) -> Rgb {
    let [r, g, b, _] = rgba.to_be_bytes();
    [r, g, b]
}

/// Numbers the colors of the faces in the order of their first faces.
fn color_numbers(carrier: &Carrier) -> Vec<i32> {
    let mut number_of = BTreeMap::new();
    let faces = carrier.graph().faces.iter();
    let number = |face: &Face| {
        let next = number_of.len() as i32;
        face.color
            .map_or(-1, |color| *number_of.entry(rgb(color)).or_insert(next))
    };
    faces.map(number).collect()
}

fn missing(name: &str, carrier: &Carrier) -> MissingLayer {
    let known: Vec<&str> = carrier.layers().keys().map(String::as_str).collect();
    MissingLayer {
        name: name.to_owned(),
        known: known.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in ["part", "raw-part", "type", "face", "cad", "ward-20"] {
            let Ok(label) = name.parse::<FaceLabel>();
            assert_eq!(label.to_string(), name);
            assert_eq!(matches!(label, FaceLabel::Layer(_)), name == "ward-20");
        }
    }
}

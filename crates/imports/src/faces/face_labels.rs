//! Defines the labels of the faces of one shape before they are matched to faces.

/// A label in a file: a number or a word. It is `None` if the face has no label.
pub(super) type RawLabel = Option<String>;

/// The labels of the faces of one shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FaceLabels {
    /// One label per face, in the order of the file's faces.
    InOrder(Vec<RawLabel>),
    /// Labels under a text that names a face: a STEP id, a name, or an index.
    Keyed(Vec<(String, RawLabel)>),
    /// Labels under the name of a face (ADVANCED_FACE).
    Named(Vec<(String, RawLabel)>),
    /// Labels under the STEP id of a face.
    ByStepId(Vec<(String, RawLabel)>),
}

/// The labels of one shape in a file with many shapes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedLabels {
    /// The name of the STEP file or of the shape, without changes.
    pub(super) file: String,
    /// The place of the labels in their file, for messages.
    pub(super) place: String,
    pub(super) labels: FaceLabels,
}

/// An entry of a file with many shapes whose labels cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DamagedLabels {
    /// The name of the STEP file or of the shape, if it can be read.
    pub(super) file: Option<String>,
    /// The place of the entry in the file of labels, for messages.
    pub(super) place: String,
    /// The reason why the labels cannot be read.
    pub(super) reason: String,
}

/// A label from its text. An empty text, a negative number and `nan` mean that there is no label. `3.0` is `3`, because some
/// tools write whole numbers as floats.
pub(super) fn raw_label(text: &str) -> RawLabel {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(number) if number < 0.0 || number.is_nan() => None,
        Ok(number) if number.fract() == 0.0 && number < 1e15 => Some(format!("{number:.0}")),
        _ => (!text.is_empty()).then(|| text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_any_notation() {
        for (text, expected) in [
            ("7", Some("7")),
            (" 7.000e+00 ", Some("7")),
            ("-1", None),
            ("-0.5", None),
            ("nan", None),
            ("", None),
            ("0", Some("0")),
            ("Extrude1", Some("Extrude1")),
            ("1.5", Some("1.5")),
        ] {
            assert_eq!(raw_label(text).as_deref(), expected, "{text}");
        }
    }
}

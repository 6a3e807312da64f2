//! Holds the labels of the faces of one shape before they are matched to faces.

/// A label as a file has it: a number or a word. `None` says that the face has no label.
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

/// The labels of a shape that a file with many shapes names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedLabels {
    /// The STEP file or the shape, as it is written.
    pub(super) file: String,
    /// Where the labels are in their file, for messages.
    pub(super) place: String,
    pub(super) labels: FaceLabels,
}

/// An entry of a file with many shapes whose labels cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DamagedLabels {
    /// The STEP file or the shape, if the entry still says it.
    pub(super) file: Option<String>,
    /// Where the entry is in the file of labels, for messages.
    pub(super) place: String,
    /// Why the labels cannot be read.
    pub(super) reason: String,
}

/// A label from its text. An empty text, a negative number and what is not a number although it claims to be (`nan`) say
/// that there is none. `3.0` is `3`, since some tools write whole numbers as floats.
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
    fn numbers_are_numbers_however_they_are_written() {
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

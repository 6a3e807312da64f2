//! Defines the interface of every type of import: it joins the labels of a shape to its carrier, and reports how.

use partprobe_carrier::Carrier;
use partprobe_sources::{LabelSource, Origin, SourceError, SourceLabels};
use std::fmt;

/// Labels of another program, for any number of shapes.
pub trait Import: Send + Sync {
    /// Joins the labels of this shape to its carrier. Files are read when their shape is requested.
    ///
    /// # Errors
    /// If there are no labels for the shape, they cannot be read, or it is not certain to which elements they belong.
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem>;

    /// Whether the labels are constant on each face of the B-Rep.
    fn labels_faces(&self) -> bool {
        false
    }

    /// The names of all entries with labels, for example files. They are used to find entries that no shape uses.
    ///
    /// # Errors
    /// If the labels cannot be listed.
    fn entries(&self) -> Result<Vec<String>, ImportError>;

    /// The names of the entries that are named after a shape. Their labels may not fit it.
    fn entries_of(&self, id: &str) -> Vec<String>;
}

/// The labels of a shape, and a report of the join.
#[derive(Clone, Debug)]
pub struct JoinedLabels {
    /// The labels, with their origin.
    pub labels: SourceLabels,
    /// The report of the join.
    pub report: JoinReport,
}

impl JoinedLabels {
    /// The same labels with another description of the join, in the report and in their origin.
    pub(crate) fn with_join_text(mut self, by: String) -> Self {
        self.report.by = by;
        let content_hash = self
            .labels
            .origin()
            .map(|origin| origin.content_hash.clone());
        let origin = Origin {
            content_hash: content_hash.unwrap_or_default(),
            join: self.report.to_string(),
        };
        Self {
            labels: self.labels.with_origin(origin),
            report: self.report,
        }
    }
}

/// A report of the join of one shape's labels to its carrier.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JoinReport {
    /// The entries with the labels, by the names of [`Import::entries`].
    pub entries: Vec<String>,
    /// The key by which the labels were joined, for example `step-id`.
    pub by: String,
    /// The kind of labeled elements, for example `faces`.
    pub items: &'static str,
    /// The number of these elements in the carrier.
    pub n_items: usize,
    /// The number of elements that got a label.
    pub n_matched: usize,
    /// The names of the elements without a label.
    pub unlabeled: Vec<String>,
    /// The names of labels that are not used.
    pub unused: Vec<String>,
    /// The number of labels whose faces are not all connected. Labels that are classes usually have such faces, and labels of parts
    /// do not. It is 0 if the labels are not of faces, or if connected faces were already separated.
    pub n_separate: usize,
}

/// The largest number of names in a message. Further ones are only counted.
const MAX_NAMED: usize = 5;

impl fmt::Display for JoinReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            by,
            items,
            n_items,
            n_matched,
            ..
        } = self;
        write!(f, "by {by}: {n_matched} of {n_items} {items} labeled")?;
        if !self.unlabeled.is_empty() {
            write!(f, ", without a label: {}", named(&self.unlabeled))?;
        }
        if !self.unused.is_empty() {
            write!(f, ", unused labels: {}", named(&self.unused))?;
        }
        Ok(())
    }
}

/// The first names, and the number of further ones.
pub(crate) fn named(names: &[String]) -> String {
    let shown = |name: &String| match name.as_str() {
        "" => "\"\"".to_owned(),
        name => name.to_owned(),
    };
    let first: Vec<String> = names.iter().take(MAX_NAMED).map(shown).collect();
    let n_more = names.len() - first.len();
    match n_more {
        0 => first.join(", "),
        _ => format!("{} and {n_more} more", first.join(", ")),
    }
}

/// The reason why a shape gets no labels.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum JoinProblem {
    /// No entry is named after the shape.
    #[error("no labels for this shape")]
    NoLabels,
    /// A file of labels cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// It is not certain to which elements the labels belong, or they do not fit.
    #[error("{0}")]
    Refused(String),
}

/// The reason why an import cannot be used at all.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// No type of import has this name.
    #[error("`{name}` is not a type of label file; the known ones are {known}")]
    UnknownType {
        /// The name.
        name: String,
        /// The types that exist, separated by commas.
        known: String,
    },
    /// The type does not know a parameter.
    #[error("type `{import_type}` has no key `{key}`; its keys are {known}")]
    UnknownKey {
        /// The type.
        import_type: &'static str,
        /// The parameter.
        key: String,
        /// The parameters that it knows, separated by commas.
        known: String,
    },
    /// A parameter that the type needs is not set.
    #[error("type `{import_type}` needs the key `{key}`; set it")]
    MissingKey {
        /// The type.
        import_type: &'static str,
        /// The parameter.
        key: &'static str,
    },
    /// A parameter has an invalid value.
    #[error("`{key}` is `{value}`; it must be {expected}")]
    Value {
        /// The parameter.
        key: &'static str,
        /// Its value.
        value: String,
        /// The valid values.
        expected: String,
    },
    /// The labels cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

/// An import under the name that a config gives it.
pub struct ImportedSource {
    name: String,
    import: Box<dyn Import>,
}

impl ImportedSource {
    /// The import as a label source of this name.
    #[must_use]
    pub fn new(name: impl Into<String>, import: Box<dyn Import>) -> Self {
        Self {
            name: name.into(),
            import,
        }
    }
}

impl LabelSource for ImportedSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn labels(&self, carrier: &Carrier, _seed: u64) -> Result<SourceLabels, SourceError> {
        let joined = self.import.join(carrier);
        joined
            .map(|joined| joined.labels)
            .map_err(|problem| SourceError::Unfit {
                reason: problem.to_string(),
            })
    }

    fn labels_faces(&self) -> bool {
        self.import.labels_faces()
    }
}

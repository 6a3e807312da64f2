//! Imports one label per face of the B-Rep: type `faces`.
//!
//! The layouts of several data sets and tools are recognized by their structure: `.seg` and other lists of numbers, the logits of
//! BRepNet, CSV with a header, and the JSON of MFCAD, MFCAD++, MFInstSeg, MFTRCAD, the timeline of Fusion 360 Gallery, and
//! partprobe's own lists.

mod csv;
mod face_labels;
mod instances;
mod join;
mod json;
mod text;

use crate::entries::{Content, Entries, Entry, plain_name};
use crate::import::{Import, ImportError, JoinProblem, JoinReport, JoinedLabels};
use crate::import_type::{ImportType, ParameterKey};
use crate::parameters;
use crate::shape_key::ShapeKey;
use face_labels::{DamagedLabels, FaceLabels, NamedLabels};
use join::{JoinBy, Scope};
use partprobe_carrier::{Carrier, sha256_hex};
use partprobe_sources::{Origin, SourceContext, SourceLabels};

/// Labels of B-Rep faces.
pub(crate) const FACES: ImportType = ImportType {
    name: "faces",
    description: "labels of B-Rep faces: .seg, CSV, JSON, JSONL, or the names of the faces themselves",
    keys: &[
        ParameterKey::optional(
            "path",
            "a folder with one file per shape, or one file with all shapes; .zst is unpacked",
        )
        .path(),
        ParameterKey::optional(
            "by",
            "how labels find their faces: auto, step-id, name, order, or name-is-label (no files)",
        ),
        ParameterKey::optional(
            "column",
            "which label to take if there are several: a CSV column, `class` or `instance`",
        ),
        ParameterKey::optional(
            "instances",
            "true: labels are classes, and connected faces of one class become one label",
        ),
        ParameterKey::optional(
            "background",
            "the class that is not divided into instances, for example the stock",
        ),
        ParameterKey::optional(
            "scope",
            "what a label is unique in: shape, or entry (a line per solid, each with its own numbers)",
        ),
    ],
    check_values: |context| Settings::of(context).map(drop),
    make: open_faces,
};

/// Suffixes that tools append to the name of a shape.
const SUFFIXES: &[&str] = &["_color_ids"];

/// The endings of label files in a folder.
const ENDINGS: &[&str] = &[".seg", ".csv", ".json", ".logits", ".txt"];

/// The settings of the join, and the path of the labels.
struct Settings {
    /// `None` if the labels are the names of the faces.
    path: Option<String>,
    by: JoinBy,
    column: Option<String>,
    instances: bool,
    background: Option<String>,
    scope: Scope,
}

impl Settings {
    fn of(context: &SourceContext) -> Result<Self, ImportError> {
        let text = |key: &str| context.parameter(key).map(str::to_owned);
        let by = parameters::choice(
            context,
            "by",
            &[
                ("auto", JoinBy::Auto),
                ("step-id", JoinBy::StepId),
                ("name", JoinBy::Name),
                ("order", JoinBy::Order),
                ("name-is-label", JoinBy::NameIsLabel),
            ],
        )?;
        Ok(Self {
            path: path_of(context, by)?,
            by,
            column: text("column"),
            instances: parameters::switch(context, "instances")?,
            background: text("background"),
            scope: parameters::choice(
                context,
                "scope",
                &[("shape", Scope::Shape), ("entry", Scope::Entry)],
            )?,
        })
    }
}

/// The path of the labels. Labels that are the names of the faces have none.
fn path_of(context: &SourceContext, by: JoinBy) -> Result<Option<String>, ImportError> {
    match (by, context.parameter("path")) {
        (JoinBy::NameIsLabel, None) => Ok(None),
        (JoinBy::NameIsLabel, Some(path)) => Err(ImportError::Value {
            key: "path",
            value: path.to_owned(),
            expected: "left out with by = \"name-is-label\", which reads the names of the faces"
                .to_owned(),
        }),
        (_, None) => Err(ImportError::MissingKey {
            import_type: FACES.name,
            key: "path",
        }),
        (_, Some(path)) => Ok(Some(path.to_owned())),
    }
}

/// The labels that are read, and the settings of the join.
struct Faces {
    /// `None` if the labels are the names of the faces.
    entries: Option<Entries<FaceLabels>>,
    settings: Settings,
}

fn open_faces(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
    let settings = Settings::of(context)?;
    let column = settings.column.as_deref();
    let key_of = |below: &str| {
        let is_label_file = ENDINGS
            .iter()
            .any(|ending| plain_name(below).ends_with(ending));
        is_label_file.then(|| ShapeKey::of_label_path(below, SUFFIXES))
    };
    let entries_at = |path: &String| {
        Entries::at(path, parameters::files(context)?, key_of, |path, bytes| {
            entries_of_file(path, &bytes, column)
        })
    };
    let entries = settings.path.as_ref().map(entries_at).transpose()?;
    Ok(Box::new(Faces { entries, settings }))
}

/// The shapes of a single file.
fn entries_of_file(
    path: &str,
    bytes: &[u8],
    column: Option<&str>,
) -> Result<Vec<Entry<FaceLabels>>, String> {
    let name = plain_name(path);
    if name.ends_with(".jsonl") {
        return entries_of_lines(path, bytes, column);
    }
    let shapes = if name.ends_with(".csv") {
        csv::shapes(bytes, column)?
    } else if name.ends_with(".json") {
        json::shapes(bytes, column)?
    } else {
        Vec::new()
    };
    if shapes.is_empty() {
        // The labels of one shape, which is named by the file.
        let labels = labels_of_file(path, bytes, column)?;
        return Ok(vec![Entry {
            name: path.to_owned(),
            key: ShapeKey::of_label_path(path, SUFFIXES),
            content: Content::Read(labels),
        }]);
    }
    Ok(shapes
        .into_iter()
        .map(|shape| named_entry(path, shape))
        .collect())
}

/// The shapes of a file with one shape per line. Damaged lines are also entries, so that messages can name them.
///
/// # Errors
/// If no line can be read.
fn entries_of_lines(
    path: &str,
    bytes: &[u8],
    column: Option<&str>,
) -> Result<Vec<Entry<FaceLabels>>, String> {
    let lines = json::shapes_of_lines(bytes, column);
    if let Some(Err(first)) = lines.first()
        && lines.iter().all(Result::is_err)
    {
        return Err(format!(
            "no line can be read; {}: {}",
            first.place, first.reason
        ));
    }

    let entry = |line: Result<NamedLabels, DamagedLabels>| match line {
        Ok(shape) => named_entry(path, shape),
        Err(damaged) => Entry {
            name: format!("{path}, {}", damaged.place),
            key: ShapeKey::of_step_path(damaged.file.as_deref().unwrap_or_default()),
            content: Content::Damaged(damaged.reason),
        },
    };
    Ok(lines.into_iter().map(entry).collect())
}

fn named_entry(path: &str, shape: NamedLabels) -> Entry<FaceLabels> {
    Entry {
        key: ShapeKey::of_step_path(&shape.file),
        name: format!("{path}, {}", shape.place),
        content: Content::Read(shape.labels),
    }
}

/// The labels of a file with one shape.
fn labels_of_file(path: &str, bytes: &[u8], column: Option<&str>) -> Result<FaceLabels, String> {
    let name = plain_name(path);
    if name.ends_with(".json") || name.ends_with(".jsonl") {
        json::labels(bytes, column)
    } else if name.ends_with(".csv") {
        csv::labels(bytes, column)
    } else if name.ends_with(".logits") {
        text::largest_of_rows(bytes)
    } else {
        text::one_per_line(bytes)
    }
}

impl Faces {
    /// The labels of a shape, entry by entry, with the names of the entries.
    fn labels_of(&self, id: &str) -> Result<(Vec<String>, Vec<FaceLabels>), JoinProblem> {
        let Some(entries) = &self.entries else {
            return Ok((Vec::new(), Vec::new()));
        };
        let mut names = Vec::new();
        let mut labels = Vec::new();
        for entry in entries.of_shape(id)? {
            names.push(entry.name.clone());
            labels.push(match &entry.content {
                Content::Read(labels) => labels.clone(),
                Content::Damaged(reason) => {
                    return Err(JoinProblem::Unreadable(format!("{}: {reason}", entry.name)));
                }
                Content::File(path) => {
                    let bytes = entries.read(path)?;
                    labels_of_file(path, &bytes, self.settings.column.as_deref())
                        .map_err(|reason| JoinProblem::Unreadable(format!("{path}: {reason}")))?
                }
            });
        }
        Ok((names, labels))
    }
}

impl Import for Faces {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let (entries, labels) = self.labels_of(&carrier.meta().id)?;
        let background = self.settings.background.as_deref();
        let joined = join::join(
            carrier,
            &labels,
            self.settings.by,
            self.settings.scope,
            background,
        )?;
        let graph = carrier.graph();
        let (label_of_face, n_separate) = if self.settings.instances {
            let labels = instances::of_classes(graph, &joined.label_of_face, background);
            (labels, 0)
        } else {
            let labels = join::numbered(&joined.label_of_face);
            (labels, instances::n_separate(graph, &joined.label_of_face))
        };

        let faces = &graph.faces;
        let unlabeled = faces
            .iter()
            .zip(&joined.label_of_face)
            .filter(|(_, label)| label.is_none());
        let report = JoinReport {
            entries,
            by: joined.by.to_owned(),
            items: "faces",
            n_items: faces.len(),
            n_matched: joined.label_of_face.iter().flatten().count(),
            unlabeled: unlabeled
                .map(|(face, _)| format!("#{}", face.step_id))
                .collect(),
            unused: joined.unused,
            n_separate,
        };
        let bytes: Vec<u8> = label_of_face
            .iter()
            .flat_map(|label| label.to_le_bytes())
            .collect();
        let origin = Origin {
            content_hash: sha256_hex(&bytes),
            join: report.to_string(),
        };
        let labels = SourceLabels::on_faces(carrier.mesh(), &label_of_face);
        Ok(JoinedLabels {
            labels: labels
                .with_origin(origin)
                .with_classes(joined.label_of_face),
            report,
        })
    }

    fn labels_faces(&self) -> bool {
        true
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self
            .entries
            .as_ref()
            .map(Entries::names)
            .unwrap_or_default())
    }

    fn entries_of(&self, id: &str) -> Vec<String> {
        self.entries
            .as_ref()
            .map(|entries| entries.names_of_shape(id))
            .unwrap_or_default()
    }
}

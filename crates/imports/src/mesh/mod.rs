//! Imports one label per triangle: type `mesh`.
//!
//! Labels are arrays or lists in the order of a mesh's triangles, or properties, groups or colors of the mesh itself. If the mesh
//! is that of the carrier, labels are joined by index. If it is another mesh, it is also read. Its triangles are found by their
//! corners, or each point of the carrier gets the label of the nearest triangle whose normal agrees.

mod join;
mod layout;
mod marks;
mod mesh_file;
mod values;

use crate::entries::{Content, Entries, Entry, one_path};
use crate::import::{Import, ImportError, JoinProblem, JoinedLabels};
use crate::import_type::{ImportType, ParameterKey};
use crate::parameters;
use crate::shape_key::ShapeKey;
pub(crate) use join::{JoinBy, JoinedMesh, Joining, with_report};
pub(crate) use marks::majority;
use marks::{AtPaletteLimit, MarkChoice};
pub(crate) use mesh_file::mesh_of;
use mesh_file::{in_millimeters, marked_mesh};
use partprobe_carrier::{Carrier, Mesh, sha256_hex};
use partprobe_formats::MarkedMesh;
use partprobe_sources::SourceContext;
use std::cell::RefCell;
pub(crate) use values::{Overlap, labels as triangle_labels};

/// Labels of triangles.
pub(crate) const MESH: ImportType = ImportType {
    name: "mesh",
    description: "labels of triangles: NPY, JSON, text, labeled PLY, OBJ and glTF, and the folders of P3-SAM, SAMPart3D and SAMesh",
    keys: &[
        ParameterKey::required(
            "path",
            "a folder with the labels of each shape, or a file with those of one",
        ).path(),
        ParameterKey::optional(
            "meshes",
            "a folder with the mesh that the labels belong to, if it is not the carrier (PLY, OBJ, GLB, STL, OFF)",
        ).path(),
        ParameterKey::optional(
            "by",
            "how labels find their triangles: auto, index, triangle, or nn-surface",
        ),
        ParameterKey::optional(
            "scale",
            "which labels of SAMPart3D to take: 0.0, 0.5, 1.0, 1.5 or 2.0",
        ),
        ParameterKey::optional(
            "overlap",
            "which mask labels a triangle that several cover: refuse, or smallest",
        ),
        ParameterKey::optional(
            "labels_from",
            "what of a labeled mesh to take: face-color, vertex-color, object, group, material, node, primitive, or the name of a property",
        ),
        ParameterKey::optional(
            "at_palette_limit",
            "what to do if there are as many colors as a common palette has: refuse, or accept",
        ),
        ParameterKey::optional(
            "unlabeled_color",
            "the color of triangles without a label: none, or a color such as #000000 (the default)",
        ),
        ParameterKey::optional(
            "tolerance",
            "triangle: how far corners may be apart, as a fraction of the diagonal (1e-5)",
        ),
        ParameterKey::optional(
            "max_distance",
            "nn-surface: how far the nearest triangle may be, as a fraction of the diagonal (0.01)",
        ),
        ParameterKey::optional(
            "max_angle_deg",
            "nn-surface: how far normals may differ, in degrees (45)",
        ),
    ],
    check_values: |context| Settings::of(context).map(drop),
    make: open_mesh,
};

/// The endings of mesh files.
const MESH_ENDINGS: &[&str] = &[".ply", ".obj", ".glb", ".gltf", ".stl", ".off"];

/// The settings of the join.
struct Settings {
    overlap: Overlap,
    marks: MarkChoice,
    joining: Joining,
}

impl Settings {
    fn of(context: &SourceContext) -> Result<Self, ImportError> {
        let joining = Joining {
            by: parameters::choice(
                context,
                "by",
                &[
                    ("auto", JoinBy::Auto),
                    ("index", JoinBy::Index),
                    ("triangle", JoinBy::Triangle),
                    ("nn-surface", JoinBy::NearestSurface),
                ],
            )?,
            tolerance: parameters::number(context, "tolerance", 0.0..=0.1, 1e-5)?,
            max_distance: parameters::number(context, "max_distance", 0.0..=1.0, 0.01)?,
            max_angle_deg: parameters::number(context, "max_angle_deg", 0.0..=180.0, 45.0)?,
        };
        Ok(Self {
            overlap: parameters::choice(
                context,
                "overlap",
                &[("refuse", Overlap::Refuse), ("smallest", Overlap::Smallest)],
            )?,
            marks: mark_choice(context)?,
            joining,
        })
    }
}

/// The labels that are read, and the settings of the join.
struct MeshLabels {
    entries: Entries<()>,
    meshes: Option<Entries<()>>,
    settings: Settings,
}

fn open_mesh(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
    let settings = Settings::of(context)?;
    let files = parameters::files(context)?;
    let scale = context.parameter("scale").map(str::to_owned);
    let path = context.parameter("path").unwrap_or_default();
    let entries = Entries::at(
        path,
        files.clone(),
        |below| layout::key_of_labels(below, scale.as_deref()),
        one_entry,
    )?
    .without_replaced(layout::is_marked);
    let is_mesh = |below: &str| MESH_ENDINGS.iter().any(|ending| below.ends_with(ending));
    let key_of_mesh = |below: &str| is_mesh(below).then(|| ShapeKey::of_label_path(below, &[]));
    let meshes = context
        .parameter("meshes")
        .map(|path| Entries::at(path, files, key_of_mesh, one_entry))
        .transpose()?;
    Ok(Box::new(MeshLabels {
        entries,
        meshes,
        settings,
    }))
}

fn mark_choice(context: &SourceContext) -> Result<MarkChoice, ImportError> {
    let requested = context.parameter("labels_from");
    Ok(MarkChoice {
        requested: requested
            .filter(|&title| title != "auto")
            .map(str::to_owned),
        at_palette_limit: parameters::choice(
            context,
            "at_palette_limit",
            &[
                ("refuse", AtPaletteLimit::Refuse),
                ("accept", AtPaletteLimit::Accept),
            ],
        )?,
        unlabeled: parameters::color(context, "unlabeled_color", Some([0; 3]))?
            .map(|channels| channels.map(|channel| u16::from(channel) * 257)),
    })
}

/// The entry of a single file. It has the labels, or the mesh, of the shape after which it is named.
fn one_entry(path: &str, _bytes: Vec<u8>) -> Result<Vec<Entry<()>>, String> {
    let key =
        layout::key_of_labels(path, None).unwrap_or_else(|| ShapeKey::of_label_path(path, &[]));
    Ok(vec![Entry {
        name: path.to_owned(),
        key,
        content: Content::File(path.to_owned()),
    }])
}

/// The labels of a file.
struct FileLabels {
    labels: Vec<i32>,
    /// The mark of a mesh file from which they were taken, and the mesh.
    marked: Option<(String, Mesh)>,
}

impl MeshLabels {
    /// The labels in a file, and its mesh if it is a mesh file. All bytes that were read are appended to `bytes`.
    fn file_labels(&self, path: &str, bytes: &mut Vec<u8>) -> Result<FileLabels, JoinProblem> {
        let located = |reason: String| format!("{path}: {reason}");
        if !layout::is_marked(path) {
            let labels = triangle_labels(path, bytes, self.settings.overlap)
                .map_err(|reason| JoinProblem::Unreadable(located(reason)))?;
            return Ok(FileLabels {
                labels,
                marked: None,
            });
        }
        let marked = self.marked_mesh(path, bytes)?;
        let chosen = self
            .settings
            .marks
            .labels(&marked)
            .map_err(|reason| JoinProblem::Refused(located(reason)))?;
        Ok(FileLabels {
            labels: chosen.labels,
            marked: Some((chosen.title, marked.mesh)),
        })
    }

    /// The mesh in these bytes. The bytes of other files that it names are appended.
    fn marked_mesh(&self, path: &str, bytes: &mut Vec<u8>) -> Result<MarkedMesh, JoinProblem> {
        let folder = path.rfind('/').map_or("", |at| &path[..=at]);
        let others = RefCell::new(Vec::new());
        let read = |name: &str| {
            let other = self
                .entries
                .read(&format!("{folder}{name}"))
                .map_err(|problem| problem.to_string())?;
            others.borrow_mut().extend_from_slice(&other);
            Ok(other)
        };
        let marked = marked_mesh(path, bytes, &read)
            .map_err(|reason| JoinProblem::Unreadable(format!("{path}: {reason}")))?;
        bytes.extend(others.into_inner());
        Ok(marked)
    }

    /// The mesh of the labels. Returns `None` if it is not given. All bytes that were read are appended to `bytes`.
    fn mesh(
        &self,
        id: &str,
        labels: &str,
        bytes: &mut Vec<u8>,
    ) -> Result<Option<Mesh>, JoinProblem> {
        let path = match (&self.meshes, layout::mesh_next_to(labels)) {
            (Some(meshes), _) => match meshes.of_shape(id) {
                Ok(found) => one_path(&found)?,
                Err(JoinProblem::NoLabels) => {
                    return Err(JoinProblem::Refused(
                        "there are labels, but `meshes` has no mesh for this shape".to_owned(),
                    ));
                }
                Err(problem) => return Err(problem),
            },
            (None, Some(path)) if self.entries.is_file(&path) => path,
            _ => return Ok(None),
        };
        let mut of_mesh = self.entries.read(&path)?;
        let mesh = if layout::is_marked(&path) {
            self.marked_mesh(&path, &mut of_mesh)?.mesh
        } else {
            mesh_of(&path, &of_mesh)
                .map_err(|reason| JoinProblem::Unreadable(format!("{path}: {reason}")))?
        };
        bytes.extend(of_mesh);
        Ok(Some(mesh))
    }
}

impl Import for MeshLabels {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let id = &carrier.meta().id;
        let found = self.entries.of_shape(id)?;
        let names = found.iter().map(|entry| entry.name.clone()).collect();
        let path = one_path(&found)?;
        let mut bytes = self.entries.read(&path)?;
        let FileLabels { labels, marked } = self.file_labels(&path, &mut bytes)?;

        let (title, own_mesh) = marked.unzip();
        let mesh = self.mesh(id, &path, &mut bytes)?.or(own_mesh);
        let placed = mesh.map(|mesh| in_millimeters(carrier, mesh));
        let (mesh, unit) = placed.unzip();
        let content_hash = sha256_hex(&bytes);
        let joined =
            self.settings
                .joining
                .join(carrier, &labels, mesh.as_ref(), names, content_hash)?;
        let notes = [title, unit.flatten().map(str::to_owned)];
        let mut by = joined.report.by.clone();
        for note in notes.into_iter().flatten() {
            by += ", ";
            by += &note;
        }
        Ok(joined.with_join_text(by))
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self.entries.names())
    }

    fn entries_of(&self, id: &str) -> Vec<String> {
        self.entries.names_of_shape(id)
    }
}

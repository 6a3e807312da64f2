//! Imports a label per triangle: type `mesh`.
//!
//! Labels are arrays or lists in the order of a mesh's triangles. If that mesh is the carrier, they are joined by index.
//! If it is another one, it is read too: its triangles are found by their corners, or each point of the carrier takes the
//! label of the nearest triangle whose normal agrees.

mod join;
mod layout;
mod values;

use crate::entries::{Content, Entries, Entry, one_path};
use crate::import::{Import, ImportError, JoinProblem, JoinedLabels};
use crate::import_type::{ImportType, ParameterKey};
use crate::parameters;
use crate::shape_key::ShapeKey;
pub(crate) use join::{JoinBy, Joining};
use partprobe_carrier::{Carrier, Mesh, sha256_hex};
use partprobe_formats::{PlyScene, mesh_from_obj, mesh_from_off, mesh_from_stl, scene_from_ply};
use partprobe_sources::SourceContext;
pub(crate) use values::{Overlap, labels as triangle_labels};

/// Labels of triangles.
pub(crate) const MESH: ImportType = ImportType {
    name: "mesh",
    description: "labels of triangles: NPY, JSON, text, and the folders of P3-SAM, SAMPart3D and SAMesh",
    keys: &[
        ParameterKey {
            name: "path",
            description: "a folder with the labels of each shape, or a file with those of one",
            is_required: true,
        },
        ParameterKey {
            name: "meshes",
            description: "a folder with the mesh that the labels belong to, if it is not the carrier (PLY, OBJ, STL, OFF)",
            is_required: false,
        },
        ParameterKey {
            name: "by",
            description: "how labels find their triangles: auto, index, triangle, or nn-surface",
            is_required: false,
        },
        ParameterKey {
            name: "scale",
            description: "which labels of SAMPart3D to take: 0.0, 0.5, 1.0, 1.5 or 2.0",
            is_required: false,
        },
        ParameterKey {
            name: "overlap",
            description: "which mask labels a triangle that several cover: refuse, or smallest",
            is_required: false,
        },
        ParameterKey {
            name: "tolerance",
            description: "triangle: how far corners may be apart, as a fraction of the diagonal (1e-5)",
            is_required: false,
        },
        ParameterKey {
            name: "max_distance",
            description: "nn-surface: how far the nearest triangle may be, as a fraction of the diagonal (0.01)",
            is_required: false,
        },
        ParameterKey {
            name: "max_angle_deg",
            description: "nn-surface: how far normals may differ, in degrees (45)",
            is_required: false,
        },
    ],
    make: open_mesh,
};

/// The endings of files that hold a mesh.
const MESH_ENDINGS: &[&str] = &[".ply", ".obj", ".stl", ".off"];

/// Which labels are read, and how they are joined.
struct MeshLabels {
    entries: Entries<()>,
    meshes: Option<Entries<()>>,
    overlap: Overlap,
    joining: Joining,
}

fn open_mesh(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
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
    let overlap = parameters::choice(
        context,
        "overlap",
        &[("refuse", Overlap::Refuse), ("smallest", Overlap::Smallest)],
    )?;
    let files = parameters::files(context)?;
    let scale = context.parameter("scale").map(str::to_owned);
    let path = context.parameter("path").unwrap_or_default();
    let entries = Entries::at(
        path,
        files.clone(),
        |below| layout::key_of_labels(below, scale.as_deref()),
        one_entry,
    )?;
    let is_mesh = |below: &str| MESH_ENDINGS.iter().any(|ending| below.ends_with(ending));
    let key_of_mesh = |below: &str| is_mesh(below).then(|| ShapeKey::of_label_path(below, &[]));
    let meshes = context
        .parameter("meshes")
        .map(|path| Entries::at(path, files, key_of_mesh, one_entry))
        .transpose()?;
    Ok(Box::new(MeshLabels {
        entries,
        meshes,
        overlap,
        joining,
    }))
}

/// A single file holds the labels, or the mesh, of the shape that it is named after.
fn one_entry(path: &str, _bytes: Vec<u8>) -> Result<Vec<Entry<()>>, String> {
    let key =
        layout::key_of_labels(path, None).unwrap_or_else(|| ShapeKey::of_label_path(path, &[]));
    Ok(vec![Entry {
        name: path.to_owned(),
        key,
        content: Content::File(path.to_owned()),
    }])
}

impl MeshLabels {
    /// The bytes of a mesh that the labels belong to, with its path; `None` if they belong to the carrier.
    fn mesh_bytes(&self, id: &str, labels: &str) -> Result<Option<(String, Vec<u8>)>, JoinProblem> {
        let path = match (&self.meshes, layout::mesh_beside(labels)) {
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
        let bytes = self.entries.read(&path)?;
        Ok(Some((path, bytes)))
    }
}

impl Import for MeshLabels {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let id = &carrier.meta().id;
        let found = self.entries.of_shape(id)?;
        let names = found.iter().map(|entry| entry.name.clone()).collect();
        let path = one_path(&found)?;
        let mut bytes = self.entries.read(&path)?;
        let unreadable =
            |path: &str, reason: String| JoinProblem::Unreadable(format!("{path}: {reason}"));
        let labels = triangle_labels(&path, &bytes, self.overlap)
            .map_err(|reason| unreadable(&path, reason))?;

        let mesh = match self.mesh_bytes(id, &path)? {
            None => None,
            Some((path, of_mesh)) => {
                let mesh = mesh_of(&path, &of_mesh).map_err(|reason| unreadable(&path, reason))?;
                bytes.extend(of_mesh);
                Some(mesh)
            }
        };
        self.joining
            .join(carrier, &labels, mesh.as_ref(), names, sha256_hex(&bytes))
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self.entries.names())
    }
}

/// The mesh of a file of any kind.
///
/// # Errors
/// If the file is damaged, or has no triangles.
pub(crate) fn mesh_of(path: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let ending = path.rsplit('.').next().unwrap_or_default().to_lowercase();
    let mesh = match ending.as_str() {
        "ply" => scene_from_ply(bytes).map(|scene| match scene {
            PlyScene::Mesh(mesh) => Some(mesh),
            PlyScene::Points { .. } => None,
        }),
        "obj" => mesh_from_obj(bytes).map(Some),
        "stl" => mesh_from_stl(bytes).map(Some),
        _ => mesh_from_off(bytes).map(Some),
    };
    let mesh = mesh.map_err(|error| error.to_string())?;
    mesh.ok_or_else(|| "the file has points and no triangles".to_owned())
}

//! Defines the paths at which tools write the labels of a shape and the labeled mesh.
//!
//! | tool | labels | mesh |
//! |---|---|---|
//! | P3-SAM | `<shape>/auto_mask_mesh_final_face_ids.npy` | `<shape>/auto_mask_mesh_final.ply` |
//! | SAMPart3D | `<shape>/results/<iteration>/mesh_<scale>.npy` | |
//! | SAMesh | `<shape>_face2label.json` | |
//! | others | `<shape>.npy`, `.json`, `.txt`, `.seg` | |
//! | PartSAM, GeoSAM2 and others | `<shape>.ply`, `.obj`, `.glb`, `.gltf`, with labels, groups or colors | the same file |

use crate::shape_key::ShapeKey;

const P3_SAM_LABELS: &str = "auto_mask_mesh_final_face_ids.npy";
const P3_SAM_MESH: &str = "auto_mask_mesh_final.ply";
/// The prefix of other files that P3-SAM writes into the same folder.
const P3_SAM_PREFIX: &str = "auto_mask_mesh";
const LABEL_ENDINGS: &[&str] = &[".npy", ".json", ".txt", ".seg"];
/// Endings of mesh files that may also have labels.
const MARKED_ENDINGS: &[&str] = &[".ply", ".obj", ".glb", ".gltf"];
const SUFFIXES: &[&str] = &["_face2label"];
/// SAMesh writes this picture next to its labels.
const SAMESH_PICTURE: &str = "_segmented.glb";

/// The shape that a file labels, by its path below the folder. Returns `None` if the file has no labels, or those of another
/// scale.
pub(super) fn key_of_labels(below: &str, scale: Option<&str>) -> Option<ShapeKey> {
    let (folder, name) = below.rsplit_once('/').unwrap_or(("", below));
    if name == P3_SAM_LABELS {
        return Some(ShapeKey::of_step_path(last_folder(folder)));
    }
    if name.starts_with(P3_SAM_PREFIX) {
        return None;
    }
    if let Some(shape) = folder.split_once("/results").map(|(shape, _)| shape)
        && name.starts_with("mesh_")
    {
        let is_wanted = scale.is_none_or(|scale| name == format!("mesh_{scale}.npy"));
        return (is_wanted && name.ends_with(".npy"))
            .then(|| ShapeKey::of_step_path(last_folder(shape)));
    }
    if name.ends_with(SAMESH_PICTURE) {
        return None;
    }
    let is_label_file =
        LABEL_ENDINGS.iter().any(|ending| name.ends_with(ending)) || is_marked(name);
    is_label_file.then(|| ShapeKey::of_label_path(below, SUFFIXES))
}

/// Whether a file is a mesh that may have labels.
pub(super) fn is_marked(path: &str) -> bool {
    MARKED_ENDINGS.iter().any(|ending| path.ends_with(ending))
}

fn last_folder(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// The path of the mesh that a tool writes next to its labels.
pub(super) fn mesh_next_to(labels: &str) -> Option<String> {
    let folder = labels.strip_suffix(P3_SAM_LABELS)?;
    Some(format!("{folder}{P3_SAM_MESH}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(below: &str, scale: Option<&str>, expected: Option<&str>) {
        let expected = expected.map(ShapeKey::of_step_path);
        assert_eq!(key_of_labels(below, scale), expected, "{below}");
    }

    #[test]
    fn each_tool_names_its_shape_elsewhere() {
        check("bolt/auto_mask_mesh_final_face_ids.npy", None, Some("bolt"));
        check("bolt/auto_mask_mesh_final_face_ids_org.npy", None, None);
        check("bolt/auto_mask_mesh_final_aabb.npy", None, None);
        check(
            "knuth/bolt/results/last/mesh_1.0.npy",
            Some("1.0"),
            Some("bolt"),
        );
        check("knuth/bolt/results/last/mesh_1.0.npy", Some("0.5"), None);
        check("bolt/results/5000/mesh_0.0.npy", None, Some("bolt"));
        check("bolt_face2label.json", None, Some("bolt"));
        check("bolt.npy", None, Some("bolt"));
        check("bolt_segmented.glb", None, None);
        check("bolt.glb", None, Some("bolt"));
        check("bolt/auto_mask_mesh_final.ply", None, None);
        check("bolt/results/5000/mesh_0.0.ply", None, None);
        assert_eq!(
            mesh_next_to("a/bolt/auto_mask_mesh_final_face_ids.npy").as_deref(),
            Some("a/bolt/auto_mask_mesh_final.ply")
        );
        assert_eq!(mesh_next_to("a/bolt.npy"), None);
    }
}

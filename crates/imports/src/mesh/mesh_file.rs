//! Reads the mesh of a file of any kind, and converts glTF scenes to millimeters.

use super::join::MAX_BOX_OFFSET;
use partprobe_carrier::{Carrier, Mesh, Point, bounding_box, distance};
use partprobe_formats::{
    MarkedMesh, PlyScene, marked_mesh_from_gltf, marked_mesh_from_obj, marked_mesh_from_ply,
    mesh_from_obj, mesh_from_off, mesh_from_stl, scene_from_ply,
};

/// The mesh of a file of any kind except glTF.
///
/// # Errors
/// If the file is damaged, or has no triangles.
pub(crate) fn mesh_of(path: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let mesh = match ending(path).as_str() {
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

/// The mesh of a PLY, OBJ or glTF file with all marks that may be labels. `read` gives the bytes of a file next to it.
///
/// # Errors
/// If the file is damaged, or has no triangles.
pub(super) fn marked_mesh(
    path: &str,
    bytes: &[u8],
    read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<MarkedMesh, String> {
    match ending(path).as_str() {
        "ply" => marked_mesh_from_ply(bytes).map_err(|error| error.to_string()),
        "obj" => marked_mesh_from_obj(bytes).map_err(|error| error.to_string()),
        _ => marked_mesh_from_gltf(bytes, read).map_err(|error| error.to_string()),
    }
}

fn ending(path: &str) -> String {
    path.rsplit('.').next().unwrap_or_default().to_lowercase()
}

/// Converts a mesh in meters with y up, the convention of glTF, to millimeters with z up, and returns a note about it. Any other
/// mesh is not changed. There is no doubt about the units, because the boxes differ by a factor of 1000.
pub(super) fn in_millimeters(carrier: &Carrier, mesh: Mesh) -> (Mesh, Option<&'static str>) {
    let own = bounding_box(&carrier.mesh().vertices);
    let other = bounding_box(&mesh.vertices).map(|[low, high]| box_from_gltf(low, high));
    let is_gltf = own
        .zip(other)
        .is_some_and(|([low, high], [other_low, other_high])| {
            let offset = distance(low, other_low).max(distance(high, other_high));
            offset <= MAX_BOX_OFFSET * distance(low, high)
        });
    if !is_gltf {
        return (mesh, None);
    }
    let placed = Mesh {
        vertices: mesh
            .vertices
            .iter()
            .map(|&vertex| from_gltf(vertex))
            .collect(),
        ..mesh
    };
    (placed, Some("from meters with y up"))
}

/// Converts a position in meters with y up to millimeters with z up.
fn from_gltf([x, y, z]: Point) -> Point {
    [1000.0 * x, -1000.0 * z, 1000.0 * y]
}

/// The box of the same points in millimeters with z up.
fn box_from_gltf(low: Point, high: Point) -> [Point; 2] {
    let [a, b] = [from_gltf(low), from_gltf(high)];
    [
        [0, 1, 2].map(|axis| a[axis].min(b[axis])),
        [0, 1, 2].map(|axis| a[axis].max(b[axis])),
    ]
}

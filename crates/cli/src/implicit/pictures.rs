//! Writes the mesh of a fit with its labels, and a picture: the reference with its labels, the reconstruction, and the
//! reconstruction with the learned labels.

use super::Probe;
use super::fit::Fit;
use super::shape::{ArmLabels, PreparedShape};
use anyhow::Result;
use partprobe_formats::{LabeledMesh, mesh_to_ply};
use partprobe_implicit::Reconstruction;
use partprobe_render::{Image, LabelView, Rgb, colors_of_triangle_labels};

/// The color of a triangle without a label.
const PLAIN: Rgb = [150, 150, 150];

/// The path of the picture of a fit in the run folder.
pub(super) fn picture_path(shape: &str, arm: &str) -> String {
    format!("pictures/{shape}/{arm}.png")
}

/// Writes both files. If several seeds are exported, the picture shows the first one, and each seed has a mesh.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn write_pictures(
    fit: &Fit,
    shape: &PreparedShape,
    labels: Option<&ArmLabels>,
    reconstruction: &Reconstruction,
    probe: &Probe<'_>,
) -> Result<()> {
    let mesh = shape.carrier.mesh();
    let surface = labels.map_or(&shape.step, |labels| &labels.surface);
    let of_reference = surface.of_triangles().of_triangle();
    let colors = colors_of_triangle_labels(mesh, of_reference, &[]);
    let learned: Vec<i32> = match labels {
        Some(_) => reconstruction.label_of_triangle.clone(),
        None => vec![-1; reconstruction.mesh.triangles.len()],
    };
    let bytes = mesh_to_ply(&labeled_mesh(reconstruction, &learned, &colors));
    probe.folder.write(
        &format!("meshes/{}/{}-{}.ply", fit.shape, fit.arm, fit.seed),
        &bytes,
    )?;
    if probe.seeds.first() != Some(&fit.seed) {
        return Ok(());
    }
    let view = LabelView::seeing_most(mesh, of_reference, probe.settings.picture_size);
    let plain = vec![-1; learned.len()];
    let mut cells = vec![
        view.picture(mesh, of_reference, &colors)
            .with_caption("reference", "", 1.0),
        view.picture(&reconstruction.mesh, &plain, &[])
            .with_caption("reconstruction", "", 1.0),
    ];
    if labels.is_some() {
        let picture = view.picture(&reconstruction.mesh, &learned, &colors);
        cells.push(picture.with_caption(&fit.arm, ": learned", 1.0));
    }
    let sheet = Image::sheet(&cells, cells.len());
    probe
        .folder
        .write(&picture_path(&fit.shape, &fit.arm), &sheet.to_png()?)
}

fn labeled_mesh(reconstruction: &Reconstruction, learned: &[i32], colors: &[Rgb]) -> LabeledMesh {
    let color = |&label: &i32| {
        let label = usize::try_from(label).ok();
        label
            .and_then(|label| colors.get(label))
            .copied()
            .unwrap_or(PLAIN)
    };
    let n_triangles = learned.len();
    LabeledMesh {
        vertices: reconstruction.mesh.vertices.clone(),
        normals: Vec::new(),
        triangles: reconstruction.mesh.triangles.clone(),
        face: vec![0; n_triangles],
        part: learned.to_vec(),
        face_type: vec![0; n_triangles],
        color: learned.iter().map(color).collect(),
    }
}

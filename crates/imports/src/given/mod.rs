//! Reads meshes and point clouds that come without a B-Rep, with the labels in the same file or in a file next to it.
//!
//! The name and the bytes of a file go in, and a [`GivenShape`] comes out. Only this module decides which properties and groups
//! count as labels, and which file next to a shape has its labels. Nothing here opens a file.

mod choice;
mod names;

pub use names::{given_stem, holds_rows_of_numbers, is_given_name, label_names_of};

use crate::mesh::{Overlap, triangle_labels};
use crate::points::Cloud;
use choice::Chosen;
use names::ending_of;
use partprobe_carrier::GivenShape;
use partprobe_formats::{
    MarkedMesh, MeshFileError, marked_mesh_from_obj, marked_mesh_from_ply, marked_points_from_ply,
    mesh_from_off, mesh_from_stl,
};

/// The reason why a file is not a mesh or a cloud with matching labels. The reason names the line or the index if there is one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GivenFileError {
    /// The file of the shape cannot be read.
    #[error("{0}")]
    Shape(String),
    /// The file of its labels cannot be read, or does not match the shape.
    #[error("{file}: {reason}")]
    Labels {
        /// The name of the file of labels.
        file: String,
        /// A description of the problem.
        reason: String,
    },
}

/// A file by its name and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct NamedBytes<'a> {
    /// The name. Its ending determines the format of the bytes.
    pub name: &'a str,
    /// The content of the file.
    pub bytes: &'a [u8],
}

/// The shape of a file. If there is also a file of labels, its labels are used instead of those in the file of the shape.
///
/// # Errors
/// If a file cannot be read, or there are more or fewer labels than triangles or points.
pub fn given_shape(
    shape: NamedBytes<'_>,
    labels: Option<NamedBytes<'_>>,
) -> Result<GivenShape, GivenFileError> {
    let mut given = read(shape).map_err(GivenFileError::Shape)?;
    if let Some(file) = labels {
        take_labels(&mut given, file).map_err(|reason| GivenFileError::Labels {
            file: file.name.to_owned(),
            reason,
        })?;
    } else if given.labels.is_empty() {
        given
            .notes
            .push("the file holds no labels, and neither does a file next to it".to_owned());
    }
    Ok(given)
}

fn read(NamedBytes { name, bytes }: NamedBytes<'_>) -> Result<GivenShape, String> {
    let in_words = |error: MeshFileError| error.to_string();
    match ending_of(name).as_str() {
        "obj" => of_mesh(marked_mesh_from_obj(bytes).map_err(in_words)?),
        "ply" => of_ply(bytes),
        "stl" => Ok(of_plain_mesh(mesh_from_stl(bytes).map_err(in_words)?)),
        "off" => Ok(of_plain_mesh(mesh_from_off(bytes).map_err(in_words)?)),
        _ => of_rows(name, bytes),
    }
}

fn of_ply(bytes: &[u8]) -> Result<GivenShape, String> {
    match marked_mesh_from_ply(bytes) {
        Ok(mesh) => of_mesh(mesh),
        Err(MeshFileError::NoFace) => {
            let cloud = marked_points_from_ply(bytes).map_err(|error| error.to_string())?;
            let chosen = Chosen::of_points(&cloud.marks)?;
            Ok(GivenShape {
                vertices: cloud.points,
                normals: cloud.normals,
                labels: chosen.labels,
                notes: chosen.notes,
                ..GivenShape::default()
            })
        }
        Err(error) => Err(error.to_string()),
    }
}

fn of_mesh(marked: MarkedMesh) -> Result<GivenShape, String> {
    let chosen = Chosen::of_triangles(&marked)?;
    Ok(GivenShape {
        labels: chosen.labels,
        notes: chosen.notes,
        ..of_plain_mesh(marked.mesh)
    })
}

fn of_plain_mesh(mesh: partprobe_carrier::Mesh) -> GivenShape {
    GivenShape {
        vertices: mesh.vertices,
        triangles: mesh.triangles,
        ..GivenShape::default()
    }
}

/// A cloud in rows of numbers.
fn of_rows(name: &str, bytes: &[u8]) -> Result<GivenShape, String> {
    let cloud = Cloud::read(name, bytes)?;
    if cloud.positions.is_empty() {
        return Err("the file holds no points; a row is `x y z`, then perhaps a normal, then perhaps a label".to_owned());
    }
    let mut notes = Vec::new();
    if !cloud.labels.is_empty() {
        notes.push("the labels are the last number of each row".to_owned());
    }
    let single = |normal: &partprobe_carrier::Point| normal.map(|x| x as f32);
    Ok(GivenShape {
        vertices: cloud.positions,
        normals: cloud.normals.iter().map(single).collect(),
        labels: cloud.labels,
        notes,
        ..GivenShape::default()
    })
}

/// The labels of the file next to a shape: one per triangle or point.
fn take_labels(
    shape: &mut GivenShape,
    NamedBytes { name, bytes }: NamedBytes<'_>,
) -> Result<(), String> {
    let labels = triangle_labels(name, bytes, Overlap::Refuse)?;
    let (n_elements, elements) = shape.elements();
    if labels.len() != n_elements {
        return Err(format!(
            "there are {} labels, and the shape has {n_elements} {elements}",
            labels.len()
        ));
    }
    shape
        .notes
        .retain(|note| !note.starts_with("the labels are"));
    shape.notes.push(format!("the labels are those of {name}"));
    shape.labels = labels;
    Ok(())
}

#[cfg(test)]
mod tests;

//! Reads labeled points in HDF5: one shape per file, or one shape per row.
//!
//! | set | arrays |
//! |---|---|
//! | ParSeNet | `points` and `normals` (S, N, 3), `labels` and `prim` (S, N); predictions: `seg_id` and `pred_primitives` (S, N) |
//! | HPNet | `points` and `normals` (N, 3), `labels` and `prim` (N,), one file per shape |
//!
//! Rows have no names in the file. They are in the order of a list of names, for example `test_ids.txt`.

use super::cloud::{Cloud, label_of, unit};
use super::hdf5_file::{Hdf5Error, Hdf5File};
use crate::entries::{Content, Entry};
use crate::shape_key::ShapeKey;
use partprobe_carrier::Point;
use std::ops::Range;
use std::sync::Arc;

/// Arrays of labels, unless the user names another one.
const LABELS: [&str; 2] = ["labels", "seg_id"];
const POSITIONS: &str = "points";
const NORMALS: &str = "normals";

/// The data of a shape that are read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Hdf5Request<'a> {
    /// Labels from this array, or from a known one, with positions if there are any.
    Labels(Option<&'a str>),
    /// Only positions and normals.
    Positions,
}

/// A shape of a file with many shapes.
#[derive(Clone, Debug)]
pub(super) struct Hdf5Row {
    file: Arc<Hdf5File>,
    row: u64,
}

/// Whether a path leads to an HDF5 file.
pub(super) fn is_hdf5(path: &str) -> bool {
    path.ends_with(".h5") || path.ends_with(".hdf5")
}

/// One entry per row, with the names in their order.
///
/// # Errors
/// If the file cannot be read, or has another number of rows.
pub(super) fn rows_of_file(
    path: &str,
    bytes: Vec<u8>,
    ids: &[String],
) -> Result<Vec<Entry<Hdf5Row>>, String> {
    let file = Arc::new(Hdf5File::open(bytes).map_err(text)?);
    let known = LABELS.iter().chain([&POSITIONS]);
    let names = file.names().map_err(text)?;
    let first = known
        .copied()
        .find(|&name| names.iter().any(|other| other == name));
    let first = first.or(names.first().map(String::as_str));
    let first = first.ok_or("the file has no arrays")?;
    let n_rows = file.shape(first).map_err(text)?.first().copied();
    if n_rows != Some(ids.len() as u64) {
        return Err(format!(
            "the file has {} shapes, and `ids` has {} names; give the list that belongs to it",
            n_rows.unwrap_or(0),
            ids.len()
        ));
    }
    let entry = |(row, id): (u64, &String)| Entry {
        name: format!("{path}, row {row} ({id})"),
        key: ShapeKey::of_step_path(id),
        content: Content::Read(Hdf5Row {
            file: file.clone(),
            row,
        }),
    };
    Ok((0..).zip(ids).map(entry).collect())
}

/// The points of a file with one shape.
///
/// # Errors
/// If it has several, or cannot be read.
pub(super) fn cloud_of_file(bytes: Vec<u8>, wanted: Hdf5Request<'_>) -> Result<Cloud, String> {
    let file = Hdf5File::open(bytes).map_err(text)?;
    Reader {
        file: &file,
        row: None,
    }
    .cloud(wanted)
}

/// The points of one row of a file.
///
/// # Errors
/// If they cannot be read.
pub(super) fn cloud_of_row(row: &Hdf5Row, wanted: Hdf5Request<'_>) -> Result<Cloud, String> {
    Reader {
        file: &row.file,
        row: Some(row.row),
    }
    .cloud(wanted)
}

fn text(error: Hdf5Error) -> String {
    error.to_string()
}

/// Reads the arrays of one shape.
struct Reader<'a> {
    file: &'a Hdf5File,
    row: Option<u64>,
}

impl Reader<'_> {
    /// Positions, normals and labels, if the file has them.
    fn cloud(&self, wanted: Hdf5Request<'_>) -> Result<Cloud, String> {
        let names = self.file.names().map_err(text)?;
        let has = |name: &str| names.iter().any(|other| other == name);
        let labels = match wanted {
            Hdf5Request::Positions => None,
            Hdf5Request::Labels(None) => LABELS.into_iter().find(|name| has(name)),
            Hdf5Request::Labels(Some(name)) if has(name) => Some(name),
            Hdf5Request::Labels(Some(name)) => {
                return Err(format!(
                    "there is no array `{name}` in the file, which has {}; choose one of them with the key `labels_from`",
                    names.join(", ")
                ));
            }
        };
        let mut cloud = Cloud::default();
        if let Some(name) = labels {
            let values = self.values(name, 1)?;
            let labels = values.into_iter().map(label_of);
            cloud.labels = labels
                .collect::<Result<_, String>>()
                .map_err(|reason| format!("array `{name}`: {reason}"))?;
        }
        if has(POSITIONS) {
            cloud.positions = self.vectors(POSITIONS)?;
        }
        if has(NORMALS) && has(POSITIONS) {
            cloud.normals = self.vectors(NORMALS)?;
            cloud
                .normals
                .iter_mut()
                .for_each(|normal| *normal = unit(*normal));
        }
        if labels.is_none() && cloud.positions.is_empty() {
            return Err(format!(
                "the file has neither labels nor points; its arrays are {}; name one with the key `labels_from`",
                names.join(", ")
            ));
        }
        Ok(cloud)
    }

    fn vectors(&self, name: &str) -> Result<Vec<Point>, String> {
        let values = self.values(name, 3)?;
        Ok(values.as_chunks::<3>().0.to_vec())
    }

    /// The numbers of an array that has rows of this width for the points of a shape.
    fn values(&self, name: &str, width: u64) -> Result<Vec<f64>, String> {
        let shape = self.file.shape(name).map_err(text)?;
        let expected = match (self.row, shape.as_slice()) {
            (None, &[n_points]) if width == 1 => Some(0..n_points),
            (None, &[n_points, last]) if last == width => Some(0..n_points),
            (Some(row), &[_, _]) if width == 1 => Some(one(row)),
            (Some(row), &[_, _, last]) if last == width => Some(one(row)),
            _ => None,
        };
        let rows = expected.ok_or_else(|| match (self.row, shape.as_slice()) {
            (None, &[n_shapes, _, ..]) => format!(
                "the array `{name}` has the shape {shape:?}, as in a file of {n_shapes} shapes; give this file as the path, and \
                 a list of the names of its shapes with the key `ids`"
            ),
            _ => format!("the array `{name}` has the shape {shape:?}, which is not a row of {width} per point"),
        })?;
        self.file.rows(name, rows).map_err(text)
    }
}

fn one(row: u64) -> Range<u64> {
    row..row.saturating_add(1)
}

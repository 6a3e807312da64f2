//! Defines the rows of an embedding file, and makes its bytes.

use super::input::EmbedInput;
use crate::backbone::Backbone;
use crate::run::{embedding_members, npz_bytes};
use anyhow::{Context, Result, ensure};
use partprobe_carrier::Embeddings;
use partprobe_formats::{Array, Half, Values, arrays_from_npz};
use partprobe_net::Tokens;
use std::fs;
use std::path::Path;

/// The member with the hash of the embedded shape.
const INPUT_SHA256: &str = "input_sha256";

/// What an embedding file has a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Form {
    /// Each token.
    Tokens,
    /// Each point.
    Points,
    /// Each face of a B-Rep.
    Faces,
    /// The shape.
    Shapes,
}

/// The types that embeddings are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Precision {
    /// `float32`.
    F32,
    /// `float16`.
    F16,
}

impl Form {
    /// The name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Tokens => "tokens",
            Self::Points => "points",
            Self::Faces => "faces",
            Self::Shapes => "shapes",
        }
    }

    /// The bytes of the embedding file of a shape.
    ///
    /// # Errors
    /// If the shape cannot be embedded, or has no faces although one row per face is requested.
    pub(super) fn file(
        self,
        shape: &EmbedInput,
        backbone: &Backbone,
        precision: Precision,
    ) -> Result<Vec<u8>> {
        let (tokens, rows) = backbone.embedded(&shape.sample)?;
        let mut members = match self {
            Self::Tokens => embedding_members(&tokens, &rows)?,
            Self::Points => vec![("embeddings".to_owned(), point_rows(&tokens, &rows)?)],
            Self::Faces => face_members(shape, &tokens, &rows)?,
            Self::Shapes => vec![(
                "embeddings".to_owned(),
                matrix(&[shape_row(&tokens, &rows)])?,
            )],
        };
        if precision == Precision::F16 {
            members[0].1 = narrowed(&members[0].1)?;
        }
        if matches!(self, Self::Tokens | Self::Points) {
            members.push(("points".to_owned(), Array::rows(&shape.sample.points)));
            members.push(("normals".to_owned(), Array::rows(&shape.sample.normals)));
            if let Some(faces) = &shape.faces {
                let of_point = faces.of_point.iter().map(|&face| face as i32).collect();
                members.push(("face_of_point".to_owned(), Array::vector::<i32>(of_point)));
            }
        }
        let digest = Array::vector::<u8>(shape.sha256().to_vec());
        members.push((INPUT_SHA256.to_owned(), digest));
        npz_bytes(members)
    }
}

/// Whether an embedding file was made from this shape. Files of earlier programs do not record this, and are accepted. A file that
/// cannot be read, for example because it was cut off, was not.
pub(super) fn is_of(file: &Path, shape: &EmbedInput) -> bool {
    let members = fs::read(file).ok().map(|bytes| arrays_from_npz(&bytes));
    let Some(Ok(members)) = members else {
        return false;
    };
    match members.array(INPUT_SHA256).map(Array::values) {
        Some(Values::U8(digest)) => *digest == shape.sha256(),
        _ => true,
    }
}

/// The row of a whole shape: the direction of the mean over its points.
pub(super) fn shape_row(tokens: &Tokens, rows: &Embeddings) -> Vec<f32> {
    let weighted = tokens.multiplicity.iter().enumerate();
    let mut sum = vec![0.0; rows.dim()];
    for (token, &n_points) in weighted {
        add(&mut sum, rows.row(token), f64::from(n_points));
    }
    direction(&sum)
}

/// The rows of all faces, and the number of points of each.
fn face_members(
    shape: &EmbedInput,
    tokens: &Tokens,
    rows: &Embeddings,
) -> Result<Vec<(String, Array)>> {
    let faces = shape
        .faces
        .as_ref()
        .context("it has no B-Rep, and so no faces; choose --form points or shapes")?;
    let mut sums = vec![vec![0.0; rows.dim()]; faces.n];
    let mut n_points = vec![0_u32; faces.n];
    for (&face, &token) in faces.of_point.iter().zip(&tokens.token_of_point) {
        add(&mut sums[face as usize], rows.row(token as usize), 1.0);
        n_points[face as usize] += 1;
    }
    let rows: Vec<Vec<f32>> = sums.iter().map(|sum| direction(sum)).collect();
    Ok(vec![
        ("embeddings".to_owned(), matrix(&rows)?),
        ("n_points".to_owned(), Array::vector(n_points)),
    ])
}

fn add(sum: &mut [f64], row: &[f32], weight: f64) {
    for (sum, &value) in sum.iter_mut().zip(row) {
        *sum += weight * f64::from(value);
    }
}

/// The vector with length 1. A zero vector is not changed.
fn direction(sum: &[f64]) -> Vec<f32> {
    let length = sum.iter().map(|value| value * value).sum::<f64>().sqrt();
    let scale = if length > 0.0 { length.recip() } else { 0.0 };
    sum.iter().map(|value| (value * scale) as f32).collect()
}

fn matrix(rows: &[Vec<f32>]) -> Result<Array> {
    let dim = rows.first().map_or(0, Vec::len);
    ensure!(dim > 0, "there are no rows");
    let values = rows.concat();
    Array::with_shape(vec![rows.len(), dim], Values::F32(values)).context("rows of one length")
}

/// The row of each point: that of its token.
fn point_rows(tokens: &Tokens, embeddings: &Embeddings) -> Result<Array> {
    let rows = tokens
        .token_of_point
        .iter()
        .flat_map(|&token| embeddings.row(token as usize))
        .copied()
        .collect();
    let shape = vec![tokens.token_of_point.len(), embeddings.dim()];
    Array::with_shape(shape, Values::F32(rows)).context("an embedding for each point")
}

fn narrowed(array: &Array) -> Result<Array> {
    let Values::F32(values) = array.values() else {
        return Ok(array.clone());
    };
    let halves = values.iter().map(|&x| Half::from_f32(x)).collect();
    Array::with_shape(array.shape().to_vec(), Values::F16(halves)).context("a half for each number")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_a_direction_unless_it_is_zero() {
        assert_eq!(direction(&[3.0, 0.0, -4.0]), [0.6, 0.0, -0.8]);
        assert_eq!(direction(&[0.0, 0.0]), [0.0, 0.0]);
    }
}

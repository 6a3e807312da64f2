//! Reads the file of one shape: reference labels, and predicted clusters or embeddings of the same points.

use anyhow::{Context, Result, anyhow, bail, ensure};
use partprobe_eval::{PointEmbeddings, near_boundary};
use partprobe_formats::{Array, Values, arrays_from_npz};

/// The data of the points of one shape in a file.
pub(super) struct ShapeFile {
    /// The label of each point. Negative ones are ignored.
    pub(super) reference: Vec<i32>,
    /// The cluster of each point. All negative ones are one cluster.
    pub(super) predicted: Option<Vec<i32>>,
    pub(super) embedded: Option<PointEmbeddings>,
    /// Whether each point is near a boundary of the reference. It is `None` if the file does not have the positions of the
    /// points.
    pub(super) near_boundary: Option<Vec<bool>>,
}

impl ShapeFile {
    /// Reads the members `reference`, and `predicted` or `embedding` or both; and `points` and `normals` if they exist.
    ///
    /// # Errors
    /// If a member is missing, has another form, or does not belong to the same points. The message names it.
    pub(super) fn read(bytes: &[u8]) -> Result<Self> {
        let members = arrays_from_npz(bytes)?;
        let reference = members.array("reference").with_context(|| {
            let found: Vec<&str> = members.names().collect();
            format!(
                "there is no member `reference`; the members are {}",
                found.join(", ")
            )
        })?;
        let reference = labels(reference).context("`reference`")?;

        let predicted = members.array("predicted").map(labels).transpose();
        let predicted = predicted.context("`predicted`")?;
        let embedded = members.array("embedding").map(embeddings).transpose();
        let embedded = embedded.context("`embedding`")?;
        ensure!(
            predicted.is_some() || embedded.is_some(),
            "there is neither a member `predicted` nor a member `embedding`"
        );

        let points = members.array("points").map(triples).transpose();
        let points = points.context("`points`")?;
        let normals = members.array("normals").map(triples).transpose();
        let normals = normals.context("`normals`")?;

        let n_points = reference.len();
        let lengths = [
            ("points", points.as_ref().map(Vec::len)),
            ("normals", normals.as_ref().map(Vec::len)),
            ("predicted", predicted.as_ref().map(Vec::len)),
            (
                "embedding",
                embedded.as_ref().map(PointEmbeddings::n_points),
            ),
        ];
        for (member, length) in lengths {
            ensure!(
                length.is_none_or(|length| length == n_points),
                "`{member}` has {} rows for the {n_points} points of `reference`",
                length.unwrap_or_default()
            );
        }
        let normals = normals.unwrap_or_default();
        let near = points.map(|points| near_boundary(&points, &normals, &reference));
        Ok(Self {
            reference,
            predicted,
            embedded,
            near_boundary: near,
        })
    }
}

/// A vector of whole numbers of any type.
fn labels(array: &Array) -> Result<Vec<i32>> {
    ensure!(
        array.shape().len() == 1,
        "it must be a vector, and its shape is {:?}",
        array.shape()
    );
    let narrowed = |values: Vec<i128>| -> Result<Vec<i32>> {
        let label = |value: i128| {
            i32::try_from(value).map_err(|_| {
                anyhow!("the label {value} is out of range; labels are whole numbers of 32 bits")
            })
        };
        values.into_iter().map(label).collect()
    };
    match array.values() {
        Values::I32(values) => Ok(values.clone()),
        Values::I64(values) => narrowed(values.iter().map(|&x| x.into()).collect()),
        Values::U8(values) => narrowed(values.iter().map(|&x| x.into()).collect()),
        Values::U32(values) => narrowed(values.iter().map(|&x| x.into()).collect()),
        Values::U64(values) => narrowed(values.iter().map(|&x| x.into()).collect()),
        other => bail!(
            "it must hold whole numbers, and its type is {}",
            other.type_name()
        ),
    }
}

/// A matrix of three finite numbers per row.
fn triples(array: &Array) -> Result<Vec<[f32; 3]>> {
    ensure!(
        matches!(array.shape(), [_, 3]),
        "it must be a matrix with three columns, and its shape is {:?}",
        array.shape()
    );
    let values = floats(array)?;
    Ok(values.as_chunks().0.to_vec())
}

/// The entries of an array of finite numbers.
fn floats(array: &Array) -> Result<Vec<f32>> {
    let values: Vec<f32> = match array.values() {
        Values::F32(values) => values.clone(),
        Values::F64(values) => values.iter().map(|&x| x as f32).collect(),
        Values::F16(values) => values.iter().map(|x| x.to_f32()).collect(),
        other => bail!(
            "it must hold floating-point numbers, and its type is {}",
            other.type_name()
        ),
    };
    let n_columns = array.shape().last().copied().unwrap_or(1).max(1);
    if let Some(at) = values.iter().position(|x| !x.is_finite()) {
        bail!("row {} holds {}", at / n_columns, values[at]);
    }
    Ok(values)
}

/// A matrix with one row per point.
fn embeddings(array: &Array) -> Result<PointEmbeddings> {
    let &[_, dim] = array.shape() else {
        bail!(
            "it must be a matrix with a row per point, and its shape is {:?}",
            array.shape()
        );
    };
    ensure!(dim > 0, "its rows are empty");
    Ok(PointEmbeddings::new(dim, &floats(array)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_formats::{Compression, arrays_to_npz};

    fn read(members: &[(&str, Array)]) -> Result<ShapeFile> {
        ShapeFile::read(&arrays_to_npz(members, Compression::Stored).unwrap())
    }

    fn matrix(shape: [usize; 2], values: &[f32]) -> Array {
        Array::with_shape(shape.to_vec(), Values::F32(values.to_vec())).unwrap()
    }

    #[test]
    fn labels_and_rows_are_read() {
        let reference = Array::vector::<i64>(vec![4, 4, -1]);
        let embedding = matrix([3, 2], &[1.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        let file = read(&[("reference", reference), ("embedding", embedding)]).unwrap();
        assert_eq!(file.reference, [4, 4, -1]);
        let expected = PointEmbeddings::new(2, &[1.0, 0.0, 0.0, 1.0, 1.0, 0.0]).unwrap();
        assert_eq!(file.embedded, Some(expected));
    }

    #[test]
    fn what_cannot_be_scored_is_named() {
        let vector = |n: usize| Array::vector::<i32>(vec![0; n]);
        let cases: [(&[(&str, Array)], &str); 6] = [
            (
                &[("labels", vector(2))],
                "there is no member `reference`; the members are format_version, labels",
            ),
            (&[("reference", vector(2))], "neither a member `predicted`"),
            (
                &[("reference", vector(2)), ("predicted", vector(3))],
                "`predicted` has 3 rows for the 2 points",
            ),
            (
                &[("reference", vector(1)), ("embedding", vector(1))],
                "`embedding`: it must be a matrix",
            ),
            (
                &[
                    ("reference", vector(1)),
                    ("embedding", matrix([1, 2], &[0.0, f32::NAN])),
                ],
                "row 0 holds NaN",
            ),
            (
                &[("reference", matrix([1, 1], &[0.0]))],
                "`reference`: it must be a vector",
            ),
        ];
        for (members, expected) in cases {
            let message = read(members)
                .err()
                .map(|error| format!("{error:#}"))
                .unwrap();
            assert!(message.contains(expected), "{message}");
        }
    }
}

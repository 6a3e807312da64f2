//! Reads arrays of numbers from HDF5 files, by the crate `hdf5-pure`.
//!
//! Only the arrays at the root of a file are read. A declared count is checked before memory is allocated for it.

use hdf5_pure::DType;
use std::fmt;
use std::ops::Range;

/// The largest number of numbers in the rows that are read at once.
const MAX_NUMBERS: u64 = 1 << 27;

/// The arrays of an HDF5 file.
pub(super) struct Hdf5File {
    file: hdf5_pure::File,
}

/// The reason why an HDF5 file or one of its arrays cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Hdf5Error {
    /// The bytes are not an HDF5 file, or its root is damaged.
    #[error("not an HDF5 file that can be read: {0}")]
    File(String),
    /// An array is damaged, or packed in an unknown way.
    #[error("the array `{name}` cannot be read: {reason}")]
    Array {
        /// Its name.
        name: String,
        /// A description of the problem.
        reason: String,
    },
}

impl fmt::Debug for Hdf5File {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Hdf5File")
    }
}

impl Hdf5File {
    /// The file in these bytes.
    ///
    /// # Errors
    /// If they are not an HDF5 file.
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, Hdf5Error> {
        let file = hdf5_pure::File::from_bytes(bytes).map_err(unreadable)?;
        Ok(Self { file })
    }

    /// The names of the arrays at the root, sorted.
    ///
    /// # Errors
    /// If the root is damaged.
    pub(super) fn names(&self) -> Result<Vec<String>, Hdf5Error> {
        let mut names = self.file.root().datasets().map_err(unreadable)?;
        names.sort();
        Ok(names)
    }

    /// The lengths of an array, beginning with the outermost axis.
    ///
    /// # Errors
    /// If there is no such array, or it is damaged.
    pub(super) fn shape(&self, name: &str) -> Result<Vec<u64>, Hdf5Error> {
        let dataset = self.file.dataset(name);
        dataset
            .and_then(|dataset| dataset.shape())
            .map_err(|error| array_error(name, &error))
    }

    /// The numbers of some rows, which are counted along the first axis.
    ///
    /// # Errors
    /// If there is no such array, it has fewer rows, its rows are too large, or it has no numbers.
    pub(super) fn rows(&self, name: &str, rows: Range<u64>) -> Result<Vec<f64>, Hdf5Error> {
        let refused = |reason: &str| Hdf5Error::Array {
            name: name.to_owned(),
            reason: reason.to_owned(),
        };
        let shape = self.shape(name)?;
        let n_rows = rows.end.saturating_sub(rows.start);
        if shape.first().is_none_or(|&length| rows.end > length) {
            return Err(refused("it has fewer rows"));
        }
        let mut inner = shape[1..].iter().copied();
        let n_numbers = inner.try_fold(n_rows, u64::checked_mul);
        let n_numbers = n_numbers.filter(|&n_numbers| n_numbers <= MAX_NUMBERS);
        let n_numbers = n_numbers.ok_or_else(|| refused("its rows are too large"))?;

        let dataset = self
            .file
            .dataset(name)
            .map_err(|error| array_error(name, &error))?;
        // The crate reads other types without an error, but with wrong values.
        if !dataset.dtype().is_ok_and(|dtype| is_number(&dtype)) {
            return Err(refused(
                "its numbers are neither integers nor floats of 32 or 64 bits; save it as float32 or int32",
            ));
        }
        let values = dataset
            .read_f64_rows(rows.start, n_rows)
            .map_err(|error| array_error(name, &error))?;
        if values.len() as u64 == n_numbers {
            Ok(values)
        } else {
            Err(refused("it holds fewer numbers than it claims"))
        }
    }
}

fn is_number(dtype: &DType) -> bool {
    matches!(
        dtype,
        DType::F32
            | DType::F64
            | DType::I8
            | DType::I16
            | DType::I32
            | DType::I64
            | DType::U8
            | DType::U16
            | DType::U32
            | DType::U64
    )
}

fn unreadable(error: hdf5_pure::Error) -> Hdf5Error {
    Hdf5Error::File(error.to_string())
}

fn array_error(name: &str, error: &hdf5_pure::Error) -> Hdf5Error {
    Hdf5Error::Array {
        name: name.to_owned(),
        reason: error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdf5_pure::FileBuilder;
    use proptest::prelude::*;

    fn file() -> Vec<u8> {
        let mut builder = FileBuilder::new();
        builder
            .create_dataset("labels")
            .with_i32_data(&[3, 4, 5, 6])
            .with_shape(&[2, 2])
            .with_chunks(&[1, 2])
            .with_deflate(6);
        builder.create_dataset("points").with_f32_data(&[0.5, 1.5]);
        builder.finish().unwrap()
    }

    #[test]
    fn rows_of_any_number_type_are_read() {
        let file = Hdf5File::open(file()).unwrap();
        assert_eq!(file.names().unwrap(), ["labels", "points"]);
        assert_eq!(file.shape("labels").unwrap(), [2, 2]);
        assert_eq!(file.rows("labels", 1..2).unwrap(), [5.0, 6.0]);
        assert_eq!(file.rows("labels", 0..2).unwrap(), [3.0, 4.0, 5.0, 6.0]);
        assert_eq!(file.rows("points", 0..2).unwrap(), [0.5, 1.5]);
    }

    #[test]
    fn what_is_missing_is_named() {
        let found = Hdf5File::open(file()).unwrap();
        let reason = found.rows("labels", 1..3).unwrap_err().to_string();
        assert_eq!(
            reason,
            "the array `labels` cannot be read: it has fewer rows"
        );
        let reason = found.shape("normals").unwrap_err().to_string();
        assert!(
            reason.starts_with("the array `normals` cannot be read: "),
            "{reason}"
        );
        assert!(matches!(
            Hdf5File::open(b"ply".to_vec()),
            Err(Hdf5Error::File(_))
        ));
    }

    proptest! {
        #[test]
        fn a_damaged_file_is_an_answer_too(at in 0usize..4000, byte: u8, end in 0usize..4000) {
            let mut bytes = file();
            let n_bytes = bytes.len();
            bytes[at % n_bytes] = byte;
            for bytes in [bytes.clone(), bytes[..end % n_bytes].to_vec()] {
                let Ok(file) = Hdf5File::open(bytes) else { continue };
                for name in file.names().unwrap_or_default() {
                    let n_rows = file.shape(&name).map_or(0, |shape| shape.first().copied().unwrap_or(0));
                    let _ = file.rows(&name, 0..n_rows.min(8));
                }
            }
        }
    }
}

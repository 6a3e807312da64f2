//! Reads and writes the header of an NPY file: `\x93NUMPY`, a version, and a Python dictionary with type, order and
//! shape.

const MAGIC: &[u8] = b"\x93NUMPY";
/// NumPy aligns the first value to this many bytes.
const ALIGNMENT: usize = 64;

/// The reason why bytes are not an array that partprobe reads.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NpyError {
    /// The magic string is missing.
    #[error("not an NPY file: it doesn't begin with \\x93NUMPY")]
    NotNpy,
    /// The version is unknown.
    #[error("NPY version {major}.{minor} is unknown; 1.0, 2.0 and 3.0 can be read")]
    Version {
        /// The first number of the version.
        major: u8,
        /// The second number of the version.
        minor: u8,
    },
    /// The file ends inside its header.
    #[error("the file ends inside its header")]
    Truncated,
    /// The header's dictionary lacks a key or has a value of another kind.
    #[error("the header gives no plain `descr`, `fortran_order` and `shape`")]
    Dictionary,
    /// partprobe does not read the type.
    #[error(
        "type `{0}` can't be read; save as float16, float32, float64, a type of whole numbers, bool or str"
    )]
    Type(String),
    /// Shape and bytes do not agree.
    #[error("shape {shape:?} of `{descr}` does not fit the {n_bytes} bytes that follow")]
    Size {
        /// NumPy's type code.
        descr: String,
        /// The shape in the header.
        shape: Vec<usize>,
        /// The number of bytes after the header.
        n_bytes: usize,
    },
    /// A text value is not Unicode.
    #[error("a text value holds the number {0:#x}, which is not a Unicode character")]
    Text(u32),
}

/// The data of a header: the type and the shape of the values after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    /// NumPy's type code, for example `<f8`.
    pub(crate) descr: String,
    /// The length of each dimension.
    pub(crate) shape: Vec<usize>,
    /// Whether the first index changes fastest, and not the last one.
    pub(crate) is_fortran: bool,
}

impl Header {
    /// Whether the highest byte of each value is the first one.
    pub(crate) fn is_big_endian(&self) -> bool {
        self.descr.starts_with('>')
    }

    /// Whether the values are texts of fixed width.
    pub(crate) fn is_text(&self) -> bool {
        self.descr.get(1..2) == Some("U")
    }

    /// The type code of the same values with the lowest byte first.
    pub(crate) fn little_endian_descr(&self) -> String {
        match self.descr.strip_prefix('>') {
            Some(code) => format!("<{code}"),
            None => self.descr.clone(),
        }
    }

    /// The number of bytes of a value. Returns `None` if the type code has none.
    pub(crate) fn item_size(&self) -> Option<usize> {
        let width: usize = self.descr.get(2..)?.parse().ok()?;
        let size = width.checked_mul(if self.is_text() { 4 } else { 1 })?;
        (size > 0).then_some(size)
    }
}

/// The bytes of a version 1.0 header, or 2.0 if the dictionary is too long.
pub(crate) fn header_bytes(descr: &str, shape: &[usize]) -> Vec<u8> {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    let tuple = if let [side] = sides.as_slice() {
        format!("({side},)")
    } else {
        format!("({})", sides.join(", "))
    };
    let mut dictionary =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {tuple}, }}");
    let is_long = dictionary.len() + ALIGNMENT > usize::from(u16::MAX);
    let prefix = MAGIC.len() + 2 + if is_long { 4 } else { 2 };
    let unpadded = prefix + dictionary.len() + 1;
    dictionary.push_str(&" ".repeat(unpadded.next_multiple_of(ALIGNMENT) - unpadded));
    dictionary.push('\n');
    let mut bytes = MAGIC.to_vec();
    if is_long {
        bytes.extend([2, 0]);
        bytes.extend((dictionary.len() as u32).to_le_bytes());
    } else {
        bytes.extend([1, 0]);
        bytes.extend((dictionary.len() as u16).to_le_bytes());
    }
    bytes.extend(dictionary.as_bytes());
    bytes
}

/// Splits a file into its header and the bytes of its values.
pub(crate) fn split_header(bytes: &[u8]) -> Result<(Header, &[u8]), NpyError> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(NpyError::NotNpy)?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or(NpyError::Truncated)?;
    let (length, rest) = match version {
        [1, 0] => {
            let (length, rest) = rest.split_first_chunk::<2>().ok_or(NpyError::Truncated)?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        }
        [2 | 3, 0] => {
            let (length, rest) = rest.split_first_chunk::<4>().ok_or(NpyError::Truncated)?;
            (u32::from_le_bytes(*length) as usize, rest)
        }
        [major, minor] => {
            return Err(NpyError::Version {
                major: *major,
                minor: *minor,
            });
        }
    };
    let (dictionary, values) = rest.split_at_checked(length).ok_or(NpyError::Truncated)?;
    let dictionary = std::str::from_utf8(dictionary).map_err(|_| NpyError::Dictionary)?;
    Ok((parse(dictionary)?, values))
}

fn parse(dictionary: &str) -> Result<Header, NpyError> {
    let descr = value_of(dictionary, "descr")
        .and_then(quoted)
        .ok_or(NpyError::Dictionary)?;
    let order = value_of(dictionary, "fortran_order").ok_or(NpyError::Dictionary)?;
    let shape = value_of(dictionary, "shape")
        .and_then(tuple)
        .ok_or(NpyError::Dictionary)?;
    Ok(Header {
        descr: descr.to_owned(),
        is_fortran: order.starts_with("True") && shape.len() > 1,
        shape,
    })
}

/// The text after `'key':`.
fn value_of<'a>(dictionary: &'a str, key: &str) -> Option<&'a str> {
    let at = [format!("'{key}'"), format!("\"{key}\"")]
        .iter()
        .find_map(|key| Some(dictionary.find(key)? + key.len()))?;
    Some(
        dictionary
            .get(at..)?
            .trim_start()
            .strip_prefix(':')?
            .trim_start(),
    )
}

fn quoted(text: &str) -> Option<&str> {
    let quote = text
        .chars()
        .next()
        .filter(|&quote| quote == '\'' || quote == '"')?;
    text.get(1..)?.split_once(quote).map(|(inner, _)| inner)
}

fn tuple(text: &str) -> Option<Vec<usize>> {
    let (inner, _) = text.strip_prefix('(')?.split_once(')')?;
    inner
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(dictionary: &str, expected: Result<(&str, &[usize]), NpyError>) {
        let expected = expected.map(|(descr, shape)| Header {
            descr: descr.to_owned(),
            shape: shape.to_vec(),
            is_fortran: dictionary.contains("True") && shape.len() > 1,
        });
        assert_eq!(parse(dictionary), expected);
    }

    #[test]
    fn dictionaries_are_read_in_any_order() {
        check(
            "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }",
            Ok(("<f8", &[3, 2])),
        );
        check(
            "{\"shape\":(7,),\"descr\":\"|u1\",\"fortran_order\":False}",
            Ok(("|u1", &[7])),
        );
        check(
            "{'descr': '<i4', 'fortran_order': True, 'shape': (), }",
            Ok(("<i4", &[])),
        );
        check(
            "{'descr': '<i4', 'fortran_order': True, 'shape': (2, 2), }",
            Ok(("<i4", &[2, 2])),
        );
        check(
            "{'descr': [('a', '<i4')], 'fortran_order': False, 'shape': (2,), }",
            Err(NpyError::Dictionary),
        );
        check(
            "{'descr': '<i4', 'fortran_order': False, 'shape': (-2,), }",
            Err(NpyError::Dictionary),
        );
        check("{'descr': '<i4'", Err(NpyError::Dictionary));
        check("", Err(NpyError::Dictionary));
    }

    #[test]
    fn headers_are_aligned_and_round_trip() {
        for shape in [vec![], vec![5], vec![1_000_000, 3], vec![1; 30_000]] {
            let bytes = header_bytes("<u4", &shape);
            assert_eq!(bytes.len() % ALIGNMENT, 0);
            let (header, rest) = split_header(&bytes).unwrap();
            assert_eq!((header.shape, rest), (shape, &[][..]));
        }
    }

    #[test]
    fn cut_and_foreign_headers_are_refused() {
        let whole = header_bytes("<u4", &[1]);
        for length in 6..whole.len() {
            assert_eq!(
                split_header(&whole[..length]),
                Err(NpyError::Truncated),
                "{length}"
            );
        }
        assert_eq!(split_header(b"PK\x03\x04"), Err(NpyError::NotNpy));
        assert_eq!(
            split_header(b"\x93NUMPY\x04\x00"),
            Err(NpyError::Version { major: 4, minor: 0 })
        );
    }
}

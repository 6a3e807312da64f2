//! Reads and writes NPY, versions 1.0 to 3.0: one array and its bytes.
//!
//! Arrays of any byte order, in C or Fortran order, are read. Integers of one or two bytes become wider. Arrays are written with the
//! lowest byte first and in C order.

use crate::numpy::array::{Array, Values};
use crate::numpy::half::Half;
use crate::numpy::npy_header::{Header, NpyError, header_bytes, split_header};

/// The bytes of an NPY file that `numpy.load` opens.
#[must_use]
pub fn array_to_npy(array: &Array) -> Vec<u8> {
    let (descr, values) = match array.values() {
        Values::F16(values) => (
            "<f2".to_owned(),
            little_endian(values, |x| x.0.to_le_bytes()),
        ),
        Values::F32(values) => ("<f4".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::F64(values) => ("<f8".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::I32(values) => ("<i4".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::I64(values) => ("<i8".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::U8(values) => ("|u1".to_owned(), values.clone()),
        Values::U32(values) => ("<u4".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::U64(values) => ("<u8".to_owned(), little_endian(values, |x| x.to_le_bytes())),
        Values::Bool(values) => (
            "|b1".to_owned(),
            values.iter().map(|&value| u8::from(value)).collect(),
        ),
        Values::Text(values) => text_bytes(values),
    };
    let mut bytes = header_bytes(&descr, array.shape());
    bytes.extend_from_slice(&values);
    bytes
}

/// The array in the bytes of an NPY file.
///
/// # Errors
/// If the header is damaged, the type or order is not supported, or the shape does not fit the bytes.
pub fn array_from_npy(bytes: &[u8]) -> Result<Array, NpyError> {
    let (header, bytes) = split_header(bytes)?;
    let n_bytes = bytes.len();
    let values = match header.item_size() {
        Some(size) if header.is_fortran || header.is_big_endian() => values_from(
            &header.little_endian_descr(),
            &reordered(&header, size, bytes),
        )?,
        _ => values_from(&header.descr, bytes)?,
    };
    let (descr, shape) = (header.descr, header.shape);
    Array::with_shape(shape.clone(), values).ok_or(NpyError::Size {
        descr,
        shape,
        n_bytes,
    })
}

/// The bytes with the last index fastest, and each value with its lowest byte first. Bytes that do not fit the shape keep their order.
fn reordered(header: &Header, item_size: usize, bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if header.is_big_endian() {
        // A text consists of characters of four bytes.
        let unit = if header.is_text() { 4 } else { item_size };
        bytes.chunks_exact_mut(unit).for_each(<[u8]>::reverse);
    }
    let n_items = header
        .shape
        .iter()
        .try_fold(1usize, |n, &side| n.checked_mul(side));
    let fits = n_items.and_then(|n| n.checked_mul(item_size)) == Some(bytes.len());
    if !header.is_fortran || !fits {
        return bytes;
    }
    let mut sorted = Vec::with_capacity(bytes.len());
    let mut index = vec![0; header.shape.len()];
    for _ in 0..bytes.len() / item_size {
        // The first index is the fastest one in the file.
        let place = index.iter().zip(&header.shape).rev();
        let place = place.fold(0, |place, (&at, &side)| place * side + at);
        sorted.extend_from_slice(&bytes[place * item_size..][..item_size]);
        for (at, &side) in index.iter_mut().zip(&header.shape).rev() {
            *at += 1;
            if *at < side {
                break;
            }
            *at = 0;
        }
    }
    sorted
}

/// All values in the bytes. An incomplete last value is left out, so the count does not fit the shape then.
fn values_from(descr: &str, bytes: &[u8]) -> Result<Values, NpyError> {
    Ok(match descr {
        "<f2" => Values::F16(chunks(bytes, |half| Half(u16::from_le_bytes(half)))?),
        "<f4" => Values::F32(chunks(bytes, f32::from_le_bytes)?),
        "<f8" => Values::F64(chunks(bytes, f64::from_le_bytes)?),
        "|i1" | "<i1" => Values::I32(chunks(bytes, |byte| i8::from_le_bytes(byte).into())?),
        "<i2" => Values::I32(chunks(bytes, |short| i16::from_le_bytes(short).into())?),
        "<u2" => Values::I32(chunks(bytes, |short| u16::from_le_bytes(short).into())?),
        "<i4" => Values::I32(chunks(bytes, i32::from_le_bytes)?),
        "<i8" => Values::I64(chunks(bytes, i64::from_le_bytes)?),
        "|u1" | "<u1" => Values::U8(bytes.to_vec()),
        "<u4" => Values::U32(chunks(bytes, u32::from_le_bytes)?),
        "<u8" => Values::U64(chunks(bytes, u64::from_le_bytes)?),
        "|b1" | "<b1" => Values::Bool(bytes.iter().map(|&byte| byte != 0).collect()),
        _ => Values::Text(texts_from(descr, bytes)?),
    })
}

fn little_endian<T: Copy, const N: usize>(
    values: &[T],
    to_bytes: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(N * values.len());
    values
        .iter()
        .for_each(|&value| bytes.extend_from_slice(&to_bytes(value)));
    bytes
}

fn chunks<T, const N: usize>(
    bytes: &[u8],
    from_bytes: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, NpyError> {
    let (whole, rest) = bytes.as_chunks::<N>();
    if rest.is_empty() {
        Ok(whole.iter().map(|&chunk| from_bytes(chunk)).collect())
    } else {
        Err(NpyError::Truncated)
    }
}

/// Fixed-width UTF-32, as wide as the longest text and at least one character.
fn text_bytes(texts: &[String]) -> (String, Vec<u8>) {
    let width = texts
        .iter()
        .map(|text| text.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let padded = texts.iter().flat_map(|text| {
        text.chars()
            .map(u32::from)
            .chain(std::iter::repeat(0))
            .take(width)
    });
    (
        format!("<U{width}"),
        padded.flat_map(u32::to_le_bytes).collect(),
    )
}

fn texts_from(descr: &str, bytes: &[u8]) -> Result<Vec<String>, NpyError> {
    let width: Option<usize> = descr
        .strip_prefix("<U")
        .and_then(|width| width.parse().ok());
    // A width of 0 would let any shape claim any number of values.
    let width = width
        .filter(|&width| width > 0)
        .ok_or_else(|| NpyError::Type(descr.to_owned()))?;
    let codes = chunks(bytes, u32::from_le_bytes)?;
    codes.chunks(width).map(text_from).collect()
}

fn text_from(codes: &[u32]) -> Result<String, NpyError> {
    let end = codes
        .iter()
        .rposition(|&code| code != 0)
        .map_or(0, |last| last + 1);
    codes[..end]
        .iter()
        .map(|&code| char::from_u32(code).ok_or(NpyError::Text(code)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check_round_trip(array: &Array) {
        assert_eq!(array_from_npy(&array_to_npy(array)).as_ref(), Ok(array));
    }

    /// Reads values of this type code, in this order, after a header with this shape.
    #[track_caller]
    fn check_read(descr: &str, order: &str, shape: &str, bytes: &[u8], expected: &Array) {
        let dictionary =
            format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((dictionary.len() as u16).to_le_bytes());
        file.extend(dictionary.bytes());
        file.extend(bytes);
        assert_eq!(array_from_npy(&file).as_ref(), Ok(expected), "{dictionary}");
    }

    #[test]
    fn other_orders_and_short_integers_are_read() {
        let shorts: Vec<u8> = [-1i16, 2, 300]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        check_read(
            "<i2",
            "False",
            "(3,)",
            &shorts,
            &Array::vector(vec![-1, 2, 300]),
        );
        check_read(
            "|i1",
            "False",
            "(2,)",
            &[255, 7],
            &Array::vector(vec![-1, 7]),
        );
        check_read(
            ">u2",
            "True",
            "(2,)",
            &[1, 0, 0, 5],
            &Array::vector(vec![256, 5]),
        );

        let columns = [1.0f32, 4.0, 2.0, 5.0, 3.0, 6.0];
        let expected = Array::rows(&[[1.0f32, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        let little: Vec<u8> = columns.iter().flat_map(|x| x.to_le_bytes()).collect();
        let big: Vec<u8> = columns.iter().flat_map(|x| x.to_be_bytes()).collect();
        check_read("<f4", "True", "(2, 3)", &little, &expected);
        check_read(">f4", "True", "(2, 3)", &big, &expected);

        // The index of three dimensions counts as NumPy counts it.
        let cube: Vec<i32> = (0..24).collect();
        let at = |[a, b, c]: [usize; 3]| cube[(a * 3 + b) * 4 + c];
        let fortran = (0..24usize).map(|n| at([n % 2, n / 2 % 3, n / 6]));
        let bytes: Vec<u8> = fortran.flat_map(i32::to_le_bytes).collect();
        let expected = Array::with_shape(vec![2, 3, 4], Values::I32(cube.clone())).unwrap();
        check_read("<i4", "True", "(2, 3, 4)", &bytes, &expected);

        let text: Vec<u8> = "ab"
            .chars()
            .flat_map(|c| u32::from(c).to_be_bytes())
            .collect();
        check_read(
            ">U2",
            "False",
            "(1,)",
            &text,
            &Array::vector(vec!["ab".to_owned()]),
        );
    }

    #[test]
    fn every_type_round_trips() {
        check_round_trip(&Array::vector(vec![1.5f32, -0.0, f32::INFINITY]));
        check_round_trip(&Array::rows(&[
            [1.0f64, 2.0, 3.0],
            [4.0, 5.0, f64::MIN_POSITIVE],
        ]));
        check_round_trip(&Array::vector(vec![i32::MIN, -1, 0]));
        check_round_trip(&Array::scalar(i64::MAX));
        check_round_trip(&Array::vector(Vec::<u8>::new()));
        check_round_trip(&Array::vector(vec![u32::MAX]));
        check_round_trip(&Array::vector(vec![u64::MAX]));
        check_round_trip(&Array::vector(vec![true, false]));
        check_round_trip(&Array::vector(vec![
            "".to_owned(),
            "Bohrung Ø5".to_owned(),
            "面".to_owned(),
        ]));
        check_round_trip(&Array::vector(Vec::<String>::new()));
    }

    fn with_header(descr: &str, shape: &[usize], values: &[u8]) -> Vec<u8> {
        let mut bytes = header_bytes(descr, shape);
        bytes.extend(values);
        bytes
    }

    #[test]
    fn what_does_not_fit_is_refused_without_allocation() {
        let size = |descr: &str, shape: &[usize], n_bytes| NpyError::Size {
            descr: descr.to_owned(),
            shape: shape.to_vec(),
            n_bytes,
        };
        let check = |descr: &str, shape: &[usize], values: &[u8], expected| {
            assert_eq!(
                array_from_npy(&with_header(descr, shape, values)),
                Err(expected)
            );
        };
        check(
            "<f8",
            &[1_000_000_000_000],
            &[0; 8],
            size("<f8", &[1_000_000_000_000], 8),
        );
        check(
            "<f8",
            &[usize::MAX, usize::MAX],
            &[0; 8],
            size("<f8", &[usize::MAX, usize::MAX], 8),
        );
        check("<f8", &[2], &[0; 15], NpyError::Truncated);
        check("<U9", &[2], &[0; 36], size("<U9", &[2], 36));
        check(
            "<U0",
            &[1_000_000_000_000],
            &[],
            NpyError::Type("<U0".to_owned()),
        );
        check("<c8", &[1], &[0; 8], NpyError::Type("<c8".to_owned()));
        check("|O", &[1], &[0; 8], NpyError::Type("|O".to_owned()));
        check(
            "<U1",
            &[1],
            &0x0011_0000u32.to_le_bytes(),
            NpyError::Text(0x0011_0000),
        );
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(descr in "[<|>][fiubUOS][0-9]{0,3}", shape in proptest::collection::vec(any::<usize>(), 0..3), values: Vec<u8>, cut in 0usize..200) {
            let bytes = with_header(&descr, &shape, &values);
            let _ = array_from_npy(&bytes[..cut.min(bytes.len())]);
            if let Ok(array) = array_from_npy(&bytes) {
                prop_assert_eq!(array.shape(), &shape[..]);
            }
        }

        #[test]
        fn texts_round_trip(texts: Vec<String>) {
            let trimmed: Vec<String> = texts.iter().map(|text| text.trim_end_matches('\0').to_owned()).collect();
            prop_assert_eq!(array_from_npy(&array_to_npy(&Array::vector(texts))), Ok(Array::vector(trimmed)));
        }
    }
}

//! Reads one label per triangle, from an array, a list, or masks.

use partprobe_carrier::IGNORE;
use partprobe_formats::{Array, Values, array_from_npy};
use serde_json::Value;

/// The label of a triangle in several masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlap {
    /// There is none, and the shape is refused.
    Refuse,
    /// The mask with the fewest triangles. If several are equal, it is the first one.
    Smallest,
}

/// The label of each triangle, or [`IGNORE`] if it has none.
pub(crate) fn labels(path: &str, bytes: &[u8], overlap: Overlap) -> Result<Vec<i32>, String> {
    match path.rsplit('.').next() {
        Some("npy") => {
            let array = array_from_npy(bytes).map_err(|error| error.to_string())?;
            of_array(&array, overlap)
        }
        Some("json") => of_json(bytes),
        _ => of_text(bytes),
    }
}

fn of_array(array: &Array, overlap: Overlap) -> Result<Vec<i32>, String> {
    match (array.values(), array.shape()) {
        (Values::Bool(cells), &[n_masks, n_triangles]) => {
            of_masks(cells, n_masks, n_triangles, overlap)
        }
        (values, [_] | [_, 1]) => of_values(values),
        (values, shape) => Err(format!(
            "an array of {} and shape {shape:?} is not one label per triangle, nor bool masks",
            values.type_name()
        )),
    }
}

fn of_values(values: &Values) -> Result<Vec<i32>, String> {
    match values {
        Values::I32(values) => values
            .iter()
            .map(|&value| whole(f64::from(value)))
            .collect(),
        Values::I64(values) => values.iter().map(|&value| integer(value)).collect(),
        Values::U8(values) => Ok(values.iter().map(|&value| i32::from(value)).collect()),
        Values::U32(values) => values.iter().map(|&value| integer(value.into())).collect(),
        Values::U64(values) => values
            .iter()
            .map(|&value| integer(value.try_into().unwrap_or(i64::MAX)))
            .collect(),
        Values::F16(values) => values
            .iter()
            .map(|&value| whole(value.to_f32().into()))
            .collect(),
        Values::F32(values) => values.iter().map(|&value| whole(value.into())).collect(),
        Values::F64(values) => values.iter().map(|&value| whole(value)).collect(),
        Values::Bool(values) => Ok(values.iter().map(|&value| i32::from(value)).collect()),
        Values::Text(_) => Err("an array of text holds no labels".to_owned()),
    }
}

fn integer(value: i64) -> Result<i32, String> {
    if value < 0 {
        return Ok(IGNORE);
    }
    value
        .try_into()
        .map_err(|_| format!("{value} is too large for a label"))
}

/// A whole number. Some tools write whole numbers as floats. Other floats are not labels.
pub(super) fn whole(value: f64) -> Result<i32, String> {
    if value < 0.0 || value.is_nan() {
        return Ok(IGNORE);
    }
    if value.fract() == 0.0 && value <= f64::from(i32::MAX) {
        return Ok(value as i32);
    }
    Err(format!(
        "{value} is not a label: a whole number is expected"
    ))
}

fn of_masks(
    cells: &[bool],
    n_masks: usize,
    n_triangles: usize,
    overlap: Overlap,
) -> Result<Vec<i32>, String> {
    if n_triangles == 0 {
        return Ok(Vec::new());
    }
    let masks: Vec<&[bool]> = cells.chunks(n_triangles).collect();
    let sizes: Vec<usize> = masks
        .iter()
        .map(|mask| mask.iter().filter(|&&cell| cell).count())
        .collect();
    // The smallest mask is written last.
    let mut order: Vec<usize> = (0..n_masks).collect();
    order.sort_by_key(|&mask| (std::cmp::Reverse(sizes[mask]), std::cmp::Reverse(mask)));

    let mut labels = vec![IGNORE; n_triangles];
    let mut n_overlapping = 0;
    for mask in order {
        for (label, _) in labels
            .iter_mut()
            .zip(masks[mask])
            .filter(|(_, cell)| **cell)
        {
            n_overlapping += usize::from(*label != IGNORE);
            *label = mask as i32;
        }
    }
    if n_overlapping > 0 && overlap == Overlap::Refuse {
        return Err(format!(
            "the masks overlap on {n_overlapping} triangles; choose overlap = \"smallest\" to take the smallest mask there"
        ));
    }
    Ok(labels)
}

/// A list, or an object whose keys are the indices of the triangles (SAMesh).
fn of_json(bytes: &[u8]) -> Result<Vec<i32>, String> {
    let value: Value =
        serde_json::from_slice(bytes).map_err(|error| format!("not JSON: {error}"))?;
    let label = |value: &Value| {
        let number = value
            .as_f64()
            .ok_or_else(|| format!("`{value}` is not a label"))?;
        whole(number)
    };
    match &value {
        Value::Array(items) => items.iter().map(label).collect(),
        Value::Object(object) => {
            let mut labels: Vec<Option<i32>> = vec![None; object.len()];
            for (key, value) in object {
                let slot = key.parse().ok().and_then(|idx: usize| labels.get_mut(idx));
                let slot = slot.ok_or_else(|| {
                    format!("the triangles must be numbered from 0 without a gap, but `{key}` is among {}", object.len())
                })?;
                *slot = Some(label(value)?);
            }
            // There are as many keys as slots, and no key is repeated, so every slot is filled.
            Ok(labels
                .into_iter()
                .map(|label| label.unwrap_or(IGNORE))
                .collect())
        }
        _ => Err("a list or an object of labels is expected".to_owned()),
    }
}

fn of_text(bytes: &[u8]) -> Result<Vec<i32>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "not text in UTF-8".to_owned())?;
    let lines = (1..)
        .zip(text.lines())
        .filter(|(_, line)| !line.trim().is_empty());
    let label = |(number, line): (usize, &str)| {
        let value: f64 = line
            .trim()
            .parse()
            .map_err(|_| format!("line {number}: `{line}` is not a label"))?;
        whole(value).map_err(|reason| format!("line {number}: {reason}"))
    };
    lines.map(label).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_formats::{Half, array_to_npy};

    #[track_caller]
    fn check(array: Array, overlap: Overlap, expected: Result<&[i32], &str>) {
        let found = labels("a.npy", &array_to_npy(&array), overlap);
        match expected {
            Ok(expected) => assert_eq!(found.as_deref(), Ok(expected)),
            Err(expected) => {
                let reason = found.unwrap_err();
                assert!(reason.contains(expected), "{reason}");
            }
        }
    }

    fn masks(rows: &[[bool; 3]]) -> Array {
        Array::with_shape(
            vec![rows.len(), 3],
            Values::Bool(rows.as_flattened().to_vec()),
        )
        .unwrap()
    }

    #[test]
    fn arrays_of_any_number_type_are_labels() {
        let refuse = Overlap::Refuse;
        check(
            Array::vector(vec![3i64, -2, 312]),
            refuse,
            Ok(&[3, -1, 312]),
        );
        check(
            Array::rows(&[[1.0f64], [0.0], [-1.0]]),
            refuse,
            Ok(&[1, 0, -1]),
        );
        check(Array::vector(vec![Half::from_f32(5.0)]), refuse, Ok(&[5]));
        check(Array::vector(vec![f32::NAN, 2.0]), refuse, Ok(&[-1, 2]));
        check(
            Array::vector(vec![0.5f32]),
            refuse,
            Err("0.5 is not a label"),
        );
        check(Array::vector(vec![u64::MAX]), refuse, Err("too large"));
        check(
            Array::rows(&[[1i32, 2], [3, 4]]),
            refuse,
            Err("int32 and shape [2, 2]"),
        );
    }

    #[test]
    fn masks_are_labels_if_they_do_not_overlap() {
        let disjoint = [[true, false, false], [false, true, false]];
        check(masks(&disjoint), Overlap::Refuse, Ok(&[0, 1, -1]));
        let nested = [
            [true, false, false],
            [true, true, true],
            [true, false, false],
        ];
        check(
            masks(&nested),
            Overlap::Refuse,
            Err("the masks overlap on 2 triangles"),
        );
        check(masks(&nested), Overlap::Smallest, Ok(&[0, 1, 1]));
    }

    #[test]
    fn lists_and_numbered_triangles_are_labels() {
        let check = |path: &str, text: &str, expected: Result<&[i32], &str>| {
            let found = labels(path, text.as_bytes(), Overlap::Refuse);
            assert_eq!(found.as_deref().map_err(String::as_str), expected);
        };
        check(
            "a_face2label.json",
            r#"{"1": 4, "0": 3, "2": -1}"#,
            Ok(&[3, 4, -1]),
        );
        check("a.json", "[1, 0]", Ok(&[1, 0]));
        check(
            "a.json",
            r#"{"0": 4, "2": 3}"#,
            Err("the triangles must be numbered from 0 without a gap, but `2` is among 2"),
        );
        check("a.seg", "1\n\n0.0\n", Ok(&[1, 0]));
        check("a.txt", "1\nx\n", Err("line 2: `x` is not a label"));
    }
}

//! Reads labels in JSON, in the structures of several data sets and tools.
//!
//! | structure | from |
//! |---|---|
//! | `[0, 3, 3]` | MFCAD++, one label per face in order |
//! | `{"12": 3}` | STEP ids, names or indices of faces |
//! | `{"file": "…", "faces": {"12": [1, 23]}}` | STEP ids of faces, with an instance and a class |
//! | `{"file": "…", "by": "name", "labels": […]}` | names that are indices into the list; or `order` |
//! | `[{"step_id": 12, "label": 3}]` | rows; also `name`, `index`, `class`, `instance` |
//! | `{"body": {"faces": [{"segment": {"index": 3}}]}}` | MFCAD; the name of a face is its index here |
//! | `[["name", {"seg": {…}, "inst": [[…]], "bottom": {…}}]]` | MFInstSeg: classes, a matrix of instances, bottoms |
//! | `{"cls": {…}, "seg": [[0, 4], [1]]}` | MFTRCAD: classes, and groups of faces |
//! | `{"faces": [{"feature": "Extrude1"}]}` | the timeline of Fusion 360 Gallery: instances |

use super::face_labels::{DamagedLabels, FaceLabels, NamedLabels, RawLabel, raw_label};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

const FILE_KEYS: &[&str] = &["file", "shape", "id"];
const LABEL_KEYS: &[&str] = &["label", "class", "instance", "part", "feature"];
/// The label of faces that belong to no instance, for example those of the stock.
const STOCK: &str = "stock";

/// The labels of a file with one shape.
///
/// # Errors
/// If the text is not JSON, or its structure is not one of those above.
pub(super) fn labels(bytes: &[u8], column: Option<&str>) -> Result<FaceLabels, String> {
    of_value(&parsed(bytes)?, column)
}

/// The shapes of a file with a list of shapes. It is empty if the file has one shape.
///
/// # Errors
/// If the text is not JSON, or the labels of a shape cannot be read.
pub(super) fn shapes(bytes: &[u8], column: Option<&str>) -> Result<Vec<NamedLabels>, String> {
    let value = parsed(bytes)?;
    let Some(items) = value
        .as_array()
        .filter(|items| items.iter().all(names_a_shape))
    else {
        return Ok(Vec::new());
    };
    let shape = |(number, item): (usize, &Value)| {
        let place = format!("item {number}");
        named(item, column, place.clone()).map_err(|reason| format!("{place}: {reason}"))
    };
    (1..).zip(items).map(shape).collect()
}

/// The shapes of a file with one shape per line. A line is damaged if it is not JSON, does not name its shape, or has labels that
/// cannot be read. The other lines are still read.
pub(super) fn shapes_of_lines(
    bytes: &[u8],
    column: Option<&str>,
) -> Vec<Result<NamedLabels, DamagedLabels>> {
    (1usize..)
        .zip(bytes.split(|&byte| byte == b'\n'))
        .filter(|(_, line)| !line.trim_ascii().is_empty())
        .map(|(number, line)| shape_of_line(line, column, format!("line {number}")))
        .collect()
}

fn shape_of_line(
    line: &[u8],
    column: Option<&str>,
    place: String,
) -> Result<NamedLabels, DamagedLabels> {
    let damaged = |file: Option<String>, reason: String| DamagedLabels {
        file,
        place: place.clone(),
        reason,
    };
    let item = parsed(line).map_err(|reason| damaged(None, reason))?;
    named(&item, column, place.clone())
        .map_err(|reason| damaged(file_of(&item).map(str::to_owned), reason))
}

fn parsed(bytes: &[u8]) -> Result<Value, String> {
    serde_json::from_slice(bytes).map_err(|error| format!("not JSON: {error}"))
}

fn names_a_shape(item: &Value) -> bool {
    file_of(item).is_some()
}

/// The shape that an item names: an entry of an object, or the first element of a pair (MFInstSeg).
fn file_of(item: &Value) -> Option<&str> {
    match item {
        Value::Object(object) => FILE_KEYS.iter().find_map(|&key| object.get(key)?.as_str()),
        Value::Array(pair) if pair.len() == 2 && pair[1].is_object() => pair[0].as_str(),
        _ => None,
    }
}

fn named(item: &Value, column: Option<&str>, place: String) -> Result<NamedLabels, String> {
    let file = file_of(item)
        .ok_or("no entry `file` names the shape")?
        .to_owned();
    let labels = match item {
        Value::Array(pair) => of_value(&pair[1], column),
        other => of_value(other, column),
    };
    Ok(NamedLabels {
        labels: labels?,
        file,
        place,
    })
}

fn of_value(value: &Value, column: Option<&str>) -> Result<FaceLabels, String> {
    match value {
        Value::Array(items) if items.iter().all(is_scalar) => {
            Ok(FaceLabels::InOrder(items.iter().map(scalar).collect()))
        }
        // MFInstSeg writes one pair per file.
        Value::Array(items)
            if items.len() == 1 && names_a_shape(&items[0]) && items[0].is_array() =>
        {
            of_value(&items[0][1], column)
        }
        Value::Array(items) => rows(items, column),
        Value::Object(object) => of_object(object, column),
        _ => Err("a list or an object of labels is expected".to_owned()),
    }
}

fn of_object(object: &Map<String, Value>, column: Option<&str>) -> Result<FaceLabels, String> {
    if let Some(faces) = object.get("body").and_then(|body| body.get("faces")) {
        return mfcad(faces);
    }
    if let Some(labels) = object.get("labels") {
        return listed(labels, object.get("by").and_then(Value::as_str), column);
    }
    match object.get("faces") {
        Some(Value::Object(faces)) => return keyed(faces, column).map(FaceLabels::ByStepId),
        Some(Value::Array(faces)) => return rows(faces, column),
        _ => {}
    }
    if ["seg", "cls", "inst"]
        .iter()
        .any(|&key| object.contains_key(key))
    {
        return features(object, column);
    }
    keyed(object, column).map(FaceLabels::Keyed)
}

/// MFCAD: the name of a face is the index of its entry.
fn mfcad(faces: &Value) -> Result<FaceLabels, String> {
    let faces = faces.as_array().ok_or("`body.faces` must be a list")?;
    let label = |(idx, face): (usize, &Value)| {
        let class = &face["segment"]["index"];
        if is_scalar(class) {
            Ok((idx.to_string(), scalar(class)))
        } else {
            Err(format!(
                "`body.faces[{idx}].segment.index` must be a number"
            ))
        }
    };
    faces
        .iter()
        .enumerate()
        .map(label)
        .collect::<Result<_, _>>()
        .map(FaceLabels::Named)
}

/// A list of labels, with a word for the key of its faces.
fn listed(labels: &Value, by: Option<&str>, column: Option<&str>) -> Result<FaceLabels, String> {
    let in_order = |labels: &Value| {
        let items = labels.as_array().ok_or("`labels` must be a list")?;
        items
            .iter()
            .map(|item| label_of(item, column))
            .collect::<Result<Vec<RawLabel>, String>>()
    };
    match (by, labels) {
        (None | Some("order"), Value::Array(_)) => in_order(labels).map(FaceLabels::InOrder),
        (Some("name"), Value::Array(_)) => {
            let labels = in_order(labels)?.into_iter().enumerate();
            Ok(FaceLabels::Named(
                labels
                    .map(|(idx, label)| (idx.to_string(), label))
                    .collect(),
            ))
        }
        (Some("name"), Value::Object(object)) => keyed(object, column).map(FaceLabels::Named),
        (Some("step-id"), Value::Object(object)) => keyed(object, column).map(FaceLabels::ByStepId),
        (None, Value::Object(object)) => keyed(object, column).map(FaceLabels::Keyed),
        (Some(other), _) => Err(format!(
            "`by` is `{other}`, which does not fit `labels`; it may be order, name or step-id"
        )),
        (None, _) => Err("`labels` must be a list or an object".to_owned()),
    }
}

fn keyed(
    object: &Map<String, Value>,
    column: Option<&str>,
) -> Result<Vec<(String, RawLabel)>, String> {
    let label = |(key, value): (&String, &Value)| {
        let label = label_of(value, column).map_err(|reason| format!("`{key}`: {reason}"))?;
        Ok((key.strip_prefix('#').unwrap_or(key).to_owned(), label))
    };
    object.iter().map(label).collect()
}

/// A list with one object per face.
fn rows(items: &[Value], column: Option<&str>) -> Result<FaceLabels, String> {
    let key_of =
        |names: &[&str], item: &Value| names.iter().find_map(|&name| scalar(item.get(name)?));
    let labeled = |names: &[&str]| -> Option<Vec<String>> {
        items.iter().map(|item| key_of(names, item)).collect()
    };
    let labels = (0..).zip(items).map(|(idx, item)| {
        label_of(item, column).map_err(|reason: String| format!("face {idx}: {reason}"))
    });
    let labels: Vec<RawLabel> = labels.collect::<Result<_, String>>()?;

    let with = |keys: Vec<String>| keys.into_iter().zip(labels.iter().cloned()).collect();
    if let Some(ids) = labeled(&["step_id", "face_step_id", "entity"]) {
        return Ok(FaceLabels::ByStepId(with(ids)));
    }
    if let Some(names) = labeled(&["name", "face_name"]) {
        return Ok(FaceLabels::Named(with(names)));
    }
    if let Some(indices) = labeled(&["index", "face_index"]) {
        return in_order(with(indices));
    }
    Ok(FaceLabels::InOrder(labels))
}

/// MFInstSeg and MFTRCAD: classes of faces, and the instances that they form.
fn features(object: &Map<String, Value>, column: Option<&str>) -> Result<FaceLabels, String> {
    let groups = object.get("seg").filter(|seg| is_list_of_lists(seg));
    let classes = match groups {
        Some(_) => object.get("cls"),
        None => object.get("seg").or_else(|| object.get("cls")),
    };
    match column {
        None | Some("class") => by_index(classes.ok_or("there are no classes: `seg` or `cls`")?),
        Some("instance") => match (object.get("inst"), groups) {
            (Some(matrix), _) => instances_of_matrix(matrix),
            (None, Some(groups)) => {
                let n_faces = classes.and_then(Value::as_object).map_or(0, Map::len);
                instances_of_groups(groups, n_faces)
            }
            (None, None) => Err("there are no instances: `inst`, or groups in `seg`".to_owned()),
        },
        Some(other) => {
            let labels = object.get(other);
            by_index(labels.ok_or_else(|| format!("there is no `{other}`"))?)
        }
    }
}

fn is_list_of_lists(value: &Value) -> bool {
    value
        .as_array()
        .is_some_and(|items| items.iter().all(Value::is_array))
}

/// A list of labels, or an object whose keys are the indices of the faces.
fn by_index(labels: &Value) -> Result<FaceLabels, String> {
    match labels {
        Value::Array(items) if items.iter().all(is_scalar) => {
            Ok(FaceLabels::InOrder(items.iter().map(scalar).collect()))
        }
        Value::Object(object) => in_order(keyed(object, None)?),
        _ => {
            Err("the labels must be a list, or an object with the indices of the faces".to_owned())
        }
    }
}

fn in_order(keyed: Vec<(String, RawLabel)>) -> Result<FaceLabels, String> {
    let n_labels = keyed.len();
    let index = |(key, label): (String, RawLabel)| {
        let idx = key.parse::<usize>().ok().filter(|&idx| idx < n_labels);
        let gap = || {
            format!(
                "the faces must be numbered from 0 without a gap, but `{key}` is among {n_labels}"
            )
        };
        Ok((idx.ok_or_else(gap)?, label))
    };
    let by_idx = keyed
        .into_iter()
        .map(index)
        .collect::<Result<BTreeMap<usize, RawLabel>, String>>()?;
    if by_idx.len() < n_labels {
        return Err("a face has two labels".to_owned());
    }
    Ok(FaceLabels::InOrder(by_idx.into_values().collect()))
}

/// Two faces belong to the same instance if the matrix says so in either direction. Faces without an instance are the stock.
fn instances_of_matrix(matrix: &Value) -> Result<FaceLabels, String> {
    let rows = matrix.as_array().ok_or("`inst` must be a matrix")?;
    let n_faces = rows.len();
    let mut instance: Vec<Option<usize>> = vec![None; n_faces];
    for (row, cells) in rows.iter().enumerate() {
        let cells = cells.as_array().filter(|cells| cells.len() == n_faces);
        let cells = cells.ok_or_else(|| {
            format!("`inst` must be square, but row {row} has not {n_faces} entries")
        })?;
        for (column, cell) in cells.iter().enumerate() {
            if cell.as_f64().is_some_and(|value| value > 0.5) {
                join(&mut instance, row, column);
            }
        }
    }
    let label =
        |instance: Option<usize>| Some(instance.map_or(STOCK.to_owned(), |idx| idx.to_string()));
    Ok(FaceLabels::InOrder(
        instance.into_iter().map(label).collect(),
    ))
}

/// Joins the instances of two faces. All their faces get the lower of the two numbers.
fn join(instance: &mut [Option<usize>], a: usize, b: usize) {
    let [first, second] = [a, b].map(|face| instance[face].unwrap_or(face));
    let (low, high) = (first.min(second), first.max(second));
    instance[a] = Some(first);
    instance[b] = Some(second);
    if low != high {
        for number in instance.iter_mut().filter(|number| **number == Some(high)) {
            *number = Some(low);
        }
    }
}

/// Faces of one group are one instance. Faces in no group are the stock.
fn instances_of_groups(groups: &Value, n_faces: usize) -> Result<FaceLabels, String> {
    let groups = groups.as_array().ok_or("`seg` must be a list of groups")?;
    let mut labels: Vec<RawLabel> = vec![None; n_faces];
    for (number, group) in groups.iter().enumerate() {
        for face in group.as_array().into_iter().flatten() {
            let face = face.as_u64().and_then(|face| usize::try_from(face).ok());
            let face =
                face.ok_or_else(|| format!("group {number} of `seg` holds what is not a face"))?;
            if face >= labels.len() {
                labels.resize(face + 1, None);
            }
            if labels[face].is_some() {
                return Err(format!("face {face} is in two groups of `seg`"));
            }
            labels[face] = Some(number.to_string());
        }
    }
    let stock = |label: RawLabel| Some(label.unwrap_or(STOCK.to_owned()));
    Ok(FaceLabels::InOrder(labels.into_iter().map(stock).collect()))
}

/// One label: a number or a word, one of several numbers, or an entry of an object.
fn label_of(value: &Value, column: Option<&str>) -> Result<RawLabel, String> {
    match value {
        Value::Array(values) => {
            let idx = match column {
                // The entries of partprobe's own lists.
                Some("instance") => 0,
                Some("class") => 1,
                Some(other) => other.parse().map_err(|_| {
                    format!("a label is `instance`, `class`, or a position from 0, not `{other}`")
                })?,
                None if values.len() == 1 => 0,
                None => {
                    return Err(format!(
                        "a face has {} labels; take one with the key `column`: instance, class, or a position from 0",
                        values.len()
                    ));
                }
            };
            let value = values.get(idx).filter(|value| is_scalar(value));
            value
                .map(scalar)
                .ok_or_else(|| format!("a face has no label {idx}"))
        }
        Value::Object(object) => {
            let found = |name: &str| {
                object
                    .get(name)
                    .filter(|value| is_scalar(value))
                    .map(scalar)
            };
            match column {
                Some(column) => {
                    found(column).ok_or_else(|| format!("a face has no entry `{column}`"))
                }
                None => {
                    let mut labels = LABEL_KEYS.iter().filter_map(|&name| found(name));
                    match (labels.next(), labels.next()) {
                        (Some(label), None) => Ok(label),
                        (None, _) => {
                            Err("a face has no label; name its entry with the key `column`"
                                .to_owned())
                        }
                        (Some(_), Some(_)) => {
                            Err("a face has several labels; name one with the key `column`"
                                .to_owned())
                        }
                    }
                }
            }
        }
        scalar_value => Ok(scalar(scalar_value)),
    }
}

fn is_scalar(value: &Value) -> bool {
    matches!(value, Value::Null | Value::Number(_) | Value::String(_))
}

fn scalar(value: &Value) -> RawLabel {
    match value {
        Value::Number(number) => raw_label(&number.to_string()),
        Value::String(text) => raw_label(text),
        _ => None,
    }
}

#[cfg(test)]
mod tests;

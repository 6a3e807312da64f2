//! Reads labels in CSV with a header.
//!
//! One column names the face: `step_id`, `name`, or `index`, with or without `face_` before it. One column is the label: `label`,
//! `class` or `instance`, or the one that the user names. If there are only labels, the rows are in the order of the faces. With a
//! column `shape` or `file`, one file can have many shapes. A column `id` has the ids of the faces if no other column names the faces
//! and all its values are whole numbers; otherwise, it names the shapes.

use super::face_labels::{FaceLabels, NamedLabels, RawLabel, raw_label};

const SHAPE_COLUMNS: &[&str] = &["shape", "file"];
/// A column that may name the shapes or the faces.
const ID_COLUMN: &str = "id";
const STEP_ID_COLUMNS: &[&str] = &["step_id", "face_step_id", "face_id", "entity"];
const NAME_COLUMNS: &[&str] = &["name", "face_name"];
const INDEX_COLUMNS: &[&str] = &["index", "face_index", "face", "order"];
const LABEL_COLUMNS: &[&str] = &["label", "class", "instance", "part", "segment"];

/// The shapes of a file with a column that names them. It is empty if there is no such column.
///
/// # Errors
/// If the file is not CSV with a column of labels.
pub(super) fn shapes(bytes: &[u8], column: Option<&str>) -> Result<Vec<NamedLabels>, String> {
    let table = Table::read(bytes, column)?;
    let Some(shape_column) = table.shape else {
        return Ok(Vec::new());
    };

    // Rows of one shape need not be consecutive. Shapes are in the order of their first rows.
    let mut names: Vec<&str> = Vec::new();
    let mut rows_of: std::collections::BTreeMap<&str, Vec<&Row>> =
        std::collections::BTreeMap::new();
    for row in &table.rows {
        let name = row.cells[shape_column].as_str();
        let rows = rows_of.entry(name).or_default();
        if rows.is_empty() {
            names.push(name);
        }
        rows.push(row);
    }
    let shape = |name: &str| {
        let rows = &rows_of[name];
        Ok(NamedLabels {
            file: name.to_owned(),
            place: format!("line {}", rows[0].line),
            labels: table.labels(rows)?,
        })
    };
    names.into_iter().map(shape).collect()
}

/// The labels of a file with one shape.
///
/// # Errors
/// If the file is not CSV with a column of labels, or it has several shapes.
pub(super) fn labels(bytes: &[u8], column: Option<&str>) -> Result<FaceLabels, String> {
    let table = Table::read(bytes, column)?;
    if let Some(shape) = table.shape {
        let header = &table.header[shape];
        return Err(format!(
            "the column `{header}` says that it holds several shapes; give this file itself as `path`"
        ));
    }
    table.labels(&table.rows.iter().collect::<Vec<_>>())
}

struct Row {
    /// The number of its line, from 1.
    line: usize,
    cells: Vec<String>,
}

/// A table with its known columns.
struct Table {
    header: Vec<String>,
    rows: Vec<Row>,
    shape: Option<usize>,
    key: Option<(KeyKind, usize)>,
    label: usize,
}

#[derive(Clone, Copy)]
enum KeyKind {
    StepId,
    Name,
    Index,
}

impl Table {
    fn read(bytes: &[u8], column: Option<&str>) -> Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "not text in UTF-8".to_owned())?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines = (1..)
            .zip(text.lines())
            .filter(|(_, line)| !line.trim().is_empty());
        let mut rows = Vec::new();
        for (line, content) in lines {
            let cells = cells(content).ok_or(format!("line {line}: a quote is not closed"))?;
            rows.push(Row { line, cells });
        }
        if rows.is_empty() {
            return Err("the file is empty".to_owned());
        }

        let header: Vec<String> = rows
            .remove(0)
            .cells
            .iter()
            .map(|cell| cell.trim().to_lowercase())
            .collect();
        if let Some(row) = rows.iter().find(|row| row.cells.len() != header.len()) {
            return Err(format!(
                "line {}: {} cells under a header of {}",
                row.line,
                row.cells.len(),
                header.len()
            ));
        }
        let key = [
            (KeyKind::StepId, STEP_ID_COLUMNS),
            (KeyKind::Name, NAME_COLUMNS),
            (KeyKind::Index, INDEX_COLUMNS),
        ];
        let mut key = key
            .into_iter()
            .find_map(|(kind, names)| Some((kind, first_of(&header, names)?)));
        let mut shape = first_of(&header, SHAPE_COLUMNS);
        if let Some(column) = first_of(&header, &[ID_COLUMN]) {
            let is_number = |row: &Row| whole_number(&row.cells[column]).is_some();
            if key.is_none() && rows.iter().all(is_number) {
                key = Some((KeyKind::StepId, column));
            } else {
                shape = shape.or(Some(column));
            }
        }
        Ok(Self {
            shape,
            key,
            label: label_column(&header, column)?,
            header,
            rows,
        })
    }

    fn labels(&self, rows: &[&Row]) -> Result<FaceLabels, String> {
        let label = |row: &Row| raw_label(&row.cells[self.label]);
        let Some((kind, column)) = self.key else {
            self.ensure_only_labels()?;
            return Ok(FaceLabels::InOrder(
                rows.iter().map(|row| label(row)).collect(),
            ));
        };
        let keyed = rows.iter().map(|row| {
            let key = row.cells[column].trim();
            (key.strip_prefix('#').unwrap_or(key).to_owned(), label(row))
        });
        let keyed: Vec<(String, RawLabel)> = keyed.collect();
        match kind {
            KeyKind::StepId => Ok(FaceLabels::ByStepId(keyed)),
            KeyKind::Name => Ok(FaceLabels::Named(keyed)),
            KeyKind::Index => in_order(keyed, rows),
        }
    }
}

impl Table {
    /// Refuses a column that may name the faces in a way that is not known. Without one, the rows are in the order of the faces.
    fn ensure_only_labels(&self) -> Result<(), String> {
        let is_known = |(at, name): &(usize, &String)| {
            *at == self.label || self.shape == Some(*at) || LABEL_COLUMNS.contains(&name.as_str())
        };
        let unknown = self
            .header
            .iter()
            .enumerate()
            .find(|column| !is_known(column));
        unknown.map_or(Ok(()), |(_, name)| {
            Err(format!(
                "the column `{name}` is not known, so it is not certain which face a row is of; name the column of the faces \
                 step_id, name or index, or leave out all columns but the labels if the rows are in the order of the faces"
            ))
        })
    }
}

/// Sorts labels by their index, which must count from 0 without a gap.
fn in_order(keyed: Vec<(String, RawLabel)>, rows: &[&Row]) -> Result<FaceLabels, String> {
    let mut labels: Vec<Option<RawLabel>> = vec![None; keyed.len()];
    for ((key, label), row) in keyed.into_iter().zip(rows) {
        let slot = key.parse().ok().and_then(|idx: usize| labels.get_mut(idx));
        let slot = slot.filter(|slot| slot.is_none()).ok_or_else(|| {
            format!(
                "line {}: the faces must be numbered from 0 without a gap, each once",
                row.line
            )
        })?;
        *slot = Some(label);
    }
    Ok(FaceLabels::InOrder(labels.into_iter().flatten().collect()))
}

fn label_column(header: &[String], column: Option<&str>) -> Result<usize, String> {
    if let Some(column) = column {
        let wanted = column.to_lowercase();
        let found = header.iter().position(|cell| *cell == wanted);
        return found.ok_or_else(|| {
            format!(
                "there is no column `{column}`; the columns are {}",
                header.join(", ")
            )
        });
    }
    let found: Vec<usize> = LABEL_COLUMNS
        .iter()
        .filter_map(|name| header.iter().position(|cell| cell == name))
        .collect();
    match found.as_slice() {
        [one] => Ok(*one),
        [] => Err(format!(
            "no label column among `{}`; name it with the key `column`",
            header.join("`, `")
        )),
        [first, second, ..] => Err(format!(
            "`{}` and `{}` are both labels; name one with the key `column`",
            header[*first], header[*second]
        )),
    }
}

/// A number like `12` or `#12`.
fn whole_number(cell: &str) -> Option<u64> {
    let cell = cell.trim();
    cell.strip_prefix('#').unwrap_or(cell).parse().ok()
}

fn first_of(header: &[String], names: &[&str]) -> Option<usize> {
    header
        .iter()
        .position(|cell| names.contains(&cell.as_str()))
}

/// The cells of a line. A cell in quotes may contain commas, and two quotes in it mean one. Returns `None` if a quote is not
/// closed.
fn cells(line: &str) -> Option<Vec<String>> {
    let mut cells = vec![String::new()];
    let mut is_quoted = false;
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        let last = cells.len() - 1;
        match character {
            '"' if is_quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cells[last].push('"');
            }
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            other => cells[last].push(other),
        }
    }
    (!is_quoted).then_some(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(pairs: &[(&str, &str)]) -> Vec<(String, RawLabel)> {
        pairs
            .iter()
            .map(|&(key, label)| (key.to_owned(), Some(label.to_owned())))
            .collect()
    }

    #[track_caller]
    fn check(text: &str, column: Option<&str>, expected: Result<FaceLabels, &str>) {
        assert_eq!(
            labels(text.as_bytes(), column),
            expected.map_err(str::to_owned)
        );
    }

    #[test]
    fn the_header_says_how_labels_find_their_faces() {
        let by_id = Ok(FaceLabels::ByStepId(some(&[
            ("12", "0"),
            ("19", "pocket, deep"),
        ])));
        check("step_id,label\n12,0\n#19,\"pocket, deep\"\n", None, by_id);
        let named = Ok(FaceLabels::Named(some(&[("a \"b\"", "1")])));
        check("Name,Class\n\"a \"\"b\"\"\",1\n", None, named);
        let ordered = Ok(FaceLabels::InOrder(vec![None, Some("4".to_owned())]));
        check("index,label\n1,4\n0,-1\n", None, ordered.clone());
        check("label\n-1\n4\n", None, ordered);
        let chosen = Ok(FaceLabels::ByStepId(some(&[("7", "2")])));
        check("step_id,class,instance\n7,9,2\n", Some("instance"), chosen);
        let by_id = Ok(FaceLabels::ByStepId(some(&[("12", "0"), ("19", "4")])));
        check("id,label\n12,0\n#19,4\n", None, by_id);
    }

    #[test]
    fn what_is_not_certain_is_refused() {
        check(
            "step_id,class,instance\n7,9,2\n",
            None,
            Err("`class` and `instance` are both labels; name one with the key `column`"),
        );
        check(
            "step_id,colour\n7,9\n",
            None,
            Err("no label column among `step_id`, `colour`; name it with the key `column`"),
        );
        check(
            "index,label\n0,1\n2,1\n",
            None,
            Err("line 3: the faces must be numbered from 0 without a gap, each once"),
        );
        check(
            "index,label\n0,1\n0,2\n",
            None,
            Err("line 3: the faces must be numbered from 0 without a gap, each once"),
        );
        check(
            "label\n1,2\n",
            None,
            Err("line 2: 2 cells under a header of 1"),
        );
        check(
            "stepid,label\n12,0\n",
            None,
            Err(
                "the column `stepid` is not known, so it is not certain which face a row is of; name the column of the faces \
                 step_id, name or index, or leave out all columns but the labels if the rows are in the order of the faces",
            ),
        );
        check("label\n\"1\n", None, Err("line 2: a quote is not closed"));
        check("", None, Err("the file is empty"));
        check(
            "file,step_id,label\na.step,1,2\n",
            None,
            Err(
                "the column `file` says that it holds several shapes; give this file itself as `path`",
            ),
        );
    }

    #[test]
    fn a_file_may_hold_many_shapes() {
        let text = "file,step_id,label\na.step,1,2\nb.step,1,3\na.step,5,4\n";
        let found = shapes(text.as_bytes(), None).unwrap();
        let expected = [
            NamedLabels {
                file: "a.step".to_owned(),
                place: "line 2".to_owned(),
                labels: FaceLabels::ByStepId(some(&[("1", "2"), ("5", "4")])),
            },
            NamedLabels {
                file: "b.step".to_owned(),
                place: "line 3".to_owned(),
                labels: FaceLabels::ByStepId(some(&[("1", "3")])),
            },
        ];
        assert_eq!(found, expected);
        for (text, shapes_in_it) in [
            ("id,step_id,label\n7,1,2\n8,1,3\n", vec!["7", "8"]),
            ("id,label\na.step,1\nb.step,2\n", vec!["a.step", "b.step"]),
            ("id,label\n7,1\n8,2\n", vec![]),
        ] {
            let found = shapes(text.as_bytes(), None).unwrap();
            let names: Vec<&str> = found.iter().map(|shape| shape.file.as_str()).collect();
            assert_eq!(names, shapes_in_it, "{text}");
        }
    }
}

//! Reads labeled points in PLY, NPY, rows of text, or arrays of HDF5.
//!
//! A row is `x y z label` or `x y z nx ny nz label`. A file of single numbers has only labels, and rows of three or six numbers
//! are only positions, without or with normals. [`super::hdf5`] has the layouts of HDF5.

use partprobe_carrier::{IGNORE, Point, norm};
use partprobe_formats::{Array, Values, array_from_npy, points_from_ply};

/// Points with a label each.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cloud {
    pub(crate) positions: Vec<Point>,
    /// Unit normals. They are empty if the points have none.
    pub(crate) normals: Vec<Point>,
    pub(crate) labels: Vec<i32>,
}

impl Cloud {
    /// The points of a file: positions, labels, or both.
    ///
    /// # Errors
    /// If the file does not have one of the layouts above.
    pub(crate) fn read(path: &str, bytes: &[u8]) -> Result<Self, String> {
        match path.rsplit('.').next() {
            Some("ply") => {
                let points = points_from_ply(bytes).map_err(|error| error.to_string())?;
                Ok(Self {
                    positions: points
                        .points
                        .iter()
                        .map(|point| point.map(f64::from))
                        .collect(),
                    normals: points
                        .normals
                        .iter()
                        .map(|normal| normal.map(f64::from))
                        .collect(),
                    labels: points.parts,
                })
            }
            Some("npy") => {
                let array = array_from_npy(bytes).map_err(|error| error.to_string())?;
                Self::of_array(&array)
            }
            _ => Self::of_text(bytes),
        }
    }

    /// Takes the positions and normals of other points.
    ///
    /// # Errors
    /// If there are none.
    pub(super) fn take_positions(&mut self, other: Self) -> Result<(), String> {
        if other.positions.is_empty() {
            return Err("the file holds no positions".to_owned());
        }
        self.positions = other.positions;
        self.normals = other.normals;
        Ok(())
    }

    /// Whether each position has a label.
    ///
    /// # Errors
    /// If there are only positions or only labels, or if their numbers differ.
    pub(crate) fn check(&self) -> Result<(), String> {
        match (self.positions.len(), self.labels.len()) {
            (0, 0) => Err("the file is empty".to_owned()),
            (0, _) => Err(
                "the file holds labels only; give the positions with the key `points`".to_owned(),
            ),
            (_, 0) => Err("the file holds positions only, and no labels".to_owned()),
            (n_points, n_labels) if n_points != n_labels => {
                Err(format!("there are {n_labels} labels for {n_points} points"))
            }
            _ if self.positions.iter().flatten().any(|x| !x.is_finite()) => {
                Err("a coordinate is not a finite number".to_owned())
            }
            _ => Ok(()),
        }
    }

    /// Multiplies the positions.
    pub(crate) fn scale(&mut self, factor: f64) {
        for position in &mut self.positions {
            *position = position.map(|x| x * factor);
        }
    }

    /// The bytes of all values, for a hash.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let vectors = self.positions.iter().chain(&self.normals).flatten();
        let labels = self.labels.iter().flat_map(|label| label.to_le_bytes());
        vectors
            .flat_map(|x| x.to_le_bytes())
            .chain(labels)
            .collect()
    }

    fn of_array(array: &Array) -> Result<Self, String> {
        let values: Vec<f64> = match array.values() {
            Values::F16(values) => values
                .iter()
                .map(|value| f64::from(value.to_f32()))
                .collect(),
            Values::F32(values) => values.iter().map(|&value| value.into()).collect(),
            Values::F64(values) => values.clone(),
            Values::I32(values) => values.iter().map(|&value| value.into()).collect(),
            Values::I64(values) => values.iter().map(|&value| value as f64).collect(),
            Values::U8(values) => values.iter().map(|&value| value.into()).collect(),
            Values::U32(values) => values.iter().map(|&value| value.into()).collect(),
            Values::U64(values) => values.iter().map(|&value| value as f64).collect(),
            other => return Err(format!("an array of {} holds no labels", other.type_name())),
        };
        let width = match array.shape() {
            [_] => 1,
            &[_, width] if width > 0 => width,
            shape => {
                return Err(format!(
                    "an array of shape {shape:?} is not a row per point"
                ));
            }
        };
        Self::of_rows(values.chunks(width).map(<[f64]>::to_vec))
    }

    fn of_text(bytes: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "not text in UTF-8".to_owned())?;
        let lines = (1..)
            .zip(text.lines())
            .filter(|(_, line)| !line.trim().is_empty());
        let row = |(number, line): (usize, &str)| {
            let words = line
                .split([' ', '\t', ',', ';'])
                .filter(|word| !word.is_empty());
            let values = words
                .map(str::parse::<f64>)
                .collect::<Result<Vec<f64>, _>>();
            values.map_err(|_| format!("line {number}: a row of numbers is expected"))
        };
        let rows = lines.map(row).collect::<Result<Vec<Vec<f64>>, String>>()?;
        let width = rows.first().map_or(0, Vec::len);
        if let Some(row) = rows.iter().position(|row| row.len() != width) {
            return Err(format!(
                "row {} has {} numbers, and the first one has {width}",
                row + 1,
                rows[row].len()
            ));
        }
        Self::of_rows(rows.into_iter())
    }

    fn of_rows(rows: impl Iterator<Item = Vec<f64>>) -> Result<Self, String> {
        let mut cloud = Self::default();
        for row in rows {
            let (vectors, label) = match row.len() {
                1 | 4 | 7 => row.split_at(row.len() - 1),
                3 | 6 => (row.as_slice(), &[][..]),
                width => {
                    return Err(format!(
                        "a row has {width} numbers; x y z, then perhaps a normal, then the label are expected"
                    ));
                }
            };
            if let [x, y, z, ..] = *vectors {
                cloud.positions.push([x, y, z]);
            }
            if let [_, _, _, x, y, z] = *vectors {
                cloud.normals.push(unit([x, y, z]));
            }
            for &value in label {
                cloud.labels.push(label_of(value)?);
            }
        }
        Ok(cloud)
    }
}

pub(super) fn unit(vector: Point) -> Point {
    let length = norm(vector);
    if length > 0.0 {
        vector.map(|x| x / length)
    } else {
        vector
    }
}

/// A label from a number. A negative number or NaN is not a label.
pub(crate) fn label_of(value: f64) -> Result<i32, String> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_formats::{PlyPoints, array_to_npy, points_to_ply};

    fn cloud(positions: &[Point], normals: &[Point], labels: &[i32]) -> Cloud {
        Cloud {
            positions: positions.to_vec(),
            normals: normals.to_vec(),
            labels: labels.to_vec(),
        }
    }

    #[track_caller]
    fn check(path: &str, bytes: &[u8], expected: Result<Cloud, &str>) {
        let found = Cloud::read(path, bytes).and_then(|cloud| cloud.check().map(|()| cloud));
        assert_eq!(found, expected.map_err(str::to_owned));
    }

    const TWO: [Point; 2] = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]];
    const UP: [Point; 2] = [[0.0, 0.0, 1.0]; 2];

    #[test]
    fn rows_hold_positions_normals_and_labels() {
        check(
            "a.xyzc",
            b"0 1 2 7\n3 4 5 -1\n",
            Ok(cloud(&TWO, &[], &[7, -1])),
        );
        check(
            "a.txt",
            b"0;1;2;0;0;2;7\n3;4;5;0;0;1;8\n",
            Ok(cloud(&TWO, &UP, &[7, 8])),
        );
        let rows = Array::rows(&[[0.0f32, 1.0, 2.0, 7.0], [3.0, 4.0, 5.0, 8.0]]);
        check("a.npy", &array_to_npy(&rows), Ok(cloud(&TWO, &[], &[7, 8])));
        let ply = PlyPoints {
            points: TWO.map(|point| point.map(|x| x as f32)).to_vec(),
            normals: Vec::new(),
            parts: vec![7, 8],
        };
        check("a.ply", &points_to_ply(&ply), Ok(cloud(&TWO, &[], &[7, 8])));
    }

    #[test]
    fn what_is_missing_is_named() {
        check("a.txt", b"", Err("the file is empty"));
        check(
            "a.txt",
            b"1\n2\n",
            Err("the file holds labels only; give the positions with the key `points`"),
        );
        check(
            "a.txt",
            b"0 1 2\n",
            Err("the file holds positions only, and no labels"),
        );
        check(
            "a.txt",
            b"0 1 2 3\n0 1\n",
            Err("row 2 has 2 numbers, and the first one has 4"),
        );
        check(
            "a.txt",
            b"0 1 2 0.5\n",
            Err("0.5 is not a label: a whole number is expected"),
        );
        check(
            "a.txt",
            b"x 1 2 3\n",
            Err("line 1: a row of numbers is expected"),
        );
        check(
            "a.txt",
            b"0 inf 2 3\n",
            Err("a coordinate is not a finite number"),
        );
    }

    #[test]
    fn positions_may_come_from_another_file() {
        let mut labels = Cloud::read("a.seg", b"7\n8\n").unwrap();
        let positions = |text: &[u8]| Cloud::read("a.xyz", text).unwrap();
        labels
            .take_positions(positions(b"0 1 2 0 0 1\n3 4 5 0 0 1\n"))
            .unwrap();
        assert_eq!(labels, cloud(&TWO, &UP, &[7, 8]));
        assert!(labels.check().is_ok());
        let refusal = labels.take_positions(positions(b"1\n")).unwrap_err();
        assert_eq!(refusal, "the file holds no positions");
        labels.take_positions(positions(b"0 1 2\n")).unwrap();
        assert_eq!(
            labels.check().unwrap_err(),
            "there are 2 labels for 1 points"
        );
    }
}

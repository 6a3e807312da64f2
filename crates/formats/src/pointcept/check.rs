//! Finds the problems of the folder of one shape, before a training fails.

use crate::numpy::array::{Array, Values};
use crate::numpy::npy::array_from_npy;
use crate::numpy::npy_header::NpyError;
use crate::pointcept::folder::POINTCEPT_FILES;
use std::collections::{BTreeMap, BTreeSet};

/// Lengths of normals that differ from 1 by more than this are not due to rounding.
const UNIT_TOLERANCE: f64 = 1e-3;

/// A problem that would stop a training or make its result wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PointceptProblem {
    /// A file is missing.
    #[error("{0} is missing")]
    Missing(&'static str),
    /// A file is not an array.
    #[error("{file}: {problem}")]
    Unreadable {
        /// The file.
        file: &'static str,
        /// The error.
        problem: NpyError,
    },
    /// An array has another type or shape.
    #[error("{file}: {found} of shape {shape:?}, {expected} is needed")]
    Type {
        /// The file.
        file: &'static str,
        /// The type of its values.
        found: &'static str,
        /// Its shape.
        shape: Vec<usize>,
        /// The needed type and shape.
        expected: &'static str,
    },
    /// There is no point.
    #[error("coord.npy has no row")]
    Empty,
    /// A file does not have one row per point.
    #[error("{file} has {found} rows for {expected} points")]
    Rows {
        /// The file.
        file: &'static str,
        /// Its rows.
        found: usize,
        /// The rows of `coord.npy`.
        expected: usize,
    },
    /// A number is infinite or NaN.
    #[error("{file}, row {row}: not finite")]
    NotFinite {
        /// The file.
        file: &'static str,
        /// The first such row.
        row: usize,
    },
    /// A normal has another length than 1.
    #[error("normal.npy, row {row}: length {length}, 1 is needed")]
    NotUnit {
        /// The first such row.
        row: usize,
        /// Its length.
        length: f64,
    },
    /// A class is not among those of the config.
    #[error("segment.npy, row {row}: class {class}; the classes are 0 to {last}, and -1 for none")]
    Class {
        /// The first such row.
        row: usize,
        /// The class.
        class: i32,
        /// The highest class.
        last: i32,
    },
    /// An instance id is below −1.
    #[error("instance.npy, row {row}: id {id}; ids begin at 0, and -1 is none")]
    Instance {
        /// The first such row.
        row: usize,
        /// The id.
        id: i32,
    },
    /// An instance id is not used, but a higher one is used.
    #[error(
        "instance.npy: no point has id {missing}, but ids go up to {last}; number them 0, 1, 2 and so on"
    )]
    Gap {
        /// The lowest id that is missing.
        missing: i32,
        /// The highest id.
        last: i32,
    },
    /// The points of an instance have several classes, of which a trainer would use that of the first point.
    #[error(
        "instance {instance} has points of the classes {first} and {second}; an instance needs one class"
    )]
    MixedInstance {
        /// The instance.
        instance: i32,
        /// A class.
        first: i32,
        /// Another class.
        second: i32,
    },
}

/// Every problem of one shape. `files` has the bytes of the existing files, by name.
///
/// `n_classes` is the number of classes in the config. A missing `normal.npy` is not a problem, because some trainers use no
/// normals. The other three files are needed.
#[must_use]
pub fn check_pointcept_shape(
    files: &BTreeMap<String, Vec<u8>>,
    n_classes: u16,
) -> Vec<PointceptProblem> {
    let mut problems = Vec::new();
    let [coord, normal, segment, instance] = POINTCEPT_FILES;
    let coords = vectors(files, coord, &mut problems);
    let normals = if files.contains_key(normal) {
        vectors(files, normal, &mut problems)
    } else {
        None
    };
    let segments = integers(files, segment, &mut problems);
    let instances = integers(files, instance, &mut problems);
    if let Some(coords) = &coords {
        problems.extend(coords.is_empty().then_some(PointceptProblem::Empty));
        let counts = [
            (normal, normals.as_ref().map(Vec::len)),
            (segment, segments.as_ref().map(Vec::len)),
            (instance, instances.as_ref().map(Vec::len)),
        ];
        let wrong = |(file, found): (&'static str, Option<usize>)| {
            let (found, expected) = (found?, coords.len());
            (found != expected).then_some(PointceptProblem::Rows {
                file,
                found,
                expected,
            })
        };
        problems.extend(counts.into_iter().filter_map(wrong));
    }
    problems.extend(normals.iter().filter_map(|normals| not_unit(normals)));
    problems.extend(
        segments
            .iter()
            .filter_map(|segments| unknown_class(segments, n_classes)),
    );
    problems.extend(instances.iter().filter_map(|instances| bad_id(instances)));
    if let (Some(segments), Some(instances)) = (&segments, &instances) {
        problems.extend(mixed_instance(segments, instances));
    }
    problems
}

/// The array of a file. Its problems are recorded.
fn array(
    files: &BTreeMap<String, Vec<u8>>,
    file: &'static str,
    problems: &mut Vec<PointceptProblem>,
) -> Option<Array> {
    let Some(bytes) = files.get(file) else {
        problems.push(PointceptProblem::Missing(file));
        return None;
    };
    array_from_npy(bytes)
        .map_err(|problem| problems.push(PointceptProblem::Unreadable { file, problem }))
        .ok()
}

/// The rows of a float32 (N, 3) array, all finite.
fn vectors(
    files: &BTreeMap<String, Vec<u8>>,
    file: &'static str,
    problems: &mut Vec<PointceptProblem>,
) -> Option<Vec<[f32; 3]>> {
    let array = array(files, file, problems)?;
    let (Values::F32(values), [_, 3]) = (array.values(), array.shape()) else {
        problems.push(wrong_type(file, &array, "float32 (N, 3)"));
        return None;
    };
    let rows = values.as_chunks::<3>().0.to_vec();
    let row = rows
        .iter()
        .position(|row| row.iter().any(|x| !x.is_finite()));
    problems.extend(row.map(|row| PointceptProblem::NotFinite { file, row }));
    Some(rows)
}

/// The values of an int32 (N) or (N, 1) array.
fn integers(
    files: &BTreeMap<String, Vec<u8>>,
    file: &'static str,
    problems: &mut Vec<PointceptProblem>,
) -> Option<Vec<i32>> {
    let array = array(files, file, problems)?;
    let (Values::I32(values), [_] | [_, 1]) = (array.values(), array.shape()) else {
        problems.push(wrong_type(file, &array, "int32 (N) or (N, 1)"));
        return None;
    };
    Some(values.clone())
}

fn wrong_type(file: &'static str, array: &Array, expected: &'static str) -> PointceptProblem {
    PointceptProblem::Type {
        file,
        found: array.values().type_name(),
        shape: array.shape().to_vec(),
        expected,
    }
}

fn not_unit(normals: &[[f32; 3]]) -> Option<PointceptProblem> {
    let length = |normal: &[f32; 3]| {
        normal
            .iter()
            .map(|&x| f64::from(x).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let (row, length) = normals.iter().map(length).enumerate().find(|(_, length)| {
        // A NaN length has already been reported.
        (length - 1.0).abs() > UNIT_TOLERANCE
    })?;
    Some(PointceptProblem::NotUnit { row, length })
}

fn unknown_class(segments: &[i32], n_classes: u16) -> Option<PointceptProblem> {
    let last = i32::from(n_classes) - 1;
    let row = segments
        .iter()
        .position(|&class| !(-1..=last).contains(&class))?;
    Some(PointceptProblem::Class {
        row,
        class: segments[row],
        last,
    })
}

fn bad_id(instances: &[i32]) -> Option<PointceptProblem> {
    if let Some(row) = instances.iter().position(|&id| id < -1) {
        return Some(PointceptProblem::Instance {
            row,
            id: instances[row],
        });
    }
    let used: BTreeSet<i32> = instances.iter().copied().filter(|&id| id >= 0).collect();
    let last = *used.last()?;
    let missing = (0..last).find(|id| !used.contains(id))?;
    Some(PointceptProblem::Gap { missing, last })
}

fn mixed_instance(segments: &[i32], instances: &[i32]) -> Option<PointceptProblem> {
    let mut class_of = BTreeMap::new();
    segments
        .iter()
        .zip(instances)
        .filter(|&(_, &instance)| instance >= 0)
        .find_map(|(&second, &instance)| {
            let first = *class_of.entry(instance).or_insert(second);
            (first != second).then_some(PointceptProblem::MixedInstance {
                instance,
                first,
                second,
            })
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numpy::array::Element;
    use crate::numpy::npy::array_to_npy;
    use crate::pointcept::folder::pointcept_files;
    use partprobe_carrier::PointSample;

    /// The problems of a good shape in which one file is replaced or removed.
    #[track_caller]
    fn check(file: &str, replacement: Option<Vec<u8>>, expected: &[PointceptProblem]) {
        let sample = PointSample {
            points: vec![[1.0; 3]; 3],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: Vec::new(),
        };
        let files = pointcept_files(&sample, &[4, 4, 0], &[0, 0, 1]);
        let mut files: BTreeMap<String, Vec<u8>> = files
            .into_iter()
            .map(|(name, bytes)| (name.to_owned(), bytes))
            .collect();
        files.remove(file);
        files.extend(replacement.map(|bytes| (file.to_owned(), bytes)));
        assert_eq!(check_pointcept_shape(&files, 11), expected);
    }

    fn npy<T: Element>(values: &[T]) -> Option<Vec<u8>> {
        Some(array_to_npy(&Array::vector(values.to_vec())))
    }

    #[test]
    fn a_good_shape_has_no_problem() {
        check("color.npy", None, &[]);
        check("normal.npy", None, &[]);
        check("color.npy", Some(b"anything".to_vec()), &[]);
        let column = Array::with_shape(vec![3, 1], Values::I32(vec![0, 0, 1])).unwrap();
        check("instance.npy", Some(array_to_npy(&column)), &[]);
        check("instance.npy", npy(&[-1, -1, -1]), &[]);
    }

    #[test]
    fn each_problem_is_located() {
        use PointceptProblem::{
            Class, Empty, Gap, Instance, Missing, MixedInstance, NotFinite, NotUnit, Rows,
        };
        let rows = |rows: &[[f32; 3]]| Some(array_to_npy(&Array::rows(rows)));
        check("coord.npy", None, &[Missing("coord.npy")]);
        check(
            "coord.npy",
            rows(&[[0.0; 3], [0.0, f32::NAN, 0.0], [0.0; 3]]),
            &[NotFinite {
                file: "coord.npy",
                row: 1,
            }],
        );
        check(
            "normal.npy",
            rows(&[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]),
            &[NotUnit {
                row: 2,
                length: 2.0,
            }],
        );
        check(
            "segment.npy",
            npy(&[4, 4, 11]),
            &[Class {
                row: 2,
                class: 11,
                last: 10,
            }],
        );
        check(
            "instance.npy",
            npy(&[0, 0, 2]),
            &[Gap {
                missing: 1,
                last: 2,
            }],
        );
        check(
            "instance.npy",
            npy(&[0, 0, -2]),
            &[Instance { row: 2, id: -2 }],
        );
        check(
            "instance.npy",
            npy(&[0, 0, 0]),
            &[MixedInstance {
                instance: 0,
                first: 4,
                second: 0,
            }],
        );
        check(
            "segment.npy",
            npy(&[4, 4]),
            &[Rows {
                file: "segment.npy",
                found: 2,
                expected: 3,
            }],
        );
        let rows_of = |file| Rows {
            file,
            found: 3,
            expected: 0,
        };
        check(
            "coord.npy",
            rows(&[]),
            &[
                Empty,
                rows_of("normal.npy"),
                rows_of("segment.npy"),
                rows_of("instance.npy"),
            ],
        );
    }

    #[test]
    fn other_types_and_damaged_files_are_named() {
        let problem = NpyError::NotNpy;
        check(
            "segment.npy",
            Some(b"hello".to_vec()),
            &[PointceptProblem::Unreadable {
                file: "segment.npy",
                problem,
            }],
        );
        let wrong = |file, found, shape: &[usize], expected| PointceptProblem::Type {
            file,
            found,
            shape: shape.to_vec(),
            expected,
        };
        check(
            "segment.npy",
            npy(&[4i64, 4, 0]),
            &[wrong("segment.npy", "int64", &[3], "int32 (N) or (N, 1)")],
        );
        let flat = Some(array_to_npy(&Array::rows(&[[0.0f32, 1.0]; 3])));
        check(
            "coord.npy",
            flat,
            &[wrong("coord.npy", "float32", &[3, 2], "float32 (N, 3)")],
        );
    }
}

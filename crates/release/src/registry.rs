//! Joins packages by the hash of the STEP text: finds the labels of each shape, and the disagreements of labels.

use crate::rows::ReleasedShape;
use partprobe_tables::{Column, Table, TableError, Text};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The data of a package that are joined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackageShapes {
    /// Its name. The names of joined packages must differ.
    pub name: String,
    /// The hash of the settings with which its files were labeled.
    pub settings_sha256: String,
    /// The version of the program that labeled them.
    pub program_version: String,
    /// Its shapes.
    pub shapes: Vec<ReleasedShape>,
}

/// The key of a shape, without the name of its file.
type ShapeKey = (String, Option<u64>);

/// A shape of one package that has labels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LabelSet {
    /// The package.
    pub package: String,
    /// The hash of its settings.
    pub settings_sha256: String,
    /// The number of parts of the shape in this package, after small ones were absorbed.
    pub n_labels: u64,
    /// The hash of the faces and their parts.
    pub parts_sha256: String,
    /// The hash of all labels.
    pub labels_sha256: String,
}

/// A shape with the labels of each package that has some.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct JoinedShape {
    /// The SHA-256 of the STEP text.
    pub source_sha256: String,
    /// The `#` number of the solid, if the shape is one.
    pub solid_step_id: Option<u64>,
    /// A name of the file, if a package has one.
    pub source: Option<String>,
    /// The labels, in the order of the packages.
    pub label_sets: Vec<LabelSet>,
}

/// A package in a registry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PackageFacts {
    /// Its name.
    pub name: String,
    /// The hash of its settings.
    pub settings_sha256: String,
    /// The version of the program that labeled its files.
    pub program_version: String,
    /// Files with labels, by hash.
    pub n_files: usize,
    /// Shapes with labels, by hash and solid.
    pub n_shapes: usize,
}

/// The common shapes of two packages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PackagePair {
    /// The names of both.
    pub packages: [String; 2],
    /// Whether their settings are the same.
    pub has_same_settings: bool,
    /// Files that have labels in both.
    pub n_files: usize,
    /// Shapes that have labels in both. A whole file and a solid of it are different shapes.
    pub n_shapes: usize,
    /// Of these, shapes with the same parts.
    pub n_same_parts: usize,
    /// Of these, shapes with the same labels altogether.
    pub n_same_labels: usize,
    /// Shapes with labels that differ although the settings are the same.
    pub disagreements: Vec<Disagreement>,
}

/// A shape that two packages label differently with the same settings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Disagreement {
    /// The SHA-256 of the STEP text.
    pub source_sha256: String,
    /// The `#` number of the solid, if the shape is one.
    pub solid_step_id: Option<u64>,
    /// A name of the file, if a package has one.
    pub source: Option<String>,
}

/// Packages that were joined.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Registry {
    /// The packages, in the order in which they were given.
    pub packages: Vec<PackageFacts>,
    /// The number of files with labels in 1, 2, … packages.
    pub files_by_n_packages: BTreeMap<usize, usize>,
    /// The results for each two packages.
    pub pairs: Vec<PackagePair>,
    /// The shapes, sorted by hash and solid.
    pub shapes: Vec<JoinedShape>,
}

impl Registry {
    /// Joins packages.
    #[must_use]
    pub fn of(packages: &[PackageShapes]) -> Self {
        let shapes = joined(packages);
        let names = |shape: &JoinedShape| -> Vec<String> {
            let sets = shape.label_sets.iter();
            sets.map(|set| set.package.clone()).collect()
        };
        let mut packages_of_file: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
        for shape in &shapes {
            let of_file = packages_of_file.entry(&shape.source_sha256).or_default();
            of_file.extend(names(shape));
        }
        let mut files_by_n_packages = BTreeMap::new();
        for of_file in packages_of_file.values() {
            *files_by_n_packages.entry(of_file.len()).or_default() += 1;
        }
        let facts = packages.iter().map(|package| PackageFacts {
            name: package.name.clone(),
            settings_sha256: package.settings_sha256.clone(),
            program_version: package.program_version.clone(),
            n_files: packages_of_file
                .values()
                .filter(|of_file| of_file.contains(&package.name))
                .count(),
            n_shapes: shapes
                .iter()
                .filter(|shape| set_of(shape, &package.name).is_some())
                .count(),
        });
        let pairs = packages.iter().enumerate().flat_map(|(position, first)| {
            let others = packages[position + 1..].iter();
            let n_files = |second: &PackageShapes| {
                let names = [&first.name, &second.name];
                let has_both =
                    |of_file: &&BTreeSet<String>| names.iter().all(|name| of_file.contains(*name));
                packages_of_file.values().filter(has_both).count()
            };
            others
                .map(|second| PackagePair::of(first, second, n_files(second), &shapes))
                .collect::<Vec<_>>()
        });
        Self {
            packages: facts.collect(),
            files_by_n_packages,
            pairs: pairs.collect(),
            shapes: shapes.clone(),
        }
    }
}

fn joined(packages: &[PackageShapes]) -> Vec<JoinedShape> {
    let mut shapes: BTreeMap<ShapeKey, JoinedShape> = BTreeMap::new();
    for package in packages {
        for shape in &package.shapes {
            let (Some(parts), Some(labels)) = (&shape.parts_sha256, &shape.labels_sha256) else {
                continue;
            };
            let key = (shape.source_sha256.clone(), shape.solid_step_id);
            let joined = shapes.entry(key).or_insert_with(|| JoinedShape {
                source_sha256: shape.source_sha256.clone(),
                solid_step_id: shape.solid_step_id,
                source: None,
                label_sets: Vec::new(),
            });
            if joined.source.is_none() {
                joined.source.clone_from(&shape.source);
            }
            // A package may have one text with two names.
            let is_known = joined
                .label_sets
                .iter()
                .any(|set| set.package == package.name);
            if !is_known {
                joined.label_sets.push(LabelSet {
                    package: package.name.clone(),
                    settings_sha256: package.settings_sha256.clone(),
                    n_labels: shape.n_labels,
                    parts_sha256: parts.clone(),
                    labels_sha256: labels.clone(),
                });
            }
        }
    }
    shapes.into_values().collect()
}

fn set_of<'a>(shape: &'a JoinedShape, package: &str) -> Option<&'a LabelSet> {
    shape.label_sets.iter().find(|set| set.package == package)
}

impl PackagePair {
    fn of(
        first: &PackageShapes,
        second: &PackageShapes,
        n_files: usize,
        shapes: &[JoinedShape],
    ) -> Self {
        let has_same_settings = first.settings_sha256 == second.settings_sha256;
        let mut pair = Self {
            packages: [first.name.clone(), second.name.clone()],
            has_same_settings,
            n_files,
            n_shapes: 0,
            n_same_parts: 0,
            n_same_labels: 0,
            disagreements: Vec::new(),
        };
        for shape in shapes {
            let sets = (set_of(shape, &first.name), set_of(shape, &second.name));
            let (Some(a), Some(b)) = sets else {
                continue;
            };
            pair.n_shapes += 1;
            pair.n_same_parts += usize::from(a.parts_sha256 == b.parts_sha256);
            let is_same = a.labels_sha256 == b.labels_sha256;
            pair.n_same_labels += usize::from(is_same);
            if has_same_settings && !is_same {
                pair.disagreements.push(Disagreement {
                    source_sha256: shape.source_sha256.clone(),
                    solid_step_id: shape.solid_step_id,
                    source: shape.source.clone(),
                });
            }
        }
        pair
    }
}

/// The table of joined shapes: one row per shape, with lists that have one element per package.
///
/// # Errors
/// Never for the shapes of a [`Registry`], because the columns are fixed.
pub fn joined_table(shapes: &[JoinedShape]) -> Result<Table, TableError> {
    let sets_text = |name: &str, text: fn(&LabelSet) -> &String| {
        let list = |shape: &JoinedShape| {
            let sets = shape.label_sets.iter();
            Some(
                sets.map(|set| Some(Text::Owned(text(set).clone())))
                    .collect(),
            )
        };
        Column::of_lists(name, shapes.iter().map(list))
    };
    let n_labels = shapes.iter().map(|shape| {
        let sets = shape.label_sets.iter();
        Some(sets.map(|set| Some(set.n_labels)).collect())
    });
    let n_partitions = |shape: &JoinedShape| {
        let sets = shape.label_sets.iter();
        let distinct: BTreeSet<&String> = sets.map(|set| &set.parts_sha256).collect();
        Some(distinct.len() as u64)
    };
    let owned = |text: &String| Text::Owned(text.clone());
    let hashes = shapes.iter().map(|shape| Some(owned(&shape.source_sha256)));
    let sources = shapes.iter().map(|shape| shape.source.as_ref().map(owned));
    let solids = shapes.iter().map(|shape| shape.solid_step_id);
    let n_packages = shapes
        .iter()
        .map(|shape| Some(shape.label_sets.len() as u64));
    Table::new(vec![
        Column::of_cells("source_sha256", hashes),
        Column::of_cells("solid_step_id", solids),
        Column::of_cells("source", sources),
        Column::of_cells("n_packages", n_packages),
        Column::of_cells("n_partitions", shapes.iter().map(n_partitions)),
        sets_text("package", |set| &set.package),
        sets_text("settings_sha256", |set| &set.settings_sha256),
        Column::of_lists("n_labels", n_labels),
        sets_text("parts_sha256", |set| &set.parts_sha256),
        sets_text("labels_sha256", |set| &set.labels_sha256),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A package with a shape for each `(hash of the text, hash of the parts, hash of all labels)`.
    fn package(name: &str, settings: &str, shapes: &[(&str, &str, &str)]) -> PackageShapes {
        let shape = |&(source, parts, labels): &(&str, &str, &str)| ReleasedShape {
            source_sha256: source.to_owned(),
            parts_sha256: Some(parts.to_owned()),
            labels_sha256: Some(labels.to_owned()),
            ..ReleasedShape::default()
        };
        PackageShapes {
            name: name.to_owned(),
            settings_sha256: settings.to_owned(),
            program_version: "0.1.0".to_owned(),
            shapes: shapes.iter().map(shape).collect(),
        }
    }

    #[test]
    fn overlaps_and_disagreements_are_counted() {
        let first = package(
            "a",
            "s",
            &[("x", "p", "l"), ("y", "p", "l"), ("x", "p", "l")],
        );
        let second = package(
            "b",
            "s",
            &[("x", "p", "l"), ("y", "p", "other"), ("z", "p", "l")],
        );
        let third = package("c", "t", &[("x", "q", "m")]);
        let registry = Registry::of(&[first, second, third]);

        let n_shapes: Vec<usize> = registry.packages.iter().map(|p| p.n_shapes).collect();
        assert_eq!(n_shapes, [2, 3, 1]);
        assert_eq!(
            registry.files_by_n_packages,
            [(1, 1), (2, 1), (3, 1)].into()
        );
        let counts = |pair: &PackagePair| {
            let n_disagreements = pair.disagreements.len();
            (
                pair.n_shapes,
                pair.n_same_parts,
                pair.n_same_labels,
                n_disagreements,
            )
        };
        let found: Vec<_> = registry.pairs.iter().map(counts).collect();
        let n_files: Vec<usize> = registry.pairs.iter().map(|pair| pair.n_files).collect();
        assert_eq!(n_files, [2, 1, 1]);
        // Other settings may give other labels, which is not a disagreement.
        assert_eq!(found, [(2, 2, 1, 1), (1, 0, 0, 0), (1, 0, 0, 0)]);
        assert_eq!(registry.pairs[0].disagreements[0].source_sha256, "y");
    }

    #[test]
    fn a_file_and_its_solids_are_in_both_and_not_compared() {
        let whole = package("a", "s", &[("x", "p", "l")]);
        let mut solids = package("b", "t", &[("x", "p", "l")]);
        solids.shapes[0].solid_step_id = Some(7);
        let pair = Registry::of(&[whole, solids]).pairs.remove(0);
        assert_eq!((pair.n_files, pair.n_shapes), (1, 0));
    }

    #[test]
    fn the_table_has_a_row_per_shape_and_an_element_per_package() {
        let first = package("a", "s", &[("x", "p", "l"), ("y", "p", "l")]);
        let second = package("b", "t", &[("x", "q", "m")]);
        let registry = Registry::of(&[first, second]);
        let mut table = joined_table(&registry.shapes).unwrap();
        let partitions = table.take_cells::<u64>("n_partitions").unwrap();
        assert_eq!(partitions, [Some(2), Some(1)]);
        let packages = table.take_lists::<Text>("package").unwrap();
        let names = |row: usize| -> Vec<String> {
            let list = packages[row].clone().unwrap();
            list.into_iter()
                .map(|name| name.unwrap().into_owned())
                .collect()
        };
        assert_eq!(
            (names(0), names(1)),
            (vec!["a".into(), "b".into()], vec!["a".into()])
        );
    }
}

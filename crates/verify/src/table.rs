//! Writes the agreement by group, as a table for readers.

use crate::{Agreement, SelfCount, VolumeCount};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The sums over the files of one group.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupCounts {
    /// Files in the folder that the reference can load.
    pub n_files: usize,
    /// Files that partprobe cannot read.
    pub n_failed: usize,
    /// Files with exact faces, types and adjacency, and the files exact in all four.
    pub exact: [usize; 4],
    /// Files with an exact partition, of those without an angle at the threshold.
    pub partition: (usize, usize),
    /// Faces that both readings have.
    pub n_faces: usize,
    /// Faces whose area agrees, of those to which the reference gives one.
    pub areas: (usize, usize),
    /// Faces without a triangle.
    pub n_without_triangles: usize,
    /// Faces whose triangles have the face's own area.
    pub n_unfolded: usize,
    /// The closed solids' volumes.
    pub volumes: VolumeCount,
    /// Solids with a closed mesh, of those that are closed in the file.
    pub watertight: (usize, usize),
    /// Faces and solids whose quadrature and triangles agree.
    pub own: SelfCount,
}

impl GroupCounts {
    /// Adds a file that was read.
    pub fn add(&mut self, agreement: &Agreement, partition_counts: bool) {
        let partition = agreement.partition || !partition_counts;
        let all = agreement.count && agreement.types && agreement.adjacency && partition;
        for (total, exact) in
            self.exact
                .iter_mut()
                .zip([agreement.count, agreement.types, agreement.adjacency, all])
        {
            *total += usize::from(exact);
        }
        self.n_files += 1;
        self.partition.0 += usize::from(agreement.partition && partition_counts);
        self.partition.1 += usize::from(partition_counts);
        self.areas.0 += agreement.areas.n_agreeing;
        self.areas.1 += agreement.areas.n_comparable;
        self.n_faces += agreement.areas.n_faces;
        self.n_without_triangles += agreement.areas.n_without_triangles;
        self.n_unfolded += agreement.areas.n_unfolded;
    }

    /// Adds a file that partprobe cannot read. It counts as wrong everywhere.
    pub fn add_failure(&mut self) {
        self.n_files += 1;
        self.n_failed += 1;
        self.partition.1 += 1;
    }

    /// Adds another group.
    pub fn merge(&mut self, other: &Self) {
        let pair = |a: &mut (usize, usize), b: (usize, usize)| *a = (a.0 + b.0, a.1 + b.1);
        self.n_files += other.n_files;
        self.n_failed += other.n_failed;
        self.n_faces += other.n_faces;
        self.n_without_triangles += other.n_without_triangles;
        self.n_unfolded += other.n_unfolded;
        for (total, exact) in self.exact.iter_mut().zip(other.exact) {
            *total += exact;
        }
        pair(&mut self.partition, other.partition);
        pair(&mut self.areas, other.areas);
        self.volumes.add(other.volumes);
        pair(&mut self.watertight, other.watertight);
        self.own.add(other.own);
    }

    fn own_cells(&self) -> [String; 2] {
        let SelfCount {
            n_faces,
            n_faces_agreeing,
            n_solids,
            n_solids_agreeing,
        } = self.own;
        [
            share((n_faces_agreeing, n_faces)),
            share((n_solids_agreeing, n_solids)),
        ]
    }

    fn cells(&self) -> [String; 18] {
        let [count, types, adjacency, all] = self.exact.map(|exact| share((exact, self.n_files)));
        let [own_areas, own_volumes] = self.own_cells();
        [
            self.n_files.to_string(),
            self.n_failed.to_string(),
            count,
            types,
            adjacency,
            share(self.partition),
            all,
            share(self.areas),
            (self.n_faces - self.areas.1).to_string(),
            self.n_without_triangles.to_string(),
            share((self.n_unfolded, self.n_faces)),
            self.volumes.n_solids.to_string(),
            share((self.volumes.n_agreeing, self.volumes.n_solids)),
            share((self.volumes.n_valid_agreeing, self.volumes.n_valid)),
            share((self.volumes.n_meshes_agreeing, self.volumes.n_solids)),
            share(self.watertight),
            own_areas,
            own_volumes,
        ]
    }
}

/// A percentage with the count of missing items. It is 100 only if nothing is missing.
fn share((part, whole): (usize, usize)) -> String {
    match whole {
        0 => "–".to_owned(),
        _ if part == whole => "100 %".to_owned(),
        _ => format!(
            "{:.2} % (−{})",
            (1e4 * part as f64 / whole as f64).floor() / 100.0,
            whole - part
        ),
    }
}

/// A Markdown table with one row per group and a last one for all.
#[must_use]
pub fn table(groups: &BTreeMap<String, GroupCounts>) -> String {
    const HEAD: [&str; 19] = [
        "group",
        "files",
        "failed",
        "count",
        "types",
        "adjacency",
        "partition",
        "all four",
        "areas ≤ 1 %",
        "no reference area",
        "no triangles",
        "mesh areas ≤ 15 %",
        "closed solids",
        "volumes ≤ 1 %",
        "of valid solids",
        "mesh volumes ≤ 1 %",
        "watertight",
        "own areas",
        "own volumes",
    ];
    rows(&HEAD, groups, |counts| counts.cells().to_vec())
}

/// The table of files that are compared only with themselves.
#[must_use]
pub fn own_table(groups: &BTreeMap<String, GroupCounts>) -> String {
    const HEAD: [&str; 7] = [
        "group",
        "files",
        "failed",
        "faces",
        "own areas",
        "closed solids",
        "own volumes",
    ];
    rows(&HEAD, groups, |counts| {
        let [areas, volumes] = counts.own_cells();
        let SelfCount {
            n_faces, n_solids, ..
        } = counts.own;
        let numbers = [counts.n_files, counts.n_failed, n_faces].map(|n| n.to_string());
        [numbers.to_vec(), vec![areas, n_solids.to_string(), volumes]].concat()
    })
}

/// One row per group and a last one for all.
fn rows(
    head: &[&str],
    groups: &BTreeMap<String, GroupCounts>,
    cells: impl Fn(&GroupCounts) -> Vec<String>,
) -> String {
    let mut all = GroupCounts::default();
    groups.values().for_each(|counts| all.merge(counts));
    let mut text = format!(
        "| {} |\n|---|{}\n",
        head.join(" | "),
        "---:|".repeat(head.len() - 1)
    );
    for (name, counts) in groups
        .iter()
        .map(|(name, counts)| (name.as_str(), counts))
        .chain([("all", &all)])
    {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {name} | {} |", cells(counts).join(" | "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_add_up_and_nothing_rounds_to_all() {
        let mut counts = GroupCounts::default();
        let good = Agreement {
            count: true,
            types: true,
            adjacency: true,
            partition: true,
            ..Agreement::default()
        };
        counts.add(&good, true);
        counts.add(
            &Agreement {
                partition: false,
                ..good.clone()
            },
            false,
        );
        counts.add_failure();
        assert_eq!(
            (
                counts.n_files,
                counts.n_failed,
                counts.exact,
                counts.partition
            ),
            (3, 1, [2; 4], (1, 2))
        );
        assert_eq!(share((99_999, 100_000)), "99.99 % (−1)");
        assert_eq!(share((0, 0)), "–");
        let text = table(&BTreeMap::from([
            ("abc".to_owned(), counts.clone()),
            ("fusion".to_owned(), counts),
        ]));
        assert!(
            text.lines()
                .last()
                .unwrap()
                .starts_with("| all | 6 | 2 | 66.66 % (−2) |"),
            "{text}"
        );
    }
}

//! Shows which primitive types are merged: for each type, the clusters of the points of its parts.

use crate::chart::{Cells, Chart, grid};
use crate::html::section;
use crate::lost_parts::main_predictions;
use crate::names::Names;
use crate::shape_digest::{PredictionDigest, ReferenceDigest, ShapeDigest};
use partprobe_carrier::FaceType;
use std::collections::BTreeMap;

/// For parts of one type: the number of points in the cluster of their part, in clusters of other parts by type, and in clusters
/// without a part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Fate {
    stayed: u64,
    moved: BTreeMap<FaceType, u64>,
    in_no_part: u64,
}

/// The section with the matrices. It is empty without them.
pub(crate) fn type_confusion(charts: &[Chart]) -> String {
    section(
        "types",
        "Which types are merged",
        "A row holds the points of all parts of a type. They are in the cluster of their own part (blue), in the cluster of another \
         part of the type above the column, or in a cluster that belongs to no part (orange). First seed, first clusterer.",
        &grid("charts matrices", charts),
    )
}

/// One matrix per trained supervision. There are none if the types are not known.
pub(crate) fn type_charts(shapes: &[ShapeDigest], names: &Names<'_>) -> Vec<Chart> {
    let mut by_supervision: BTreeMap<usize, (&str, BTreeMap<FaceType, Fate>)> = BTreeMap::new();
    for shape in shapes {
        for prediction in
            main_predictions(shape).filter(|found| names.is_trained(&found.supervision))
        {
            let color = names.color(&prediction.supervision);
            let entry = by_supervision.entry(color);
            let (_, fates) = entry.or_insert_with(|| (&prediction.supervision, BTreeMap::new()));
            add(fates, prediction, &shape.references[prediction.reference]);
        }
    }
    let found = by_supervision
        .values()
        .filter(|(_, fates)| !fates.is_empty());
    let charts = found.filter_map(|(name, fates)| {
        Some(Chart::new(
            &format!("types-{name}"),
            format!("Trained on {name}: % of the points"),
            matrix(fates).draw()?,
        ))
    });
    charts.collect()
}

fn add(
    fates: &mut BTreeMap<FaceType, Fate>,
    prediction: &PredictionDigest,
    reference: &ReferenceDigest,
) {
    for (part, moved) in prediction.moved.iter().enumerate() {
        let Some(face_type) = reference.parts.get(part).and_then(|part| part.face_type) else {
            continue;
        };
        let fate = fates.entry(face_type).or_default();
        for (to, &n) in moved.iter().enumerate().filter(|(_, n)| **n > 0) {
            let n = u64::from(n);
            match reference.parts.get(to).map(|part| part.face_type) {
                _ if to == part => fate.stayed += n,
                Some(Some(other)) => *fate.moved.entry(other).or_default() += n,
                _ => fate.in_no_part += n,
            }
        }
    }
}

fn matrix(fates: &BTreeMap<FaceType, Fate>) -> Cells {
    let types: Vec<FaceType> = fates.keys().copied().collect();
    let mut shares = Vec::new();
    for fate in fates.values() {
        let moved = types
            .iter()
            .map(|to| fate.moved.get(to).copied().unwrap_or(0));
        let counts: Vec<u64> = std::iter::once(fate.stayed)
            .chain(moved)
            .chain([fate.in_no_part])
            .collect();
        let sum = counts.iter().sum::<u64>().max(1) as f64;
        shares.extend(counts.iter().map(|&count| Some(count as f64 / sum)));
    }
    let names = types.iter().map(|face_type| face_type.name().to_owned());
    Cells {
        rows: names.clone().collect(),
        columns: std::iter::once("own".to_owned())
            .chain(names)
            .chain(["none".to_owned()])
            .collect(),
        shares,
        column_label: "where the points of a type end up".to_owned(),
        n_good: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape_digest::tests::plate;

    #[test]
    fn merged_points_are_counted_under_the_type_that_took_them() {
        let digest = ShapeDigest::of(&plate(100));
        let mut fates = BTreeMap::new();
        add(&mut fates, &digest.predictions[1], &digest.references[0]);
        assert_eq!(
            fates[&FaceType::Plane].moved,
            BTreeMap::from([(FaceType::Cylinder, 40)])
        );
        assert_eq!(
            fates[&FaceType::Cylinder],
            Fate {
                stayed: 60,
                ..Fate::default()
            }
        );
        let cells = matrix(&fates);
        assert_eq!(cells.columns, ["own", "plane", "cylinder", "none"]);
        assert_eq!(
            cells.shares,
            [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0].map(Some)
        );
    }
}

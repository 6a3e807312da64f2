//! Defines a metric outside the workspace's libraries, using only their public functions and types.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_carrier::Embeddings;
use partprobe_eval::{
    Bootstrap, MIOU, Metric, ScoreRow, ScoredShape, TableSettings, score_clusters, tables,
};
use std::collections::BTreeSet;

/// The share of the points that are in a cluster whose points all have one reference label.
const PURE_POINTS: Metric = Metric {
    name: "pure_points",
    heading: "pure points",
    value: pure_points,
};

fn pure_points(shape: &ScoredShape<'_>) -> Option<f64> {
    let labels_of = |cluster: u32| -> BTreeSet<i32> {
        let points = shape.predicted.iter().zip(shape.reference);
        points
            .filter(|(predicted, _)| **predicted == cluster)
            .map(|(_, label)| *label)
            .collect()
    };
    let n_pure = shape
        .predicted
        .iter()
        .filter(|&&cluster| labels_of(cluster).len() == 1)
        .count();
    Some(n_pure as f64 / shape.predicted.len() as f64)
}

fn row(shape: &str, predicted: &[u32], reference: &[i32]) -> ScoreRow {
    let token_of_point: Vec<u32> = (0..predicted.len() as u32).collect();
    let embeddings = Embeddings::new(1, vec![1.0; predicted.len()]).unwrap();
    let matched = score_clusters(predicted, reference).unwrap();
    let scored =
        ScoredShape::of_clusters(predicted, reference, &token_of_point, &embeddings, matched);

    let mut scores = scored.scores();
    scores.extend((PURE_POINTS.value)(&scored).map(|value| (PURE_POINTS, value)));
    ScoreRow {
        shape: shape.to_owned(),
        supervision: "step-parts".to_owned(),
        seed: 0,
        reference: "step-parts".to_owned(),
        clusterer: "k-means".to_owned(),
        k: matched.k,
        scores,
        group: shape.to_owned(),
    }
}

#[test]
fn a_metric_of_another_crate_is_written_and_averaged_like_those_of_the_list() {
    let rows = [
        row("a", &[0, 0, 1, 1], &[0, 0, 0, 1]),
        row("b", &[0, 0, 1, 1], &[5, 5, 7, 7]),
    ];
    assert_eq!(
        rows.each_ref().map(|row| PURE_POINTS.of(row)),
        [Some(0.5), Some(1.0)]
    );

    // In the line, it follows the metrics of the list.
    let line = serde_json::to_string(&rows[0]).unwrap();
    assert!(line.contains(r#","pure_points":0.5,"group":"a""#), "{line}");

    let settings = TableSettings {
        bin_reference: "step-parts".to_owned(),
        clusterer: "k-means".to_owned(),
        compared: Vec::new(),
        primary: Vec::new(),
        seed_deviation: None,
        bootstrap: Bootstrap {
            draws: 10,
            seed: 0,
            least_groups: 2,
        },
        footer: Vec::new(),
    };
    let tables = tables(&rows, &settings);
    assert_eq!(tables.rows[0].means[&PURE_POINTS], 0.75);
    assert!(tables.rows[0].means.contains_key(&MIOU));
    assert!(
        tables
            .to_markdown()
            .contains("| mIoU | accuracy | pure points |"),
        "{}",
        tables.to_markdown()
    );
    assert!(
        tables
            .to_csv()
            .contains(",pure_points,pure_points_low,pure_points_high,"),
        "{}",
        tables.to_csv()
    );
}

//! Scores the bounds of every table: plain geometry, the labels of the sources themselves, and the best result with tokens.
//!
//! A shape and a reference go in, and rows of scores come out. Nothing here is trained. A network that is not better than
//! `growing-20` is not better than plain geometry, and no network can be better than `token-ceiling`.

use super::evaluation::{ScoreColumn, clusters_array, member_name, score_columns, score_row};
use super::scoring_context::ScoringContext;
use super::shapes::Shape;
use crate::config::{ClustererName, Config};
use crate::progress::Progress;
use anyhow::{Context, Result};
use partprobe_carrier::{Embeddings, Point, keyed_rng, nearest_points, unit_interval};
use partprobe_cluster::{Modes, RegionGrowing, Regions};
use partprobe_eval::{
    ScoreRow, ScoredShape, TokenizedShape, clusters_of_labels, labels_row, score_clusters,
    score_oracle_k,
};
use partprobe_formats::Array;
use partprobe_net::Tokens;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The rows of region growing on the sampled points, with their largest angle between the normals of neighbors.
const GROWING: [(&str, f64); 3] = [
    ("growing-10", 10.0),
    ("growing-20", 20.0),
    ("growing-30", 30.0),
];

/// The number of nearest points with which each point may be joined.
const N_NEIGHBORS: usize = 10;

/// The smallest number of points of a region that counts as a part, if the number of parts is not known.
const MIN_REGION: usize = 20;

/// The row in which each token has the label of most of its points.
const TOKEN_CEILING: &str = "token-ceiling";

/// The row of the clusterer on embeddings that separate the parts perfectly, except within tokens.
const PERFECT: &str = "perfect-embeddings";

/// The row of the labels of the points in a random order: a prediction that only has the right sizes.
const SHUFFLED: &str = "shuffled-labels";

/// The names of all rows of a run.
pub(super) fn bound_names(config: &Config) -> Vec<String> {
    let sources = config.compare.supervision.iter();
    let growing = GROWING.iter().map(|(name, _)| (*name).to_owned());
    growing
        .chain(sources.map(|source| labels_row(source)))
        .chain([SHUFFLED, TOKEN_CEILING, PERFECT].map(str::to_owned))
        .collect()
}

/// Scores the bounds of every held-out shape, and writes the clusters that were scored.
///
/// Rows come in the order of the shapes, then of the references.
///
/// # Errors
/// If a shape cannot be divided into tokens, clustered or scored, or a file cannot be written.
pub(super) fn bounds(
    context: &ScoringContext<'_>,
    shapes: &[&Shape],
    progress: &Progress,
) -> Result<Vec<ScoreRow>> {
    let bar = progress.bar("score without training", shapes.len());
    let rows: Vec<Vec<ScoreRow>> = shapes
        .par_iter()
        .map(|shape| {
            let rows = bounds_of_shape(context, shape);
            bar.inc(1);
            rows.with_context(|| format!("scoring shape {}", shape.id))
        })
        .collect::<Result<_>>()?;
    bar.finish();
    Ok(rows.concat())
}

fn bounds_of_shape(context: &ScoringContext<'_>, shape: &Shape) -> Result<Vec<ScoreRow>> {
    let config = context.config;
    let bounded = BoundedShape::new(shape, config)?;
    let columns = score_columns(config);
    let seed = config.compare.seeds[0];
    let mut rows = Vec::new();
    let mut files: BTreeMap<String, Vec<(String, Array)>> = BTreeMap::new();
    let finds_count = |column: &ScoreColumn| column.clusterer.name() == Modes::NAME;
    let found_count = columns
        .iter()
        .any(finds_count)
        .then(|| bounded.grown(|regions| regions.n_with_at_least(MIN_REGION).max(1)));
    for reference in &context.references {
        let labels = shape.labels_by(reference)?;
        let n_parts = score_clusters(&vec![0; labels.len()], labels)?.k;
        let grown = bounded.grown(|_| n_parts);
        let others = bounded.predictions(reference, config)?;
        let near_boundary = context.boundaries.of(&shape.id, reference);
        for (idx, column) in columns.iter().enumerate() {
            // A clusterer that is not given the number of parts is compared with regions that are not given it either.
            let grown = match &found_count {
                Some(found) if finds_count(column) => found,
                _ => &grown,
            };
            let perfect = bounded.perfect(labels, column.clusterer, config)?;
            for (name, predicted) in grown.iter().chain(&others).chain([&perfect]) {
                let scored = ScoredShape {
                    near_boundary,
                    ..bounded.scored(predicted, labels)?
                };
                let names = (name.as_str(), seed);
                rows.push(score_row(names, shape, reference, &column.name, &scored));
                let member = (
                    member_name(reference, idx, &column.name),
                    clusters_array(predicted),
                );
                files.entry(name.clone()).or_default().push(member);
            }
        }
    }
    for (name, members) in files {
        context.write_predictions(&format!("{name}-{seed}/{}", shape.id), members)?;
    }
    Ok(rows)
}

/// A shape whose bounds are scored.
struct BoundedShape<'a> {
    shape: &'a Shape,
    tokens: Tokens,
    /// Its embeddings in the tables.
    geometry: Embeddings,
    points: Vec<Point>,
    /// The regions of each entry of [`GROWING`].
    regions: Vec<(&'static str, Regions)>,
}

impl<'a> BoundedShape<'a> {
    fn new(shape: &'a Shape, config: &Config) -> Result<Self> {
        let tokens = partprobe_net::tokenize(
            &shape.sample,
            config.tokens.test_tokens,
            config.tokens.voxels,
        )?;
        let widened = |rows: &[[f32; 3]]| -> Vec<Point> {
            rows.iter().map(|row| row.map(f64::from)).collect()
        };
        let (points, normals) = (
            widened(&shape.sample.points),
            widened(&shape.sample.normals),
        );
        let neighbors = nearest_points(&points, N_NEIGHBORS);
        let grown = |(name, max_angle_deg)| {
            let growing = RegionGrowing { max_angle_deg };
            (name, growing.regions(&neighbors, &normals))
        };
        Ok(Self {
            shape,
            geometry: tokens.geometry_rows(),
            tokens,
            regions: GROWING.into_iter().map(grown).collect(),
            points,
        })
    }

    /// The rows of region growing, each with the cluster of each point. `count` gives the number of regions that are kept; all other
    /// points get the region of a near point.
    fn grown(&self, count: impl Fn(&Regions) -> usize) -> Vec<(String, Vec<u32>)> {
        let grown = self.regions.iter().map(|(name, regions)| {
            let predicted = regions.largest(&self.points, count(regions));
            ((*name).to_owned(), predicted)
        });
        grown.collect()
    }

    /// All other rows against one reference that need no clusterer, each with the cluster of each point.
    fn predictions(&self, reference: &str, config: &Config) -> Result<Vec<(String, Vec<u32>)>> {
        let labels = self.shape.labels_by(reference)?;
        let mut predictions = Vec::new();
        let others = config.compare.supervision.iter();
        for source in others.filter(|&source| source != reference) {
            // An endpoint on other shapes may lack the labels of a supervision.
            if let Some(labels) = self.shape.labels().get(source) {
                predictions.push((labels_row(source), clusters_of_labels(labels)));
            }
        }

        let of_tokens = self.tokens.majority_labels(labels);
        let of_points = self.tokens.token_of_point.iter();
        let ceiling: Vec<i32> = of_points.map(|&token| of_tokens[token as usize]).collect();
        predictions.push((TOKEN_CEILING.to_owned(), clusters_of_labels(&ceiling)));
        let shuffled = shuffled(labels, config.eval.seed, &self.shape.id);
        predictions.push((SHUFFLED.to_owned(), clusters_of_labels(&shuffled)));
        Ok(predictions)
    }

    fn scored<'b>(&'b self, predicted: &'b [u32], labels: &'b [i32]) -> Result<ScoredShape<'b>> {
        Ok(ScoredShape::of_clusters(
            predicted,
            labels,
            &self.tokens.token_of_point,
            &self.geometry,
            score_clusters(predicted, labels)?,
        ))
    }

    /// The row of a clusterer that knows the number of parts, on one unit vector per part.
    fn perfect(
        &self,
        labels: &[i32],
        clusterer: ClustererName,
        config: &Config,
    ) -> Result<(String, Vec<u32>)> {
        let embeddings = one_hot(&self.tokens.majority_labels(labels))?;
        let tokenized = TokenizedShape {
            id: &self.shape.id,
            embeddings: &embeddings,
            multiplicity: &self.tokens.multiplicity,
            token_of_point: &self.tokens.token_of_point,
        };
        let clusterer = clusterer.clusterer(&config.eval.clusterer_settings());
        let found = score_oracle_k(&tokenized, labels, clusterer.as_ref(), config.eval.seed)?;
        Ok((PERFECT.to_owned(), found.predicted))
    }
}

/// The same labels in a random order, by seed and shape.
fn shuffled(labels: &[i32], seed: u64, shape: &str) -> Vec<i32> {
    let mut rng = keyed_rng(seed, &[SHUFFLED, shape]);
    let mut labels = labels.to_vec();
    for end in (1..labels.len()).rev() {
        let other = (unit_interval(&mut rng) * (end + 1) as f64) as usize;
        labels.swap(end, other.min(end));
    }
    labels
}

/// One unit vector per label; tokens without a label share one.
fn one_hot(labels: &[i32]) -> Result<Embeddings> {
    let mut distinct: Vec<i32> = labels.to_vec();
    distinct.sort_unstable();
    distinct.dedup();

    let dim = distinct.len().max(1);
    let mut values = vec![0.0; labels.len() * dim];
    for (token, label) in labels.iter().enumerate() {
        if let Ok(axis) = distinct.binary_search(label) {
            values[token * dim + axis] = 1.0;
        }
    }
    Ok(Embeddings::new(dim, values)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shuffled_labels_are_the_same_ones() {
        let labels: Vec<i32> = (0..500).map(|point| point / 100 - 1).collect();
        let found = shuffled(&labels, 0, "a");
        assert_ne!(found, labels);
        assert_ne!(found, shuffled(&labels, 0, "b"));
        let mut sorted = found;
        sorted.sort_unstable();
        assert_eq!(sorted, labels);
    }

    #[test]
    fn labels_become_axes() {
        let rows = one_hot(&[3, -1, 3]).unwrap();
        assert_eq!(rows.values(), [0.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!(rows.dim(), 2);
    }
}

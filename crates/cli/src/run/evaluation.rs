//! Evaluates held-out shapes: embedding, clustering, scoring, and the files from which the scores can be computed again.

use super::folder::RunFolder;
use super::page::face_members;
use super::scoring_context::ScoringContext;
use super::shapes::Shape;
use crate::config::{ClustererName, Config, EvalConfig};
use crate::progress::Progress;
use anyhow::{Context, Result};
use partprobe_carrier::{Embeddings, PointSample};
use partprobe_cluster::AverageLinkTree;
use partprobe_eval::{
    OracleScores, ScoreRow, ScoredShape, TokenizedShape, best_cut_ari, gtc, score_oracle_k,
    split_gtc,
};
use partprobe_formats::{Array, Compression, arrays_to_npz};
use partprobe_net::{Model, RefineConfig, TokenConfig, Tokens};
use rayon::prelude::*;

/// The row of the network with its initial weights.
pub(crate) const UNTRAINED: &str = "untrained";
/// The row of the clusterer on plain geometry.
pub(crate) const NO_NETWORK: &str = "no-network";

/// The row of the clusterer on random Fourier features of plain geometry.
pub(crate) const RANDOM_FOURIER: &str = "random-fourier";

/// The method that gives a token its embedding.
pub(crate) enum Embedder<'a> {
    /// A network, trained or not.
    Network(&'a Model),
    /// ½·position and normal.
    Geometry,
    /// Random Fourier features of the same, by a seed.
    RandomFourier(u64),
}

impl Embedder<'_> {
    /// The tokens of a shape, and their embeddings.
    pub(super) fn embed(
        &self,
        sample: &PointSample,
        config: &TokenConfig,
    ) -> Result<(Tokens, Embeddings)> {
        if let Self::Network(network) = self {
            return Ok(network.embed_sample(sample, config)?);
        }
        let tokens = partprobe_net::tokenize(sample, config.test_tokens, config.voxels)?;
        let rows = match self {
            Self::RandomFourier(seed) => tokens.fourier_rows(*seed),
            _ => tokens.geometry_rows(),
        };
        Ok((tokens, rows))
    }
}

/// A row of the score table: its name and its embedder.
pub(crate) struct ScoredModel<'a> {
    pub(crate) supervision: &'a str,
    pub(crate) seed: u64,
    pub(crate) embedder: Embedder<'a>,
}

/// A column of scores: a clusterer and the kind of embeddings.
pub(super) struct ScoreColumn {
    /// `k-means`, or `mean-shift+k-means` after the layer `net.refine`.
    pub(super) name: String,
    pub(super) clusterer: ClustererName,
    is_refined: bool,
}

/// One column per clusterer, and one more per clusterer for the refined embeddings, if there is a layer that refines.
pub(super) fn score_columns(config: &Config) -> Vec<ScoreColumn> {
    let clusterers = config.eval.clusterers.iter();
    let plain = clusterers.clone().map(|&clusterer| ScoreColumn {
        name: clusterer.name().to_owned(),
        clusterer,
        is_refined: false,
    });
    let layer = config.net.refine.iter().map(RefineConfig::name);
    let behind = layer.flat_map(|layer| {
        clusterers.clone().map(move |&clusterer| ScoreColumn {
            name: format!("{layer}+{}", clusterer.name()),
            clusterer,
            is_refined: true,
        })
    });
    plain.chain(behind).collect()
}

/// The largest number of tokens for the best cut. They are evenly spaced in their order. The time grows with the square of this
/// number.
const MAX_TOKENS_OF_TREE: usize = 512;

/// Embeddings of one shape, with the tree of their merges. The tree does not depend on the reference.
struct Embedded {
    rows: Embeddings,
    tree: AverageLinkTree,
}

impl Embedded {
    fn new(rows: Embeddings, tokens: &Tokens) -> Result<Self> {
        let chosen = chosen_tokens(rows.n_rows());
        let values = chosen.iter().flat_map(|&token| rows.row(token)).copied();
        let of_tree = Embeddings::new(rows.dim(), values.collect())?;
        let weights: Vec<u32> = chosen
            .iter()
            .map(|&token| tokens.multiplicity[token])
            .collect();
        let tree = AverageLinkTree::new(&of_tree, &weights)?;
        Ok(Self { rows, tree })
    }

    /// The best cut against labels, over the points of the tokens in the tree.
    fn best_cut_ari(&self, tokens: &Tokens, labels: &[i32]) -> Option<f64> {
        let chosen = chosen_tokens(self.rows.n_rows());
        let mut row_of_token = vec![None; self.rows.n_rows()];
        for (row, &token) in (0u32..).zip(&chosen) {
            row_of_token[token] = Some(row);
        }
        let mut rows = Vec::new();
        let mut reference = Vec::new();
        for (&token, &label) in tokens.token_of_point.iter().zip(labels) {
            if let Some(row) = row_of_token[token as usize] {
                rows.push(row);
                reference.push(label);
            }
        }
        // Without a labeled point among them, there is no best cut.
        best_cut_ari(&self.tree, &rows, &reference).ok()
    }
}

fn chosen_tokens(n_tokens: usize) -> Vec<usize> {
    let n_chosen = n_tokens.min(MAX_TOKENS_OF_TREE);
    (0..n_chosen).map(|idx| idx * n_tokens / n_chosen).collect()
}

/// Clusters the tokens into as many groups as the reference has parts on the sampled points, and scores all points.
pub(crate) fn score_against(
    shape: &Shape,
    reference: &str,
    tokens: &Tokens,
    embeddings: &Embeddings,
    clusterer: ClustererName,
    config: &EvalConfig,
) -> Result<OracleScores> {
    let tokenized = TokenizedShape {
        id: &shape.id,
        embeddings,
        multiplicity: &tokens.multiplicity,
        token_of_point: &tokens.token_of_point,
    };
    let clusterer = clusterer.clusterer(&config.clusterer_settings());
    Ok(score_oracle_k(
        &tokenized,
        shape.labels_by(reference)?,
        clusterer.as_ref(),
        config.seed,
    )?)
}

/// Writes `test/<shape>.npz` for each held-out shape: its points, normals and faces, and every reference's labels.
pub(crate) fn write_test_shapes(
    folder: &RunFolder,
    shapes: &[&Shape],
    references: &[String],
) -> Result<()> {
    shapes.par_iter().try_for_each(|shape| {
        let mut members = vec![
            ("points".to_owned(), Array::rows(&shape.sample.points)),
            ("normals".to_owned(), Array::rows(&shape.sample.normals)),
        ];
        for reference in references {
            members.push((
                format!("reference_{reference}"),
                Array::vector(shape.labels_by(reference)?.to_vec()),
            ));
        }
        members.extend(face_members(shape)?);
        write_npz(folder, &format!("test/{}.npz", shape.id), members)
    })
}

/// Scores every held-out shape for one model, and writes its predictions.
///
/// Rows come in the order of the shapes, then of the references.
pub(crate) fn evaluate(
    context: &ScoringContext<'_>,
    model: &ScoredModel<'_>,
    shapes: &[&Shape],
    progress: &Progress,
) -> Result<Vec<ScoreRow>> {
    let bar = progress.bar(
        &format!("score {} seed {}", model.supervision, model.seed),
        shapes.len(),
    );
    let rows: Vec<Vec<ScoreRow>> = shapes
        .par_iter()
        .map(|shape| {
            let rows = evaluate_shape(context, model, shape);
            bar.inc(1);
            rows.with_context(|| format!("scoring shape {}", shape.id))
        })
        .collect::<Result<_>>()?;
    bar.finish();
    Ok(rows.into_iter().flatten().collect())
}

fn evaluate_shape(
    context: &ScoringContext<'_>,
    model: &ScoredModel<'_>,
    shape: &Shape,
) -> Result<Vec<ScoreRow>> {
    let config = context.config;
    let (tokens, raw) = model.embedder.embed(&shape.sample, &config.tokens)?;
    let refine = config.net.refine.as_ref();
    let refined = refine
        .map(|layer| layer.refined(&raw, &tokens.multiplicity))
        .transpose()?;
    let refined = refined
        .map(|rows| Embedded::new(rows, &tokens))
        .transpose()?;
    let raw = Embedded::new(raw, &tokens)?;
    let columns = score_columns(config);

    let mut members: Vec<(String, Array)> = Vec::new();
    let mut rows = Vec::new();
    for reference in &context.references {
        let labels = shape.labels_by(reference)?;
        let of_tokens = &tokens.token_of_point;
        let gtc = Some(gtc(&raw.rows, of_tokens, labels)?);
        let split_gtc = split_gtc(&raw.rows, of_tokens, labels)?;
        let best_cut = |embedded: &Embedded| embedded.best_cut_ari(&tokens, labels);
        let [of_raw, of_refined] =
            [Some(&raw), refined.as_ref()].map(|rows| rows.and_then(best_cut));
        for (idx, column) in columns.iter().enumerate() {
            let (embedded, best_cut_ari) = match &refined {
                Some(refined) if column.is_refined => (refined, of_refined),
                _ => (&raw, of_raw),
            };
            let found = score_against(
                shape,
                reference,
                &tokens,
                &embedded.rows,
                column.clusterer,
                &config.eval,
            )?;
            let clusters = ScoredShape::of_clusters(
                &found.predicted,
                labels,
                of_tokens,
                &embedded.rows,
                found.scores,
            );
            let scored = ScoredShape {
                gtc,
                split_gtc,
                best_cut_ari,
                near_boundary: context.boundaries.of(&shape.id, reference),
                ..clusters
            };
            let names = (model.supervision, model.seed);
            rows.push(score_row(names, shape, reference, &column.name, &scored));
            let member = member_name(reference, idx, &column.name);
            members.push((member, clusters_array(&found.predicted)));
        }
    }
    let name = format!("{}-{}/{}", model.supervision, model.seed, shape.id);
    context.write_predictions(&name, members)?;
    if config.eval.embeddings {
        context.write_embeddings(&name, &tokens, &raw.rows)?;
    }
    Ok(rows)
}

/// `predicted_<source>` for the first column, with the suffix `__<column>` for any other.
pub(super) fn member_name(reference: &str, idx: usize, column: &str) -> String {
    if idx == 0 {
        format!("predicted_{reference}")
    } else {
        format!("predicted_{reference}__{column}")
    }
}

/// The cluster of each point as signed integers, like all labels.
pub(super) fn clusters_array(predicted: &[u32]) -> Array {
    let signed = predicted.iter().map(|&cluster| cluster as i32);
    Array::vector::<i32>(signed.collect())
}

/// The line of a shape under a supervision, or a row without one, and a seed.
pub(super) fn score_row(
    (supervision, seed): (&str, u64),
    shape: &Shape,
    reference: &str,
    column: &str,
    scored: &ScoredShape<'_>,
) -> ScoreRow {
    ScoreRow {
        shape: shape.id.clone(),
        supervision: supervision.to_owned(),
        seed,
        reference: reference.to_owned(),
        clusterer: column.to_owned(),
        k: scored.matched.k,
        scores: scored.scores(),
        group: shape.group.clone(),
    }
}

/// Writes the tokens' embeddings with the token of each point.
pub(crate) fn write_embeddings(
    folder: &RunFolder,
    relative: &str,
    tokens: &Tokens,
    embeddings: &Embeddings,
) -> Result<()> {
    write_npz(folder, relative, embedding_members(tokens, embeddings)?)
}

/// The members of an embedding file: `embeddings f32 (tokens, dim)`, `token_of_point u32`, `multiplicity u32`.
pub(crate) fn embedding_members(
    tokens: &Tokens,
    embeddings: &Embeddings,
) -> Result<Vec<(String, Array)>> {
    let shape = vec![embeddings.n_rows(), embeddings.dim()];
    let matrix = Array::with_shape(
        shape,
        partprobe_formats::Values::F32(embeddings.values().to_vec()),
    );
    Ok(vec![
        (
            "embeddings".to_owned(),
            matrix.context("an embedding for each token")?,
        ),
        (
            "token_of_point".to_owned(),
            Array::vector(tokens.token_of_point.clone()),
        ),
        (
            "multiplicity".to_owned(),
            Array::vector(tokens.multiplicity.clone()),
        ),
    ])
}

pub(super) fn write_npz(
    folder: &RunFolder,
    relative: &str,
    members: Vec<(String, Array)>,
) -> Result<()> {
    folder.write(relative, &npz_bytes(members)?)
}

/// The members as an NPZ file.
pub(crate) fn npz_bytes(members: Vec<(String, Array)>) -> Result<Vec<u8>> {
    let (names, arrays): (Vec<String>, Vec<Array>) = members.into_iter().unzip();
    let members: Vec<(&str, Array)> = names.iter().map(String::as_str).zip(arrays).collect();
    Ok(arrays_to_npz(&members, Compression::Stored)?)
}

//! Evaluates held-out shapes: embedding, clustering, scoring, and the files that let anybody score again.

use super::folder::RunFolder;
use super::page::face_members;
use super::shapes::Shape;
use crate::config::{ClustererName, Config, EvalConfig};
use crate::progress::Progress;
use anyhow::{Context, Result};
use partprobe_carrier::Embeddings;
use partprobe_eval::{OracleScores, ScoreRow, ScoredShape, TokenizedShape, gtc, score_oracle_k};
use partprobe_formats::{Array, Compression, arrays_to_npz};
use partprobe_net::{Model, RefineConfig, TokenConfig, Tokens};
use rayon::prelude::*;

/// The row of the network with its initial weights.
pub(crate) const UNTRAINED: &str = "untrained";
/// The row of the clusterer on plain geometry.
pub(crate) const NO_NETWORK: &str = "no-network";

/// What gives a token its embedding.
pub(crate) enum Embedder<'a> {
    /// A network, trained or not.
    Network(&'a Model),
    /// ½·position and normal.
    Geometry,
}

/// A row of the score table: what it is called and what embeds for it.
pub(crate) struct ScoredModel<'a> {
    pub(crate) supervision: &'a str,
    pub(crate) seed: u64,
    pub(crate) embedder: Embedder<'a>,
}

/// A column of scores: a clusterer, and the embeddings that it divides.
struct ScoreColumn<'a> {
    /// `k-means`, or `mean-shift+k-means` behind the layer `net.refine`.
    name: String,
    clusterer: ClustererName,
    embeddings: &'a Embeddings,
}

/// The names of the columns, each with its clusterer.
pub(super) fn column_names(config: &Config) -> Vec<(String, ClustererName)> {
    let none = Embeddings::from_rows([[0.0]; 0]);
    let layer = config.net.refine.as_ref().map(RefineConfig::name);
    let columns = score_columns(
        &config.eval.clusterers,
        &none,
        layer.map(|name| (name, &none)),
    );
    columns
        .into_iter()
        .map(|column| (column.name, column.clusterer))
        .collect()
}

/// One column per clusterer, and one more per clusterer for the embeddings behind the layer that refines, if there is one.
fn score_columns<'a>(
    clusterers: &[ClustererName],
    raw: &'a Embeddings,
    refined: Option<(&str, &'a Embeddings)>,
) -> Vec<ScoreColumn<'a>> {
    let plain = clusterers.iter().map(|&clusterer| ScoreColumn {
        name: clusterer.name().to_owned(),
        clusterer,
        embeddings: raw,
    });
    let behind = refined.into_iter().flat_map(|(layer, embeddings)| {
        clusterers.iter().map(move |&clusterer| ScoreColumn {
            name: format!("{layer}+{}", clusterer.name()),
            clusterer,
            embeddings,
        })
    });
    plain.chain(behind).collect()
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
    folder: &RunFolder,
    config: &Config,
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
            let rows = evaluate_shape(folder, config, model, shape);
            bar.inc(1);
            rows.with_context(|| format!("scoring shape {}", shape.id))
        })
        .collect::<Result<_>>()?;
    bar.finish();
    Ok(rows.into_iter().flatten().collect())
}

fn evaluate_shape(
    folder: &RunFolder,
    config: &Config,
    model: &ScoredModel<'_>,
    shape: &Shape,
) -> Result<Vec<ScoreRow>> {
    let (tokens, embeddings) = match model.embedder {
        Embedder::Network(network) => network.embed_sample(&shape.sample, &config.tokens)?,
        Embedder::Geometry => {
            let TokenConfig {
                test_tokens,
                voxels,
                ..
            } = config.tokens;
            let tokens = partprobe_net::tokenize(&shape.sample, test_tokens, voxels)?;
            let rows = tokens.geometry_rows();
            (tokens, rows)
        }
    };
    let place = format!("{}-{}/{}", model.supervision, model.seed, shape.id);
    let refine = config.net.refine.as_ref();
    let refined = refine
        .map(|layer| layer.refined(&embeddings, &tokens.multiplicity))
        .transpose()?;
    let columns = score_columns(
        &config.eval.clusterers,
        &embeddings,
        refine.map(RefineConfig::name).zip(refined.as_ref()),
    );

    let mut members: Vec<(String, Array)> = Vec::new();
    let mut rows = Vec::new();
    for reference in config.references() {
        let labels = shape.labels_by(&reference)?;
        let gtc = match model.embedder {
            Embedder::Network(_) => Some(gtc(&embeddings, &tokens.token_of_point, labels)?),
            Embedder::Geometry => None,
        };
        for (idx, column) in columns.iter().enumerate() {
            let found = score_against(
                shape,
                &reference,
                &tokens,
                column.embeddings,
                column.clusterer,
                &config.eval,
            )?;
            let scored = ScoredShape {
                predicted: &found.predicted,
                reference: labels,
                token_of_point: &tokens.token_of_point,
                embeddings: column.embeddings,
                matched: found.scores,
                gtc,
            };
            let names = (model.supervision, model.seed);
            rows.push(score_row(names, shape, &reference, &column.name, &scored));
            let member = member_name(&reference, idx, &column.name);
            members.push((member, clusters_array(&found.predicted)));
        }
    }
    write_npz(folder, &format!("predictions/{place}.npz"), members)?;
    if config.eval.embeddings {
        write_embeddings(
            folder,
            &format!("embeddings/{place}.npz"),
            &tokens,
            &embeddings,
        )?;
    }
    Ok(rows)
}

/// `predicted_<source>` for the first column, with `__<column>` behind it for any other.
pub(super) fn member_name(reference: &str, idx: usize, column: &str) -> String {
    if idx == 0 {
        format!("predicted_{reference}")
    } else {
        format!("predicted_{reference}__{column}")
    }
}

/// The cluster of each point as signed integers, as all labels are.
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

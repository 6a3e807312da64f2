//! Writes the sentences below every table: its settings, and notes about the scores.

use super::false_alarms::{error_rate, measured_false_alarms};
use super::split_file::SplitFile;
use crate::config::{Config, LabelConfig, NormalConfig};
use crate::counted::counted;
use crate::program_version::commit_or_version;
use partprobe_cluster::Modes;
use partprobe_eval::ScoreRow;
use partprobe_net::Voxels;
use std::collections::BTreeSet;

/// The shapes that tables are about.
#[derive(Clone, Debug)]
pub(super) struct TestShapes {
    /// Twelve digits that identify the shapes.
    pub(super) data_hash: String,
    /// The number of held-out shapes, including those that could not be scored.
    pub(super) n_held_out: usize,
}

impl TestShapes {
    /// The held-out shapes of a run.
    pub(super) fn of_split(split: &SplitFile) -> Self {
        Self {
            data_hash: split.data_hash(),
            n_held_out: split.n_test_shapes(),
        }
    }
}

/// The sentences below the tables of these rows. Without normals, those of the config were removed.
pub(super) fn footer(
    config: &Config,
    rows: &[ScoreRow],
    shapes: &TestShapes,
    normals: Normals,
) -> Vec<String> {
    let mut sentences = vec![settings(
        config,
        &trained_seeds(config, rows),
        &shapes.data_hash,
        normals,
    )];
    sentences.extend(unscored(rows, shapes.n_held_out));
    // The trainings optimize GTc, so the table mentions this.
    if config.loss.proto_ce_weight > 0.0 {
        sentences.push(
            "GTc: our loss trains for it (its prototype cross-entropy), and the loss of the paper may not. The centers come from the \
             labels that are scored; split GTc takes them from the other half of the tokens."
                .to_owned(),
        );
    }
    if config.compare.supervision.len() > 1 {
        sentences.extend(measured_false_alarms().ok().map(|found| error_rate(&found)));
    }
    sentences
}

/// A sentence about the held-out shapes that are not in the tables. Returns `None` if all are in them.
fn unscored(rows: &[ScoreRow], n_held_out: usize) -> Option<String> {
    let scored: BTreeSet<&str> = rows.iter().map(|row| row.shape.as_str()).collect();
    (scored.len() < n_held_out).then(|| {
        format!(
            "Only {} of the {n_held_out} held-out shapes are scored. The others do not have at least two labels by each source that is \
             compared.",
            scored.len()
        )
    })
}

/// The normals of the scored points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Normals {
    /// Those of the config.
    OfConfig,
    /// All are zero.
    None,
}

/// The seeds of the scored backbones. Perhaps not all seeds of the config are trained yet.
fn trained_seeds(config: &Config, rows: &[ScoreRow]) -> BTreeSet<u64> {
    let of_backbones = rows
        .iter()
        .filter(|row| config.compare.supervision.contains(&row.supervision));
    of_backbones.map(|row| row.seed).collect()
}

fn settings(
    config: &Config,
    trained_seeds: &BTreeSet<u64>,
    data_hash: &str,
    normals: Normals,
) -> String {
    let LabelConfig {
        theta_deg,
        tau_min,
        chord_fraction,
        angle_rad,
        volume_loss,
        ..
    } = &config.label;
    // Without normals, voxels cannot use them.
    let voxels = match (normals, config.tokens.voxels) {
        (Normals::OfConfig, Voxels::NormalKeyed) => "normal-keyed",
        (Normals::None, _) | (_, Voxels::Plain) => "plain",
    };
    let normals = match (normals, config.sample.normals) {
        (Normals::None, _) => "none",
        (Normals::OfConfig, NormalConfig::Triangle) => "of the triangles",
        (Normals::OfConfig, NormalConfig::Analytic) => "of the true surface",
    };
    let mut clusterers = config.eval.clusterers.iter();
    let found_k = match clusterers.any(|clusterer| clusterer.name() == Modes::NAME) {
        true => " (`modes` finds its own K)",
        false => "",
    };
    let seeds: Vec<String> = trained_seeds.iter().map(u64::to_string).collect();
    format!(
        "θ {theta_deg}°, τ_min {tau_min}; tessellation: chord {chord_fraction} of the diagonal, angle {angle_rad} rad, volume \
         loss {volume_loss}; {} points, normals {normals}, labels by the triangle of each point (transfer `index`); about {} \
         {voxels} tokens, {}; K of the reference{found_k}, {} restarts, clustering seed {}; training seeds {}; \
         commit {}, data {data_hash}.",
        config.sample.n_points,
        config.tokens.test_tokens,
        counted(config.tokens.test_poses, "pose", "poses"),
        config.eval.restarts,
        config.eval.seed,
        seeds.join(", "),
        commit_or_version(),
    )
}

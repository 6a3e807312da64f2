//! Reads the weights with which a training starts: `train.init`.
//!
//! The label source and the seed of a training go in, and the weights and the shapes that they have seen come out. Weights that
//! were trained on the labels of another source are refused in a comparison, because it would then measure the difference of two
//! trainings.

use crate::config::{Config, FOREIGN_SUPERVISION};
use anyhow::{Context, Result, ensure};
use partprobe_carrier::sha256_hex;
use partprobe_net::{Backend, InitialWeights, Model, ModelFile};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Refuses weights that a training of the run could not start from, before its folder is made. Trainings that have a checkpoint in the
/// folder have started.
///
/// # Errors
/// As for [`initial_weights`].
pub(crate) fn ensure_initial_weights(
    config: &Config,
    supervisions: &[String],
    folder: &Path,
    backend: Backend,
) -> Result<()> {
    let Some(pattern) = &config.train.init else {
        return Ok(());
    };
    for supervision in supervisions {
        let starts = config.compare.seeds.iter().filter(|seed| {
            let started = folder.join(format!("checkpoints/{supervision}-{seed}"));
            !started.exists()
        });
        // Each file is read once.
        let of_path: BTreeMap<String, u64> = starts
            .map(|&seed| (path_of(pattern, supervision, seed), seed))
            .collect();
        for seed in of_path.into_values() {
            initial_weights(config, (supervision, seed), backend)?;
        }
    }
    Ok(())
}

/// Weights from another run.
pub(super) struct LoadedWeights {
    pub(super) model: Model,
    pub(super) initial: InitialWeights,
}

/// The weights that `train.init` names for this label source and seed. Returns `None` if it names none.
///
/// # Errors
/// If the file cannot be read, has another network, or was trained on another source than the arm of the comparison.
pub(super) fn initial_weights(
    config: &Config,
    (supervision, seed): (&str, u64),
    backend: Backend,
) -> Result<Option<LoadedWeights>> {
    let Some(pattern) = &config.train.init else {
        return Ok(None);
    };
    let path = path_of(pattern, supervision, seed);
    let context = || format!("train.init: {path}");

    let bytes = fs::read(&path).with_context(context)?;
    let file = ModelFile::from_bytes(&bytes, backend).with_context(context)?;
    file.ensure_network(&config.net).with_context(context)?;

    let trained_on = file.trained_on.with_context(|| {
        format!(
            "train.init: {path} does not say on which shapes it was trained, so a test shape may be among them; if it came \
             from Pointcept and has seen none of your shapes, convert it with --unseen"
        )
    })?;
    ensure!(
        config.compare.supervision.len() == 1
            || [supervision, FOREIGN_SUPERVISION].contains(&trained_on.supervision.as_str()),
        "train.init: {path} was trained on `{}`, and would start a training on `{supervision}`; each source of a \
         comparison must start from its own weights: write {{source}} in the path",
        trained_on.supervision
    );
    Ok(Some(LoadedWeights {
        model: file.model,
        initial: InitialWeights {
            sha256: sha256_hex(&bytes),
            seen: trained_on.seen(),
        },
    }))
}

fn path_of(pattern: &str, supervision: &str, seed: u64) -> String {
    pattern
        .replace("{source}", supervision)
        .replace("{seed}", &seed.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn source_and_seed_are_inserted_into_the_path() {
        let path = |pattern| path_of(pattern, "step-parts", 2);
        assert_eq!(path("a/{source}-{seed}/m"), "a/step-parts-2/m");
        assert_eq!(path("a/m"), "a/m");
    }
}

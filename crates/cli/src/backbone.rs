//! Opens a trained backbone: a run folder or a file of weights goes in, and the network and its settings for preparing shapes
//! come out.

use crate::config::{Config, as_written, is_set, key_of, load, overrides_of_preparation};
use crate::run::{RunFolder, read_weights, weights_path};
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_carrier::{Embeddings, PointSample, sha256_hex};
use partprobe_net::{Backend, Model, ModelFile, Tokens};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Which backbone to use.
#[derive(Clone, Debug, PartialEq, Eq, clap::Args, Deserialize, Serialize)]
pub(crate) struct BackboneArgs {
    /// The run folder with the trained backbone, or a file of weights.
    #[arg(value_name = "RUN|WEIGHTS")]
    run: PathBuf,
    /// The supervision of the backbone, if the run has several; the config's first one if not given.
    #[arg(long, value_name = "SOURCE")]
    supervision: Option<String>,
    /// The seed of the training; the config's first one if not given.
    #[arg(long)]
    seed: Option<u64>,
}

/// The keys that say how shapes are prepared for a backbone and what becomes of its embeddings.
const PREPARATION_KEYS: [&str; 6] = [
    "label.",
    "net.refine",
    "sample.",
    "tokens.test_poses",
    "tokens.test_tokens",
    "tokens.voxels",
];

/// Refuses a setting that does nothing to a trained backbone. `more` are the beginnings of further keys that the caller looks at.
///
/// # Errors
/// If there is such a setting; the message names it and the keys that count.
pub(crate) fn ensure_preparation(overrides: &[String], more: &[&str]) -> Result<()> {
    let counts = |key: &str| {
        let keys = PREPARATION_KEYS.iter().chain(more);
        keys.copied().any(|counted| key.starts_with(counted))
    };
    if let Some(idle) = overrides.iter().find(|set| !counts(key_of(set))) {
        let keys: Vec<String> = PREPARATION_KEYS
            .iter()
            .chain(more)
            .map(|key| {
                if key.ends_with('.') {
                    format!("{key}*")
                } else {
                    (*key).to_owned()
                }
            })
            .collect();
        bail!(UsageError(format!(
            "{} changes nothing here: the backbone is trained already. These keys count: {}",
            as_written(idle),
            keys.join(", ")
        )));
    }
    Ok(())
}

/// A trained network, and the config by which shapes are prepared for it.
pub(crate) struct Backbone {
    pub(crate) model: Model,
    pub(crate) config: Config,
    /// The SHA-256 of the weights, in hexadecimal.
    pub(crate) weights_sha256: String,
}

impl BackboneArgs {
    /// Opens the backbone. `overrides` replace some of its settings.
    ///
    /// # Errors
    /// If there is no such backbone, its file is damaged, or an override is wrong.
    pub(crate) fn open(&self, overrides: &[String], backend: Backend) -> Result<Backbone> {
        if self.run.is_file() {
            self.of_file(overrides, backend)
        } else {
            self.of_run(overrides, backend)
        }
    }

    /// The same backbone, with a path that does not depend on the current folder.
    ///
    /// # Errors
    /// If there is no such path.
    pub(crate) fn absolute(&self) -> Result<Self> {
        let run = self.run.canonicalize();
        Ok(Self {
            run: run.with_context(|| format!("reading {}", self.run.display()))?,
            ..self.clone()
        })
    }

    /// The backbone of the same name in another run folder or file.
    pub(crate) fn in_other_run(&self, run: &Path) -> Self {
        if run.is_file() {
            return Self {
                run: run.to_owned(),
                supervision: None,
                seed: None,
            };
        }
        Self {
            run: run.to_owned(),
            ..self.clone()
        }
    }

    /// The backbone of a run folder, with the run's own settings.
    fn of_run(&self, overrides: &[String], backend: Backend) -> Result<Backbone> {
        let (config, weights) = self.weights_of_run(overrides)?;
        let model = Model::from_safetensors(&config.net, &weights, backend)?;
        Ok(Backbone {
            model,
            config,
            weights_sha256: sha256_hex(&weights),
        })
    }

    /// The config and the weights of a run folder.
    fn weights_of_run(&self, overrides: &[String]) -> Result<(Config, Vec<u8>)> {
        let folder = RunFolder::open_read_only(&self.run)?;
        let config = load(&folder.path("config.toml").to_string_lossy(), overrides)?.config;
        config.ensure_point_probe()?;
        let compare = &config.compare;
        let supervision = self.supervision.as_ref().unwrap_or(&compare.supervision[0]);
        ensure!(
            compare.supervision.contains(supervision),
            UsageError(format!(
                "the run has no backbone `{supervision}`, only {}",
                compare.supervision.join(", ")
            ))
        );
        let seed = self.seed.unwrap_or(compare.seeds[0]);
        let seeds: Vec<String> = compare.seeds.iter().map(u64::to_string).collect();
        ensure!(
            compare.seeds.contains(&seed),
            UsageError(format!(
                "the run has no backbone with seed {seed}, only {}",
                seeds.join(", ")
            ))
        );
        ensure!(
            folder.path(&weights_path(supervision, seed)).is_file(),
            "the training of `{supervision}` with seed {seed} is not finished in {}; resume the run with --resume",
            self.run.display()
        );
        let weights = read_weights(&folder, supervision, seed)?;
        Ok((config, weights))
    }

    /// The backbone of a file of weights. The settings in the file replace those of `base`.
    fn of_file(&self, overrides: &[String], backend: Backend) -> Result<Backbone> {
        ensure!(
            self.supervision.is_none() && self.seed.is_none(),
            UsageError(
                "--supervision and --seed choose a backbone of a run folder; a file of weights holds one".to_owned()
            )
        );
        let bytes =
            fs::read(&self.run).with_context(|| format!("reading {}", self.run.display()))?;
        let ModelFile {
            model, preparation, ..
        } = ModelFile::from_bytes(&bytes, backend)
            .with_context(|| self.run.display().to_string())?;
        let mut all = overrides_of_preparation(&preparation);
        all.extend(overrides.iter().cloned());
        let mut config = load("base", &all)?.config;
        // The layer after the head is that of the file, unless the user requests another one, or none.
        let refine = config.net.refine.take();
        config.net = model.config().clone();
        if is_set(overrides, "net.refine") {
            config.net.refine = refine;
        }
        Ok(Backbone {
            model,
            config,
            weights_sha256: sha256_hex(&bytes),
        })
    }
}

impl Backbone {
    /// The tokens of a sample, and one unit row per token. The rows are refined if the network has a layer for this.
    ///
    /// # Errors
    /// If the points cannot be divided into tokens, or the weights give numbers that are not finite.
    pub(crate) fn embedded(&self, sample: &PointSample) -> Result<(Tokens, Embeddings)> {
        let (tokens, raw) = self.model.embed_sample(sample, &self.config.tokens)?;
        let embeddings = match &self.config.net.refine {
            None => raw,
            Some(refine) => refine.refined(&raw, &tokens.multiplicity)?,
        };
        Ok((tokens, embeddings))
    }
}

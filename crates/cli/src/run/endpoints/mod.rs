//! Scores the backbones of a run again under the conditions of `[[endpoints]]`: on other meshes of the test shapes, without
//! normals or with noise, with other tokens, or on shapes of another data set.
//!
//! Plain geometry is tuned to the mesh of a table. Scores on another mesh show whether a network has learned more. Nothing is
//! trained here, and every endpoint has its own tables.

mod classes;
mod disturbance;
mod shapes;

use super::data_settings::settings_of;
use super::evaluation::Embedder;
use super::footer::{Normals, TestShapes, footer};
use super::held_out::HeldOut;
use super::results::table_settings;
use super::scoring_context::{Boundaries, ScoringContext};
use super::shapes::Shape;
use super::stages::Run;
use crate::config::{Attribute, Config, EndpointConfig, EndpointNormals};
use crate::label_sources::{source_named, sources_named};
use crate::stderr;
use crate::usage::as_usage_error;
use anyhow::{Context, Error, Result, ensure};
use classes::FaceClasses;
use partprobe_dataset::{Dataset, json_lines};
use partprobe_eval::tables;
use partprobe_net::Model;
use shapes::{EndpointData, KnownShapes};
use std::cell::OnceCell;

/// The tables of the endpoints as text, and the first reason why one could not be scored.
#[derive(Default)]
pub(crate) struct EndpointTables {
    pub(crate) scored: Vec<String>,
    pub(crate) failed: Option<Error>,
}

impl Run<'_> {
    /// Refuses endpoints that cannot be scored according to their names and data sets, before any work is done.
    ///
    /// # Errors
    /// If a data set cannot be opened or lacks requested normals, or a source is unknown.
    pub(crate) fn check_endpoints(&self) -> Result<()> {
        for endpoint in &self.config.endpoints {
            check_endpoint(self.config, endpoint)
                .with_context(|| format!("endpoint `{}`", endpoint.name))
                .map_err(as_usage_error)?;
        }
        Ok(())
    }

    /// Scores all endpoints, and writes `endpoints/<name>/`. An endpoint that fails is named, and the others are still scored.
    ///
    /// # Errors
    /// If the run is interrupted.
    pub(crate) fn evaluate_endpoints(&self) -> Result<EndpointTables> {
        let mut tables = EndpointTables::default();
        let known = OnceCell::new();
        for endpoint in &self.config.endpoints {
            let scored = self
                .evaluate_endpoint(endpoint, &known)
                .with_context(|| format!("endpoint `{}`", endpoint.name));
            match scored {
                Ok(text) => tables.scored.push(text),
                Err(error) if self.execution.interrupt.is_set() => return Err(error),
                Err(error) => match &tables.failed {
                    // The program ends with the first error. The others are printed here.
                    Some(_) => stderr::print_line(format_args!("error: {error:#}")),
                    None => tables.failed = Some(error),
                },
            }
        }
        Ok(tables)
    }

    fn evaluate_endpoint(
        &self,
        endpoint: &EndpointConfig,
        known: &OnceCell<KnownShapes>,
    ) -> Result<String> {
        let config = config_of(self.config, endpoint)?;
        let data = EndpointData::load(endpoint, &config, self, known)?;
        let progress = &self.execution.progress;
        progress.note(&format!("endpoint {}: {}", endpoint.name, data.summary));
        let shapes: Vec<&Shape> = data.shapes.iter().collect();

        let held_out = self.held_out(&shapes);
        let trained = self.trained_models(&held_out)?;
        let context = ScoringContext {
            boundaries: &Boundaries::of_shapes(&shapes, &data.references)?,
            references: data.references.clone(),
            config: &config,
            folder: None,
        };
        let rows = self.scored(&context, &held_out, &trained, &shapes)?;
        let normals = match endpoint.normals {
            Some(EndpointNormals::None) => Normals::None,
            _ => Normals::OfConfig,
        };
        // The summary of the endpoint counts the missing held-out shapes.
        let of = TestShapes {
            data_hash: data.hash.clone(),
            n_held_out: shapes.len(),
        };
        let footer = footer(&config, &rows, &of, normals);
        let tables = tables(&rows, &table_settings(&config, footer)?);
        let mut text = format!("## Endpoint {}\n\n{}.\n\n", endpoint.name, data.summary);
        text += &tables.to_markdown();

        let write = |file: &str, bytes: &[u8]| {
            self.folder
                .write(&format!("endpoints/{}/{file}", endpoint.name), bytes)
        };
        if let Some(classes) = &data.classes {
            let probes = self.probes(classes, &held_out, &trained, &config)?;
            text += &probes.to_markdown();
            write("probe.json", &probes.to_json()?)?;
        }
        write("tables.md", text.as_bytes())?;
        write("tables.csv", tables.to_csv().as_bytes())?;
        write("tables.json", tables.to_json().as_bytes())?;
        write("scores.jsonl", &json_lines(&rows)?)?;
        Ok(text)
    }

    /// The probe of each backbone, and of the rows without a network.
    fn probes(
        &self,
        classes: &FaceClasses,
        held_out: &HeldOut<'_>,
        trained: &[(&str, u64)],
        config: &Config,
    ) -> Result<classes::ProbeTable> {
        let seeds = &self.config.compare.seeds;
        let mut table = classes::ProbeTable::new(classes);
        let mut add = |name: &str, seed: u64, embedder: &Embedder<'_>| -> Result<()> {
            let scores = classes.probe(embedder, &config.tokens)?;
            table.add(name, seed, scores);
            Ok(())
        };
        add(super::evaluation::NO_NETWORK, seeds[0], &Embedder::Geometry)?;
        let fourier = Embedder::RandomFourier(seeds[0]);
        add(super::evaluation::RANDOM_FOURIER, seeds[0], &fourier)?;
        for &seed in seeds {
            let untrained = Model::init(&self.config.net, seed, self.execution.backend)?;
            add(
                super::evaluation::UNTRAINED,
                seed,
                &Embedder::Network(&untrained),
            )?;
            for &(supervision, _) in trained.iter().filter(|(_, of)| *of == seed) {
                let model = held_out.model(supervision, seed)?;
                add(supervision, seed, &Embedder::Network(&model))?;
            }
        }
        Ok(table)
    }
}

/// Checks the names and the data set of an endpoint.
fn check_endpoint(config: &Config, endpoint: &EndpointConfig) -> Result<()> {
    if let Some(data) = &endpoint.data {
        Dataset::open(data)?;
    }
    sources_named(config, &endpoint.references)?;
    if let Some(probe) = &endpoint.probe {
        source_named(config, probe)?;
    }
    let config = config_of(config, endpoint)?;
    ensure!(
        endpoint.normals != Some(EndpointNormals::Analytic)
            || config.label.attributes.contains(&Attribute::Normal),
        "its carriers hold no analytic normals; label the files with --attributes normal, and name that data set with `data`"
    );
    Ok(())
}

/// The settings of the run with the changes of the endpoint.
fn config_of(config: &Config, endpoint: &EndpointConfig) -> Result<Config> {
    let mut changed = config.clone();
    // Shapes are not chosen again: a test shape is kept even if its number of parts is different on another mesh.
    changed.select.min_parts = endpoint.min_parts;
    changed.select.max_parts = match endpoint.max_parts {
        0 => usize::MAX,
        most => most,
    };
    if let Some(data) = &endpoint.data {
        // The tables of the endpoint name the settings of its own data set.
        let label = settings_of(data)?["label"].take();
        let mut own = serde_json::to_value(&changed.label)?;
        if let (Some(own), Some(label)) = (own.as_object_mut(), label.as_object()) {
            own.extend(label.clone());
        }
        changed.label = serde_json::from_value(own)
            .with_context(|| format!("the settings of {}", data.display()))?;
    }
    if let Some(voxels) = endpoint.voxels {
        changed.tokens.voxels = voxels;
    }
    match endpoint.normals {
        Some(EndpointNormals::Triangle) => {
            changed.sample.normals = crate::config::NormalConfig::Triangle;
        }
        Some(EndpointNormals::Analytic) => {
            changed.sample.normals = crate::config::NormalConfig::Analytic;
        }
        // The normals are removed from the points.
        Some(EndpointNormals::None) | None => {}
    }
    if !endpoint.references.is_empty() {
        changed.compare.references.clone_from(&endpoint.references);
        // The primary endpoints of the run are about its own references.
        changed.compare.primary.clear();
    }
    Ok(changed)
}

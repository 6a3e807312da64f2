//! Runs the implicit probe (paper §4.5): one network per shape, label source and seed, and the tables of their scores.
//!
//! The command `run` calls this for a config with a table `[implicit]`. The computations are in `partprobe-implicit`. This module
//! names files, finds finished fits, and shows progress.

mod fit;
mod metrics;
mod pictures;
mod record;
mod report;
mod settings;
mod shape;
mod tables;

pub(crate) use settings::ImplicitConfig;

use crate::config::Config;
use crate::label_sources::sources_named;
use crate::run::{Execution, Points, RunFolder, Shape, ShapeLoader, choose};
use anyhow::{Result, bail};
use fit::Fit;
use partprobe_dataset::Dataset;
use partprobe_sources::BoxedSource;
use record::{FitRecord, Outcome};
use shape::PreparedShape;
use tables::{TableInput, tables};

/// The arm without a segmentation loss.
pub(crate) const CONTROL: &str = "control";

/// The data that all fits of a run share.
pub(crate) struct Probe<'a> {
    pub(crate) settings: &'a ImplicitConfig,
    pub(crate) folder: &'a RunFolder,
    pub(crate) execution: &'a Execution,
    /// The label sources of the arms, without the control.
    pub(crate) sources: Vec<BoxedSource>,
    /// The source against which all arms are scored.
    pub(crate) reference: BoxedSource,
    pub(crate) seeds: &'a [u64],
    pub(crate) source_seed: u64,
}

/// Fits and scores all shapes of a data set that the config chooses, and prints the tables.
///
/// # Errors
/// If no shape takes part, a file cannot be written, or the user stops the program. A shape that cannot be fitted is named, and
/// the others are still fitted.
pub(crate) fn run(
    dataset: &Dataset,
    config: &Config,
    settings: &ImplicitConfig,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<()> {
    let choice = choose(
        &ShapeLoader::new(dataset, config, Points::Redrawn)?,
        &execution.progress,
    )?;
    execution.progress.note(&choice.selection.to_string());
    let mut shapes = choice.shapes;
    shapes.sort_by(|a, b| a.id.cmp(&b.id));
    if shapes.is_empty() {
        bail!("no shape takes part; see `select` in the config");
    }
    folder.write_json("shapes.json", &choice.selection)?;
    let mut references = sources_named(config, &config.compare.references[..1])?;
    let probe = Probe {
        settings,
        folder,
        execution,
        sources: sources_named(config, &config.compare.supervision)?,
        reference: references.swap_remove(0),
        seeds: &config.compare.seeds,
        source_seed: config.sample.seed,
    };
    let records = probe.fit_all(&shapes)?;
    let ids: Vec<String> = shapes.iter().map(|shape| shape.id.clone()).collect();
    let arms = probe.arms();
    let input = TableInput {
        records: &records,
        arms: &arms,
        seeds: probe.seeds,
        reference: probe.reference.name(),
        settings,
        shapes: &ids,
    };
    let made = tables(&input);
    folder.write("tables.md", made.markdown.as_bytes())?;
    folder.write("tables.csv", record::csv(&records).as_bytes())?;
    folder.write_json("tables.json", &made.json)?;
    let page = report::html(&made, &ids, &arms);
    folder.write("report.html", page.as_bytes())?;
    crate::stdout::print_result_tables(made.markdown.trim_end())
}

impl Probe<'_> {
    /// The names of the arms: the label sources, and the control if it is requested.
    pub(crate) fn arms(&self) -> Vec<String> {
        let sources = self.sources.iter().map(|source| source.name().to_owned());
        let control = self.settings.control.then(|| CONTROL.to_owned());
        sources.chain(control).collect()
    }

    /// Fits every arm and seed of every shape, unless its record is in the folder.
    fn fit_all(&self, shapes: &[Shape]) -> Result<Vec<FitRecord>> {
        let fits = self.fits(shapes);
        let bar = self
            .execution
            .progress
            .bar("fit", fits.len() * self.settings.iterations);
        let mut records = Vec::with_capacity(fits.len());
        let mut prepared: Option<(String, Result<PreparedShape, String>)> = None;
        for (done, (shape, fit)) in fits.iter().enumerate() {
            bar.set_position((done * self.settings.iterations) as u64);
            if let Some(record) = FitRecord::read(self.folder, fit)? {
                records.push(record);
                continue;
            }
            let is_next = prepared.as_ref().is_none_or(|(id, _)| *id != shape.id);
            if is_next {
                let made = PreparedShape::new(shape, self).map_err(|error| format!("{error:#}"));
                prepared = Some((shape.id.clone(), made));
            }
            let record = match prepared.as_ref().map(|(_, prepared)| prepared) {
                Some(Ok(prepared)) => fit.record(prepared, self, &bar)?,
                Some(Err(reason)) => fit.failed(reason),
                None => continue,
            };
            record.write(self.folder)?;
            if let Outcome::Failed { reason } = &record.outcome {
                self.execution
                    .progress
                    .note(&format!("warning: {fit}: {reason}"));
            }
            records.push(record);
        }
        bar.finish_and_clear();
        Ok(records)
    }

    /// All fits: shape by shape, so that a shape is prepared only once, then seed by seed and arm by arm.
    fn fits<'a>(&self, shapes: &'a [Shape]) -> Vec<(&'a Shape, Fit)> {
        let arms = self.arms();
        let mut fits = Vec::new();
        for shape in shapes {
            for &seed in self.seeds {
                for arm in &arms {
                    let fit = Fit {
                        shape: shape.id.clone(),
                        arm: arm.clone(),
                        seed,
                    };
                    fits.push((shape, fit));
                }
            }
        }
        fits
    }
}

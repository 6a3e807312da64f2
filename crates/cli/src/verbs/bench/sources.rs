//! Runs `partprobe bench sources`: measures the time of each label source on one carrier, and the time of carrying labels to
//! points.

use super::timing::{cpu_seconds, median_ms};
use crate::markdown_table::Alignment::{Left, Right};
use crate::markdown_table::markdown_table;
use crate::stdout::{print_line, print_tables};
use crate::usage::as_usage_error;
use anyhow::{Context, Result, bail};
use partprobe_carrier::{Carrier, Color, NormalKind, PointSample, keyed_rng, sample_by_area};
use partprobe_label::LabelOptions;
use partprobe_sources::{SOURCES, SourceError, SourceFactory, source_named};
use partprobe_transfer::{
    Channel, LabeledSurface, Limits, Query, Surface, Target, carry, queries_of,
};
use serde::Serialize;
use std::fmt;

/// The number that replaces each placeholder in the names of the sources, if the source accepts it.
const NUMBER: u32 = 20;

/// The factor by which each step of the search for a fine mesh reduces the angle tolerance.
const FINER: f64 = 0.8;

/// The colors of the faces of the carrier.
const COLORS: [Color; 3] = [Color(0xff00_00ff), Color(0x00ff_00ff), Color(0x0000_ffff)];

/// The largest number of steps of the search.
const MAX_STEPS: usize = 60;

/// Measure the time of each label source and of each way to transfer labels to points.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe bench sources
  partprobe bench sources ward-20 sdf-5 --rounds 9
  partprobe bench sources --triangles 200000 --json

The carrier is a generated part with 20 to 30 STEP-Parts, tessellated finely enough. Each source labels it --rounds times in one
thread; ms is the median. cpu_ms is the mean CPU time of the whole process, which is more reliable on a busy machine.
Labels of triangles are then transferred to --points points, with one thread per core.
Without names, all sources are measured. Each placeholder such as <K> is replaced by 20, or by the nearest number that the source
accepts.")]
pub(super) struct SourcesArgs {
    /// The sources to measure; all of them if none is named.
    #[arg(value_name = "SOURCE")]
    sources: Vec<String>,
    /// The smallest number of triangles of the carrier.
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = clap::value_parser!(u32).range(1..=2_000_000))]
    triangles: u32,
    /// The number of points to which labels are transferred.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// The number of rounds of each measurement.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    rounds: u16,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// All measurements.
#[derive(Debug, Serialize)]
struct Figures {
    triangles: usize,
    points: u32,
    sources: Vec<SourceFigures>,
    transfer: Vec<TransferFigures>,
}

/// The measurements of one source.
#[derive(Debug, Serialize)]
struct SourceFigures {
    source: String,
    /// The number of labels of the triangles. It is `None` if the source refuses the carrier.
    labels: Option<u32>,
    ms: f64,
    cpu_ms: f64,
    /// The reason why the source refuses the carrier.
    refused: Option<String>,
}

/// The time of carrying the labels of `step-parts` to the points, including the search structure.
#[derive(Debug, Serialize)]
struct TransferFigures {
    channel: &'static str,
    ms: f64,
    cpu_ms: f64,
}

/// Measures and prints.
///
/// # Errors
/// If a name is unknown, the part cannot be tessellated that finely, or the output cannot be written.
pub(super) fn bench_sources(args: &SourcesArgs) -> Result<()> {
    let figures = measure(args)?;
    if args.json {
        return print_line(serde_json::to_string(&figures)?);
    }
    print_tables(figures)
}

fn measure(args: &SourcesArgs) -> Result<Figures> {
    let names = match args.sources.as_slice() {
        [] => SOURCES.iter().map(example_name).collect(),
        named => named.to_vec(),
    };
    let carrier = painted(&fine_carrier(args.triangles as usize)?)?;
    let sources = names
        .iter()
        .map(|name| measure_source(name, &carrier, args.rounds))
        .collect::<Result<Vec<SourceFigures>>>()?;
    Ok(Figures {
        triangles: carrier.mesh().triangles.len(),
        points: args.points,
        sources,
        transfer: measure_transfer(&carrier, args)?,
    })
}

/// A name that the factory accepts.
fn example_name(factory: &SourceFactory) -> String {
    let stem = factory.pattern().split('<').next().unwrap_or_default();
    match factory.numbers() {
        None => factory.pattern().to_owned(),
        Some(numbers) => format!("{stem}{}", NUMBER.clamp(*numbers.start(), *numbers.end())),
    }
}

/// A generated part, tessellated so finely that it has at least this number of triangles.
fn fine_carrier(n_triangles: usize) -> Result<Carrier> {
    let settings = partprobe_synth::SynthSettings {
        seed: 1,
        min_parts: 20,
        max_parts: 30,
    };
    let part = partprobe_synth::part(&settings, 0);
    let mut options = LabelOptions::default();
    for _ in 0..MAX_STEPS {
        let file = partprobe_label::label(part.step.as_bytes(), &part.name, &options)?;
        let shape = file.shapes.into_iter().next();
        let carrier = shape
            .context("the generated part has no shape")?
            .carrier
            .context("the generated part has no carrier")?;
        if carrier.mesh().triangles.len() >= n_triangles {
            return Ok(carrier);
        }
        // The sag of an arc grows with the square of its angle.
        options.tessellation.angle_rad *= FINER;
        options.tessellation.chord_fraction *= FINER * FINER;
    }
    bail!("no tessellation has {n_triangles} triangles; ask for fewer")
}

/// The same carrier, with the type of each face as its name, and with one of three colors per face.
fn painted(carrier: &Carrier) -> Result<Carrier> {
    let mut graph = carrier.graph().clone();
    for (index, face) in graph.faces.iter_mut().enumerate() {
        face.name = Some(face.face_type.name().to_owned());
        face.color = Some(COLORS[index % COLORS.len()]);
    }
    Ok(Carrier::new(
        carrier.mesh().clone(),
        graph,
        carrier.layers().clone(),
        carrier.meta().clone(),
    )?)
}

fn measure_source(name: &str, carrier: &Carrier, n_rounds: u16) -> Result<SourceFigures> {
    let source = source_named(name).map_err(|error| as_usage_error(error.into()))?;
    let mut figures = SourceFigures {
        source: name.to_owned(),
        labels: None,
        ms: 0.0,
        cpu_ms: 0.0,
        refused: None,
    };
    let cpu_before = cpu_seconds();
    figures.ms = median_ms(n_rounds, || {
        match source.labels(carrier, 0) {
            Ok(labels) => figures.labels = Some(labels.n_labels()),
            Err(SourceError::Unfit { reason }) => figures.refused = Some(reason),
            Err(error) => return Err(error),
        }
        Ok(())
    })?;
    figures.cpu_ms = (cpu_seconds() - cpu_before) * 1e3 / f64::from(n_rounds);
    Ok(figures)
}

fn measure_transfer(carrier: &Carrier, args: &SourcesArgs) -> Result<Vec<TransferFigures>> {
    let n_points = args.points as usize;
    let mut rng = keyed_rng(0, &["bench"]);
    let sample = sample_by_area(carrier.mesh(), n_points, NormalKind::Triangle, &mut rng)?;
    let queries = queries_of(&sample);
    let labels = carrier.triangle_labels();
    let surface = Surface::of_mesh(carrier.mesh())?;
    let labeled = LabeledSurface::new(surface, labels.of_triangle())?;

    [Channel::Index, Channel::NnVertex, Channel::NnSurface]
        .into_iter()
        .map(|channel| measure_channel(channel, &labeled, (&sample, &queries), args.rounds))
        .collect()
}

fn measure_channel(
    channel: Channel,
    labeled: &LabeledSurface<'_>,
    (sample, queries): (&PointSample, &[Query]),
    n_rounds: u16,
) -> Result<TransferFigures> {
    let target = Target {
        surface: labeled.surface(),
        points: queries,
        triangles: &sample.triangles,
    };
    let cpu_before = cpu_seconds();
    let ms = median_ms(n_rounds, || carry(channel, labeled, &target, &Limits::NONE))?;
    Ok(TransferFigures {
        channel: channel.name(),
        ms,
        cpu_ms: (cpu_seconds() - cpu_before) * 1e3 / f64::from(n_rounds),
    })
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} triangles, one thread", self.triangles)?;
        let sources = self.sources.iter().map(|row| {
            let labels = row.labels.map_or_else(|| "–".to_owned(), |n| n.to_string());
            let [ms, cpu_ms] = [row.ms, row.cpu_ms].map(|ms| format!("{ms:.1}"));
            [row.source.clone(), labels, ms, cpu_ms]
        });
        let heading = ["source", "labels", "ms", "CPU ms"];
        let alignment = [Left, Right, Right, Right];
        writeln!(f, "\n{}\n", markdown_table(heading, alignment, sources))?;
        for row in &self.sources {
            if let Some(reason) = &row.refused {
                writeln!(f, "{} refuses the carrier: {reason}", row.source)?;
            }
        }
        let transfer = self.transfer.iter().map(|row| {
            let [ms, cpu_ms] = [row.ms, row.cpu_ms].map(|ms| format!("{ms:.1}"));
            [row.channel.to_owned(), ms, cpu_ms]
        });
        let heading = ["transfer by", "ms", "CPU ms"];
        let table = markdown_table(heading, [Left, Right, Right], transfer);
        write!(f, "{} points, all threads\n\n{table}", self.points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_bench_has_a_row_for_each_source() {
        let args = SourcesArgs {
            sources: Vec::new(),
            triangles: 300,
            points: 100,
            rounds: 1,
            json: false,
        };
        let figures = measure(&args).unwrap();
        assert!(figures.triangles >= 300);
        assert_eq!(figures.sources.len(), SOURCES.len());
        for row in &figures.sources {
            assert!(row.labels.is_some() != row.refused.is_some(), "{row:?}");
        }
        assert_eq!(figures.transfer.len(), 3);
        let text = figures.to_string();
        assert!(text.contains("given refuses the carrier: "), "{text}");
    }

    #[test]
    fn unknown_names_are_refused() {
        let args = SourcesArgs {
            sources: vec!["nothing".to_owned()],
            triangles: 1,
            points: 1,
            rounds: 1,
            json: false,
        };
        let error = measure(&args).unwrap_err().to_string();
        assert!(error.contains("`nothing` is not a label source"), "{error}");
    }
}

//! Runs `partprobe compare`.

use super::complexity_svg::complexity_svg;
use super::counts_svg::counts_svg;
use super::curve_svg::{distance_svg, thickness_svg};
use super::distribution_svg::distribution_svg;
use super::measure::{Comparison, MeasuredShape};
use crate::damaged_carriers::{is_damaged_carrier, refuse_damaged_carriers};
use crate::interrupt::Interrupt;
use crate::label_sources::listed_sources;
use crate::own_output::OwnOutput;
use crate::shape_choice::ChoiceArgs;
use crate::shape_input::{DataArgs, ShapeInput, ShapeInputs};
use crate::stderr;
use crate::stdout::{print_line, print_tables};
use anyhow::{Result, ensure};
use partprobe_dataset::{json_lines, write_atomically};
use partprobe_eval::{
    AgreementRow, AgreementTables, AgreementTablesSettings, Bootstrap, RefusedShape,
    agreement_tables,
};
use partprobe_transfer::Channel;
use std::path::{Path, PathBuf};

/// The number of shapes that are measured between two checks for Ctrl-C. It has no other effect.
const SHAPES_AT_ONCE: usize = 16;
/// Bootstrap draws of the intervals.
const DRAWS: usize = 2000;

/// Compare label sources on the same shapes without training: agreement with the first source, which is the reference.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe compare step-parts ward-20 --data parts/                              STEP files, labeled on the way
  partprobe compare step-parts ward-20 canonical --data dataset/ --out agreement/
  partprobe compare step-parts ward-20 --data dataset/ --shapes 240 --min-parts 2 --max-parts 20 --channel nn-vertex

Points are drawn from each shape and labeled by each source. Labels are matched one to one to the reference parts, so that as many
points as possible agree. Prints means, standard deviations and 95 % intervals of accuracy, mIoU, ARI and of the accuracy near the
reference's borders; counts of labels, merges and splits; and the accuracy by number of parts, by distance to a border and by
local thickness. Each agreement has its transfer ceiling: the score of the reference itself after its labels went through the same
channel.
--out writes agreement.md, agreement.csv, agreement.json, curves.csv, shapes.csv (a line per shape, source and channel),
shapes.jsonl, refused.csv and, for each channel, five figures as SVG.")]
pub(crate) struct CompareArgs {
    /// The reference source, and then the sources that are compared with it; `partprobe sources` lists them.
    #[arg(required = true, num_args = 2.., value_name = "SOURCE")]
    sources: Vec<String>,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// The number of points per shape. They are uniform by area.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// How labels are transferred from triangles to points; can be given several times, for several tables.
    #[arg(
        long = "channel",
        value_enum,
        value_name = "CHANNEL",
        default_value = "index"
    )]
    channels: Vec<ChannelName>,
    /// A folder to write tables and figures to.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the output of an earlier call.
    #[arg(long, requires = "out")]
    force: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The channels that carry labels between the points and the triangles of one carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ChannelName {
    /// A point has the label of the triangle that it was drawn from. Nothing is lost.
    Index,
    /// A point has the label of the nearest point of the surface.
    NnSurface,
    /// A point has the label that most triangles at the nearest vertex have: the paper's protocol.
    NnVertex,
}

impl ChannelName {
    fn channel(self) -> Channel {
        match self {
            Self::Index => Channel::Index,
            Self::NnSurface => Channel::NnSurface,
            Self::NnVertex => Channel::NnVertex,
        }
    }
}

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "compare",
    marker: Some("agreement.md"),
    is_own: |name| {
        let tables = [
            "agreement.md",
            "agreement.csv",
            "agreement.json",
            "curves.csv",
            "shapes.csv",
            "shapes.jsonl",
            "refused.csv",
        ];
        tables.contains(&name) || name.ends_with(".svg")
    },
};

/// Measures the agreement of the sources on every shape and prints the tables.
///
/// # Errors
/// If an argument is invalid, no shape could be compared, or a file cannot be written.
pub(crate) fn compare(args: &CompareArgs) -> Result<()> {
    let comparison = comparison(args)?;
    args.choice.check()?;
    args.data.check()?;
    if let Some(out) = &args.out {
        OUTPUT.ensure_free(out, args.force, &args.data.paths)?;
    }
    let shape_args = args.data.shape_args();

    let interrupt = Interrupt::listen()?;
    let sources = shape_args.open_for("compare", &interrupt)?;
    let pool = shape_args.thread_pool()?;
    let measured = pool.install(|| measure(&comparison, args, &sources, &interrupt))?;
    ensure!(
        !measured.rows.is_empty(),
        "no shape could be compared{}",
        first_reason(&measured.refused)
    );

    let tables = agreement_tables(
        &measured.rows,
        measured.refused,
        table_settings(&comparison),
    );
    if let Some(out) = &args.out {
        let _lock = OUTPUT.take(out, "writing tables into", args.force, &args.data.paths)?;
        write_files(out, &tables, &measured.rows)?;
    }
    if args.json {
        print_line(tables.to_json().trim_end())?;
    } else {
        print_tables(tables.to_markdown().trim_end())?;
    }
    refuse_damaged_carriers(measured.n_damaged)
}

fn comparison(args: &CompareArgs) -> Result<Comparison> {
    let config = args.data.settings()?;
    let mut reference = listed_sources(&config, &args.sources[..1])?;
    let sources = listed_sources(&config, &args.sources[1..])?;
    let mut channels: Vec<Channel> = Vec::new();
    for channel in args.channels.iter().map(|name| name.channel()) {
        if !channels.contains(&channel) {
            channels.push(channel);
        }
    }
    Ok(Comparison {
        reference: reference.swap_remove(0),
        sources,
        channels,
        n_points: args.points as usize,
        seed: args.choice.seed,
    })
}

fn table_settings(comparison: &Comparison) -> AgreementTablesSettings {
    let name = |channel: &Channel| channel.name().to_owned();
    AgreementTablesSettings {
        reference: comparison.reference.name().to_owned(),
        sources: comparison
            .sources
            .iter()
            .map(|source| source.name().to_owned())
            .collect(),
        channels: comparison.channels.iter().map(name).collect(),
        n_points: comparison.n_points,
        bootstrap: Bootstrap {
            draws: DRAWS,
            seed: comparison.seed,
            least_groups: Bootstrap::LEAST_GROUPS,
        },
    }
}

/// Measures the chosen shapes. Rows are in the order of the shapes' ids, for any speed of the threads.
fn measure(
    comparison: &Comparison,
    args: &CompareArgs,
    sources: &ShapeInputs,
    interrupt: &Interrupt,
) -> Result<MeasuredShape> {
    let reference = comparison.reference.name();
    let mut all = MeasuredShape::default();
    all.refused
        .extend(sources.failed.iter().map(|failed| RefusedShape {
            source: reference.to_owned(),
            shape: failed.id.clone(),
            reason: format!("it has no carrier: {}", failed.reason),
        }));
    let chosen = args.choice.choose(&sources.shapes);
    let found = chosen.measured("compare", SHAPES_AT_ONCE, interrupt, |shape| {
        measured_shape(comparison, shape)
    })?;
    for shape in found {
        all.rows.extend(shape.rows);
        all.refused.extend(shape.refused);
        all.n_damaged += shape.n_damaged;
    }
    Ok(all)
}

fn measured_shape(comparison: &Comparison, shape: &ShapeInput) -> MeasuredShape {
    let refused = |source: Option<String>, reason: String| MeasuredShape {
        rows: Vec::new(),
        refused: vec![RefusedShape {
            source: source.unwrap_or_else(|| comparison.reference.name().to_owned()),
            shape: shape.id.clone(),
            reason,
        }],
        n_damaged: 0,
    };
    match shape.carrier() {
        Err(error) => MeasuredShape {
            n_damaged: usize::from(is_damaged_carrier(&error)),
            ..refused(None, format!("{error:#}"))
        },
        Ok(carrier) => match comparison.measure(&carrier, &shape.source) {
            Ok(measured) => measured,
            Err(error) => refused(error.source, error.reason),
        },
    }
}

fn first_reason(refused: &[RefusedShape]) -> String {
    refused.first().map_or_else(String::new, |first| {
        format!("; `{}` on {}: {}", first.source, first.shape, first.reason)
    })
}

fn write_files(out: &Path, tables: &AgreementTables, rows: &[AgreementRow]) -> Result<()> {
    let lines: String = rows.iter().map(AgreementRow::to_csv).collect();
    let mut files = vec![
        ("agreement.md".to_owned(), tables.to_markdown()),
        ("agreement.csv".to_owned(), tables.to_csv()),
        ("agreement.json".to_owned(), tables.to_json()),
        ("curves.csv".to_owned(), tables.curves_csv()),
        ("shapes.csv".to_owned(), AgreementRow::csv_header() + &lines),
        ("refused.csv".to_owned(), tables.refused_csv()),
    ];
    for channel in &tables.settings.channels {
        let of_channel: Vec<_> = tables
            .tables
            .iter()
            .filter(|table| table.channel == *channel)
            .collect();
        let rows: Vec<_> = rows.iter().filter(|row| row.channel == *channel).collect();
        let figures = [
            ("complexity", complexity_svg(&of_channel)),
            ("distribution", distribution_svg(&of_channel, &rows)),
            ("counts", counts_svg(&of_channel, &rows)),
            ("distance", distance_svg(&of_channel)),
            ("thickness", thickness_svg(&of_channel)),
        ];
        files.extend(figures.map(|(name, svg)| (format!("{name}-{channel}.svg"), svg)));
    }
    files
        .iter()
        .try_for_each(|(name, text)| write_atomically(&out.join(name), text.as_bytes()))?;
    write_atomically(&out.join("shapes.jsonl"), &json_lines(rows)?)?;
    stderr::print_line(format_args!("{}: tables and figures", out.display()));
    Ok(())
}

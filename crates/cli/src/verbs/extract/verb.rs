//! Runs `partprobe extract`.

use super::compare::{InstanceReading, with_chord_of};
use crate::config;
use crate::counted::counted;
use crate::given_path::are_same_path;
use crate::label::step_text;
use crate::stderr;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_brep::{Extract, Numbering};
use partprobe_dataset::write_atomically;
use partprobe_verify::MeasureSettings;
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io::{self, Write as _};
use std::path::PathBuf;

/// The largest number of rows of a list. Longer lists end with the number of rows that are left out.
const MAX_ROWS: usize = 40;

/// Extract an entity, with all that it needs, from a large STEP file into a small one, to report a fault without sending the
/// large file.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe extract bracket.step '#123' -o small.step         a face, with the units of its file
  partprobe extract bracket.step '#123' '#140' -o small.step  two faces in one shell
  partprobe extract bracket.step '#77' -o -                   to stdout; the report goes to stderr

The small file contains everything that the entity refers to. For an edge, a curve or a surface, it contains the faces that use
it. Names, header and product are replaced by neutral ones; coordinates and the schema stay the same. Then both files are read,
and the verb says whether the faces have the same types, areas and reasons of lost entities in both. The exit code is 1 if they do
not.
Quote the numbers: a shell takes # for a comment.")]
pub(crate) struct ExtractArgs {
    /// The STEP file.
    file: PathBuf,
    /// Numbers of entities, such as '#123'.
    #[arg(required = true, value_name = "#N")]
    entities: Vec<String>,
    /// The file to write; - for stdout.
    #[arg(long, short = 'o', alias = "output", value_name = "STEP")]
    out: PathBuf,
    /// Keep the `#` numbers of the large file; if not given, instances are numbered from 1.
    #[arg(long)]
    keep_ids: bool,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example label.chord_fraction=0.001.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Writes the small file and reports whether it gives the same results as the large one.
///
/// # Errors
/// If the file cannot be read, has no such entity, or the small file gives other results. It is still written then.
pub(crate) fn extract(args: &ExtractArgs) -> Result<()> {
    let ids = args
        .entities
        .iter()
        .map(|entity| number(entity))
        .collect::<Result<Vec<u64>>>()?;
    let settings = config::load(&args.config, &args.set)?
        .config
        .label
        .measure_settings();
    let is_stdout = args.out.as_os_str() == "-";
    ensure!(
        is_stdout || !are_same_path(&args.file, &args.out),
        UsageError(format!(
            "{} is the file that is cut; choose another -o",
            args.out.display()
        ))
    );
    let max_bytes = settings.budget.max_bytes;
    let text = step_text(&args.file, max_bytes).with_context(|| args.file.display().to_string())?;
    let numbering = if args.keep_ids {
        Numbering::Kept
    } else {
        Numbering::FromOne
    };
    let small = partprobe_brep::extract(&text, &ids, numbering, &settings.budget)
        .with_context(|| args.file.display().to_string())?;
    if is_stdout {
        let mut out = io::stdout().lock();
        out.write_all(&small.text)
            .and_then(|()| out.flush())
            .context("writing to stdout")?;
    } else {
        write_atomically(&args.out, &small.text)?;
    }
    let comparison = Comparison::of(args, &ids, &text, &small, &settings);
    let report = comparison.report()?;
    let differences = comparison.differences();
    if is_stdout {
        stderr::print_line(report.trim_end())
    } else {
        print_line(report.trim_end())?
    }
    if !differences.is_empty() {
        bail!(
            "the extract does not show what the file shows: {}",
            differences.join("; ")
        );
    }
    Ok(())
}

/// The number of an entity, with or without its `#`.
fn number(entity: &str) -> Result<u64> {
    let digits = entity.strip_prefix('#').unwrap_or(entity);
    match digits.parse() {
        Ok(number) if digits.bytes().all(|byte| byte.is_ascii_digit()) => Ok(number),
        _ => bail!(UsageError(format!(
            "'{entity}' is not the number of an entity; write it as '#123', in quotes"
        ))),
    }
}

/// A small file and the large one from which it was cut.
struct Comparison<'a> {
    args: &'a ExtractArgs,
    ids: &'a [u64],
    small: &'a Extract,
    new_of: BTreeMap<u64, u64>,
    before: InstanceReading,
    after: InstanceReading,
    /// The chord fraction of the small file that gives the chords of the large one, if it is a different one.
    chord_fraction: Option<f64>,
}

impl<'a> Comparison<'a> {
    /// Measures both files.
    fn of(
        args: &'a ExtractArgs,
        ids: &'a [u64],
        text: &[u8],
        small: &'a Extract,
        settings: &MeasureSettings,
    ) -> Self {
        let new_of: BTreeMap<u64, u64> = small.numbers.iter().copied().collect();
        let old_of: BTreeMap<u64, u64> =
            small.numbers.iter().map(|&(old, new)| (new, old)).collect();
        let before =
            InstanceReading::of(text, settings, |id| new_of.contains_key(&id).then_some(id));
        let (at_chord, fraction) = with_chord_of(settings, &before, &small.text);
        let after = InstanceReading::of(&small.text, &at_chord, |id| old_of.get(&id).copied());
        let is_other =
            |fraction: &f64| (fraction / settings.options.chord_fraction - 1.0).abs() > 1e-6;
        Self {
            args,
            ids,
            small,
            new_of,
            before,
            after,
            chord_fraction: fraction.filter(is_other),
        }
    }

    /// The differences between the files.
    fn differences(&self) -> Vec<String> {
        self.before.differences(&self.after)
    }

    /// The number of an entity in the small file.
    fn new_number(&self, id: u64) -> u64 {
        self.new_of.get(&id).copied().unwrap_or_default()
    }

    fn write_cut(&self, report: &mut String) -> fmt::Result {
        let output = if self.args.out.as_os_str() == "-" {
            "stdout".to_owned()
        } else {
            self.args.out.display().to_string()
        };
        let instances = counted(self.small.n_instances, "instance", "instances");
        let faces = counted(self.after.faces.len(), "face", "faces");
        writeln!(report, "{output}: {instances}, {faces}")?;
        for &id in self.ids {
            let new = self.new_number(id);
            writeln!(report, "  #{id} is #{new} in the extract")?;
        }
        Ok(())
    }

    /// The faces with their areas in both files.
    fn write_faces(&self, report: &mut String) -> fmt::Result {
        for (id, (face_type, area)) in self.before.faces.iter().take(MAX_ROWS) {
            let new = self.new_number(*id);
            let there = self
                .after
                .faces
                .get(id)
                .map_or_else(|| "not read".to_owned(), |(_, area)| format!("{area:.6}"));
            writeln!(
                report,
                "  face #{id} (#{new}) {face_type}: area {area:.6} mm² in the file, {there} in the extract"
            )?;
        }
        let n_faces = self.before.faces.len();
        if n_faces > MAX_ROWS {
            writeln!(report, "  … and {} more faces", n_faces - MAX_ROWS)?;
        }
        Ok(())
    }

    /// Writes the lost, left-out and missing entities.
    fn write_absent(&self, report: &mut String) -> fmt::Result {
        let lost = self.before.lost.iter().filter(|(id, _)| **id > 0);
        for (id, reason) in lost.take(MAX_ROWS) {
            writeln!(report, "  lost in the file: #{id}: {reason}")?;
        }
        if self.small.n_left_out > 0 {
            writeln!(
                report,
                "  {} more faces use it and were left out; name them to have them",
                self.small.n_left_out
            )?;
        }
        for id in self.small.missing.iter().take(MAX_ROWS) {
            writeln!(
                report,
                "  #{id} is referred to, and the file does not have it"
            )?;
        }
        Ok(())
    }

    fn write_verdict(&self, report: &mut String) -> fmt::Result {
        if self.before.faces.is_empty() && self.after.faces.is_empty() {
            writeln!(
                report,
                "no face is read around it, neither in the file nor in the extract"
            )?;
        } else if self.differences().is_empty() {
            writeln!(report, "the extract shows what the file shows")?;
        }
        if let Some(fraction) = self.chord_fraction {
            writeln!(
                report,
                "measured with the chords of the file: --set label.chord_fraction={fraction:.6}"
            )?;
        }
        Ok(())
    }

    /// The report about the small file and the comparison.
    fn report(&self) -> Result<String, fmt::Error> {
        let mut report = String::new();
        self.write_cut(&mut report)?;
        self.write_faces(&mut report)?;
        self.write_absent(&mut report)?;
        self.write_verdict(&mut report)?;
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_with_and_without_their_sign() {
        assert_eq!((number("#12").unwrap(), number("7").unwrap()), (12, 7));
        for wrong in ["", "#", "#-1", "+3", "12a", "##1", "99999999999999999999"] {
            assert!(
                number(wrong).is_err_and(|error| error.is::<UsageError>()),
                "{wrong}"
            );
        }
    }
}

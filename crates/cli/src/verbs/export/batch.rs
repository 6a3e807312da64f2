//! Passes every shape through one writer, on several threads, in the requested order.

use super::folder::ExportFolder;
use super::shape_line::ShapeLine;
use crate::counted::counted;
use crate::damaged_carriers::refuse_damaged_carriers;
use crate::interrupt::Interrupt;
use crate::output_folder::is_output_error;
use crate::progress::Progress;
use crate::shape_input::{SHAPES_FILE, ShapeInput};
use crate::stderr;
use crate::stdout::print_line;
use anyhow::{Context, Result, anyhow, ensure};
use partprobe_carrier::Carrier;
use partprobe_dataset::json_lines;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The largest number of failures that are named on stderr. `shapes.jsonl` names all of them.
const MAX_WARNINGS: usize = 10;
/// The number of shapes that a thread processes before their results are taken.
const SHAPES_PER_THREAD: usize = 16;

/// The files of a shape: paths below the export, and bytes.
pub(super) type Files = Vec<(PathBuf, Vec<u8>)>;

/// The data that every export needs in addition to its shapes.
pub(super) struct Batch<'a> {
    pub(super) folder: &'a ExportFolder,
    pub(super) interrupt: &'a Interrupt,
    pub(super) n_threads: usize,
    /// The advice if the batch is stopped.
    pub(super) after_stop: &'static str,
    /// Whether a failed shape makes the call fail.
    pub(super) is_strict: bool,
}

impl Batch<'_> {
    /// Reads each carrier and returns the results of `work`, in the order of the shapes.
    ///
    /// # Errors
    /// If the user stops the batch, or something cannot be written. A shape that cannot be read is a result like any other.
    pub(super) fn map<T: Send>(
        &self,
        what: &str,
        shapes: &[&ShapeInput],
        work: impl Fn(&ShapeInput, &Carrier) -> Result<T> + Sync,
    ) -> Result<Vec<Result<T>>> {
        let mut all = Vec::with_capacity(shapes.len());
        self.for_each(what, shapes, work, |_, done| {
            all.push(done);
            Ok(())
        })?;
        Ok(all)
    }

    /// Reads each carrier and passes the result of `work` to `take`, in the order of the shapes. Only few results are in memory
    /// at a time.
    ///
    /// # Errors
    /// As for [`map`](Self::map), or if `take` fails.
    pub(super) fn for_each<T: Send>(
        &self,
        what: &str,
        shapes: &[&ShapeInput],
        work: impl Fn(&ShapeInput, &Carrier) -> Result<T> + Sync,
        mut take: impl FnMut(&ShapeInput, Result<T>) -> Result<()>,
    ) -> Result<()> {
        let bar = Progress::on_terminal().bar(what, shapes.len());
        let has_no_room = AtomicBool::new(false);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.n_threads)
            .build()
            .context("starting threads")?;
        let one = |shape: &&ShapeInput| {
            let goes_on = !self.interrupt.is_set() && !has_no_room.load(Ordering::Relaxed);
            let done = goes_on.then(|| work(shape, &shape.carrier()?));
            if let Some(Err(error)) = &done
                && is_output_error(error)
            {
                has_no_room.store(true, Ordering::Relaxed);
            }
            bar.inc(1);
            done
        };
        let mut n_done = 0;
        for chunk in shapes.chunks(self.n_threads * SHAPES_PER_THREAD) {
            let mut done: Vec<_> = pool.install(|| chunk.par_iter().map(one).collect());
            let has_broken = |done: &Option<Result<T>>| matches!(done, Some(Err(error)) if is_output_error(error));
            if let Some(position) = done.iter().position(has_broken)
                && let Some(Err(error)) = done.swap_remove(position)
            {
                return Err(self.incomplete(error));
            }
            for (shape, done) in chunk.iter().zip(done) {
                let Some(done) = done else {
                    return Err(self.stopped(n_done, shapes.len()));
                };
                take(shape, done)?;
                n_done += 1;
            }
        }
        bar.finish_and_clear();
        Ok(())
    }

    fn incomplete(&self, error: anyhow::Error) -> anyhow::Error {
        let out = self.folder.root().display();
        error.context(format!(
            "{out} is not complete; make room or choose another --out"
        ))
    }

    fn stopped(&self, n_done: usize, n_shapes: usize) -> anyhow::Error {
        let out = self.folder.root().display();
        anyhow!(
            "stopped after {n_done} of {}; {out} is not complete, {}",
            counted(n_shapes, "shape", "shapes"),
            self.after_stop
        )
    }

    /// Writes the files that `files_of` makes for each shape, and returns one line per shape.
    pub(super) fn write(
        &self,
        shapes: &[&ShapeInput],
        files_of: impl Fn(&ShapeInput, &Carrier) -> Result<Files> + Sync,
    ) -> Result<Vec<ShapeLine>> {
        self.write_missing(shapes, |_, _| None, files_of)
    }

    /// Like [`write`](Self::write), but shapes for which `finished` knows the files are not processed again.
    pub(super) fn write_missing(
        &self,
        shapes: &[&ShapeInput],
        finished: impl Fn(&ShapeInput, &Carrier) -> Option<Vec<PathBuf>> + Sync,
        files_of: impl Fn(&ShapeInput, &Carrier) -> Result<Files> + Sync,
    ) -> Result<Vec<ShapeLine>> {
        let done = self.map("export", shapes, |shape, carrier| {
            if let Some(paths) = finished(shape, carrier) {
                return Ok(paths.iter().map(|path| portable(path)).collect());
            }
            let mut names = Vec::new();
            for (path, bytes) in files_of(shape, carrier)? {
                self.folder.write(&path, &bytes)?;
                names.push(portable(&path));
            }
            Ok(names)
        })?;
        let line = |(shape, done): (&&ShapeInput, Result<Vec<String>>)| match done {
            Ok(names) => ShapeLine::written(shape, names),
            Err(error) => ShapeLine::failed(shape, &error),
        };
        Ok(shapes.iter().zip(done).map(line).collect())
    }

    /// Writes `shapes.jsonl`, names the failed shapes, and prints a summary.
    ///
    /// # Errors
    /// If no shape was written, a carrier is not the one that was labeled, or with `--strict` any shape failed.
    pub(super) fn conclude(&self, lines: &[ShapeLine]) -> Result<()> {
        self.folder
            .write(Path::new(SHAPES_FILE), &json_lines(lines)?)?;
        let failed: Vec<&ShapeLine> = lines.iter().filter(|line| line.reason.is_some()).collect();
        for line in failed.iter().take(MAX_WARNINGS) {
            let reason = line.reason.as_deref().unwrap_or_default();
            stderr::print_line(format_args!("warning: {}: {reason}", line.id));
        }
        if failed.len() > MAX_WARNINGS {
            stderr::print_line(format_args!(
                "warning: and {} more, see {SHAPES_FILE}",
                failed.len() - MAX_WARNINGS
            ));
        }
        // Shapes may share a file.
        let files: BTreeSet<&String> = lines.iter().flat_map(|line| &line.files).collect();
        let n_files = files.len();
        let n_written = lines.iter().filter(|line| !line.files.is_empty()).count();
        let out = self.folder.root().display();
        let (shapes, files) = (
            counted(n_written, "shape", "shapes"),
            counted(n_files, "file", "files"),
        );
        print_line(format_args!(
            "{out}: {shapes} in {files}, {} failed",
            failed.len()
        ))?;
        ensure!(
            n_written > 0,
            "no shape could be written; the lines above say why"
        );
        ensure!(
            !self.is_strict || failed.is_empty(),
            "--strict: {} failed; the others are written",
            counted(failed.len(), "file or shape", "files or shapes")
        );
        refuse_damaged_carriers(lines.iter().filter(|line| line.is_damaged).count())
    }
}

/// The path with `/` on any system.
pub(super) fn portable(path: &Path) -> String {
    path.iter()
        .map(|part| part.to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
}

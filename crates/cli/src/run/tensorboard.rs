//! Writes the curves of a training for TensorBoard: one event file per start of the program.

use super::folder::RunFolder;
use anyhow::{Context, Result};
use partprobe_formats::{TensorboardEvent, tensorboard_record};
use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// An event file that is written record by record, so that TensorBoard immediately shows each step.
pub(super) struct EventFile {
    path: PathBuf,
    file: File,
}

impl EventFile {
    /// Makes a new file in a folder of the run. Values in earlier files for steps from `first_step` on no longer count.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub(super) fn open(folder: &RunFolder, relative: &str, first_step: usize) -> Result<Self> {
        let parent = folder.path(relative);
        fs::create_dir_all(&parent).with_context(|| format!("making {}", parent.display()))?;
        let name = format!(
            "events.out.tfevents.{:010.0}.partprobe.{}",
            seconds_since_1970(),
            std::process::id()
        );
        let path = parent.join(name);
        let file = File::create(&path).with_context(|| format!("making {}", path.display()))?;
        let mut curves = Self { path, file };
        curves.put(&TensorboardEvent::FileVersion)?;
        curves.put(&TensorboardEvent::Start {
            step: first_step as u64,
        })?;
        Ok(curves)
    }

    /// Adds a point to each curve.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn draw(&mut self, step: usize, values: &[(&str, f64)]) -> Result<()> {
        let values: Vec<(&str, f32)> = values
            .iter()
            .map(|&(tag, value)| (tag, value as f32))
            .collect();
        self.put(&TensorboardEvent::Scalars {
            step: step as u64,
            values: &values,
        })
    }

    fn put(&mut self, event: &TensorboardEvent) -> Result<()> {
        let record = tensorboard_record(seconds_since_1970(), event);
        self.file
            .write_all(&record)
            .with_context(|| format!("writing {}", self.path.display()))
    }
}

fn seconds_since_1970() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |elapsed| elapsed.as_secs_f64())
}

//! Defines a job: its inputs, its settings, and the use of a data set that already exists in the folder.

use super::released::ReleasedLabels;
use super::shard::Shard;
use crate::config::Config;
use partprobe_dataset::Status;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The use of a data set that already exists in the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum ExistingDataset {
    /// The job is refused.
    Refused,
    /// It is removed.
    Replaced,
    /// It is resumed, if settings and inputs are the same.
    Resumed,
    /// It is resumed, and files with one of these outcomes are labeled again. Budgets may be larger.
    Retried(Vec<Status>),
}

/// The inputs, the settings and the output folder.
#[derive(Clone, Debug)]
pub(crate) struct LabelJob {
    pub(super) paths: Vec<PathBuf>,
    /// Files that are always read as lists of paths.
    pub(super) lists: Vec<PathBuf>,
    pub(super) out: PathBuf,
    pub(super) config: Config,
    pub(super) n_workers: usize,
    pub(super) shard: Option<Shard>,
    pub(super) existing: ExistingDataset,
    /// The labels that the files must have, if they were released.
    pub(super) released: Option<Arc<ReleasedLabels>>,
}

impl LabelJob {
    /// A job that labels these paths into a new or empty folder.
    #[must_use]
    pub(crate) fn in_folder(
        paths: &[PathBuf],
        out: &Path,
        config: &Config,
        n_workers: usize,
    ) -> Self {
        Self {
            paths: paths.to_vec(),
            lists: Vec::new(),
            out: out.to_owned(),
            config: config.clone(),
            n_workers: n_workers.max(1),
            shard: None,
            existing: ExistingDataset::Refused,
            released: None,
        }
    }

    /// The same job, with the files that these lists name.
    #[must_use]
    pub(crate) fn with_lists(self, lists: &[PathBuf]) -> Self {
        Self {
            lists: lists.to_vec(),
            ..self
        }
    }

    /// The same job, only for files of a package, which must get the labels of the package.
    #[must_use]
    pub(crate) fn with_released(self, released: &Arc<ReleasedLabels>) -> Self {
        Self {
            released: Some(Arc::clone(released)),
            ..self
        }
    }

    /// The same job, for one share of the files.
    #[must_use]
    pub(crate) fn of_shard(self, shard: Option<Shard>) -> Self {
        Self { shard, ..self }
    }

    /// The same job, which removes the existing data set in the folder once its own files are known.
    #[must_use]
    pub(crate) fn replacing(self) -> Self {
        Self {
            existing: ExistingDataset::Replaced,
            ..self
        }
    }

    /// The same job, which resumes the data set in the folder, or begins a new one if there is none.
    #[must_use]
    pub(crate) fn resuming(self) -> Self {
        Self {
            existing: ExistingDataset::Resumed,
            ..self
        }
    }

    /// The same job, which also labels again the files with one of these outcomes.
    #[must_use]
    pub(crate) fn retrying(self, outcomes: &[Status]) -> Self {
        Self {
            existing: ExistingDataset::Retried(outcomes.to_vec()),
            ..self
        }
    }
}

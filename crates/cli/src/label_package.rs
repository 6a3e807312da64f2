//! Opens packages of released labels. Every file is compared with its hash before it is read.

use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_carrier::sha256_hex;
use partprobe_dataset::is_plain_name;
use partprobe_release::{
    MANIFEST_FILE, Manifest, ReleasedRow, ReleasedShape, rows_from_parquet, shapes_from_parquet,
};
use partprobe_tables::ShapeLabels;
use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A package whose `release.json` was read.
#[derive(Debug)]
pub(crate) struct LabelPackage {
    root: PathBuf,
    pub(crate) manifest: Manifest,
    /// The hash of `release.json`, which contains the hashes of all other files.
    pub(crate) sha256: String,
    /// The rows of the file with labels that was read last, and its number. Consecutive requests are mostly for shapes of the
    /// same file.
    last_rows: Mutex<Option<(usize, Arc<Vec<ReleasedRow>>)>>,
}

/// A shape of a package, and the row of its labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PackagedShape {
    pub(crate) shape: ReleasedShape,
    /// The index of the file with its labels.
    file: usize,
    /// The row in this file.
    row: usize,
}

impl LabelPackage {
    /// Reads `release.json`.
    ///
    /// # Errors
    /// If the folder is not a package, or one of a later version.
    pub(crate) fn open(root: &Path) -> Result<Self> {
        let path = root.join(MANIFEST_FILE);
        let bytes = match fs::read(&path) {
            Err(error)
                if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) =>
            {
                bail!(UsageError(format!(
                    "{} is not a package of released labels; make one with `partprobe release`",
                    root.display()
                )))
            }
            read => read.with_context(|| format!("reading {}", path.display()))?,
        };
        let manifest = Manifest::parse(&bytes).with_context(|| path.display().to_string())?;
        Ok(Self {
            root: root.to_owned(),
            manifest,
            sha256: sha256_hex(&bytes),
            last_rows: Mutex::new(None),
        })
    }

    /// The folder.
    #[must_use]
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Compares the files without labels with the hashes in `release.json`. Those with labels are compared when they are read.
    ///
    /// # Errors
    /// If a file is missing, damaged or changed.
    pub(crate) fn check_files_without_labels(&self) -> Result<()> {
        let with_labels: BTreeSet<&str> = self.manifest.labels_files().collect();
        let names = self.manifest.files.keys();
        let mut others = names.filter(|name| !with_labels.contains(name.as_str()));
        others.try_for_each(|name| self.bytes(name).map(drop))
    }

    /// All shapes, without their labels.
    ///
    /// # Errors
    /// If a file is missing, damaged or changed, or a shape has an id that cannot be the name of a file.
    pub(crate) fn shapes(&self) -> Result<Vec<PackagedShape>> {
        let mut all = Vec::new();
        for (file, name) in self.manifest.labels_files().enumerate() {
            let path = self.root.join(name);
            let shapes = shapes_from_parquet(self.bytes(name)?)
                .with_context(|| path.display().to_string())?;
            for (row, shape) in shapes.into_iter().enumerate() {
                ensure!(
                    is_plain_name(&shape.file_id),
                    "{}, row {row}: the id `{}` is not a file name",
                    path.display(),
                    shape.file_id
                );
                all.push(PackagedShape { shape, file, row });
            }
        }
        Ok(all)
    }

    /// The labels of a shape, or `None` if it has none.
    ///
    /// # Errors
    /// If the file is missing, damaged or changed.
    pub(crate) fn labels(&self, shape: &PackagedShape) -> Result<Option<ShapeLabels>> {
        let rows = self.rows(shape.file)?;
        Ok(rows.get(shape.row).and_then(|row| row.labels.clone()))
    }

    /// The rows of a file with labels.
    fn rows(&self, file: usize) -> Result<Arc<Vec<ReleasedRow>>> {
        let mut last = self
            .last_rows
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some((number, rows)) = &*last
            && *number == file
        {
            return Ok(Arc::clone(rows));
        }
        let name = self.manifest.labels_files().nth(file);
        let name = name.context("the package has fewer files with labels than it had")?;
        let rows = rows_from_parquet(self.bytes(name)?)
            .with_context(|| self.root.join(name).display().to_string())?;
        let rows = Arc::new(rows);
        *last = Some((file, Arc::clone(&rows)));
        Ok(rows)
    }

    fn bytes(&self, name: &str) -> Result<Vec<u8>> {
        let path = self.root.join(name);
        let bytes = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
        self.manifest
            .check_file(name, &bytes)
            .with_context(|| self.root.display().to_string())?;
        Ok(bytes)
    }
}

//! Defines `release.json`: the content of a package, its labeling settings, and the hash of each of its files.

use partprobe_carrier::sha256_hex;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The file of a package that names all others. It is written last, so a folder that has it is a complete package.
pub const MANIFEST_FILE: &str = "release.json";
/// The file that describes the content of a package in sentences.
pub const DATASHEET_FILE: &str = "DATASHEET.md";
/// The file that names the owners of the labels and the geometry.
pub const LICENSE_NOTE_FILE: &str = "LICENSE-NOTE.md";
/// The version of packages that this crate writes.
pub const PACKAGE_VERSION: u32 = 1;

/// The name of a file with labels, by its number.
#[must_use]
pub fn labels_file(number: usize) -> String {
    format!("labels-{number:05}.parquet")
}

/// The content of `release.json`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Manifest {
    /// The version of the package.
    pub format_version: u32,
    /// The version of the program that made the labels.
    pub program_version: String,
    /// The commit of the program that made the package, if it is known.
    pub commit: Option<String>,
    /// Whether names of files are left out.
    pub is_anonymous: bool,
    /// The license of the labels, if the releaser has named one.
    pub license: Option<String>,
    /// The hash of the settings that determine the carriers.
    pub settings_sha256: String,
    /// The settings with which the files were labeled.
    pub settings: Value,
    /// The label sources whose labels are stored next to the parts.
    pub layers: Vec<String>,
    /// The counts of the package.
    pub counts: Counts,
    /// Each other file of the package, by name.
    pub files: BTreeMap<String, FileFacts>,
}

/// The content of a package in numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct Counts {
    /// Files with labels.
    pub n_files: u64,
    /// Shapes with labels.
    pub n_shapes: u64,
    /// Faces of these shapes.
    pub n_faces: u64,
    /// Their shared edges.
    pub n_edges: u64,
    /// Shared edges without a defined angle.
    pub n_undefined_angles: u64,
    /// Parts before small ones were absorbed.
    pub n_parts: u64,
    /// Parts after small ones were absorbed.
    pub n_labels: u64,
    /// Faces of each primitive type.
    pub faces_by_type: BTreeMap<String, u64>,
    /// Files and solids that are in the package with their hash but without labels, by status.
    pub without_labels: BTreeMap<String, u64>,
    /// Files and shapes that are not in the package at all, by reason.
    pub left_out: BTreeMap<String, u64>,
}

/// A file of a package.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct FileFacts {
    /// Its size.
    pub bytes: u64,
    /// Its SHA-256, in hexadecimal.
    pub sha256: String,
}

impl FileFacts {
    /// The facts of a file with these bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self {
            bytes: bytes.len() as u64,
            sha256: sha256_hex(bytes),
        }
    }
}

/// The reason why a package cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ManifestError {
    /// `release.json` is not that of a package.
    #[error("`release.json` is not that of a package of released labels")]
    Json(#[from] serde_json::Error),
    /// A later program has written the package.
    #[error(
        "the package has format version {found}, and this program reads {PACKAGE_VERSION}; use a newer partprobe"
    )]
    Version {
        /// The version of the package.
        found: u32,
    },
    /// The package has a file that is not named in it, or names no file with labels.
    #[error("`release.json` does not name `{0}`")]
    Unnamed(String),
    /// A file is not the one that was released.
    #[error("`{0}` is not the file that was released: its SHA-256 differs; get the package again")]
    Changed(String),
}

impl Manifest {
    /// Reads `release.json`.
    ///
    /// # Errors
    /// If it is not that of a package, or of a later version.
    pub fn parse(bytes: &[u8]) -> Result<Self, ManifestError> {
        let manifest: Self = serde_json::from_slice(bytes)?;
        if manifest.format_version != PACKAGE_VERSION {
            return Err(ManifestError::Version {
                found: manifest.format_version,
            });
        }
        Ok(manifest)
    }

    /// The names of the files with labels, in their order.
    pub fn labels_files(&self) -> impl Iterator<Item = &str> {
        let names = self.files.keys().map(String::as_str);
        names.filter(|name| {
            let number = name.strip_prefix("labels-");
            number
                .and_then(|rest| rest.strip_suffix(".parquet"))
                .is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
        })
    }

    /// Compares a file of the package with what was released.
    ///
    /// # Errors
    /// If the file is not named, or has another size or hash.
    pub fn check_file(&self, name: &str, bytes: &[u8]) -> Result<(), ManifestError> {
        let facts = self
            .files
            .get(name)
            .ok_or_else(|| ManifestError::Unnamed(name.to_owned()))?;
        if *facts == FileFacts::of(bytes) {
            Ok(())
        } else {
            Err(ManifestError::Changed(name.to_owned()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest() -> Manifest {
        let file = |name: &str| (name.to_owned(), FileFacts::of(name.as_bytes()));
        Manifest {
            format_version: PACKAGE_VERSION,
            program_version: "0.1.0".to_owned(),
            commit: None,
            is_anonymous: false,
            license: None,
            settings_sha256: "ab".to_owned(),
            settings: serde_json::json!({ "label": { "theta_deg": 8.0 } }),
            layers: Vec::new(),
            counts: Counts::default(),
            files: [
                file("labels-00000.parquet"),
                file("labels-x/../a.parquet"),
                file("a.md"),
            ]
            .into(),
        }
    }

    #[test]
    fn a_changed_file_is_named() {
        let manifest = manifest();
        assert!(manifest.check_file("a.md", b"a.md").is_ok());
        let message = |name, bytes| manifest.check_file(name, bytes).unwrap_err().to_string();
        assert!(message("a.md", b"b").starts_with("`a.md` is not the file that was released"));
        assert_eq!(message("b.md", b""), "`release.json` does not name `b.md`");
    }

    #[test]
    fn only_plain_names_are_files_with_labels() {
        let manifest = manifest();
        let names: Vec<&str> = manifest.labels_files().collect();
        assert_eq!(names, [labels_file(0)]);
    }

    #[test]
    fn other_json_and_other_versions_are_refused() {
        let text = serde_json::to_vec(&manifest()).unwrap();
        assert_eq!(Manifest::parse(&text).unwrap(), manifest());
        let later = Manifest {
            format_version: 2,
            ..manifest()
        };
        let later = serde_json::to_vec(&later).unwrap();
        assert!(matches!(
            Manifest::parse(&later),
            Err(ManifestError::Version { found: 2 })
        ));
        assert!(matches!(
            Manifest::parse(b"{}"),
            Err(ManifestError::Json(_))
        ));
    }
}

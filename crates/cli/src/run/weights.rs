//! Reads and writes the weights of a trained backbone in a run folder. No other code does.
//!
//! The training records a hash of the file in the same folder, and every reader of the file compares it. So weights that were
//! changed, exchanged or damaged after the training are refused with their name.

use super::folder::RunFolder;
use super::training_job::TrainingRecord;
use crate::stderr;
use anyhow::{Result, bail};
use partprobe_carrier::sha256_hex;
use std::sync::Once;

/// The path of the evaluated weights.
pub(crate) fn weights_path(supervision: &str, seed: u64) -> String {
    format!("checkpoints/{supervision}-{seed}/model.safetensors")
}

/// The bytes of a backbone's weights. They are checked to be those that its training wrote.
///
/// A run of an earlier version has no hash of them. Then there is one warning.
///
/// # Errors
/// If the file cannot be read, or its hash is not the one that the training recorded.
pub(crate) fn read_weights(folder: &RunFolder, supervision: &str, seed: u64) -> Result<Vec<u8>> {
    static WARNED: Once = Once::new();
    let relative = weights_path(supervision, seed);
    let bytes = folder.read(&relative)?;
    let path = folder.path(&relative);
    let record = TrainingRecord::read(folder, supervision, seed)?;
    let Some(noted) = record.and_then(|record| record.weights_sha256) else {
        WARNED.call_once(|| {
            stderr::print_line(format_args!(
                "warning: an earlier version of partprobe trained {} and noted no hash of it, so a later change of the \
                 file would not be noticed",
                path.display()
            ));
        });
        return Ok(bytes);
    };
    let found = sha256_hex(&bytes);
    if found != noted {
        bail!(
            "{} was changed after its training ended: its SHA-256 is {found}, and training.json in the same folder says {noted}; \
             put the file back, or remove it and train again with --resume",
            path.display()
        );
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

    /// Reads weights with these bytes, if the record has this hash.
    #[track_caller]
    fn check(bytes: &[u8], noted: Option<&str>, expected: Result<(), &str>) {
        let root = tempfile::tempdir().unwrap();
        let folder =
            RunFolder::open(root.path(), &load("smoke", &[]).unwrap().merged, false).unwrap();
        let record = serde_json::json!({
            "format_version": 1, "steps": 2, "stopped_early": false, "best": null, "untouched_tensors": [],
            "weights_sha256": noted,
        });
        folder
            .write_json("checkpoints/p-0/training.json", &record)
            .unwrap();
        folder
            .write("checkpoints/p-0/model.safetensors", bytes)
            .unwrap();
        match (read_weights(&folder, "p", 0), expected) {
            (Ok(read), Ok(())) => assert_eq!(read, bytes),
            (Err(error), Err(expected)) => assert!(error.to_string().contains(expected), "{error}"),
            (read, expected) => panic!("{read:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn only_the_weights_of_the_training_are_read() {
        let hash = sha256_hex(b"weights");
        check(b"weights", Some(&hash), Ok(()));
        check(b"weights", None, Ok(()));
        for changed in [&b"weightz"[..], b"weight", b"", b"weights "] {
            check(
                changed,
                Some(&hash),
                Err("p-0/model.safetensors was changed after its training ended"),
            );
        }
    }
}

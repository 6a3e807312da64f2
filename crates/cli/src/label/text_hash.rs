//! Hashes an input, so that it can be recognized later: the STEP text of a file, from any container, or the bytes of a mesh or a
//! cloud and of its labels.

use super::input_bytes::InputBytes;
use super::step_text::unpacked;
use partprobe_carrier::sha256_hex;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// The hash of a file's text. Returns `None` if it cannot be read, or is larger than `max_bytes`.
pub(super) fn hash_of_file(path: &Path, max_bytes: u64) -> Option<String> {
    guarded(|| Some(InputBytes::of_path(path, max_bytes).ok()?.sha256()))
}

/// The same for the bytes of an archive's member.
pub(super) fn hash_of_member(bytes: Vec<u8>, max_bytes: u64) -> Option<String> {
    guarded(|| Some(sha256_hex(&unpacked(bytes, max_bytes).ok()?)))
}

/// Catches a panic of a decoder, so only the hash of one file is lost. Elsewhere, decoders run in a worker, but not here.
fn guarded(hash: impl FnOnce() -> Option<String>) -> Option<String> {
    catch_unwind(AssertUnwindSafe(hash)).ok().flatten()
}

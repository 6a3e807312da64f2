//! The hash by which a text is known again: SHA-256 of the STEP text, out of whatever it is packed in.

use super::step_text::{step_text, unpacked};
use sha2::{Digest, Sha256};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// The hash of a text, in hexadecimal.
pub(super) fn hash_of_text(text: &[u8]) -> String {
    Sha256::digest(text)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// The hash of a file's text; `None` if it cannot be read, or is larger than `max_bytes`.
pub(super) fn hash_of_file(path: &Path, max_bytes: u64) -> Option<String> {
    guarded(|| Some(hash_of_text(&step_text(path, max_bytes).ok()?)))
}

/// The same for the bytes of an archive's member.
pub(super) fn hash_of_member(bytes: Vec<u8>, max_bytes: u64) -> Option<String> {
    guarded(|| Some(hash_of_text(&unpacked(bytes, max_bytes).ok()?)))
}

/// A decoder that panics costs the hash of one file. Elsewhere it runs in a worker, and here it does not.
fn guarded(hash: impl FnOnce() -> Option<String>) -> Option<String> {
    catch_unwind(AssertUnwindSafe(hash)).ok().flatten()
}

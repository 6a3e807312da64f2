//! Writes paths as bytes for pipes, and as text for the index, because names need not be UTF-8.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

/// The text of a file name, see [`partprobe_formats::text_of_name`].
pub(super) fn name_text(name: &OsStr) -> String {
    partprobe_formats::text_of_name(&bytes_of(name))
}

/// The bytes of a path.
pub(super) fn path_bytes(path: &Path) -> Vec<u8> {
    bytes_of(path.as_os_str())
}

/// The path that has these bytes.
pub(super) fn path_of_bytes(bytes: &[u8]) -> PathBuf {
    PathBuf::from(name_of(bytes))
}

#[cfg(unix)]
fn bytes_of(name: &OsStr) -> Vec<u8> {
    use std::os::unix::ffi::OsStrExt;
    name.as_bytes().to_vec()
}

#[cfg(unix)]
fn name_of(bytes: &[u8]) -> OsString {
    use std::os::unix::ffi::OsStrExt;
    OsStr::from_bytes(bytes).to_owned()
}

#[cfg(not(unix))]
fn bytes_of(name: &OsStr) -> Vec<u8> {
    name.to_string_lossy().into_owned().into_bytes()
}

#[cfg(not(unix))]
fn name_of(bytes: &[u8]) -> OsString {
    OsString::from(String::from_utf8_lossy(bytes).into_owned())
}

//! JSON and JSON lines as bytes.

use anyhow::Result;
use serde::Serialize;

/// One object a line, in the order given.
///
/// # Errors
/// If a row cannot be written as JSON.
pub fn json_lines<T: Serialize>(rows: impl IntoIterator<Item = T>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    for row in rows {
        serde_json::to_writer(&mut bytes, &row)?;
        bytes.push(b'\n');
    }
    Ok(bytes)
}

/// One indented object, with a line end.
///
/// # Errors
/// If the value cannot be written as JSON.
pub fn json_document(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

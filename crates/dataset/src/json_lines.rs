//! Writes values as the bytes of JSON and JSON lines.

use serde::Serialize;

/// One object per line, in the order given.
///
/// # Errors
/// If a row cannot be written as JSON.
pub fn json_lines<T: Serialize>(rows: impl IntoIterator<Item = T>) -> serde_json::Result<Vec<u8>> {
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
pub fn json_document(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

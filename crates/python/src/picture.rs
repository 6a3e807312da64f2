//! Draws carriers as PNG files.

use crate::background::compute;
use crate::errors::usage;
use partprobe_carrier::Carrier;
use partprobe_render::PictureStyle;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;

/// The allowed sides of a picture, in pixels.
const SIZES: std::ops::RangeInclusive<usize> = 16..=8192;

/// The bytes of the picture of a carrier.
///
/// # Errors
/// `UsageError` if the label or the size is not possible, or the carrier is a cloud.
pub(crate) fn png<'py>(
    py: Python<'py>,
    carrier: &Arc<Carrier>,
    label: &str,
    size: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    if !SIZES.contains(&size) {
        return Err(usage(format!(
            "size must be from {} to {} pixels, not {size}",
            SIZES.start(),
            SIZES.end()
        )));
    }
    let Ok(label) = label.parse();
    let style = PictureStyle {
        label,
        size,
        ..PictureStyle::default()
    };
    let carrier = carrier.clone();
    let picture = compute(py, move || style.picture(&carrier))?.map_err(usage)?;
    let bytes = compute(py, move || picture.to_png())?.map_err(usage)?;
    Ok(PyBytes::new(py, &bytes))
}

//! Makes the files that are written for a shape: its carrier, only its labels, or its sampled points.

use super::protocol::{EmittedFile, WorkerSettings};
use crate::config::Emit;
use crate::points::{default_sources, sample_npz};
use anyhow::Result;
use partprobe_carrier::Carrier;
use partprobe_dataset::IndexEntry;
use partprobe_formats::{Compression, carrier_file, labels_to_npz};

/// The bytes of every file that the settings request, in their order. The shape's entry gets the hash of its carrier.
pub(super) fn emitted(
    carrier: &Carrier,
    settings: &WorkerSettings,
    entry: &mut IndexEntry,
) -> Result<Vec<EmittedFile>> {
    let compression = if settings.label.compress {
        Compression::Deflated
    } else {
        Compression::Stored
    };
    let file = |&emit: &Emit| {
        let bytes = match emit {
            Emit::Carrier => {
                let file = carrier_file(carrier, compression)?;
                entry.content_hash = Some(file.content_hash.to_string());
                file.bytes
            }
            Emit::Labels => labels_to_npz(carrier, compression)?,
            Emit::Points => sample_npz(
                carrier,
                &settings.sample,
                default_sources(carrier),
                compression,
            )?,
        };
        Ok(EmittedFile { emit, bytes })
    };
    settings.label.emit.iter().map(file).collect()
}

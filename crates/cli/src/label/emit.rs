//! The files that are written for a shape: its carrier, its labels alone, its sampled points.

use super::worker::{Emitted, WorkerSettings};
use crate::config::Emit;
use crate::sample::{DEFAULT_SOURCES, sample_npz};
use anyhow::Result;
use carrier::Carrier;
use formats::{Compression, carrier_to_npz, labels_to_npz};

/// The bytes of every file that the settings ask for, in their order.
pub(super) fn emitted(carrier: &Carrier, settings: &WorkerSettings) -> Result<Vec<Emitted>> {
    let compression = if settings.label.compress { Compression::Deflated } else { Compression::Stored };
    let file = |&emit: &Emit| {
        let bytes = match emit {
            Emit::Carrier => carrier_to_npz(carrier, compression)?,
            Emit::Labels => labels_to_npz(carrier, compression)?,
            Emit::Points => sample_npz(carrier, &settings.sample, &DEFAULT_SOURCES, compression)?,
        };
        Ok(Emitted { emit, bytes })
    };
    settings.label.emit.iter().map(file).collect()
}

//! Keeps the surfaces of a file, so that each is read once for all faces and edges of a root.

use super::error::{EntityError, Problem};
use super::memo::Memo;
use super::space::Reader;
use super::surfaces::TypedSurface;
use crate::geometry::Surface;
use partprobe_shape::FaceType;
use std::sync::Arc;

/// A surface that several faces may share.
#[derive(Clone)]
pub(super) struct SharedSurface {
    pub(super) surface: Arc<Surface>,
    pub(super) face_type: FaceType,
    /// False if the surface that the file names has the opposite normal.
    pub(super) same_sense: bool,
}

/// Surfaces, and the instances from which they were read.
pub(super) struct SurfaceTable {
    memo: Memo,
    list: Vec<SharedSurface>,
}

impl SurfaceTable {
    /// An empty table for a file of `n_records` instances.
    pub(super) fn new(n_records: usize) -> Self {
        Self {
            memo: Memo::new(n_records),
            list: Vec::new(),
        }
    }

    /// The surface of an instance, read for a root.
    pub(super) fn surface(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        id: u64,
    ) -> Result<SharedSurface, EntityError> {
        let slot = reader
            .source
            .exchange
            .slot(id)
            .ok_or_else(|| EntityError::from(Problem::Missing).within(id))?;
        if let Some(index) = self.memo.index(root, slot) {
            return Ok(self.list[index as usize].clone());
        }
        let TypedSurface {
            surface,
            face_type,
            same_sense,
        } = reader.surface(id, 0)?;
        let shared = SharedSurface {
            surface: Arc::new(surface),
            face_type,
            same_sense,
        };
        self.memo.remember(root, slot, self.list.len() as u32);
        self.list.push(shared.clone());
        Ok(shared)
    }
}

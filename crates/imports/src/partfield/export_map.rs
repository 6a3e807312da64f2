//! Reads the map of `partprobe export partfield-input`: the name of each shape, its pose, and the parents of its triangles.

use crate::import::{ImportError, JoinProblem};
use partprobe_carrier::{Mesh, Point};
use partprobe_formats::{PARTFIELD_MAP_FILE, PartFieldMap, PartFieldShape, Values, array_from_npy};
use partprobe_sources::SourceFiles;
use std::sync::Arc;

/// An export whose map was read.
pub(super) struct ExportMap {
    root: String,
    map: PartFieldMap,
    files: Arc<dyn SourceFiles>,
}

/// A shape of the export.
pub(super) struct ExportedShape<'a> {
    /// Its name in PartField's files.
    pub(super) name: &'a str,
    shape: &'a PartFieldShape,
}

impl ExportMap {
    /// The map in a folder that the export wrote.
    ///
    /// # Errors
    /// If it does not exist, or cannot be read.
    pub(super) fn open(folder: &str, files: Arc<dyn SourceFiles>) -> Result<Self, ImportError> {
        let root = folder.trim_end_matches('/').to_owned();
        let path = format!("{root}/{PARTFIELD_MAP_FILE}");
        let unreadable = |reason: String| ImportError::Unreadable(reason);
        let bytes = files
            .read(&path)
            .map_err(|error| unreadable(error.to_string()))?;
        let map = PartFieldMap::from_json(&bytes)
            .map_err(|error| unreadable(format!("{path}: {error}")))?;
        Ok(Self { root, map, files })
    }

    /// The shape with this id.
    ///
    /// # Errors
    /// If it was not exported.
    pub(super) fn shape(&self, id: &str) -> Result<ExportedShape<'_>, JoinProblem> {
        let (name, shape) = self.map.shape(id).ok_or(JoinProblem::NoLabels)?;
        Ok(ExportedShape { name, shape })
    }

    /// The bytes of the file with the parents: for each triangle of the mesh, the triangle of the carrier that contains it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(super) fn parents_file(&self, shape: &ExportedShape<'_>) -> Result<Vec<u8>, JoinProblem> {
        let path = format!("{}/{}", self.root, shape.shape.parents);
        self.files
            .read(&path)
            .map_err(|error| JoinProblem::Unreadable(error.to_string()))
    }
}

impl ExportedShape<'_> {
    /// The parent of each triangle.
    ///
    /// # Errors
    /// If the bytes are not an array of whole numbers that are not negative.
    pub(super) fn parents(&self, bytes: &[u8]) -> Result<Vec<u32>, JoinProblem> {
        let unreadable =
            |reason: String| JoinProblem::Unreadable(format!("{}: {reason}", self.shape.parents));
        let array = array_from_npy(bytes).map_err(|error| unreadable(error.to_string()))?;
        match array.into_values() {
            Values::U32(parents) => Ok(parents),
            other => Err(unreadable(format!(
                "an array of {} is not one triangle number per triangle",
                other.type_name()
            ))),
        }
    }

    /// The mesh that PartField wrote, in millimeters and in the position of the carrier.
    pub(super) fn in_carrier_position(&self, mesh: &Mesh) -> Mesh {
        let PartFieldShape { center, scale, .. } = self.shape;
        let placed =
            |vertex: &Point| std::array::from_fn(|axis| vertex[axis] / scale + center[axis]);
        Mesh {
            vertices: mesh.vertices.iter().map(placed).collect(),
            ..mesh.clone()
        }
    }
}

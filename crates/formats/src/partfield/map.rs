//! Defines the map of an export for PartField: the shape of each name, and the original pose of the shape.

use crate::format_version::FORMAT_VERSION;
use partprobe_carrier::Point;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The name of the file with the map.
pub const PARTFIELD_MAP_FILE: &str = "map.json";

/// Maps the names in PartField's results to shapes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct PartFieldMap {
    /// The version of the file format.
    pub format_version: u32,
    /// The unit of the exported positions: always `mm`.
    pub unit: String,
    /// The longest edge of the exported meshes, as a fraction of the diagonal of each bounding box.
    pub max_edge: f64,
    /// Each exported shape, by its name in PartField's files.
    pub shapes: BTreeMap<String, PartFieldShape>,
}

/// One shape of an export for PartField.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct PartFieldShape {
    /// The id of the shape.
    pub id: String,
    /// The file from which it was read.
    pub source: String,
    /// Its mesh, relative to the map.
    pub mesh: String,
    /// An NPY file relative to the map: for each triangle of the mesh, the triangle of the carrier that contains it.
    pub parents: String,
    /// The number of triangles of the mesh.
    pub n_triangles: usize,
    /// PartField's position is (position − `center`) · `scale`.
    pub center: Point,
    /// In 1 per millimeter.
    pub scale: f64,
}

/// A map file cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartFieldMapError {
    /// It is not JSON, or not a map.
    #[error("not a map of `export partfield-input`: {0}")]
    Content(String),
    /// A newer version of the program wrote it.
    #[error(
        "its format version is {found}, and this program reads up to {FORMAT_VERSION}; use a newer program"
    )]
    Version {
        /// The version of the file.
        found: u32,
    },
}

impl PartFieldMap {
    /// A map of these shapes.
    #[must_use]
    pub fn new(max_edge: f64, shapes: BTreeMap<String, PartFieldShape>) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            unit: "mm".to_owned(),
            max_edge,
            shapes,
        }
    }

    /// Reads the JSON of a map.
    ///
    /// # Errors
    /// If it is not a map, or has a newer version.
    pub fn from_json(bytes: &[u8]) -> Result<Self, PartFieldMapError> {
        let map: Self = serde_json::from_slice(bytes)
            .map_err(|error| PartFieldMapError::Content(error.to_string()))?;
        if map.format_version > FORMAT_VERSION {
            return Err(PartFieldMapError::Version {
                found: map.format_version,
            });
        }
        Ok(map)
    }

    /// The name and the entry of a shape, by its id.
    #[must_use]
    pub fn shape(&self, id: &str) -> Option<(&str, &PartFieldShape)> {
        let mut shapes = self.shapes.iter();
        shapes
            .find(|(_, shape)| shape.id == id)
            .map(|(name, shape)| (name.as_str(), shape))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> PartFieldMap {
        let shape = PartFieldShape {
            id: "a__b".to_owned(),
            source: "a/b.step".to_owned(),
            mesh: "meshes/a-b.obj".to_owned(),
            parents: "parents/a-b.npy".to_owned(),
            n_triangles: 40,
            center: [1.0, 2.0, 0.5],
            scale: 0.25,
        };
        PartFieldMap::new(0.02, BTreeMap::from([("a-b".to_owned(), shape)]))
    }

    #[test]
    fn a_map_reads_back_and_finds_shapes_by_id() {
        let bytes = serde_json::to_vec(&map()).unwrap();
        let read = PartFieldMap::from_json(&bytes).unwrap();
        assert_eq!(read, map());
        assert_eq!(read.shape("a__b").unwrap().0, "a-b");
        assert_eq!(read.shape("a-b"), None);
    }

    #[test]
    fn other_files_are_refused() {
        let refusal = |bytes: &[u8]| PartFieldMap::from_json(bytes).unwrap_err().to_string();
        assert!(refusal(b"{}").contains("not a map"));
        let mut newer = map();
        newer.format_version += 1;
        let bytes = serde_json::to_vec(&newer).unwrap();
        assert!(refusal(&bytes).contains("use a newer program"));
    }
}

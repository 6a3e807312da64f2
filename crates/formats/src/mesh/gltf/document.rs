//! Defines the part of the JSON of a glTF file that partprobe uses.

use crate::mesh::gltf::error::GltfError;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The whole document.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Document {
    asset: Asset,
    #[serde(default)]
    extensions_required: Vec<String>,
    pub(crate) scene: Option<usize>,
    #[serde(default)]
    pub(crate) scenes: Vec<Scene>,
    #[serde(default)]
    pub(crate) nodes: Vec<Node>,
    #[serde(default)]
    pub(crate) meshes: Vec<MeshJson>,
    #[serde(default)]
    pub(crate) accessors: Vec<AccessorJson>,
    #[serde(default)]
    pub(crate) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(crate) buffers: Vec<BufferJson>,
}

#[derive(Debug, Deserialize)]
struct Asset {
    version: String,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Scene {
    #[serde(default)]
    pub(crate) nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Node {
    pub(crate) mesh: Option<usize>,
    #[serde(default)]
    pub(crate) children: Vec<usize>,
    /// Column by column.
    pub(crate) matrix: Option<[f64; 16]>,
    pub(crate) translation: Option<[f64; 3]>,
    /// A quaternion, the real part last.
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct MeshJson {
    pub(crate) primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Primitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<u32>,
    #[serde(default = "triangles")]
    pub(crate) mode: u32,
    #[serde(default)]
    extensions: PrimitiveExtensions,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Default, Deserialize)]
struct PrimitiveExtensions {
    #[serde(rename = "EXT_mesh_features")]
    mesh_features: Option<MeshFeatures>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct MeshFeatures {
    #[serde(default)]
    feature_ids: Vec<FeatureIds>,
}

/// The description of the attribute `_FEATURE_ID_<attribute>` by `EXT_mesh_features`.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FeatureIds {
    attribute: Option<u32>,
    pub(crate) label: Option<String>,
    pub(crate) null_feature_id: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct AccessorJson {
    pub(crate) buffer_view: Option<usize>,
    #[serde(default)]
    pub(crate) byte_offset: usize,
    pub(crate) component_type: u32,
    pub(crate) count: usize,
    #[serde(rename = "type")]
    pub(crate) shape: String,
    pub(crate) sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: usize,
    pub(crate) byte_length: usize,
    pub(crate) byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct BufferJson {
    pub(crate) uri: Option<String>,
}

/// Extensions that may be required: they do not change the surface or its marks.
const HARMLESS: &[&str] = &["EXT_mesh_features", "KHR_texture_transform"];

impl Document {
    /// The document in these bytes.
    ///
    /// # Errors
    /// If it is not JSON in this form, another version, or needs an extension that changes the surface.
    pub(crate) fn parse(json: &[u8]) -> Result<Self, GltfError> {
        let document: Self =
            serde_json::from_slice(json).map_err(|error| GltfError::Json(error.to_string()))?;
        if !document.asset.version.starts_with("2.") {
            return Err(GltfError::Version(document.asset.version));
        }
        let is_harmless =
            |name: &String| HARMLESS.contains(&name.as_str()) || name.starts_with("KHR_materials_");
        let unknown = document
            .extensions_required
            .iter()
            .find(|name| !is_harmless(name));
        match unknown {
            Some(name) => Err(GltfError::Extension(name.clone())),
            None => Ok(document),
        }
    }

    /// The root nodes of the scene. Without a scene, they are the nodes that are not children of other nodes.
    ///
    /// # Errors
    /// If the scene does not exist.
    pub(crate) fn roots(&self) -> Result<Vec<usize>, GltfError> {
        if self.scenes.is_empty() {
            let mut is_child = vec![false; self.nodes.len()];
            for &child in self.nodes.iter().flat_map(|node| &node.children) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            return Ok((0..self.nodes.len())
                .filter(|&node| !is_child[node])
                .collect());
        }
        let index = self.scene.unwrap_or(0);
        let missing = GltfError::Missing {
            what: "scene",
            index,
        };
        let scene = self.scenes.get(index).ok_or(missing)?;
        Ok(scene.nodes.clone())
    }
}

impl Primitive {
    /// The extension's description of the attribute with this name.
    pub(crate) fn feature_ids(&self, attribute: &str) -> Option<&FeatureIds> {
        let number: u32 = attribute.strip_prefix("_FEATURE_ID_")?.parse().ok()?;
        let features = self.extensions.mesh_features.as_ref()?;
        features
            .feature_ids
            .iter()
            .find(|ids| ids.attribute == Some(number))
    }
}

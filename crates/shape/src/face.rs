//! Describes a face of a B-Rep without its geometry.

use crate::face_type::FaceType;

/// A color: red, green, blue and alpha, from the highest byte to the lowest. Alpha 255 is opaque.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Color(pub u32);

/// The properties of one face without its geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The `#` number of the face's entity in its STEP file.
    pub step_id: u64,
    /// The class of the basis surface.
    pub face_type: FaceType,
    /// The class after recognition of primitives that are written in another form, for example as B-splines. It is equal to
    /// `face_type` if none was recognized.
    pub canonical_type: FaceType,
    /// Area of the trimmed surface, in square millimeters. It is not the area of the mesh.
    pub area: f64,
    /// Index of the face's shell among the shells of the file.
    pub shell: u32,
    /// Index of the face's solid among the solids of the file, or `None` for a face of an open shell model.
    pub solid: Option<u32>,
    /// Index of the product occurrence that places the face, in the list of [`Instance`]s of the shape.
    pub instance: u32,
    /// The name of the `ADVANCED_FACE`, if it has one.
    pub name: Option<String>,
    /// The color that a `STYLED_ITEM` gives the face, its shell or its solid.
    pub color: Option<Color>,
    /// The layer to which the face, its shell or its solid is assigned.
    pub layer: Option<String>,
}

impl Face {
    /// A face of the first shell and the first occurrence, without a solid, name, color or layer.
    #[must_use]
    pub fn new(step_id: u64, face_type: FaceType, area: f64) -> Self {
        Self {
            step_id,
            face_type,
            canonical_type: face_type,
            area,
            shell: 0,
            solid: None,
            instance: 0,
            name: None,
            color: None,
            layer: None,
        }
    }
}

/// One occurrence of a product in an assembly.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The names of the products from the root of the assembly to this one, with `/` between them.
    pub path: String,
    /// The name of the product, or `None` if the file has none.
    pub product: Option<String>,
    /// The transform from the product's own coordinates to those of the assembly: the rows of a matrix for column
    /// vectors, with lengths in millimeters.
    pub transform: [[f64; 4]; 4],
}

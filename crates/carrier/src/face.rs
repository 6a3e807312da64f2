//! A face of a B-Rep, without its geometry.

use crate::FaceType;

/// A colour, red, green, blue and alpha from the highest byte down; alpha 255 is opaque.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Color(pub u32);

/// What a labeller knows of one face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The `#` number of the face's entity in its STEP file.
    pub step_id: u64,
    /// The class of the basis surface.
    pub face_type: FaceType,
    /// The class after recognition of primitives written as B-splines; `face_type` where nothing was recognised.
    pub canonical_type: FaceType,
    /// Area of the trimmed surface, in square millimetres; never the mesh's area.
    pub area: f64,
    /// Index of the face's shell among the shells of the file.
    pub shell: u32,
    /// Index of the face's solid among the solids of the file; none for a face of an open shell model.
    pub solid: Option<u32>,
    /// Index of the product instance that places the face; 0 where instances are not asked for.
    pub instance: u32,
    /// The name of the `ADVANCED_FACE`, if it has one.
    pub name: Option<String>,
    /// The colour that a `STYLED_ITEM` gives the face, its shell or its solid.
    pub color: Option<Color>,
}

//! Defines the settings of the mesh: tolerances, budgets, and the attributes that are kept at the vertices.

/// The attributes of the true surfaces that are kept at the mesh's vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttributeChoice {
    /// The outward unit normal.
    pub normal: bool,
    /// The surface's parameters.
    pub uv: bool,
    /// The principal curvatures and their directions.
    pub curvature: bool,
}

/// How finely a shape is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshSettings {
    /// Largest distance between an edge and its chord, in millimeters.
    pub(crate) chord_mm: f64,
    /// Largest angle between neighboring chords, in radians.
    pub(crate) angle_rad: f64,
    /// The attributes that are kept at the vertices.
    pub(crate) attributes: AttributeChoice,
    /// Whether the solids' volumes are wanted.
    pub(crate) solid_volumes: bool,
    /// The fraction of a closed solid's volume that triangles may cut off or add. A value of 0 means that any fraction is
    /// allowed.
    pub(crate) volume_loss: f64,
    /// Faces that would bring the mesh above this number of triangles are lost.
    pub(crate) max_triangles: u64,
}

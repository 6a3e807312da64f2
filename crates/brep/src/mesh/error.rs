//! Lists the reasons for which a face has no mesh.

/// Why a face has no mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum FaceMeshError {
    /// A point of a boundary edge is not finite.
    #[error("an edge has no finite points")]
    EdgePoints,
    /// The points of a boundary have no finite parameters on the surface.
    #[error("its boundary has no finite parameters")]
    BoundaryParameters,
    /// All points of a boundary coincide.
    #[error("a boundary lies in one point")]
    PointBoundary,
    /// There is no boundary, and the surface does not close without one.
    #[error("it has no boundary and its surface is open")]
    NoBoundary,
    /// Boundaries wind along u, and also along v.
    #[error("its boundaries wind in both directions")]
    WindsBothWays,
    /// A boundary winds in a direction in which the surface has no period.
    #[error("it winds around an open direction")]
    WindsAlongOpenDirection,
    /// A boundary winds two or more periods.
    #[error("a boundary winds more than once")]
    WindsTwice,
    /// Three or more boundaries wind, and their windings do not add up to zero.
    #[error("its winding boundaries don't pair")]
    UnpairedWindings,
    /// A single boundary winds, and the surface has no pole that it could enclose.
    #[error("a boundary winds once on an open surface")]
    WindsOnOpenSurface,
    /// The seam of the face is not between its boundaries.
    #[error("its seam lies outside its boundary")]
    SeamOutside,
    /// The boundaries enclose no triangle.
    #[error("its boundary encloses nothing")]
    Empty,
    /// A vertex or the area of the mesh is not finite.
    #[error("its surface has no finite places")]
    Infinite,
}

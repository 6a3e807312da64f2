//! Holds properties of the true surface at the vertices of a mesh, or at sampled points.

/// Lists with one row per vertex or point. A list that was not requested is empty. A value that is not defined is NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceAttributes {
    /// Parameters of the face's surface as its file defines it, in millimeters and radians. Parameters of a spline are in units
    /// of its knots.
    pub uv: Vec<[f64; 2]>,
    /// Principal curvatures in 1/mm, the larger one first. They are positive where the shape is convex, as on a ball.
    pub curvature: Vec<[f32; 2]>,
    /// The directions of the curvatures: unit vectors in the tangent plane.
    pub direction: Vec<[[f32; 3]; 2]>,
}

impl SurfaceAttributes {
    /// Appends the rows of another list of the same kinds.
    pub fn extend(&mut self, other: Self) {
        self.uv.extend(other.uv);
        self.curvature.extend(other.curvature);
        self.direction.extend(other.direction);
    }
}

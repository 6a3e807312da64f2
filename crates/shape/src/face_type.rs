//! Lists the primitive types of faces, with their codes and names.

use std::fmt;
use std::str::FromStr;

/// The class of a face's basis surface. The codes are those of `face_type` in a carrier file.
///
/// A trimmed surface counts as its basis. A B-spline that happens to be flat is still a B-spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum FaceType {
    /// `PLANE`.
    Plane = 0,
    /// `CYLINDRICAL_SURFACE`.
    Cylinder = 1,
    /// `CONICAL_SURFACE`.
    Cone = 2,
    /// `SPHERICAL_SURFACE`.
    Sphere = 3,
    /// `TOROIDAL_SURFACE` and `DEGENERATE_TOROIDAL_SURFACE`.
    Torus = 4,
    /// `BEZIER_SURFACE`.
    Bezier = 5,
    /// Every other `B_SPLINE_SURFACE`, rational or not.
    Bspline = 6,
    /// `SURFACE_OF_REVOLUTION`.
    Revolution = 7,
    /// `SURFACE_OF_LINEAR_EXTRUSION`.
    Extrusion = 8,
    /// `OFFSET_SURFACE`.
    Offset = 9,
    /// A surface class that is none of these.
    Other = 10,
}

impl FaceType {
    /// Every type, in the order of its code.
    pub const ALL: [Self; 11] = [
        Self::Plane,
        Self::Cylinder,
        Self::Cone,
        Self::Sphere,
        Self::Torus,
        Self::Bezier,
        Self::Bspline,
        Self::Revolution,
        Self::Extrusion,
        Self::Offset,
        Self::Other,
    ];

    /// The number of the type in files, from 0 to 10.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The type with this code, if there is one.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// The lower-case name of the type in JSON and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::Sphere => "sphere",
            Self::Torus => "torus",
            Self::Bezier => "bezier",
            Self::Bspline => "bspline",
            Self::Revolution => "revolution",
            Self::Extrusion => "extrusion",
            Self::Offset => "offset",
            Self::Other => "other",
        }
    }
}

impl fmt::Display for FaceType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The text does not name a primitive type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a primitive type; the types are plane, cylinder, cone, sphere, torus, bezier, bspline, revolution, extrusion, offset and other"
)]
pub struct UnknownFaceType(pub String);

impl FromStr for FaceType {
    type Err = UnknownFaceType;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownFaceType(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_names_round_trip() {
        for (code, kind) in (0..).zip(FaceType::ALL) {
            assert_eq!(kind.code(), code);
            assert_eq!(FaceType::from_code(code), Some(kind));
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        assert_eq!(FaceType::from_code(11), None);
        assert!("Plane".parse::<FaceType>().is_err());
    }
}

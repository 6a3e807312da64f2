//! Names the units that a STEP file is written in.

/// The length and angle units that a shape was written in.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// Name of the length unit in the file, for example `mm` or `inch`.
    pub length: String,
    /// Millimeters in one unit of the file; coordinates have been multiplied by it.
    pub mm_per_unit: f64,
    /// Name of the plane angle unit in the file: `radian` or `degree`.
    pub angle: String,
    /// Radians in one angle unit of the file.
    pub rad_per_unit: f64,
}

impl Units {
    /// Millimeters and radians, in which every shape is after reading.
    #[must_use]
    pub fn millimeters_and_radians() -> Self {
        Self {
            length: "mm".to_owned(),
            mm_per_unit: 1.0,
            angle: "radian".to_owned(),
            rad_per_unit: 1.0,
        }
    }
}

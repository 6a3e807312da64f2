//! Defines the units in which a STEP file is written.

/// The length and angle units in which a shape was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// Name of the length unit in the file, for example `mm` or `inch`.
    pub length: String,
    /// Millimeters per length unit of the file. Coordinates have already been multiplied by it.
    pub mm_per_unit: f64,
    /// Name of the plane angle unit in the file: `radian` or `degree`.
    pub angle: String,
    /// Radians per angle unit of the file.
    pub rad_per_unit: f64,
}

impl Units {
    /// Millimeters and radians. Every shape has these units after reading.
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

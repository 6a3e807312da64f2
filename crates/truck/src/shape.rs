//! Reads a text into a shape, if the kernel is built in. This is the entry point.

use crate::truck_shape::{TruckError, TruckSettings, TruckShape};

/// Reads and meshes the text of one file.
///
/// # Errors
/// If the kernel is not built in, if truck panics or cannot parse the text, or if it finds no face.
pub fn shape(text: &str, settings: &TruckSettings) -> Result<TruckShape, TruckError> {
    #[cfg(feature = "truck")]
    return crate::reading::shape_of(text, settings);
    #[cfg(not(feature = "truck"))]
    {
        let _ = (text, settings);
        Err(TruckError::NotBuilt)
    }
}

#[cfg(all(test, not(feature = "truck")))]
mod tests {
    use super::*;

    #[test]
    fn a_build_without_truck_says_so() {
        let settings = TruckSettings {
            mm_per_unit: 1.0,
            rad_per_unit: 1.0,
            chord_fraction: 0.002,
        };
        assert_eq!(
            shape("ISO-10303-21;", &settings).err(),
            Some(TruckError::NotBuilt)
        );
    }
}

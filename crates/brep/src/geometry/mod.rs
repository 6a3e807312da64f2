//! Curves and surfaces as STEP defines them, in millimetres and radians.

mod types;

pub use types::{BsplineCurve, BsplineSurface, CompositeSegment, Curve, Frame, Surface};

//! Runs `partprobe sample`: points with normals and labels from each carrier of a data set, or from STEP files, whose
//! true surfaces can then be asked for more.

mod true_surface;
mod verb;

pub(crate) use verb::{SampleArgs, sample};

//! Runs `partprobe sample`: draws points with normals and labels from each carrier of a data set, or from STEP files. Only STEP
//! files have true surfaces, which give further attributes.

mod true_surface;
mod verb;

pub(crate) use verb::{SampleArgs, sample};

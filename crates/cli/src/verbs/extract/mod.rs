//! Runs `partprobe extract`: it writes the smallest STEP file around an entity, to report a fault without sending the
//! whole file.

mod compare;
mod verb;

pub(crate) use verb::{ExtractArgs, extract};

//! `partprobe extract`: the smallest STEP file around an entity, to report a fault without the part.

mod compare;
mod verb;

pub(crate) use verb::{ExtractArgs, extract};

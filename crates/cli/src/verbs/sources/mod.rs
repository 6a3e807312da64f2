//! Runs `partprobe sources`: lists the label sources that a config or `sample --source` can name, or makes the card of some of
//! them on a data set.

mod card;
mod verb;

pub(crate) use card::matched_colors;
pub(crate) use verb::{SourcesArgs, sources};

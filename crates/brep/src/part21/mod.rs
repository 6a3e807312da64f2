//! ISO 10303-21 text, read lazily: bytes go in, a table of instances comes out, and parameters are
//! parsed where they lie when somebody asks for them.
//!
//! Nothing here knows what an entity means. Nothing recurses over the file, nothing allocates by a
//! number that the file states, and what stands for an instance and is none is a loss with its `#` number.

mod encoding;
mod exchange;
mod folding;
mod keyword;
mod params;
mod records;
mod scan;
mod short_names;
mod text;

pub(crate) use encoding::in_utf8;
pub(crate) use exchange::{Exchange, ExchangeError, Record};
pub(crate) use folding::unfolded;
pub(crate) use keyword::{Keyword, full_name};
pub(crate) use params::{Param, ParamError, Params};
pub(crate) use text::decode_text;

//! ISO 10303-21 text, read lazily: bytes go in, a table of instances comes out, and parameters are
//! parsed where they lie when somebody asks for them.
//!
//! Nothing here knows what an entity means. Nothing recurses over the file, nothing allocates by a
//! number that the file states, and an instance that is no instance is a loss with its `#` number.

mod exchange;
mod keyword;
mod params;
mod rewrite;
mod scan;
mod text;

pub(crate) use exchange::{Exchange, ExchangeError, Record};
pub(crate) use keyword::Keyword;
pub(crate) use params::{Param, ParamError, Params};
pub(crate) use rewrite::{references_in, rewritten, schema_of};
pub(crate) use text::decode_text;

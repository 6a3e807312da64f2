//! Reads ISO 10303-21 texts ("STEP physical files"): it indexes the instances and parses parameters when they are needed.
//!
//! ```
//! use partprobe_brep::part21::{Exchange, decode_text, normalized};
//!
//! let text = b"ISO-10303-21;HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');
//! FILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));ENDSEC;DATA;
//! #1=CARTESIAN_POINT('corner',(1.,2.,3.5));
//! #2=VERTEX_POINT('',#1);
//! ENDSEC;END-ISO-10303-21;";
//! let text = normalized(text);
//! let mut lost = Vec::new();
//! let exchange = Exchange::index(&text, 1000, &mut lost)?;
//! assert!(lost.is_empty());
//!
//! for &record in exchange.records() {
//!     println!("#{} is a {}", record.id, exchange.class_name(record));
//! }
//!
//! let point = exchange.record(1).expect("an instance");
//! let [name, coordinates] = exchange.params(point).first()?;
//! assert_eq!(name.text().map(decode_text).as_deref(), Some("corner"));
//! assert_eq!(coordinates.list()?.numbers()?, [1.0, 2.0, 3.5]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - It reads all three editions, plain and complex instances, short names of classes, and texts in any encoding.
//! - Parameters are borrowed from the text.
//! - Nothing recurses over the file, and no allocation depends on a number that the file states.
//! - A statement that looks like an instance and does not parse is a lost entity with its `#` number.
//!
//! # What it does not do
//!
//! It does not know what an entity means, does not check a schema, and does not follow references to other files. It writes
//! no files.

mod encoding;
mod encoding_guess;
mod exchange;
mod folding;
mod keyword;
mod number;
mod params;
mod record;
mod records;
mod rewrite;
mod scan;
mod short_names;
mod text;

pub use exchange::Exchange;
pub use params::{Param, ParamError, Params};
pub use record::{ExchangeError, Record};
pub use text::decode_text;

pub(crate) use keyword::{Keyword, full_name};
pub(crate) use rewrite::{references_in, rewritten, schema_of};

use std::borrow::Cow;

/// The text in UTF-8, without the line ends of writers that cut their text into lines of one fixed length.
///
/// Most texts are returned as they are.
#[must_use]
pub fn normalized(text: &[u8]) -> Cow<'_, [u8]> {
    folding::unfolded(encoding::in_utf8(text))
}

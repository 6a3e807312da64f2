//! Defines an instance in the index, and the reasons for which a text has no index.

use super::keyword::Keyword;

/// The reason why a text is not an exchange structure.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExchangeError {
    /// There is no `ISO-10303-21` at the beginning of the file.
    #[error("the text does not begin with ISO-10303-21")]
    NotStep,
    /// It contains no instance.
    #[error("the text has no data section with instances")]
    NoData,
    /// It has more instances than the limit allows.
    #[error("the text has too many instances; raise the limit")]
    TooManyEntities,
}

/// An instance of the file. [`Exchange`](super::Exchange) reads its class and its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Its `#` number.
    pub id: u64,
    /// The position in the text at which its class begins, or the parenthesis of a complex instance.
    pub(crate) at: u32,
    /// Its class.
    pub(crate) keyword: Keyword,
    /// The number of bytes of the text that certainly belong to the name of its class. It is 0 for a complex instance.
    pub(crate) n_name: u8,
}

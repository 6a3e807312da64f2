//! Reads the bytes of one member, up to a limit.

use std::fmt;
use std::io::Read;

/// The bytes of a member, still in the archive.
pub struct Content<'a> {
    bytes: &'a mut dyn Read,
    /// The size according to the archive, if fewer bytes mean damage.
    size: Option<u64>,
    damage: &'a mut Option<String>,
}

/// The reason why the bytes of a member cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ContentError {
    /// There are more bytes than allowed.
    #[error("the file has more than {limit} bytes")]
    TooLarge {
        /// The allowed number.
        limit: u64,
    },
    /// The archive is damaged here.
    #[error("the archive is damaged in this member: {0}")]
    Damaged(String),
}

impl<'a> Content<'a> {
    pub(super) fn new(
        bytes: &'a mut dyn Read,
        size: Option<u64>,
        damage: &'a mut Option<String>,
    ) -> Self {
        Self {
            bytes,
            size,
            damage,
        }
    }

    /// Reads all bytes, or finds that there are more than `limit`. At most this number is decoded and kept.
    ///
    /// # Errors
    /// If there are more, or the archive is damaged.
    pub fn read(self, limit: u64) -> Result<Vec<u8>, ContentError> {
        let mut bytes = Vec::new();
        let read = self
            .bytes
            .take(limit.saturating_add(1))
            .read_to_end(&mut bytes);
        let problem = match (read, self.size) {
            (Err(error), _) => error.to_string(),
            (Ok(_), _) if bytes.len() as u64 > limit => {
                return Err(ContentError::TooLarge { limit });
            }
            (Ok(_), Some(size)) if (bytes.len() as u64) < size => CUT_OFF.to_owned(),
            _ => return Ok(bytes),
        };
        *self.damage = Some(problem.clone());
        Err(ContentError::Damaged(problem))
    }
}

/// The message for a stream that ends inside a member.
pub(super) const CUT_OFF: &str = "it ends inside a member";

impl fmt::Debug for Content<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Content")
            .field("size", &self.size)
            .finish_non_exhaustive()
    }
}

//! Defines the version of the files.

/// The version that every archive and every JSON file of partprobe contains. A reader refuses a higher one.
pub const FORMAT_VERSION: u32 = 1;

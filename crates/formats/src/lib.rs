//! File formats: bytes to exchange types and back.

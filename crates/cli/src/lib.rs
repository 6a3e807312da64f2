//! The program `partprobe` as a library.

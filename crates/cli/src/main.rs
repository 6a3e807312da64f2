//! The program `partprobe`.
fn main() {}

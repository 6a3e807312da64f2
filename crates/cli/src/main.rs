//! Starts the program `partprobe`, which is implemented in the library of this package.

use std::process::ExitCode;

fn main() -> ExitCode {
    partprobe::main()
}

//! The program `partprobe`; everything it does stands in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    partprobe::main()
}

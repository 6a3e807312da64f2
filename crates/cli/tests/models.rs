//! Tests a golden listing of the backbones.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot run the program has failed"
)]

use std::process::Command;

const LISTING: &str = "\
| backbone | parameters | with head | encoder | decoder | tokens train / test |
|---|---:|---:|---|---|---|
| micro | 524 160 | 530 432 | 1×32 1×48 1×64 | 1×48 1×48 | 512 / 1024 |
| tiny | 2 389 280 | 2 397 600 | 1×32 1×64 2×96 1×128 | 1×64 1×64 1×96 | 512 / 1024 |
| mini | 5 790 496 | 5 796 768 | 1×32 1×48 1×96 2×160 1×192 | 1×48 1×48 1×96 1×160 | 512 / 1024 |
| base | 46 166 272 | 46 174 592 | 2×32 2×64 2×128 6×256 2×512 | 2×64 2×64 2×128 2×256 | 512 / 1024 |
| pointnet | 174 528 | 207 424 | 1×64 1×128 1×256 | – | 512 / 1024 |
";

#[test]
fn the_backbones_are_listed_with_their_sizes() {
    let output = Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .arg("models")
        .output()
        .unwrap();
    let found = String::from_utf8(output.stdout).unwrap();
    assert_eq!(found, LISTING);
}

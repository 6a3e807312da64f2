//! Tests a golden listing of the backbones.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot run the program has failed"
)]

use std::process::Command;

const LISTING: &str = "\
| backbone | preset | parameters | with head | encoder | decoder | tokens train / test |
|---|---|---:|---:|---|---|---|
| ptv3 | micro | 524 160 | 530 432 | 1×32 1×48 1×64 | 1×48 1×48 | 512 / 1024 |
| ptv3 | tiny | 2 389 280 | 2 397 600 | 1×32 1×64 2×96 1×128 | 1×64 1×64 1×96 | 512 / 1024 |
| ptv3 | mini | 5 790 496 | 5 796 768 | 1×32 1×48 1×96 2×160 1×192 | 1×48 1×48 1×96 1×160 | 512 / 1024 |
| ptv3 | base | 46 166 272 | 46 174 592 | 2×32 2×64 2×128 6×256 2×512 | 2×64 2×64 2×128 2×256 | 512 / 1024 |
| litept | micro | 290 466 | 297 506 | 1×36 1×54 2×72 | 0×54 0×54 | 512 / 1024 |
| litept | tiny | 1 070 460 | 1 079 804 | 1×36 1×72 2×108 2×144 | 0×72 0×72 0×108 | 512 / 1024 |
| litept | small | 12 712 932 | 12 722 276 | 2×36 2×72 2×144 6×252 2×504 | 0×72 0×72 0×144 0×252 | 512 / 1024 |
| ptx | micro | 114 010 | 120 282 | 1×32 1×48 1×64 | 1×48 1×48 | 512 / 1024 |
| ptx | tiny | 526 896 | 535 216 | 1×32 1×64 2×96 1×128 | 1×64 1×64 1×96 | 512 / 1024 |
| ptx | mini | 1 279 846 | 1 286 118 | 1×32 1×48 1×96 2×160 1×192 | 1×48 1×48 1×96 1×160 | 512 / 1024 |
| ptx | base | 9 616 264 | 9 624 584 | 2×32 2×64 2×128 6×256 2×512 | 2×64 2×64 2×128 2×256 | 512 / 1024 |
| pointnet | pointnet | 174 528 | 207 424 | 1×64 1×128 1×256 | – | 512 / 1024 |
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

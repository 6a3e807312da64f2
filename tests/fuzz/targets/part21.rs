//! Fuzzes bytes → B-Rep: the Part 21 parser and everything that follows references.
#![no_main]

use partprobe_brep::{ReadBudget, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &[u8]| {
    if let Ok(brep) = read(text, &ReadBudget::default()) {
        assert!(!brep.faces.is_empty(), "a B-Rep without faces must be an error");
    }
});

//! Fuzzes text → carrier → NPZ → carrier, as `label` does it, on STEP text in which single tokens were edited.
#![no_main]

use fuzz::{edited, label};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_target!(|text: &[u8]| label(text));

fuzz_mutator!(|text: &mut [u8], size: usize, max_size: usize, seed: u32| {
    // Raw bytes nearly always break the syntax, which the other target is for: three edits of four are of tokens.
    match (seed % 4, edited(&text[..size], seed)) {
        (1.., Some(edit)) if edit.len() <= max_size.min(text.len()) => {
            text[..edit.len()].copy_from_slice(&edit);
            edit.len()
        }
        _ => fuzzer_mutate(text, size, max_size),
    }
});

//! Writes a number with its noun or its unit for messages: `1 file`, `2 files`, `4.2 MB`.

/// The number and the noun that fits it.
pub(crate) fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// A number of bytes in a suitable unit, for example `812 bytes` or `4.2 MB`. A megabyte is 10⁶ bytes.
pub(crate) fn file_size(bytes: u64) -> String {
    let in_unit = |unit: u64| bytes as f64 / unit as f64;
    match bytes {
        1 => "1 byte".to_owned(),
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", in_unit(1_000)),
        1_000_000..1_000_000_000 => format!("{:.1} MB", in_unit(1_000_000)),
        _ => format!("{:.1} GB", in_unit(1_000_000_000)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_the_unit_that_suits_them() {
        for (bytes, expected) in [
            (0, "0 bytes"),
            (1, "1 byte"),
            (999, "999 bytes"),
            (1_000, "1.0 kB"),
            (4_234_000, "4.2 MB"),
            (12_000_000_000, "12.0 GB"),
        ] {
            assert_eq!(file_size(bytes), expected);
        }
    }

    #[test]
    fn only_one_is_singular() {
        for (n, expected) in [(0, "0 bodies"), (1, "1 body"), (2, "2 bodies")] {
            assert_eq!(counted(n, "body", "bodies"), expected);
        }
    }
}

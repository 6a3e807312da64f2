//! Writes a number with its noun, as a message says it: `1 file`, `2 files`.

/// The number and the noun that fits it.
pub(crate) fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_is_singular() {
        for (n, expected) in [(0, "0 bodies"), (1, "1 body"), (2, "2 bodies")] {
            assert_eq!(counted(n, "body", "bodies"), expected);
        }
    }
}

//! Defines a comparison with a number, such as `>= 0.5`.

/// How a value is compared with the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    AtLeast,
    Above,
    AtMost,
    Below,
}

/// Every comparison with its symbol. The longer symbols come first, so that `>=` is not read as `>`.
const SYMBOLS: [(&str, Comparison); 4] = [
    (">=", Comparison::AtLeast),
    ("<=", Comparison::AtMost),
    (">", Comparison::Above),
    ("<", Comparison::Below),
];

/// A bound on a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    symbol: &'static str,
    comparison: Comparison,
    number: f64,
}

impl Bound {
    /// Reads a symbol and a finite number. Returns `None` if the text is something else.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        for (symbol, comparison) in SYMBOLS {
            if let Some(number) = text.strip_prefix(symbol) {
                let number: f64 = number.trim().parse().ok()?;
                return number.is_finite().then_some(Self {
                    symbol,
                    comparison,
                    number,
                });
            }
        }
        None
    }

    pub(super) fn holds_for(self, value: f64) -> bool {
        match self.comparison {
            Comparison::AtLeast => value >= self.number,
            Comparison::Above => value > self.number,
            Comparison::AtMost => value <= self.number,
            Comparison::Below => value < self.number,
        }
    }
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.symbol, self.number)
    }
}

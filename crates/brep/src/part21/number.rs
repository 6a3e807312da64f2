//! Parses short decimal numbers exactly and fast; longer ones are left to the standard library.

/// The powers of ten that are exact.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Every whole number up to this one is exact.
const MOST_EXACT: u64 = 1 << 53;

/// Parses a number whose digits and whose power of ten are both exact, as they are in most numbers. Then one division or product
/// gives the correctly rounded result. Returns `None` for all other numbers.
pub(super) fn short_decimal(text: &[u8], at: usize) -> Option<(f64, usize)> {
    let is_negative = text[at] == b'-';
    let start = at + usize::from(matches!(text[at], b'-' | b'+'));
    let (whole, end) = digits(text, start, 0)?;
    let n_whole = end - start;
    let (mantissa, fraction_end) = match text.get(end) {
        Some(b'.') => digits(text, end + 1, whole)?,
        _ => (whole, end),
    };
    let n_fraction = fraction_end.saturating_sub(end + 1);
    let (power, end) = match text.get(fraction_end) {
        Some(b'e' | b'E' | b'd' | b'D') => exponent(text, fraction_end + 1)?,
        Some(b'+' | b'-' | b'.') => return None,
        _ => (0, fraction_end),
    };
    let power = power - n_fraction as i32;
    if n_whole + n_fraction == 0 || mantissa > MOST_EXACT {
        return None;
    }
    let scale = *POWERS.get(power.unsigned_abs() as usize)?;
    let number = if power < 0 {
        mantissa as f64 / scale
    } else {
        mantissa as f64 * scale
    };
    Some((if is_negative { -number } else { number }, end))
}

/// Appends digits to a number, and returns it with the position after them. Returns `None` if there are too many digits.
fn digits(text: &[u8], start: usize, mut number: u64) -> Option<(u64, usize)> {
    let mut end = start;
    while let Some(digit @ b'0'..=b'9') = text.get(end) {
        if number > MOST_EXACT {
            return None;
        }
        number = 10 * number + u64::from(digit - b'0');
        end += 1;
    }
    Some((number, end))
}

/// The power of ten after an `E`.
fn exponent(text: &[u8], at: usize) -> Option<(i32, usize)> {
    let sign = *text.get(at)?;
    let start = at + usize::from(matches!(sign, b'-' | b'+'));
    let (power, end) = digits(text, start, 0)?;
    let is_plain =
        end > start && end - start <= 3 && !matches!(text.get(end), Some(b'+' | b'-' | b'.'));
    is_plain.then_some((
        if sign == b'-' {
            -(power as i32)
        } else {
            power as i32
        },
        end,
    ))
}

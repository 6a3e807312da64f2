//! Writes numbers in the format of Part 21.

use partprobe_carrier::Point;

/// Formats a real number with a decimal point, and with an exponent if it would be long otherwise.
pub(super) fn real(value: f64) -> String {
    // A sum of products that should be 0 can leave a rounding error, whose digits are of no use.
    if value.abs() < 1e-14 {
        return "0.".to_owned();
    }
    let shortest = format!("{value:?}");
    match shortest.split_once('e') {
        None => shortest
            .strip_suffix(".0")
            .map_or(shortest.clone(), |whole| format!("{whole}.")),
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.E{exponent}"),
    }
}

/// Formats three real numbers with commas between them.
pub(super) fn point_list(point: Point) -> String {
    point.map(real).join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_have_a_point_and_read_back() {
        for (value, text) in [
            (0.0, "0."),
            (-0.0, "0."),
            (1.0, "1."),
            (-2.5, "-2.5"),
            (1e-7, "1.E-7"),
            (1.5e-9, "1.5E-9"),
            (1e-17, "0."),
        ] {
            assert_eq!(real(value), text.replace("E-0", "E-"));
            assert_eq!(
                text.parse::<f64>().unwrap(),
                if value.abs() < 1e-14 { 0.0 } else { value }
            );
        }
    }
}

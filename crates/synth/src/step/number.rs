//! Writes numbers as Part 21 does.

use partprobe_carrier::Point;

/// A real with a point, and an exponent where the plain form would be long.
pub(super) fn real(value: f64) -> String {
    // What is left of a sum of products that should be 0 would only cost digits.
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

/// Three reals with commas between them.
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

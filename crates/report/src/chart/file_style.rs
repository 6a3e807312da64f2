//! Writes the style of a chart's file. It has the rules and the bright colors of the page, without variables.

use super::N_COLORS;
use std::fmt::Write as _;

/// The style of the charts of the page.
const CHART_STYLE: &str = include_str!("../../assets/chart.css");
/// The colors of the page. The first value of each is the bright one.
const COLORS: &str = include_str!("../../assets/colors.css");
/// What only a file has.
const OWN: &str = ".caption { font-weight: 600; }\n";

/// The style of a file. A rule that uses the color of a series, `var(--c)`, becomes one rule per series.
pub(super) fn file_style() -> String {
    let mut style = String::new();
    for rule in CHART_STYLE.split_inclusive('}') {
        let Some((selectors, declarations)) = rule.split_once('{') else {
            continue;
        };
        let declarations = declarations.trim_end_matches('}');
        let is_of_series = |declaration: &&str| declaration.contains("var(--c)");
        let common: Vec<&str> = declarations
            .split(';')
            .map(str::trim)
            .filter(|declaration| !declaration.is_empty() && !declaration.starts_with("--"))
            .collect();
        let (of_series, common): (Vec<&str>, Vec<&str>) =
            common.iter().partition(|d| is_of_series(d));

        push_rule(&mut style, selectors, &common);
        for class in series_classes().filter(|_| !of_series.is_empty()) {
            let selectors: Vec<String> = selectors
                .split(',')
                .map(|selector| format!("{}.{class}", selector.trim()))
                .collect();
            let color = format!("var(--{class})");
            let declarations: Vec<String> = of_series
                .iter()
                .map(|declaration| declaration.replace("var(--c)", &color))
                .collect();
            let declarations: Vec<&str> = declarations.iter().map(String::as_str).collect();
            push_rule(&mut style, &selectors.join(", "), &declarations);
        }
    }
    style.push_str(OWN);
    with_values(&style)
}

fn push_rule(style: &mut String, selectors: &str, declarations: &[&str]) {
    if !declarations.is_empty() {
        let _ = writeln!(
            style,
            "{} {{ {}; }}",
            selectors.trim(),
            declarations.join("; ")
        );
    }
}

fn series_classes() -> impl Iterator<Item = String> {
    (0..N_COLORS)
        .map(|idx| format!("s{idx}"))
        .chain([String::from("plain")])
}

/// A style with the values of its variables in their places.
fn with_values(style: &str) -> String {
    let mut parts = style.split("var(--");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once(')').unwrap_or((part, ""));
        text.push_str(value_of(name));
        text.push_str(rest);
    }
    text
}

/// The first value of a variable in the colors of the page.
fn value_of(name: &str) -> &'static str {
    let start = format!("--{name}: ");
    let found = COLORS.split_once(&start);
    found
        .and_then(|(_, rest)| rest.split_once(';'))
        .map_or("none", |(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variable_has_a_value_and_every_series_its_color() {
        let style = file_style();
        assert!(
            !style.contains("var(") && !style.contains("inherit"),
            "{style}"
        );
        assert!(
            style.contains("svg .line { fill: none; stroke-width: 1.8;"),
            "{style}"
        );
        assert!(
            style.contains("svg .line.s0 { stroke: #0072b2; }"),
            "{style}"
        );
        assert!(
            style.contains("svg .column.plain { fill: #7d8894; }"),
            "{style}"
        );
    }
}

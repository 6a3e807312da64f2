//! Writes the outcomes of bounds as a JUnit report, which CI servers show.

use crate::expectation::ExpectationOutcome;
use std::fmt::Write as _;

/// A report with one test case per bound; `suite` names them all. A bound that is missed is a failure with its value.
#[must_use]
pub fn junit_xml(suite: &str, outcomes: &[ExpectationOutcome]) -> String {
    let n_missed = outcomes.iter().filter(|outcome| !outcome.passed).count();
    let suite = escaped(suite);
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        text,
        "<testsuite name=\"{suite}\" tests=\"{}\" failures=\"{n_missed}\">",
        outcomes.len()
    );
    for outcome in outcomes {
        let name = escaped(&outcome.text);
        let _ = write!(text, "  <testcase classname=\"{suite}\" name=\"{name}\"");
        if outcome.passed {
            text.push_str("/>\n");
        } else {
            let message = escaped(&outcome.to_string());
            let _ = writeln!(text, "><failure message=\"{message}\"/></testcase>");
        }
    }
    text.push_str("</testsuite>\n");
    text
}

/// The text of an attribute.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missed_bound_is_a_failure() {
        let outcome = |text: &str, value, passed| ExpectationOutcome {
            text: text.to_owned(),
            value,
            passed,
        };
        let outcomes = [
            outcome("a/b.miou >= 0.5", 0.625, true),
            outcome("a/b.miou >= 0.75", 0.625, false),
        ];
        let expected = "\
<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<testsuite name=\"partprobe\" tests=\"2\" failures=\"1\">
  <testcase classname=\"partprobe\" name=\"a/b.miou &gt;= 0.5\"/>
  <testcase classname=\"partprobe\" name=\"a/b.miou &gt;= 0.75\"><failure message=\"missed: a/b.miou &gt;= 0.75 (it is 0.6250)\"/></testcase>
</testsuite>
";
        assert_eq!(junit_xml("partprobe", &outcomes), expected);
    }
}

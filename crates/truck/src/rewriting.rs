//! Rewrites STEP text so that truck can read it. The shape stays the same.

/// Rewrites constructs that truck misreads. The rest of the text stays as it is.
///
/// - Comments are removed.
/// - `$` as the first parameter of an instance becomes an empty name; otherwise truck drops the instance.
/// - Surface curves name their space curve as the master, since truck misplaces planar edges that are given by parameter
///   curves.
/// - Characters that are not ASCII become `?`.
/// - Half angles of cones become radians.
#[must_use]
pub fn rewritten(text: &str, rad_per_unit: f64) -> String {
    let mut out = String::with_capacity(text.len());
    for statement in (Statements { rest: text }) {
        out.push_str(&rewritten_statement(&statement, rad_per_unit));
        out.push('\n');
    }
    out
}

/// Splits a text into statements, at the semicolons outside of quoted strings. Comments are left out.
struct Statements<'a> {
    rest: &'a str,
}

impl Iterator for Statements<'_> {
    type Item = String;

    fn next(&mut self) -> Option<String> {
        let mut statement = String::new();
        let mut chars = self.rest.char_indices();
        let mut in_name = false;
        while let Some((at, c)) = chars.next() {
            if !in_name && self.rest[at..].starts_with("/*") {
                // A comment that is not closed extends to the end of the text.
                let end = self.rest[at..]
                    .find("*/")
                    .map_or(self.rest.len(), |end| at + end + 2);
                self.rest = &self.rest[end..];
                chars = self.rest.char_indices();
                continue;
            }
            in_name ^= c == '\'';
            statement.push(if c.is_ascii() { c } else { '?' });
            if c == ';' && !in_name {
                self.rest = &self.rest[at + 1..];
                return Some(statement.trim_start().to_owned());
            }
        }
        self.rest = "";
        let last = statement.trim();
        (!last.is_empty()).then(|| last.to_owned())
    }
}

fn rewritten_statement(statement: &str, rad_per_unit: f64) -> String {
    let statement = statement
        .replace(".PCURVE_S1.", ".CURVE_3D.")
        .replace(".PCURVE_S2.", ".CURVE_3D.");
    let Some((head, parameters)) = statement.split_once('(') else {
        return statement;
    };
    let keyword = head.rsplit('=').next().unwrap_or_default().trim();
    if !head.starts_with('#') || keyword.is_empty() {
        return statement;
    }
    let named = match parameters.trim_start().strip_prefix('$') {
        Some(rest) => format!("{head}(''{rest}"),
        None => statement.clone(),
    };
    if keyword == "CONICAL_SURFACE" && rad_per_unit != 1.0 {
        with_radians(&named, rad_per_unit)
    } else {
        named
    }
}

/// Multiplies the last parameter, the half angle, by `rad_per_unit`.
fn with_radians(cone: &str, rad_per_unit: f64) -> String {
    let end = cone.rfind(')').unwrap_or(cone.len());
    let start = cone[..end].rfind(',').map_or(end, |comma| comma + 1);
    match cone[start..end].trim().parse::<f64>() {
        // `{:?}` writes the shortest digits that read back as the same number. It also writes a decimal point, which STEP
        // requires.
        Ok(angle) => format!(
            "{}{:?}{}",
            &cone[..start],
            angle * rad_per_unit,
            &cone[end..]
        ),
        Err(_) => cone.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, rad_per_unit: f64, expected: &str) {
        assert_eq!(rewritten(text, rad_per_unit), expected);
    }

    #[test]
    fn only_what_truck_misreads_changes() {
        check(
            "#1=PLANE('a;b',#2);#2=X($,$);",
            1.0,
            "#1=PLANE('a;b',#2);\n#2=X('',$);\n",
        );
        check(
            "#1 = ADVANCED_FACE ( $,(#2),#3,.T.);",
            1.0,
            "#1 = ADVANCED_FACE ('',(#2),#3,.T.);\n",
        );
        check("#1=(A($)B());", 1.0, "#1=(A($)B());\n");
        check("FILE_NAME($);", 1.0, "FILE_NAME($);\n");
        check(
            "#1=A('/* no comment */')/* one; */;",
            1.0,
            "#1=A('/* no comment */');\n",
        );
        check("#1=A('f\u{fc}r');/* without end", 1.0, "#1=A('f?r');\n");
        check(
            "#1=SURFACE_CURVE('',#2,(#3),.PCURVE_S1.);",
            1.0,
            "#1=SURFACE_CURVE('',#2,(#3),.CURVE_3D.);\n",
        );
    }

    #[test]
    fn half_angles_become_radians() {
        check(
            "#1=CONICAL_SURFACE('',#2,1.,90.);",
            0.5,
            "#1=CONICAL_SURFACE('',#2,1.,45.0);\n",
        );
        check(
            "#1=CONICAL_SURFACE('',#2,1.,90.);",
            1.0,
            "#1=CONICAL_SURFACE('',#2,1.,90.);\n",
        );
        check(
            "#1=CYLINDRICAL_SURFACE('',#2,90.);",
            0.5,
            "#1=CYLINDRICAL_SURFACE('',#2,90.);\n",
        );
        check(
            "#1=CONICAL_SURFACE('',#2,1.,*);",
            0.5,
            "#1=CONICAL_SURFACE('',#2,1.,*);\n",
        );
    }
}

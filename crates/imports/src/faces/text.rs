//! Reads labels in plain text: one number or word per line (`.seg` of Fusion 360 Gallery and BRepNet), or a row of logits per
//! face.

use super::face_labels::{FaceLabels, raw_label};

/// One label per line, in the order of the faces.
pub(super) fn one_per_line(bytes: &[u8]) -> Result<FaceLabels, String> {
    let lines = lines(bytes)?;
    let labels = lines.iter().map(|(number, line)| {
        if line.split_whitespace().count() > 1 {
            return Err(format!(
                "line {number}: one label is expected, not `{line}`"
            ));
        }
        Ok(raw_label(line))
    });
    Ok(FaceLabels::InOrder(labels.collect::<Result<_, String>>()?))
}

/// One row of numbers per face. The label is the position of the largest number. If several are equal, it is the first one.
pub(super) fn largest_of_rows(bytes: &[u8]) -> Result<FaceLabels, String> {
    let lines = lines(bytes)?;
    let labels = lines.iter().map(|(number, line)| {
        let values = line.split_whitespace().map(str::parse::<f64>);
        let values: Vec<f64> = values
            .collect::<Result<_, _>>()
            .map_err(|_| format!("line {number}: a row of numbers is expected"))?;
        let largest = (0..values.len()).reduce(|best, idx| {
            if values[idx] > values[best] {
                idx
            } else {
                best
            }
        });
        Ok(largest.map(|idx| idx.to_string()))
    });
    Ok(FaceLabels::InOrder(labels.collect::<Result<_, String>>()?))
}

/// The lines that are not empty, with their numbers from 1.
fn lines(bytes: &[u8]) -> Result<Vec<(usize, &str)>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "not text in UTF-8".to_owned())?;
    let lines = (1..).zip(text.lines());
    Ok(lines.filter(|(_, line)| !line.trim().is_empty()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(found: Result<FaceLabels, String>, expected: Result<&[&str], &str>) {
        let expected = expected.map(|labels| {
            FaceLabels::InOrder(labels.iter().map(|&label| Some(label.to_owned())).collect())
        });
        assert_eq!(found, expected.map_err(str::to_owned));
    }

    #[test]
    fn lines_are_labels() {
        check(one_per_line(b"3\n0\r\n3\n\n"), Ok(&["3", "0", "3"]));
        check(
            one_per_line(b"3\n0 1\n"),
            Err("line 2: one label is expected, not `0 1`"),
        );
        check(one_per_line(&[0xff]), Err("not text in UTF-8"));
    }

    #[test]
    fn the_largest_logit_is_the_label() {
        check(
            largest_of_rows(b"1.0e+00 2.5e+00 -3\n4 4 0\n"),
            Ok(&["1", "0"]),
        );
        check(
            largest_of_rows(b"1 2\n1 x\n"),
            Err("line 2: a row of numbers is expected"),
        );
    }
}

//! Recognizes file names of STEP, plain or packed: a name goes in, and the name without its ending comes out.

/// Endings of STEP text, with their dot.
const PLAIN: [&str; 4] = [".step", ".stp", ".p21", ".ste"];
/// Endings of STEP text that is packed in any way: `.stpZ` is gzip from some programs and zip from others.
const PACKED: [&str; 3] = [".stpz", ".stepz", ".p21z"];
/// Endings that packers append to the ending of the text.
const PACKERS: [&str; 3] = [".gz", ".zst", ".xz"];
/// Endings of STEP-XML, which is another format.
const XML: [&str; 2] = [".stpx", ".stpxz"];

/// The name without its ending if this is an ending of STEP, in upper or lower case, packed or not.
#[must_use]
pub fn step_stem(name: &str) -> Option<&str> {
    let bare = || {
        PACKERS
            .iter()
            .find_map(|packer| without_ending(name, packer))
    };
    let stem_of = |name, endings: &[&str]| {
        endings
            .iter()
            .find_map(|ending| without_ending(name, ending))
    };
    stem_of(name, &PLAIN)
        .or_else(|| stem_of(name, &PACKED))
        .or_else(|| stem_of(bare()?, &PLAIN))
}

/// Whether the ending is one of STEP-XML.
#[must_use]
pub fn is_step_xml_name(name: &str) -> bool {
    XML.iter()
        .any(|ending| without_ending(name, ending).is_some())
}

/// The name without this ending in upper or lower case. The result may be empty if the name is only an ending.
pub(crate) fn without_ending<'a>(name: &'a str, ending: &str) -> Option<&'a str> {
    let start = name
        .len()
        .checked_sub(ending.len())
        .filter(|&start| start > 0)?;
    name.get(start..)?
        .eq_ignore_ascii_case(ending)
        .then(|| &name[..start])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_of_step_files_are_known_in_any_case() {
        for (name, stem) in [
            ("a.step", "a"),
            ("a.b.STP", "a.b"),
            ("a.p21", "a"),
            ("a.ste", "a"),
            ("a.stpZ", "a"),
            ("a.STPZ", "a"),
            ("a.stepz", "a"),
            ("a.step.gz", "a"),
            ("a.Stp.GZ", "a"),
            ("a.p21.zst", "a"),
            ("ä.step.xz", "ä"),
        ] {
            assert_eq!(step_stem(name), Some(stem), "{name}");
        }
        for name in [
            "a.gz",
            ".step",
            ".step.gz",
            "step",
            "a.stpx",
            "a.zip",
            "a.step.zip",
            "a.step~",
            "ä",
        ] {
            assert_eq!(step_stem(name), None, "{name}");
        }
        assert!(
            is_step_xml_name("a.StpX") && is_step_xml_name("a.stpxz") && !is_step_xml_name("a.stp")
        );
    }
}

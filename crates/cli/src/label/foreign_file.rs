//! Recognizes a file that `label` does not read, and makes a message with advice.
//!
//! A name and the first bytes go in, and a sentence comes out. The rest of the file is not read.

/// The message for meshes that are read only without STEP files next to them.
const NEXT_TO_STEP: &str =
    "it is not read together with STEP files; label meshes and point clouds in a call of their own";
/// The message for meshes that are not read.
const OTHER_MESH: &str =
    "export STEP from the program that made it, or a mesh as OBJ, PLY, STL or OFF";
/// The advice for files of CAD programs.
const CAD: &str = "open it in a CAD program and export STEP (AP214 or AP242)";
/// The message for carriers and point samples.
const ALREADY_LABELED: &str =
    "it is labeled already; `render`, `export` and `sample` read data sets and carriers";

/// Endings, the description of such a file, and the advice.
const KNOWN: [(&[&str], &str, &str); 20] = [
    (&["stl", "obj", "off"], "a mesh", NEXT_TO_STEP),
    (&["ply"], "a mesh or a point cloud", NEXT_TO_STEP),
    (&["npy", "xyz", "pts"], "a point cloud", NEXT_TO_STEP),
    (&["glb", "gltf"], "a glTF mesh", OTHER_MESH),
    (&["3mf", "amf"], "a mesh for printing", OTHER_MESH),
    (
        &["wrl", "vrml", "x3d", "dae", "fbx", "3ds"],
        "a scene of meshes",
        OTHER_MESH,
    ),
    (&["npz"], "a NumPy archive", ALREADY_LABELED),
    (
        &["stpx", "stpxz"],
        "STEP-XML, which is not read",
        "export STEP Part 21 (.stp or .step) instead",
    ),
    (&["iges", "igs"], "an IGES file", CAD),
    (
        &["brep", "brp"],
        "a B-Rep of OpenCASCADE",
        "write it as STEP, for example with FreeCAD or OpenCASCADE",
    ),
    (&["fcstd"], "a FreeCAD document", CAD),
    (&["sldprt", "sldasm"], "a SolidWorks file", CAD),
    (&["ipt", "iam"], "an Inventor file", CAD),
    (
        &["prt", "asm"],
        "a part or an assembly of a CAD program",
        CAD,
    ),
    (&["catpart", "catproduct", "cgr"], "a CATIA file", CAD),
    (
        &["x_t", "x_b", "xmt_txt", "xmt_bin"],
        "a Parasolid file",
        CAD,
    ),
    (&["sat", "sab"], "an ACIS file", CAD),
    (&["3dm"], "a Rhino file", CAD),
    (&["jt"], "a JT file", CAD),
    (
        &["dwg", "dxf", "f3d", "ifc"],
        "a file of a CAD program",
        CAD,
    ),
];

/// The description of a file by its ending, with advice. Returns `None` if the ending is not known.
pub(super) fn foreign_by_name(name: &str) -> Option<String> {
    let (stem, ending) = name.rsplit_once('.')?;
    // Creo appends version numbers to its endings: `bracket.prt.3`.
    let is_version = ending.chars().all(|c| c.is_ascii_digit());
    let ending = if is_version {
        stem.rsplit_once('.').map_or(ending, |(_, ending)| ending)
    } else {
        ending
    };
    let (_, what, advice) = KNOWN.iter().find(|(endings, ..)| {
        endings
            .iter()
            .any(|known| known.eq_ignore_ascii_case(ending))
    })?;
    Some(format!("it is {what}: {advice}"))
}

/// The description of a file by its first bytes, if its name is not known. The file is neither STEP nor a list.
pub(super) fn foreign_by_content(start: &[u8]) -> String {
    if start.is_empty() {
        return "the file is empty".to_owned();
    }
    let begins = |mark: &[u8]| start.starts_with(mark);
    if begins(b"\xff\xfe") || begins(b"\xfe\xff") {
        return "it is text in UTF-16; save it as UTF-8".to_owned();
    }
    if begins(b"<?xml") || begins(b"\xef\xbb\xbf<?xml") {
        return "it is XML; export STEP Part 21 (.stp or .step) instead".to_owned();
    }
    if begins(b"%PDF") {
        return "it is a PDF document".to_owned();
    }
    if start.contains(&0) {
        return "it is a binary file, not STEP; export STEP Part 21 (.stp or .step)".to_owned();
    }
    let text = String::from_utf8_lossy(start);
    let first = text
        .lines()
        .map(str::trim)
        .find(|line| !line.is_empty())
        .unwrap_or_default();
    let shown: String = first
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    format!(
        "it is text, but it is neither STEP nor a list of paths, as it begins with `{shown}`; \
         `--list FILE` reads a file as a list in any case"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_bytes_decide_the_advice() {
        for (name, words) in [
            ("a.STL", "in a call of their own"),
            ("a.glb", "a mesh as OBJ"),
            ("a.x_t", "Parasolid"),
            ("a.prt.12", "CAD program"),
            ("a.stpx", "STEP-XML"),
        ] {
            assert!(
                foreign_by_name(name).is_some_and(|text| text.contains(words)),
                "{name}"
            );
        }
        assert_eq!(foreign_by_name("a.txt"), None);

        let cases: [(&[u8], &str); 6] = [
            (b"", "empty"),
            (b"\xff\xfea\0", "UTF-16"),
            (b"<?xml version", "XML"),
            (b"ab\0c", "binary"),
            (b"\n  a, b\x07\n", "begins with `a, b\u{fffd}`"),
            (b"%PDF-1.7", "PDF"),
        ];
        for (start, words) in cases {
            assert!(
                foreign_by_content(start).contains(words),
                "{}",
                foreign_by_content(start)
            );
        }
    }
}

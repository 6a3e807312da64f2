//! Finds solids of one file that are copies of each other, so that they are labeled once.

use partprobe_carrier::{FaceGraph, Mesh, Signature, signature};

/// Total areas that differ by no more than this fraction are equal.
const AREA_TOLERANCE: f64 = 1e-3;

/// The signature and the area of a solid.
pub(crate) struct SolidOutline {
    signature: Signature,
    area: f64,
}

impl SolidOutline {
    /// Computes the signature and the area of a solid.
    pub(crate) fn new(graph: &FaceGraph, mesh: &Mesh) -> Self {
        Self {
            signature: signature(graph, mesh),
            area: graph.faces.iter().map(|face| face.area).sum(),
        }
    }

    /// Whether the two solids have the same faces, by type, number of edges, and area.
    pub(crate) fn equals(&self, other: &Self) -> bool {
        (self.area - other.area).abs() <= AREA_TOLERANCE * self.area.max(other.area)
            && self.signature.is_duplicate_of(&other.signature)
    }
}

/// Names that modelers give automatically. They do not describe the product.
const GENERIC_NAMES: [&str; 10] = [
    "",
    "part",
    "body",
    "solid",
    "shape",
    "component",
    "object",
    "none",
    "unnamed",
    "importedpart",
];

/// The name, unless it is one like `Part 1`.
pub(crate) fn meaningful_name(name: Option<&str>) -> Option<String> {
    let letters = |name: &str| {
        name.chars()
            .filter(|c| c.is_alphabetic())
            .collect::<String>()
            .to_lowercase()
    };
    let is_generic = |name: &str| {
        GENERIC_NAMES.contains(&letters(name).as_str()) || name.starts_with("Open CASCADE")
    };
    name.filter(|name| !is_generic(name)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{Face, FaceType};

    fn outline(areas: &[f64]) -> SolidOutline {
        let face = |&area: &f64| Face::new(1, FaceType::Plane, area);
        let graph = FaceGraph {
            faces: areas.iter().map(face).collect(),
            edges: Vec::new(),
        };
        SolidOutline::new(&graph, &Mesh::default())
    }

    #[test]
    fn copies_are_equal_and_scaled_ones_are_not() {
        assert!(outline(&[1.0, 2.0]).equals(&outline(&[2.0, 1.0])));
        assert!(!outline(&[1.0, 2.0]).equals(&outline(&[2.0, 4.0])));
        assert!(!outline(&[1.0, 2.0]).equals(&outline(&[1.5, 1.5])));
        assert!(!outline(&[1.0, 2.0]).equals(&outline(&[3.0])));
    }

    #[test]
    fn generic_names_are_ignored() {
        for name in [
            "Part 1",
            "Body12",
            "SOLID",
            "",
            "Open CASCADE STEP translator 7.5 1",
            "42",
        ] {
            assert_eq!(meaningful_name(Some(name)), None, "{name}");
        }
        assert_eq!(
            meaningful_name(Some("Bracket 2")),
            Some("Bracket 2".to_owned())
        );
        assert_eq!(meaningful_name(None), None);
    }
}

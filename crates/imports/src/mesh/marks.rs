//! Chooses the mark of a mesh file that is a label, and gives each triangle its label.
//!
//! A file may have a label property, groups of several kinds, and colors. Without a choice by the user, a property that is named
//! like a label has priority, because colors and groups are often only for display. If two candidates divide the mesh
//! differently, the file is refused.

use crate::mesh::values::whole;
use partprobe_carrier::{IGNORE, Mesh};
use partprobe_formats::{Mark, MarkValues, Marked, MarkedMesh};
use std::collections::{BTreeMap, BTreeSet};

/// Properties with one of these names are labels. Upper and lower case are equal.
const LABEL_NAMES: &[&str] = &[
    "label",
    "labels",
    "label_id",
    "segment",
    "segment_id",
    "segmentation",
    "seg",
    "seg_id",
    "part",
    "part_id",
    "instance",
    "instance_id",
    "cluster",
    "cluster_id",
    "class",
    "class_id",
    "category",
    "category_id",
];

/// The numbers of colors in the palettes of well-known programs. If there are more parts, some share a color.
const PALETTES: &[(usize, &str)] = &[
    (10, "tab10 of Matplotlib"),
    (20, "tab20 of Matplotlib, which PartField uses"),
    (62, "CSS colors that PartSAM and SAMPart3D use"),
];

/// Red, green and blue, each from 0 to 65535.
pub(super) type Color = [u16; 3];

/// The reaction to a file with as many colors as a palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AtPaletteLimit {
    /// Refuse the shape: parts may share a color.
    Refuse,
    /// Take each color as one label.
    Accept,
}

/// The settings for the labels in mesh files.
#[derive(Clone, Debug)]
pub(super) struct MarkChoice {
    /// The title of the chosen mark, or `None` to find it.
    pub(super) requested: Option<String>,
    pub(super) at_palette_limit: AtPaletteLimit,
    /// The color of triangles without a label, if there is one.
    pub(super) unlabeled: Option<Color>,
}

/// The label of each triangle, and the mark from which it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MarkLabels {
    pub(super) labels: Vec<i32>,
    pub(super) title: String,
}

impl MarkChoice {
    /// The labels of the triangles.
    ///
    /// # Errors
    /// If no mark of the file is a label, several marks may be labels, or there are as many colors as in a palette.
    pub(super) fn labels(&self, marked: &MarkedMesh) -> Result<MarkLabels, String> {
        let chosen = match &self.requested {
            Some(title) => self.mark_named(marked, title)?,
            None => self.only_candidate(marked)?,
        };
        self.check_palette(chosen)?;
        Ok(MarkLabels {
            labels: self.labels_of(chosen, &marked.mesh)?,
            title: title(chosen),
        })
    }

    fn mark_named<'a>(&self, marked: &'a MarkedMesh, requested: &str) -> Result<&'a Mark, String> {
        let found = marked.marks.iter().find(|mark| title(mark) == requested);
        found.ok_or_else(|| {
            format!(
                "there is no `{requested}` in the file, which has {}; choose one of them with the key `labels_from`",
                titles(&marked.marks)
            )
        })
    }

    fn only_candidate<'a>(&self, marked: &'a MarkedMesh) -> Result<&'a Mark, String> {
        let (labels, others) = candidates(&marked.marks);
        let remaining = if labels.is_empty() { others } else { labels };
        let mut dividing: Vec<(&Mark, Vec<i32>)> = Vec::new();
        for mark in &remaining {
            let labels = numbered(&self.labels_of(mark, &marked.mesh)?);
            if labels.iter().any(|&label| label != labels[0]) {
                dividing.push((mark, labels));
            }
        }

        let Some((first, division)) = dividing.first() else {
            let undivided = remaining.first().copied();
            return undivided.ok_or_else(|| {
                format!(
                    "nothing in the file is known as a label; it has {}; name a property with the key `labels_from`",
                    titles(&marked.marks)
                )
            });
        };
        if dividing.iter().all(|(_, other)| other == division) {
            return Ok(first);
        }
        let counted = dividing.iter().map(|(mark, labels)| {
            let n_labels = 1 + labels.iter().max().unwrap_or(&IGNORE);
            format!("{} {n_labels}", title(mark))
        });
        Err(format!(
            "several things in the file may be labels, and they divide it differently (the number of labels by each: {}); choose \
             one with the key `labels_from`",
            counted.collect::<Vec<String>>().join(", ")
        ))
    }

    /// Refuses colors that are as many as in a palette, because some parts may share a color.
    fn check_palette(&self, mark: &Mark) -> Result<(), String> {
        let MarkValues::Colors(colors) = &mark.values else {
            return Ok(());
        };
        let distinct: BTreeSet<&Color> = colors
            .iter()
            .filter(|color| Some(**color) != self.unlabeled)
            .collect();
        let palette = PALETTES
            .iter()
            .find(|(n_colors, _)| *n_colors == distinct.len());
        match palette {
            Some((n_colors, name)) if self.at_palette_limit == AtPaletteLimit::Refuse => {
                Err(format!(
                    "there are {n_colors} colors, which is all that a common palette has ({name}), so that parts may share a \
                     color; give the labels as numbers, or set at_palette_limit = \"accept\" if each part has its own color"
                ))
            }
            _ => Ok(()),
        }
    }

    /// The label of each triangle by this mark.
    fn labels_of(&self, mark: &Mark, mesh: &Mesh) -> Result<Vec<i32>, String> {
        let of_items: Vec<i32> = match &mark.values {
            MarkValues::Numbers(values) => values
                .iter()
                .map(|&value| whole(value))
                .collect::<Result<_, String>>()
                .map_err(|reason| format!("`{}`: {reason}", title(mark)))?,
            MarkValues::Groups(groups) => groups.iter().map(|&group| group as i32).collect(),
            MarkValues::Colors(colors) => {
                let mut numbers: BTreeMap<Color, i32> = BTreeMap::new();
                let number = |&color: &Color| {
                    if Some(color) == self.unlabeled {
                        return IGNORE;
                    }
                    let next = numbers.len() as i32;
                    *numbers.entry(color).or_insert(next)
                };
                colors.iter().map(number).collect()
            }
        };
        Ok(match mark.of {
            Marked::Triangles => of_items,
            Marked::Vertices => {
                let corners = mesh.triangles.iter();
                corners
                    .map(|corners| majority(corners.map(|vertex| of_items[vertex as usize])))
                    .collect()
            }
        })
    }
}

/// The label of at least two corners, or [`IGNORE`] if all three differ.
pub(crate) fn majority([a, b, c]: [i32; 3]) -> i32 {
    if a == b || a == c {
        a
    } else if b == c {
        b
    } else {
        IGNORE
    }
}

/// The properties that are named like labels, and then the groups and colors.
fn candidates(marks: &[Mark]) -> (Vec<&Mark>, Vec<&Mark>) {
    let is_label = |mark: &&Mark| {
        let name = mark.name.to_lowercase();
        matches!(mark.values, MarkValues::Numbers(_)) && LABEL_NAMES.contains(&name.as_str())
    };
    let is_other = |mark: &&Mark| !matches!(mark.values, MarkValues::Numbers(_));
    (
        marks.iter().filter(is_label).collect(),
        marks.iter().filter(is_other).collect(),
    )
}

/// The labels numbered in the order in which they appear, so that equal divisions are equal.
fn numbered(labels: &[i32]) -> Vec<i32> {
    let mut numbers: BTreeMap<i32, i32> = BTreeMap::new();
    let number = |&label: &i32| {
        if label == IGNORE {
            return IGNORE;
        }
        let next = numbers.len() as i32;
        *numbers.entry(label).or_insert(next)
    };
    labels.iter().map(number).collect()
}

/// The name of a mark for the key `labels_from`.
fn title(mark: &Mark) -> String {
    match (&mark.values, mark.of) {
        (MarkValues::Colors(_), Marked::Triangles) => "face-color".to_owned(),
        (MarkValues::Colors(_), Marked::Vertices) => "vertex-color".to_owned(),
        _ => mark.name.clone(),
    }
}

fn titles(marks: &[Mark]) -> String {
    if marks.is_empty() {
        return "no properties, groups or colors".to_owned();
    }
    marks.iter().map(title).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with a common side.
    fn square(marks: Vec<Mark>) -> MarkedMesh {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        MarkedMesh {
            mesh: Mesh {
                vertex_face: vec![0; 4],
                vertices,
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                tri_face: vec![0; 2],
                vertex_normal: Vec::new(),
            },
            marks,
        }
    }

    fn mark(name: &str, of: Marked, values: MarkValues) -> Mark {
        Mark {
            name: name.to_owned(),
            of,
            values,
        }
    }

    fn property(name: &str, values: &[f64]) -> Mark {
        mark(
            name,
            Marked::Triangles,
            MarkValues::Numbers(values.to_vec()),
        )
    }

    fn group(name: &str, groups: [u32; 2]) -> Mark {
        mark(name, Marked::Triangles, MarkValues::Groups(groups.to_vec()))
    }

    fn face_colors(colors: [Color; 2]) -> Mark {
        mark(
            "color",
            Marked::Triangles,
            MarkValues::Colors(colors.to_vec()),
        )
    }

    fn vertex_colors(colors: [Color; 4]) -> Mark {
        mark(
            "color",
            Marked::Vertices,
            MarkValues::Colors(colors.to_vec()),
        )
    }

    const RED: Color = [65535, 0, 0];
    const BLUE: Color = [0, 0, 65535];
    const BLACK: Color = [0; 3];

    fn choice(requested: Option<&str>) -> MarkChoice {
        MarkChoice {
            requested: requested.map(str::to_owned),
            at_palette_limit: AtPaletteLimit::Refuse,
            unlabeled: Some(BLACK),
        }
    }

    #[track_caller]
    fn check(requested: Option<&str>, marks: &[Mark], title: &str, labels: [i32; 2]) {
        let found = choice(requested).labels(&square(marks.to_vec())).unwrap();
        assert_eq!(
            (found.title.as_str(), found.labels),
            (title, labels.to_vec())
        );
    }

    #[track_caller]
    fn check_refused(requested: Option<&str>, marks: &[Mark], expected: &str) {
        let reason = choice(requested)
            .labels(&square(marks.to_vec()))
            .unwrap_err();
        assert!(reason.contains(expected), "{reason}");
    }

    #[test]
    fn a_property_named_like_a_label_counts_first() {
        let label = property("Label", &[7.0, -1.0]);
        let flags = property("flags", &[0.0, 1.0]);
        let colors = face_colors([RED, RED]);
        check(
            None,
            &[flags.clone(), label.clone(), colors.clone()],
            "Label",
            [7, -1],
        );
        check(
            Some("flags"),
            &[flags.clone(), label.clone()],
            "flags",
            [0, 1],
        );
        check(
            Some("face-color"),
            &[label.clone(), colors],
            "face-color",
            [0, 0],
        );
        let part = property("part", &[3.0, 4.0]);
        check(
            None,
            &[property("class", &[1.0, 2.0]), part.clone()],
            "class",
            [1, 2],
        );
        check_refused(
            None,
            &[property("class", &[1.0, 1.0]), part, label],
            "divide it differently (the number of labels by each: part 2, Label 1)",
        );
        check_refused(
            None,
            &[flags],
            "nothing in the file is known as a label; it has flags",
        );
        check_refused(None, &[], "it has no properties, groups or colors");
        check_refused(
            Some("seg"),
            &[property("label", &[0.0, 0.5])],
            "there is no `seg` in the file, which has label",
        );
        check_refused(
            None,
            &[property("label", &[0.0, 0.5])],
            "`label`: 0.5 is not a label",
        );
    }

    #[test]
    fn groups_and_colors_that_agree_are_one_answer() {
        let [objects, materials] = [group("object", [4, 2]), group("material", [1, 1])];
        check(
            None,
            &[objects.clone(), materials.clone()],
            "object",
            [4, 2],
        );
        check(
            None,
            &[objects.clone(), face_colors([BLUE, RED])],
            "object",
            [4, 2],
        );
        check(None, std::slice::from_ref(&materials), "material", [1, 1]);
        check_refused(
            None,
            &[
                objects,
                face_colors([BLACK, RED]),
                group("material", [0, 1]),
            ],
            "object 2, face-color 1",
        );
    }

    #[test]
    fn a_triangle_takes_the_color_of_two_corners() {
        let check = |colors, labels| check(None, &[vertex_colors(colors)], "vertex-color", labels);
        check([RED, RED, RED, BLUE], [0, 0]);
        check([RED, RED, BLUE, BLUE], [0, 1]);
        check([RED, BLUE, BLACK, RED], [-1, 0]);
        check([BLACK, RED, BLACK, RED], [-1, -1]);
    }

    #[test]
    fn as_many_colors_as_a_palette_has_are_refused() {
        let colors = |n_colors: u16| {
            let colors = (0..n_colors).map(|number| [number, 1, 0]).collect();
            let mut marked = square(vec![mark(
                "color",
                Marked::Triangles,
                MarkValues::Colors(colors),
            )]);
            marked.mesh.triangles = vec![[0, 1, 2]; n_colors.into()];
            marked
        };
        for (n_colors, _) in PALETTES {
            let n_colors = *n_colors as u16;
            let reason = choice(None).labels(&colors(n_colors)).unwrap_err();
            assert!(
                reason.starts_with(&format!("there are {n_colors} colors")),
                "{reason}"
            );
            let accepting = MarkChoice {
                at_palette_limit: AtPaletteLimit::Accept,
                ..choice(None)
            };
            assert!(accepting.labels(&colors(n_colors)).is_ok());
            assert!(choice(None).labels(&colors(n_colors - 1)).is_ok());
            assert!(choice(None).labels(&colors(n_colors + 1)).is_ok());
        }
    }
}

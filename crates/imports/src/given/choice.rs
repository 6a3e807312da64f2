//! Chooses the data of a file that count as its labels.
//!
//! Properties with certain names are labels. Their priority is their order in [`PROPERTIES`], and properties of faces come before
//! those of vertices. Without one, groups are labels, then objects, then materials, if there are at least two of them. Colors and
//! other properties are never labels here: the import `mesh` reads them on request.

use crate::mesh::majority;
use crate::points::label_of;
use partprobe_carrier::IGNORE;
use partprobe_formats::{Mark, MarkValues, Marked, MarkedMesh};

/// Names of label properties, in lower case. CloudCompare puts `scalar_` before them.
const PROPERTIES: &[&str] = &[
    "label",
    "labels",
    "part",
    "part_id",
    "segment",
    "segment_id",
    "segmentation",
    "instance",
    "instance_id",
    "object_id",
    "class",
    "class_id",
    "category",
    "category_id",
    "semantic",
];
/// Kinds of groups. The first kind with at least two groups counts.
const GROUPS: &[&str] = &["group", "object", "material"];

/// The labels of a shape, and their origin.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Chosen {
    /// One label per triangle or point. It is empty if nothing counts as labels.
    pub(super) labels: Vec<i32>,
    pub(super) notes: Vec<String>,
}

impl Chosen {
    /// The labels of the triangles of a mesh.
    pub(super) fn of_triangles(marked: &MarkedMesh) -> Result<Self, String> {
        let marks = &marked.marks;
        let of = |of: Marked| move |mark: &&Mark| mark.of == of;
        let of_faces = property(marks.iter().filter(of(Marked::Triangles)));
        let of_vertices = property(marks.iter().filter(of(Marked::Vertices)));
        if let Some((name, values)) = of_faces {
            return Ok(Self {
                labels: whole(name, values)?,
                notes: vec![format!("the labels are the property `{name}` of the faces")],
            });
        }
        if let Some((name, values)) = of_vertices {
            let of_vertex = whole(name, values)?;
            return Ok(Self::by_majority(name, &of_vertex, &marked.mesh.triangles));
        }
        Ok(groups(marks).unwrap_or_default())
    }

    /// The labels of the points of a cloud.
    pub(super) fn of_points(marks: &[Mark]) -> Result<Self, String> {
        let Some((name, values)) = property(marks.iter()) else {
            return Ok(Self::default());
        };
        Ok(Self {
            labels: whole(name, values)?,
            notes: vec![format!(
                "the labels are the property `{name}` of the points"
            )],
        })
    }

    /// The label of at least two corners of each triangle, or [`IGNORE`] if all three differ.
    fn by_majority(name: &str, of_vertex: &[i32], triangles: &[[u32; 3]]) -> Self {
        let label = |corners: &[u32; 3]| {
            majority(
                corners.map(|vertex| of_vertex.get(vertex as usize).copied().unwrap_or(IGNORE)),
            )
        };
        let labels: Vec<i32> = triangles.iter().map(label).collect();
        let n_without = labels.iter().filter(|&&label| label == IGNORE).count();
        let mut notes = vec![format!(
            "the labels are those that most corners have by the property `{name}`"
        )];
        if n_without > 0 {
            notes.push(format!(
                "{n_without} triangles have no label, because their corners differ or have none"
            ));
        }
        Self { labels, notes }
    }
}

/// The property that holds labels.
fn property<'a>(marks: impl Iterator<Item = &'a Mark>) -> Option<(&'a str, &'a [f64])> {
    let rank = |mark: &'a Mark| {
        let name = mark.name.to_lowercase();
        let name = name.strip_prefix("scalar_").unwrap_or(&name);
        let rank = PROPERTIES.iter().position(|known| *known == name)?;
        match &mark.values {
            MarkValues::Numbers(values) => Some((rank, mark.name.as_str(), values.as_slice())),
            _ => None,
        }
    };
    let best = marks.filter_map(rank).min_by_key(|&(rank, ..)| rank);
    best.map(|(_, name, values)| (name, values))
}

/// The groups of triangles that count as labels.
fn groups(marks: &[Mark]) -> Option<Chosen> {
    let of_kind = |kind: &&str| {
        marks.iter().find_map(|mark| match &mark.values {
            MarkValues::Groups(values) if mark.name == *kind => Some((mark.name.as_str(), values)),
            _ => None,
        })
    };
    let has_several =
        |(_, values): &(&str, &Vec<u32>)| values.iter().any(|group| *group != values[0]);
    let (kind, values) = GROUPS.iter().filter_map(of_kind).find(has_several)?;
    Some(Chosen {
        labels: values
            .iter()
            .map(|&group| i32::try_from(group).unwrap_or(IGNORE))
            .collect(),
        notes: vec![format!(
            "the labels are the {kind}s of the faces, in the order of the file"
        )],
    })
}

fn whole(name: &str, values: &[f64]) -> Result<Vec<i32>, String> {
    let label = |(index, &value): (usize, &f64)| {
        label_of(value).map_err(|reason| format!("property `{name}`, value {index}: {reason}"))
    };
    values.iter().enumerate().map(label).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::Mesh;

    fn numbers(name: &str, of: Marked, values: &[f64]) -> Mark {
        Mark {
            name: name.to_owned(),
            of,
            values: MarkValues::Numbers(values.to_vec()),
        }
    }

    fn groups(name: &str, values: &[u32]) -> Mark {
        Mark {
            name: name.to_owned(),
            of: Marked::Triangles,
            values: MarkValues::Groups(values.to_vec()),
        }
    }

    /// The labels of two triangles with the vertices 0 1 2 and 0 2 3.
    #[track_caller]
    fn check(marks: &[Mark], expected: Result<&[i32], &str>) {
        let mesh = Mesh {
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let marked = MarkedMesh {
            mesh,
            marks: marks.to_vec(),
        };
        let found = Chosen::of_triangles(&marked).map(|chosen| chosen.labels);
        assert_eq!(found, expected.map(<[i32]>::to_vec).map_err(str::to_owned));
    }

    #[test]
    fn properties_come_before_groups_and_faces_before_vertices() {
        use Marked::{Triangles, Vertices};
        let of_vertices = numbers("Label", Vertices, &[5.0, 5.0, 6.0, 6.0]);
        let part = numbers("part", Triangles, &[7.0, -1.0]);
        check(&[], Ok(&[]));
        check(&[numbers("quality", Triangles, &[1.0, 2.0])], Ok(&[]));
        check(std::slice::from_ref(&of_vertices), Ok(&[5, 6]));
        check(
            &[of_vertices, part.clone(), groups("group", &[1, 2])],
            Ok(&[7, IGNORE]),
        );
        check(
            &[part, numbers("scalar_Label", Triangles, &[3.0, 4.0])],
            Ok(&[3, 4]),
        );
        check(
            &[groups("group", &[1, 1]), groups("material", &[1, 2])],
            Ok(&[1, 2]),
        );
        check(&[groups("group", &[1, 1])], Ok(&[]));
        check(
            &[numbers("label", Vertices, &[1.0, 2.0, 3.0, 3.0])],
            Ok(&[IGNORE, 3]),
        );
        check(
            &[numbers("label", Triangles, &[1.0, 0.5])],
            Err("property `label`, value 1: 0.5 is not a label: a whole number is expected"),
        );
    }
}

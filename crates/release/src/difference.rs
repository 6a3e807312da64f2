//! Finds the first face or edge at which two sets of labels of one shape differ.

use partprobe_tables::ShapeLabels;
use std::fmt::{self, Display};

/// The first difference of current labels from the released ones.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum LabelDifference {
    /// The numbers of faces differ.
    FaceCount {
        /// The number in the package.
        released: usize,
        /// The current number.
        now: usize,
    },
    /// A face has another `#` number, occurrence, type, part or label.
    Face {
        /// The `#` number of the face in the package.
        step_id: u64,
        /// The property that differs.
        what: String,
        /// The value in the package.
        released: String,
        /// The current value.
        now: String,
    },
    /// The labels of a source exist only on one side.
    Layer {
        /// The source.
        name: String,
        /// Whether the package has them.
        is_released: bool,
    },
    /// The numbers of shared edges differ.
    EdgeCount {
        /// The number in the package.
        released: usize,
        /// The current number.
        now: usize,
    },
    /// A shared edge lies between other faces, or has another angle.
    Edge {
        /// The `#` numbers of its faces in the package.
        step_ids: [u64; 2],
        /// The property that differs.
        what: &'static str,
        /// The value in the package.
        released: String,
        /// The current value.
        now: String,
    },
}

impl Display for LabelDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FaceCount { released, now } => {
                write!(f, "there are {now} faces, and the package has {released}")
            }
            Self::Face {
                step_id,
                what,
                released,
                now,
            } => write!(
                f,
                "face #{step_id} has {what} {now}, and the package has {released}"
            ),
            Self::Layer { name, is_released } => {
                let side = if *is_released { "only" } else { "not" };
                write!(f, "labels of `{name}` are {side} in the package")
            }
            Self::EdgeCount { released, now } => write!(
                f,
                "there are {now} shared edges, and the package has {released}"
            ),
            Self::Edge {
                step_ids: [a, b],
                what,
                released,
                now,
            } => write!(
                f,
                "the edge of the faces #{a} and #{b} has {what} {now}, and the package has {released}"
            ),
        }
    }
}

/// The first difference, or `None` if the labels are equal. Faces are compared before edges.
#[must_use]
pub fn first_difference(released: &ShapeLabels, now: &ShapeLabels) -> Option<LabelDifference> {
    if released.step_id.len() != now.step_id.len() {
        return Some(LabelDifference::FaceCount {
            released: released.step_id.len(),
            now: now.step_id.len(),
        });
    }
    different_layers(released, now)
        .or_else(|| different_face(released, now))
        .or_else(|| different_edge(released, now))
}

fn different_layers(released: &ShapeLabels, now: &ShapeLabels) -> Option<LabelDifference> {
    let names = released.layers.keys().chain(now.layers.keys());
    let is_alone =
        |name: &&String| released.layers.contains_key(*name) != now.layers.contains_key(*name);
    names
        .filter(is_alone)
        .min()
        .map(|name| LabelDifference::Layer {
            name: name.clone(),
            is_released: released.layers.contains_key(name),
        })
}

/// A value of each face, in words, with its name.
type FaceValues<'a> = (String, Box<dyn Fn(&ShapeLabels, usize) -> String + 'a>);

fn face_values(released: &ShapeLabels) -> Vec<FaceValues<'_>> {
    let value = |name: &str, value: fn(&ShapeLabels, usize) -> String| -> FaceValues<'_> {
        (name.to_owned(), Box::new(value))
    };
    let mut values = vec![
        value("the number", |labels, face| {
            format!("#{}", labels.step_id[face])
        }),
        value("the occurrence", |labels, face| {
            labels.instance[face].to_string()
        }),
        value("the type", |labels, face| {
            labels.face_type[face].to_string()
        }),
        value("the recognized type", |labels, face| {
            labels.canonical_type[face].to_string()
        }),
        value("the raw part", |labels, face| labels.part[face].to_string()),
        value("the part", |labels, face| labels.label[face].to_string()),
    ];
    for name in released.layers.keys() {
        let label = move |labels: &ShapeLabels, face: usize| labels.layers[name][face].to_string();
        values.push((format!("the label of `{name}`"), Box::new(label)));
    }
    values
}

fn different_face(released: &ShapeLabels, now: &ShapeLabels) -> Option<LabelDifference> {
    let values = face_values(released);
    (0..released.step_id.len()).find_map(|face| {
        values.iter().find_map(|(what, value)| {
            let (released_value, now) = (value(released, face), value(now, face));
            (released_value != now).then(|| LabelDifference::Face {
                step_id: released.step_id[face],
                what: what.clone(),
                released: released_value,
                now,
            })
        })
    })
}

fn different_edge(released: &ShapeLabels, now: &ShapeLabels) -> Option<LabelDifference> {
    if released.edge_faces.len() != now.edge_faces.len() {
        return Some(LabelDifference::EdgeCount {
            released: released.edge_faces.len(),
            now: now.edge_faces.len(),
        });
    }
    let step_ids = |labels: &ShapeLabels, edge: usize| {
        let step_id = |face: i32| {
            let position = usize::try_from(face).unwrap_or(usize::MAX);
            labels.step_id.get(position).copied().unwrap_or(0)
        };
        labels.edge_faces[edge].map(step_id)
    };
    let angle = |phi: Option<f64>| phi.map_or("undefined".to_owned(), |phi| format!("{phi}°"));
    (0..released.edge_faces.len()).find_map(|edge| {
        let faces = step_ids(released, edge);
        let difference = |what, released, now| LabelDifference::Edge {
            step_ids: faces,
            what,
            released,
            now,
        };
        if released.edge_faces[edge] != now.edge_faces[edge] {
            let [a, b] = step_ids(now, edge);
            let [c, d] = faces;
            let faces = |a, b| format!("#{a} and #{b}");
            return Some(difference("the faces", faces(c, d), faces(a, b)));
        }
        let (released_phi, phi) = (released.phi_deg[edge], now.phi_deg[edge]);
        (released_phi.map(f64::to_bits) != phi.map(f64::to_bits))
            .then(|| difference("the angle", angle(released_phi), angle(phi)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::two_faces;
    use partprobe_carrier::FaceType;

    /// The message for labels that were changed in this way.
    #[track_caller]
    fn check(change: impl Fn(&mut ShapeLabels), expected: &str) {
        let mut now = two_faces();
        change(&mut now);
        let message = first_difference(&two_faces(), &now).map(|found| found.to_string());
        assert_eq!(message.unwrap_or_default(), expected);
    }

    #[test]
    fn the_first_difference_names_its_face() {
        check(|_| {}, "");
        check(
            |labels| labels.step_id.truncate(1),
            "there are 1 faces, and the package has 2",
        );
        check(
            |labels| labels.step_id[1] = 21,
            "face #20 has the number #21, and the package has #20",
        );
        check(
            |labels| labels.face_type[0] = FaceType::Cone,
            "face #10 has the type cone, and the package has plane",
        );
        check(
            |labels| labels.label[1] = 0,
            "face #20 has the part 0, and the package has 1",
        );
        check(
            |labels| labels.layers.clear(),
            "labels of `smooth-12` are only in the package",
        );
        let one = |labels: &mut ShapeLabels| labels.layers.insert("a".to_owned(), vec![0, 0]);
        check(
            |labels| drop(one(labels)),
            "labels of `a` are not in the package",
        );
        check(
            |labels| labels.edge_faces.clear(),
            "there are 0 shared edges, and the package has 1",
        );
        check(
            |labels| labels.phi_deg[0] = None,
            "the edge of the faces #10 and #20 has the angle undefined, and the package has 90°",
        );
        check(
            |labels| labels.edge_faces[0] = [1, 0],
            "the edge of the faces #10 and #20 has the faces #20 and #10, and the package has #10 and #20",
        );
    }
}

//! Makes instances of classes: connected faces of one class are one instance.

use super::face_labels::RawLabel;
use partprobe_carrier::{FaceGraph, IGNORE};
use std::collections::{BTreeMap, BTreeSet};

/// Numbers the connected sets of faces with one class, in the order of their lowest faces. All faces of the background class have
/// one label, even if they are not connected. Faces without a class have no label.
pub(super) fn of_classes(
    graph: &FaceGraph,
    classes: &[RawLabel],
    background: Option<&str>,
) -> Vec<i32> {
    let is_background =
        |face: usize| background.is_some() && classes[face].as_deref() == background;
    let mut neighbors: Vec<Vec<usize>> = vec![Vec::new(); classes.len()];
    for edge in &graph.edges {
        let [a, b] = edge.faces.map(|face| face as usize);
        if classes[a] == classes[b] {
            neighbors[a].push(b);
            neighbors[b].push(a);
        }
    }

    let mut labels = vec![IGNORE; classes.len()];
    let mut background_label = None;
    let mut next = 0;
    for face in 0..classes.len() {
        if classes[face].is_none() || labels[face] != IGNORE {
            continue;
        }
        if is_background(face) {
            let label = *background_label.get_or_insert_with(|| {
                next += 1;
                next - 1
            });
            labels[face] = label;
            continue;
        }
        let mut open = vec![face];
        labels[face] = next;
        while let Some(face) = open.pop() {
            for &neighbor in &neighbors[face] {
                if labels[neighbor] == IGNORE {
                    labels[neighbor] = next;
                    open.push(neighbor);
                }
            }
        }
        next += 1;
    }
    labels
}

/// The number of classes whose faces are not all connected.
pub(super) fn n_separate(graph: &FaceGraph, classes: &[RawLabel]) -> usize {
    let mut instances_of: BTreeMap<&str, BTreeSet<i32>> = BTreeMap::new();
    for (class, instance) in classes.iter().zip(of_classes(graph, classes, None)) {
        if let Some(class) = class {
            instances_of.entry(class).or_default().insert(instance);
        }
    }
    instances_of
        .values()
        .filter(|instances| instances.len() > 1)
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::Edge;

    #[track_caller]
    fn check(classes: &str, edges: &[[u32; 2]], background: Option<&str>, expected: &[i32]) {
        let found = of_classes(&graph(edges), &labels(classes), background);
        assert_eq!(found, expected);
    }

    fn graph(edges: &[[u32; 2]]) -> FaceGraph {
        FaceGraph {
            faces: Vec::new(),
            edges: edges
                .iter()
                .map(|&faces| Edge {
                    faces,
                    phi: 90.0,
                    length: 1.0,
                })
                .collect(),
        }
    }

    /// A label per character. A face with `-` has none.
    fn labels(classes: &str) -> Vec<RawLabel> {
        classes
            .chars()
            .map(|class| (class != '-').then(|| class.to_string()))
            .collect()
    }

    #[test]
    fn classes_with_separate_faces_are_counted() {
        let chain = [[0, 1], [1, 2], [2, 3], [3, 4]];
        for (classes, expected) in [("aabbb", 0), ("aabaa", 1), ("ababa", 2), ("a-a-b", 1)] {
            assert_eq!(
                n_separate(&graph(&chain), &labels(classes)),
                expected,
                "{classes}"
            );
        }
    }

    #[test]
    fn faces_of_one_class_are_one_instance_if_they_meet() {
        let chain = [[0, 1], [1, 2], [2, 3], [3, 4]];
        check("aabaa", &chain, None, &[0, 0, 1, 2, 2]);
        check("aabaa", &chain, Some("a"), &[0, 0, 1, 0, 0]);
        check("aabaa", &chain, Some("b"), &[0, 0, 1, 2, 2]);
        check("a-aa-", &chain, None, &[0, -1, 1, 1, -1]);
        check("aaaaa", &[], None, &[0, 1, 2, 3, 4]);
    }
}

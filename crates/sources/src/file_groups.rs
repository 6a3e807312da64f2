//! Labels faces by their attributes in the file: solid, shell, color and name.
//!
//! The face graph of a carrier goes in, and one label per face comes out. A file whose colors or names merely number its faces is
//! refused with a reason, because such labels repeat `brep-face`.

use crate::factory::SourceFactory;
use crate::source::{SourceError, SourceLabels};
use partprobe_carrier::{Carrier, Face, Partition, ShapeKind};
use std::collections::BTreeSet;

/// Each solid is a label, and so is each open shell that belongs to no solid.
pub(crate) const SOLID: SourceFactory = SourceFactory::rule(
    "solid",
    "the solid that the face bounds; an open shell counts as one",
    |carrier, _| {
        grouped(carrier, |face| {
            (
                face.instance,
                face.solid,
                face.solid.map_or(face.shell, |_| 0),
            )
        })
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// Each shell is a label: a hollow solid has at least two.
pub(crate) const SHELL: SourceFactory = SourceFactory::rule(
    "shell",
    "the shell that the face lies in: a cavity is a shell of its own",
    |carrier, _| grouped(carrier, |face| (face.instance, face.shell)),
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// Each color is a label. Faces without a color have a further label.
pub(crate) const COLOR: SourceFactory = SourceFactory::rule(
    "color",
    "the color of the face in the file (STYLED_ITEM); refused if colors merely number the faces",
    |carrier, _| {
        let colors: Vec<Option<u32>> = carrier
            .graph()
            .faces
            .iter()
            .map(|face| face.color.map(|color| color.0))
            .collect();
        refuse_numbering(&colors, "color")?;
        Ok(SourceLabels::on_partition(
            carrier.mesh(),
            &Partition::from_keys(&colors),
        ))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// Each name is a label. Faces without a name have a further label.
pub(crate) const NAME: SourceFactory = SourceFactory::rule(
    "name",
    "the name of the face in the file (ADVANCED_FACE); refused if names merely number the faces",
    |carrier, _| {
        let named = |face: &Face| face.name.clone().filter(|name| !name.trim().is_empty());
        let names: Vec<Option<String>> = carrier.graph().faces.iter().map(named).collect();
        refuse_numbering(&names, "name")?;
        Ok(SourceLabels::on_partition(
            carrier.mesh(),
            &Partition::from_keys(&names),
        ))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

fn grouped<K: Ord>(carrier: &Carrier, key: fn(&Face) -> K) -> Result<SourceLabels, SourceError> {
    let keys: Vec<K> = carrier.graph().faces.iter().map(key).collect();
    Ok(SourceLabels::on_partition(
        carrier.mesh(),
        &Partition::from_keys(&keys),
    ))
}

/// Refuses keys that no face has, and keys that (almost) number the faces.
///
/// Keys number the faces if there are at least three faces, more than half of them have a key, and nine of ten of these keys
/// differ. The tenth allows for a number that two faces share, for example the two halves of a hole.
fn refuse_numbering<K: Ord>(keys: &[Option<K>], what: &str) -> Result<(), SourceError> {
    let unfit = |reason| SourceError::Unfit { reason };
    let n_keyed = keys.iter().flatten().count();
    let n_distinct = keys.iter().flatten().collect::<BTreeSet<_>>().len();

    if n_keyed == 0 {
        return Err(unfit(format!("no face has a {what}; use another source")));
    }
    let covers_most = keys.len() >= 3 && 2 * n_keyed > keys.len();
    if covers_most && 10 * n_distinct >= 9 * n_keyed {
        return Err(unfit(format!(
            "its {n_keyed} faces with a {what} have {n_distinct} different {what}s, which merely number the faces; \
             use `brep-face` for that"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::factory::SourceContext;
    use crate::registry::tests::{carrier_of_faces, plain_face};
    use partprobe_carrier::Color;

    /// The labels of a carrier with one triangle per face.
    fn labels(factory: &SourceFactory, faces: Vec<Face>) -> Result<Vec<i32>, String> {
        let source = factory
            .make(factory.pattern(), &SourceContext::default())
            .unwrap()
            .unwrap();
        let labels = source.labels(&carrier_of_faces(faces), 0);
        labels
            .map(|labels| labels.of_triangles().of_triangle().to_vec())
            .map_err(|error| error.to_string())
    }

    #[track_caller]
    fn check_grouping(factory: &SourceFactory, expected: &[i32]) {
        // Instance, solid and shell: a solid with a cavity, the same solid placed again, and two open shells.
        let places = [
            (0, Some(0), 0),
            (0, Some(0), 0),
            (0, Some(0), 1),
            (1, Some(0), 0),
            (0, None, 2),
            (0, None, 3),
            (0, None, 2),
        ];
        let face = |(instance, solid, shell)| Face {
            instance,
            solid,
            shell,
            ..plain_face()
        };
        assert_eq!(labels(factory, places.map(face).into()).unwrap(), expected);
    }

    #[test]
    fn faces_are_grouped_by_instance_solid_and_shell() {
        check_grouping(&SOLID, &[0, 0, 0, 1, 2, 3, 2]);
        check_grouping(&SHELL, &[0, 0, 1, 2, 3, 4, 3]);
    }

    /// `expected` is the labels, or a piece of the refusal.
    #[track_caller]
    fn check_keys(keys: &[&str], expected: Result<&[i32], &str>) {
        let color = |key: &str| {
            (!key.is_empty())
                .then(|| Color(key.bytes().fold(7, |sum, byte| sum * 31 + u32::from(byte))))
        };
        let face = |&key: &&str| Face {
            name: Some(key.to_owned()),
            color: color(key),
            ..plain_face()
        };
        for (factory, what) in [(NAME, "name"), (COLOR, "color")] {
            let found = labels(&factory, keys.iter().map(face).collect());
            match expected {
                Ok(expected) => assert_eq!(found.unwrap(), expected),
                Err(reason) => {
                    let (reason, error) = (reason.replace("KEY", what), found.unwrap_err());
                    assert!(error.contains(&reason), "{error}");
                }
            }
        }
    }

    #[test]
    fn names_and_colors_group_faces_unless_they_number_them() {
        check_keys(&["a"], Ok(&[0]));
        check_keys(&["a", "b"], Ok(&[0, 1]));
        check_keys(&["b", "a", "b"], Ok(&[0, 1, 0]));
        check_keys(&["", "a", "", "b"], Ok(&[0, 1, 0, 2]));
        check_keys(&["a", "b", "c", "a", "b", "c"], Ok(&[0, 1, 2, 0, 1, 2]));
        check_keys(&["", "", ""], Err("no face has a KEY"));
        check_keys(
            &["a", "b", "c"],
            Err("its 3 faces with a KEY have 3 different KEYs"),
        );
        check_keys(
            &["a", "b", "", "c"],
            Err("its 3 faces with a KEY have 3 different KEYs"),
        );
        let nearly = ["0", "1", "2", "3", "4", "5", "6", "7", "8", "8"];
        check_keys(
            &nearly,
            Err("its 10 faces with a KEY have 9 different KEYs"),
        );
        check_keys(
            &["0", "1", "2", "3", "4", "5", "6", "7", "7", "7"],
            Ok(&[0, 1, 2, 3, 4, 5, 6, 7, 7, 7]),
        );
    }
}

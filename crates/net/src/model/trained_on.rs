//! Lists the shapes that a backbone was trained on. Its weights file contains them, so that it is never scored on these shapes.
//!
//! Nothing here interprets the keys. The caller decides how to identify a shape.

use crate::config::TrainSettings;
use serde::{Deserialize, Serialize};

/// The supervision, the settings and the shapes of a training.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct TrainedOn {
    /// The label source.
    pub supervision: String,
    /// The settings of the training, including the seed.
    pub settings: TrainSettings,
    /// The shapes from which its gradients were computed.
    pub train: ShapeKeys,
    /// The shapes by which its checkpoint was selected.
    pub valid: ShapeKeys,
    /// The weights from which the training started, or `None` if they were random.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<InitialWeights>,
}

/// Weights of another training, from which a training starts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct InitialWeights {
    /// SHA-256 of their file, in hexadecimal.
    pub sha256: String,
    /// All shapes that they were trained on or selected by, including those of the weights from which they were trained. It is
    /// empty if their file names none.
    pub seen: ShapeKeys,
}

impl TrainedOn {
    /// All shapes that the weights have seen, in this training or in an earlier one.
    #[must_use]
    pub fn seen(&self) -> ShapeKeys {
        let before = self.initial.as_ref().map(|initial| &initial.seen);
        let each = [Some(&self.train), Some(&self.valid), before];
        let seen = each.into_iter().flatten();
        seen.fold(ShapeKeys::default(), |all, keys| all.union(keys))
    }
}

/// Keys that identify shapes without their names. Each list is sorted and contains each key once.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct ShapeKeys {
    /// A key of the text from which each shape was read.
    pub texts: Vec<String>,
    /// A key of each shape's mesh.
    pub meshes: Vec<String>,
}

impl ShapeKeys {
    /// The keys of these shapes. Each shape is given by the keys of its text and its mesh.
    #[must_use]
    pub fn of<'a>(shapes: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let (texts, meshes): (Vec<&str>, Vec<&str>) = shapes.into_iter().unzip();
        Self {
            texts: sorted(texts),
            meshes: sorted(meshes),
        }
    }

    /// The keys in either list.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let joined = |own: &[String], others: &[String]| {
            sorted(own.iter().chain(others).map(String::as_str).collect())
        };
        Self {
            texts: joined(&self.texts, &other.texts),
            meshes: joined(&self.meshes, &other.meshes),
        }
    }

    /// Whether a shape with this text or this mesh is among them.
    #[must_use]
    pub fn has(&self, text: &str, mesh: &str) -> bool {
        let is_in = |keys: &[String], key: &str| {
            keys.binary_search_by(|known| known.as_str().cmp(key))
                .is_ok()
        };
        is_in(&self.texts, text) || is_in(&self.meshes, mesh)
    }
}

fn sorted(mut keys: Vec<&str>) -> Vec<String> {
    keys.sort_unstable();
    keys.dedup();
    keys.into_iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_is_found_by_its_text_or_its_mesh() {
        let keys = ShapeKeys::of([("t2", "m1"), ("t1", "m2"), ("t1", "m3")]);
        assert_eq!(keys.texts, ["t1", "t2"]);
        for (text, mesh, expected) in [
            ("t1", "m1", true),
            ("t1", "x", true),
            ("x", "m3", true),
            ("m1", "t1", false),
        ] {
            assert_eq!(keys.has(text, mesh), expected, "{text} {mesh}");
        }
        assert!(!ShapeKeys::default().has("t1", "m1"));
    }

    #[test]
    fn weights_record_the_training_shapes_of_their_initial_weights() {
        let keys = |name: &str| ShapeKeys::of([(name, name)]);
        let trained_on = TrainedOn {
            supervision: "step-parts".to_owned(),
            settings: crate::testing::settings(3),
            train: keys("train"),
            valid: keys("valid"),
            initial: Some(InitialWeights {
                sha256: String::new(),
                seen: keys("before").union(&keys("train")),
            }),
        };
        assert_eq!(trained_on.seen().texts, ["before", "train", "valid"]);
        assert_eq!(trained_on.seen().meshes, ["before", "train", "valid"]);
    }
}

//! Reads the name of a clusterer in a config, and checks it against the list of clusterers.

use partprobe_cluster::{CLUSTERERS, Clusterer, ClustererFactory, ClustererSettings};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A clusterer that a config names.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClustererName(&'static ClustererFactory);

impl ClustererName {
    /// The name in the config, the score files and the tables.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        self.0.name
    }

    /// The clusterer with these settings.
    pub(crate) fn clusterer(
        self,
        settings: &ClustererSettings,
    ) -> Box<dyn Clusterer + Send + Sync> {
        (self.0.make)(settings)
    }
}

impl PartialEq for ClustererName {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl<'de> Deserialize<'de> for ClustererName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let unknown = || {
            let known: Vec<String> = CLUSTERERS
                .iter()
                .map(|factory| format!("`{}`", factory.name))
                .collect();
            de::Error::custom(format!(
                "unknown variant `{name}`, expected one of {}",
                known.join(", ")
            ))
        };

        ClustererFactory::named(&name).map(Self).ok_or_else(unknown)
    }
}

impl Serialize for ClustererName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

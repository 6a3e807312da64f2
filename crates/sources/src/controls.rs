//! Makes controls of granularity: sources that take their number of labels from another source.
//!
//! A source with more labels may lose a comparison because it has more labels, and not because they are worse. A control
//! keeps one of the two and changes the other. The labels of the other source go in, and labels with its number, or with at
//! most the number of STEP-Parts, come out.

use crate::capped::capped;
use crate::factory::BoxedSource;
use crate::source::{LabelSource, SourceError, SourceLabels};
use crate::step_merged::merged_to;
use crate::step_split::split_to;
use partprobe_carrier::Carrier;

/// The rule of a control, which changes the labels of another source: `(carrier, labels, seed) → labels`.
type ControlRule = fn(&Carrier, &SourceLabels, u64) -> SourceLabels;

/// Makes the sources whose names begin with a prefix and end with the name of another source.
#[derive(Clone, Copy, Debug)]
pub struct SourceControl {
    prefix: &'static str,
    description: &'static str,
    labels_faces: bool,
    rule: ControlRule,
}

/// Every control, in the order in which help texts list them.
pub const CONTROLS: &[SourceControl] = &[
    SourceControl {
        prefix: "step-merged-to-",
        description: "step-parts with random neighbors merged, at most as many labels as SOURCE has",
        labels_faces: true,
        rule: |carrier, other, seed| merged_to(carrier, other.n_labels().max(1), seed),
    },
    SourceControl {
        prefix: "step-split-to-",
        description: "step-parts with random parts cut by random planes until there are as many as SOURCE has",
        labels_faces: false,
        rule: |carrier, other, seed| split_to(carrier, other.n_labels(), seed),
    },
    SourceControl {
        prefix: "capped-",
        description: "SOURCE with its smallest labels merged into their neighbors, at most as many as step-parts has",
        labels_faces: false,
        rule: |carrier, other, _| capped(carrier, other),
    },
];

impl SourceControl {
    /// The control whose prefix a name has, and the name of the other source. Returns `None` if the name is not that of a
    /// control.
    #[must_use]
    pub fn of_name(name: &str) -> Option<(&'static Self, &str)> {
        CONTROLS
            .iter()
            .find_map(|control| Some((control, name.strip_prefix(control.prefix)?)))
            .filter(|(_, other)| !other.is_empty())
    }

    /// The pattern of its names. `<SOURCE>` is a placeholder for the name of another source.
    #[must_use]
    pub fn pattern(&self) -> String {
        format!("{}<SOURCE>", self.prefix)
    }

    /// A description of the labels in one line.
    #[must_use]
    pub fn description(&self) -> &'static str {
        self.description
    }

    /// Whether the labels are constant on each face of a carrier.
    #[must_use]
    pub fn labels_faces(&self) -> bool {
        self.labels_faces
    }

    /// The source that takes its number of labels from another one.
    #[must_use]
    pub fn of(&'static self, other: BoxedSource) -> BoxedSource {
        Box::new(ControlledSource {
            name: format!("{}{}", self.prefix, other.name()),
            control: self,
            other,
        })
    }
}

struct ControlledSource {
    name: String,
    control: &'static SourceControl,
    other: BoxedSource,
}

impl LabelSource for ControlledSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn labels(&self, carrier: &Carrier, seed: u64) -> Result<SourceLabels, SourceError> {
        let other = self.other.labels(carrier, seed)?;
        let labels = (self.control.rule)(carrier, &other, seed);
        // With other label files, the numbers change, and the labels with them.
        Ok(match other.origin() {
            Some(origin) => labels.with_origin(origin.clone()),
            None => labels,
        })
    }

    fn labels_faces(&self) -> bool {
        self.control.labels_faces
    }
}

//! Makes a source from the name that a user writes.
//!
//! Takes a name and a [`SourceContext`], and returns a source. The number in a name such as `ward-20` is read here and
//! nowhere else. Nothing here labels a surface, and nothing here knows which sources exist.

use crate::label_files::SourceFiles;
use crate::source::{LabelSource, SourceError, SourceLabels};
use partprobe_carrier::{Carrier, ShapeKind};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A source that any thread may use.
pub type BoxedSource = Box<dyn LabelSource + Send + Sync>;

/// The data that a source needs in addition to its name: parameters, for example the path of imported labels, and a way to read
/// files.
///
/// Each parameter has a name and a text as its value.
#[derive(Clone, Debug, Default)]
pub struct SourceContext {
    parameters: BTreeMap<String, String>,
    files: Option<Arc<dyn SourceFiles>>,
}

impl SourceContext {
    /// The same context with one more parameter. A parameter of the same name is replaced.
    #[must_use]
    pub fn with(mut self, parameter: impl Into<String>, value: impl Into<String>) -> Self {
        self.parameters.insert(parameter.into(), value.into());
        self
    }

    /// The same context with a way to read files.
    #[must_use]
    pub fn with_files(mut self, files: Arc<dyn SourceFiles>) -> Self {
        self.files = Some(files);
        self
    }

    /// The value of a parameter, or `None` if it is not set.
    #[must_use]
    pub fn parameter(&self, parameter: &str) -> Option<&str> {
        self.parameters.get(parameter).map(String::as_str)
    }

    /// All parameters, by name.
    #[must_use]
    pub fn parameters(&self) -> &BTreeMap<String, String> {
        &self.parameters
    }

    /// The way to read files, or `None` if the program gives none.
    #[must_use]
    pub fn files(&self) -> Option<&Arc<dyn SourceFiles>> {
        self.files.as_ref()
    }
}

/// A rule without a number: `(carrier, seed) → labels`.
pub type Rule = fn(&Carrier, u64) -> Result<SourceLabels, SourceError>;

/// A rule with the number from its name: `(carrier, number, seed) → labels`.
pub type NumberedRule = fn(&Carrier, u32, u64) -> Result<SourceLabels, SourceError>;

/// Makes the sources of one name pattern.
#[derive(Clone, Debug)]
pub struct SourceFactory {
    pattern: &'static str,
    description: &'static str,
    numbers: RangeInclusive<u32>,
    labels_faces: bool,
    needs: ShapeKind,
    build: Build,
}

#[derive(Clone, Copy, Debug)]
enum Build {
    Rule(Rule),
    NumberedRule(NumberedRule),
    Source(fn(&str, &SourceContext) -> Result<BoxedSource, SourceError>),
}

impl SourceFactory {
    /// A source that is one function.
    #[must_use]
    pub const fn rule(name: &'static str, description: &'static str, rule: Rule) -> Self {
        Self {
            pattern: name,
            description,
            numbers: 0..=0,
            labels_faces: false,
            needs: ShapeKind::Cloud,
            build: Build::Rule(rule),
        }
    }

    /// A source that is one function of the carrier and of the number that its name ends with.
    ///
    /// `pattern` ends with a placeholder, for example `ward-<K>`. `numbers` are the numbers that it accepts.
    #[must_use]
    pub const fn numbered_rule(
        pattern: &'static str,
        description: &'static str,
        numbers: RangeInclusive<u32>,
        rule: NumberedRule,
    ) -> Self {
        Self {
            pattern,
            description,
            numbers,
            labels_faces: false,
            needs: ShapeKind::Cloud,
            build: Build::NumberedRule(rule),
        }
    }

    /// A source that needs the context, for example because its labels come from outside.
    #[must_use]
    pub const fn source(
        name: &'static str,
        description: &'static str,
        build: fn(&str, &SourceContext) -> Result<BoxedSource, SourceError>,
    ) -> Self {
        Self {
            pattern: name,
            description,
            numbers: 0..=0,
            labels_faces: false,
            needs: ShapeKind::Cloud,
            build: Build::Source(build),
        }
    }

    /// The same rule, with the promise that its labels are made by [`SourceLabels::on_faces`] or
    /// [`SourceLabels::on_partition`]. A carrier can then store them as a layer.
    #[must_use]
    pub const fn labeling_faces(self) -> Self {
        Self {
            labels_faces: true,
            ..self
        }
    }

    /// The same rule, limited to shapes that have at least these data. Without this limit, a rule is applied to every shape,
    /// including clouds.
    ///
    /// A shape with a B-Rep has a mesh too, and a mesh is also a set of points. For other shapes, the source refuses with
    /// [`SourceError::Kind`].
    #[must_use]
    pub const fn needing(self, needs: ShapeKind) -> Self {
        Self { needs, ..self }
    }

    /// The data that a shape must have at least, so that the source can label it.
    #[must_use]
    pub fn needs(&self) -> ShapeKind {
        self.needs
    }

    /// Whether the labels are constant on each face of a carrier.
    #[must_use]
    pub fn labels_faces(&self) -> bool {
        self.labels_faces
    }

    /// The pattern of its names. A placeholder such as `<K>` stands for a whole number.
    #[must_use]
    pub fn pattern(&self) -> &'static str {
        self.pattern
    }

    /// A description of the labels in one line.
    #[must_use]
    pub fn description(&self) -> &'static str {
        self.description
    }

    /// The numbers that may stand for the placeholder, or `None` if the name has no placeholder.
    #[must_use]
    pub fn numbers(&self) -> Option<RangeInclusive<u32>> {
        matches!(self.build, Build::NumberedRule(_)).then(|| self.numbers.clone())
    }

    /// The source with this name, or `None` if the name does not match the pattern.
    ///
    /// # Errors
    /// If the name matches and its number is not possible, or the context lacks what the source needs.
    pub fn make(
        &self,
        name: &str,
        context: &SourceContext,
    ) -> Option<Result<BoxedSource, SourceError>> {
        match self.build {
            Build::Rule(rule) => {
                let label = move |carrier: &Carrier, seed| rule(carrier, seed);
                (name == self.pattern).then(|| Ok(self.named(name, label)))
            }
            Build::NumberedRule(rule) => {
                let number = name.strip_prefix(self.stem())?;
                Some(self.number(name, number).map(|number| {
                    let label = move |carrier: &Carrier, seed| rule(carrier, number, seed);
                    self.named(name, label)
                }))
            }
            Build::Source(build) => (name == self.pattern).then(|| build(name, context)),
        }
    }

    fn named<L>(&self, name: &str, label: L) -> BoxedSource
    where
        L: Fn(&Carrier, u64) -> Result<SourceLabels, SourceError> + Send + Sync + 'static,
    {
        Box::new(RuleSource {
            name: name.to_owned(),
            labels_faces: self.labels_faces,
            needs: self.needs,
            label,
        })
    }

    /// The pattern before its placeholder.
    fn stem(&self) -> &'static str {
        self.pattern.split('<').next().unwrap_or(self.pattern)
    }

    fn number(&self, name: &str, text: &str) -> Result<u32, SourceError> {
        // `020` or `+20` would look like another source than `20` in scores.
        let number = text
            .parse()
            .ok()
            .filter(|parsed: &u32| parsed.to_string() == text);

        number
            .filter(|number| self.numbers.contains(number))
            .ok_or_else(|| SourceError::Number {
                name: name.to_owned(),
                min: *self.numbers.start(),
                max: *self.numbers.end(),
            })
    }
}

/// A rule with the name by which it was requested.
struct RuleSource<L> {
    name: String,
    labels_faces: bool,
    needs: ShapeKind,
    label: L,
}

impl<L> LabelSource for RuleSource<L>
where
    L: Fn(&Carrier, u64) -> Result<SourceLabels, SourceError>,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn labels(&self, carrier: &Carrier, seed: u64) -> Result<SourceLabels, SourceError> {
        let found = carrier.kind();
        if self.needs < found {
            return Err(SourceError::Kind {
                source_name: self.name.clone(),
                needs: self.needs,
                found,
            });
        }
        (self.label)(carrier, seed)
    }

    fn labels_faces(&self) -> bool {
        self.labels_faces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::Labels;

    fn one_label(carrier: &Carrier) -> SourceLabels {
        SourceLabels::on_plain(Labels::compacted(&vec![0; carrier.mesh().triangles.len()]))
    }

    const NUMBERED: SourceFactory =
        SourceFactory::numbered_rule("part-<K>", "parts", 2..=30, |carrier, _, _| {
            Ok(one_label(carrier))
        });

    #[test]
    fn a_number_is_read_once_and_checked() {
        let context = SourceContext::default();
        for name in ["part-2", "part-30"] {
            assert_eq!(NUMBERED.make(name, &context).unwrap().unwrap().name(), name);
        }
        for name in [
            "part-",
            "part-1",
            "part-31",
            "part-020",
            "part-+20",
            "part-x",
            "part-99999999999",
        ] {
            let error = NUMBERED.make(name, &context).unwrap().err().unwrap();
            assert_eq!(
                error,
                SourceError::Number {
                    name: name.to_owned(),
                    min: 2,
                    max: 30
                }
            );
        }
        assert!(NUMBERED.make("parts", &context).is_none());
        assert_eq!(NUMBERED.numbers(), Some(2..=30));
    }

    #[test]
    fn a_source_can_use_its_context() {
        let factory = SourceFactory::source("file", "labels of a file", |_, context| {
            let missing = SourceError::Parameter {
                source_name: "file".to_owned(),
                parameter: "path".to_owned(),
            };
            context.parameter("path").ok_or(missing)?;
            Ok(Box::new(RuleSource {
                name: "file".to_owned(),
                labels_faces: false,
                needs: ShapeKind::Cloud,
                label: |carrier: &Carrier, _| Ok(one_label(carrier)),
            }))
        });
        let context = SourceContext::default();
        let error = factory.make("file", &context).unwrap().err().unwrap();
        assert_eq!(
            error.to_string(),
            "the source `file` needs the parameter `path`; set it"
        );
        assert_eq!(
            factory
                .make("file", &context.with("path", "x"))
                .unwrap()
                .unwrap()
                .name(),
            "file"
        );
        assert_eq!(factory.numbers(), None);
    }
}

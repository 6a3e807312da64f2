//! Defines a type of import: its name, its parameters, and the function that opens it.

use crate::import::{Import, ImportError};
use partprobe_sources::SourceContext;

/// A kind of label files, or of labels from another program.
#[derive(Clone, Copy, Debug)]
pub struct ImportType {
    /// The name in configs: `type = "faces"`.
    pub name: &'static str,
    /// One line that describes the files.
    pub description: &'static str,
    /// The parameters that it knows.
    pub keys: &'static [ParameterKey],
    /// Checks the values of the parameters without reading a file.
    pub check_values: fn(&SourceContext) -> Result<(), ImportError>,
    /// Makes an import whose parameters are all known.
    pub make: fn(&SourceContext) -> Result<Box<dyn Import>, ImportError>,
}

/// A parameter of a type.
#[derive(Clone, Copy, Debug)]
pub struct ParameterKey {
    /// The name in configs.
    pub name: &'static str,
    /// One line that describes it, with its possible values.
    pub description: &'static str,
    /// Whether it must be set.
    pub is_required: bool,
    /// Whether its value is the path of a file or a folder.
    pub is_path: bool,
}

impl ParameterKey {
    /// A parameter that must be set.
    #[must_use]
    pub const fn required(name: &'static str, description: &'static str) -> Self {
        Self {
            name,
            description,
            is_required: true,
            is_path: false,
        }
    }

    /// A parameter that need not be set.
    #[must_use]
    pub const fn optional(name: &'static str, description: &'static str) -> Self {
        Self {
            name,
            description,
            is_required: false,
            is_path: false,
        }
    }

    /// The same parameter, whose value is a path.
    #[must_use]
    pub const fn path(self) -> Self {
        Self {
            is_path: true,
            ..self
        }
    }
}

impl ImportType {
    /// The import of this type with the parameters of a context.
    ///
    /// # Errors
    /// If a parameter is unknown, missing or out of range, or the labels cannot be listed.
    pub fn open(&self, context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
        self.check(context)?;
        (self.make)(context)
    }

    /// Checks that the type knows all parameters, that all parameters that it needs are set, and that their values are possible.
    /// No file is read.
    ///
    /// # Errors
    /// If this is not so.
    pub fn check(&self, context: &SourceContext) -> Result<(), ImportError> {
        self.check_keys(context)?;
        (self.check_values)(context)
    }

    fn check_keys(&self, context: &SourceContext) -> Result<(), ImportError> {
        let is_known = |key: &str| self.keys.iter().any(|known| known.name == key);
        if let Some(key) = context.parameters().keys().find(|key| !is_known(key)) {
            return Err(ImportError::UnknownKey {
                import_type: self.name,
                key: key.clone(),
                known: names(self.keys.iter().map(|known| known.name)),
            });
        }

        let is_missing =
            |key: &&ParameterKey| key.is_required && context.parameter(key.name).is_none();
        match self.keys.iter().find(is_missing) {
            Some(key) => Err(ImportError::MissingKey {
                import_type: self.name,
                key: key.name,
            }),
            None => Ok(()),
        }
    }
}

/// The names in one line, for messages.
pub(crate) fn names(names: impl Iterator<Item = &'static str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

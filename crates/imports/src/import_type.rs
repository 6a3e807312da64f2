//! The list of every type of import; a type is looked up here by its name.
//!
//! A new type is one file with an [`ImportType`] constant, and one line in [`IMPORT_TYPES`].

use crate::import::{Import, ImportError};
use crate::{faces, mesh};
use partprobe_sources::SourceContext;

/// Every type, in the order in which help texts list them.
pub const IMPORT_TYPES: &[ImportType] = &[faces::FACES, mesh::MESH];

/// A kind of label files.
#[derive(Clone, Copy, Debug)]
pub struct ImportType {
    /// The name in configs: `type = "faces"`.
    pub name: &'static str,
    /// One line that says what the files hold.
    pub description: &'static str,
    /// The parameters that it knows.
    pub keys: &'static [ParameterKey],
    /// Makes an import whose parameters are all known.
    pub(crate) open: fn(&SourceContext) -> Result<Box<dyn Import>, ImportError>,
}

/// A parameter of a type.
#[derive(Clone, Copy, Debug)]
pub struct ParameterKey {
    /// The name in configs.
    pub name: &'static str,
    /// One line that says what it does, with the values that it may have.
    pub description: &'static str,
    /// Whether it must be set.
    pub is_required: bool,
}

/// The type with this name.
///
/// # Errors
/// If there is none; the message lists those that exist.
pub fn import_type(name: &str) -> Result<&'static ImportType, ImportError> {
    let found = IMPORT_TYPES.iter().find(|known| known.name == name);
    found.ok_or_else(|| ImportError::UnknownType {
        name: name.to_owned(),
        known: names(IMPORT_TYPES.iter().map(|known| known.name)),
    })
}

/// The import of this type with the parameters of a context.
///
/// # Errors
/// If there is no such type, a parameter is unknown, missing or out of range, or the labels cannot be listed.
pub fn open_import(
    type_name: &str,
    context: &SourceContext,
) -> Result<Box<dyn Import>, ImportError> {
    let import_type = import_type(type_name)?;
    import_type.check_keys(context)?;
    (import_type.open)(context)
}

impl ImportType {
    /// Refuses parameters that the type does not know, and misses those that it needs.
    ///
    /// # Errors
    /// If there is one.
    pub fn check_keys(&self, context: &SourceContext) -> Result<(), ImportError> {
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

fn names(names: impl Iterator<Item = &'static str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

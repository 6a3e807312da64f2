//! Lists every type of import, and finds a type by its name.
//!
//! A new type is one file with an [`ImportType`] constant, and one line in [`IMPORT_TYPES`].

use crate::import::{Import, ImportError};
use crate::import_type::{ImportType, names};
use crate::{faces, mesh, partfield, points};
use partprobe_sources::SourceContext;

/// Every type, in the order in which help texts list them.
pub const IMPORT_TYPES: &[ImportType] = &[
    faces::FACES,
    mesh::MESH,
    points::POINTS,
    partfield::PARTFIELD,
];

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

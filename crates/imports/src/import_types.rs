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

/// The type with this name among these, which may be [`IMPORT_TYPES`] and others.
///
/// # Errors
/// If there is no such type. The message lists those that exist.
pub fn import_type_among<'a>(
    types: impl IntoIterator<Item = &'a ImportType> + Clone,
    name: &str,
) -> Result<&'a ImportType, ImportError> {
    let found = types.clone().into_iter().find(|known| known.name == name);
    found.ok_or_else(|| ImportError::UnknownType {
        name: name.to_owned(),
        known: names(types.into_iter().map(|known| known.name)),
    })
}

/// The import of one of [`IMPORT_TYPES`] with the parameters of a context.
///
/// # Errors
/// If there is no such type, a parameter is unknown, missing or out of range, or the labels cannot be listed.
pub fn open_import(
    type_name: &str,
    context: &SourceContext,
) -> Result<Box<dyn Import>, ImportError> {
    import_type_among(IMPORT_TYPES, type_name)?.open(context)
}

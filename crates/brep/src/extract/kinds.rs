//! Classifies instances by their role in a shape: a listed item, a shell, a face, or an item below a face.

use crate::part21::{Exchange, Keyword, Param, Params, Record};

/// The role of an instance in the nesting of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A solid bounded by shells.
    Solid,
    /// A solid of planar facets.
    FacetedSolid,
    /// A surface model of shells.
    SurfaceModel,
    /// A set of surfaces with bounds of their own.
    GeometricSet,
    /// A set of faces that a surface model may list.
    Shell,
    /// A set of faces that only a face based surface model lists.
    FaceSet,
    /// A face.
    Face,
    /// Anything else.
    Other,
}

impl Kind {
    /// Whether a representation lists instances of this kind.
    pub(super) fn is_item(self) -> bool {
        self <= Self::GeometricSet
    }

    /// Whether it is a set of faces.
    pub(super) fn is_shell(self) -> bool {
        matches!(self, Self::Shell | Self::FaceSet)
    }
}

/// The kind of an instance.
pub(super) fn kind(exchange: &Exchange<'_>, record: Record) -> Kind {
    match record.keyword {
        Keyword::ManifoldSolidBrep | Keyword::BrepWithVoids => Kind::Solid,
        Keyword::FacetedBrep => Kind::FacetedSolid,
        Keyword::ShellBasedSurfaceModel | Keyword::FaceBasedSurfaceModel => Kind::SurfaceModel,
        Keyword::GeometricSet => Kind::GeometricSet,
        Keyword::ClosedShell
        | Keyword::OpenShell
        | Keyword::OrientedClosedShell
        | Keyword::OrientedOpenShell => Kind::Shell,
        Keyword::ConnectedFaceSet | Keyword::ConnectedFaceSubSet => Kind::FaceSet,
        Keyword::AdvancedFace
        | Keyword::FaceSurface
        | Keyword::Face
        | Keyword::OrientedFace
        | Keyword::Subface => Kind::Face,
        Keyword::Complex => {
            let is_a = |name: &str| exchange.partial(record, name).is_some();
            match () {
                () if is_a("FACETED_BREP") => Kind::FacetedSolid,
                () if is_a("MANIFOLD_SOLID_BREP") => Kind::Solid,
                () if is_a("SHELL_BASED_SURFACE_MODEL") => Kind::SurfaceModel,
                () if is_a("FACE") => Kind::Face,
                () => Kind::Other,
            }
        }
        _ => Kind::Other,
    }
}

/// The items and the context of a representation. Returns `None` for any other instance.
pub(super) fn representation<'a>(
    exchange: &Exchange<'a>,
    record: Record,
) -> Option<(Params<'a>, u64)> {
    let params = match record.keyword {
        Keyword::Complex => exchange.partial(record, "REPRESENTATION")?,
        Keyword::Representation => exchange.params(record),
        Keyword::Other
            if exchange
                .class_name(record)
                .to_ascii_uppercase()
                .contains("REPRESENTATION") =>
        {
            exchange.params(record)
        }
        _ => return None,
    };
    match params.first().ok()? {
        [
            Param::Text(_) | Param::Unset,
            Param::List(items),
            Param::Reference(context),
        ] => Some((items, context)),
        _ => None,
    }
}

/// Whether a representation lists something that has faces, or places another representation.
pub(super) fn lists_shapes(exchange: &Exchange<'_>, items: Params<'_>) -> bool {
    let records = items
        .iter()
        .filter_map(|item| exchange.record(item.ok()?.reference().ok()?));
    records
        .into_iter()
        .any(|item| item.keyword == Keyword::MappedItem || kind(exchange, item).is_item())
}

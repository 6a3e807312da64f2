//! Lists the solids, surface models and sets of surfaces of a file, in file order.

use super::construction_classes::{is_constructed_solid, is_operand};
use super::error::EntityError;
use super::file::StepFile;
use super::tessellation::is_triangulated;
use crate::part21::{Keyword, Param, ParamError, Record};

/// An entity that contains shells: a solid, a surface model or a similar entity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    pub(super) record: Record,
    pub(super) kind: RootKind,
}

/// The kind of a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RootKind {
    /// `MANIFOLD_SOLID_BREP` and similar classes.
    Solid,
    /// `SHELL_BASED_SURFACE_MODEL` or `FACE_BASED_SURFACE_MODEL`.
    SurfaceModel,
    /// `GEOMETRIC_SET`: surfaces with their own bounds.
    GeometricSet,
    /// A solid that is defined by its construction: `CSG_SOLID`, `EXTRUDED_AREA_SOLID` and similar classes.
    Construction,
    /// Faces and shells that a representation lists without a model around them. The record is that of the representation.
    Bare,
    /// `TESSELLATED_SOLID` or `TESSELLATED_SHELL`.
    Tessellated,
    /// Tessellated faces and sets that a representation lists without a body. The record is that of the representation.
    BareFacets,
}

/// Every solid and surface model, in file order.
pub(super) fn roots(source: &StepFile<'_>) -> Vec<Root> {
    let with_kind = |&record| {
        Some(Root {
            record,
            kind: root_kind(source, record)?,
        })
    };
    let mut roots: Vec<Root> = source
        .exchange
        .records()
        .iter()
        .filter_map(with_kind)
        .collect();
    roots.sort_by_key(|root| root.record.at);
    roots
}

/// The kind of an entity. Returns `None` if it is not a root.
pub(super) fn root_kind(source: &StepFile<'_>, record: Record) -> Option<RootKind> {
    match record.keyword {
        Keyword::ManifoldSolidBrep | Keyword::BrepWithVoids | Keyword::FacetedBrep => {
            Some(RootKind::Solid)
        }
        Keyword::ShellBasedSurfaceModel | Keyword::FaceBasedSurfaceModel => {
            Some(RootKind::SurfaceModel)
        }
        Keyword::GeometricSet => Some(RootKind::GeometricSet),
        Keyword::TessellatedSolid | Keyword::TessellatedShell => Some(RootKind::Tessellated),
        keyword if is_constructed_solid(keyword) => Some(RootKind::Construction),
        Keyword::Complex => complex_kind(source, record),
        _ => None,
    }
}

/// The kind of a complex instance, from the first of its classes that defines one.
fn complex_kind(source: &StepFile<'_>, record: Record) -> Option<RootKind> {
    if source.is_spline_or_context(record) {
        return None;
    }
    source
        .exchange
        .partials(record)
        .find_map(|(class, _)| match Keyword::from_name(class) {
            Keyword::Complex => None,
            keyword => root_kind(source, Record { keyword, ..record }),
        })
}

/// The kind of a root for an item that a representation lists without a body around it.
pub(super) fn bare_kind(source: &StepFile<'_>, item: Record) -> Option<RootKind> {
    match item.keyword {
        Keyword::AdvancedFace
        | Keyword::FaceSurface
        | Keyword::Face
        | Keyword::Subface
        | Keyword::OrientedFace
        | Keyword::ClosedShell
        | Keyword::OpenShell
        | Keyword::OrientedClosedShell
        | Keyword::OrientedOpenShell
        | Keyword::ConnectedFaceSet
        | Keyword::ConnectedFaceSubSet
        | Keyword::CurveBoundedSurface
        | Keyword::RectangularTrimmedSurface
        | Keyword::RectangularCompositeSurface => Some(RootKind::Bare),
        keyword if is_operand(keyword) => Some(RootKind::Bare),
        Keyword::TessellatedGeometricSet | Keyword::CubicBezierTriangulatedFace => {
            Some(RootKind::BareFacets)
        }
        _ if is_triangulated(source, item) => Some(RootKind::BareFacets),
        Keyword::Complex => {
            let is_a = |name| source.exchange.partial(item, name).is_some();
            match () {
                () if is_a("FACE_SURFACE") || is_a("CONNECTED_FACE_SET") => Some(RootKind::Bare),
                () if is_a("TESSELLATED_GEOMETRIC_SET") => Some(RootKind::BareFacets),
                () => None,
            }
        }
        _ => None,
    }
}

impl Root {
    /// The shells that the root names, with the outer shell first. For other roots, these are the elements of a geometric set, or
    /// the items of a tessellated body or of a representation.
    pub(super) fn shells(&self, source: &StepFile<'_>) -> Result<Vec<u64>, EntityError> {
        let list_class = match self.kind {
            RootKind::Solid => return self.shells_of_solid(source),
            RootKind::Construction => return Ok(Vec::new()),
            RootKind::SurfaceModel => "SHELL_BASED_SURFACE_MODEL",
            RootKind::GeometricSet => "GEOMETRIC_SET",
            RootKind::Tessellated => self.tessellated_class(source),
            RootKind::Bare | RootKind::BareFacets => return self.items(source),
        };
        let [list] = source.class_params(self.record, list_class, 1)?.first()?;
        Ok(list.list()?.references()?)
    }

    fn shells_of_solid(&self, source: &StepFile<'_>) -> Result<Vec<u64>, EntityError> {
        let [outer] = source
            .class_params(self.record, "MANIFOLD_SOLID_BREP", 1)?
            .first()?;
        let mut shells = vec![outer.reference()?];
        shells.extend(self.voids(source)?);
        Ok(shells)
    }

    fn voids(&self, source: &StepFile<'_>) -> Result<Vec<u64>, ParamError> {
        let params = match self.record.keyword {
            Keyword::BrepWithVoids => source.class_params(self.record, "BREP_WITH_VOIDS", 2)?,
            _ => match source.exchange.partial(self.record, "BREP_WITH_VOIDS") {
                Some(params) => params,
                None => return Ok(Vec::new()),
            },
        };
        let [voids] = params.first()?;
        voids.list()?.references()
    }

    /// The items of a representation that have no body and are of the root's kind.
    fn items(&self, source: &StepFile<'_>) -> Result<Vec<u64>, EntityError> {
        let [_, items] = source.representation_params(self.record)?.first()?;
        let is_here = |id: &u64| {
            source
                .exchange
                .record(*id)
                .and_then(|item| bare_kind(source, item))
                == Some(self.kind)
        };
        Ok(items
            .list()?
            .iter()
            .filter_map(|item| item.ok()?.reference().ok())
            .filter(is_here)
            .collect())
    }

    fn tessellated_class(&self, source: &StepFile<'_>) -> &'static str {
        if self.bounds_solid(source) {
            "TESSELLATED_SOLID"
        } else {
            "TESSELLATED_SHELL"
        }
    }

    /// Whether the root is a solid of the model.
    pub(super) fn bounds_solid(&self, source: &StepFile<'_>) -> bool {
        match self.kind {
            RootKind::Solid => true,
            RootKind::Tessellated => match self.record.keyword {
                Keyword::Complex => source
                    .exchange
                    .partial(self.record, "TESSELLATED_SOLID")
                    .is_some(),
                keyword => keyword == Keyword::TessellatedSolid,
            },
            _ => false,
        }
    }

    /// The exact body to which a tessellated body belongs, if it names one.
    pub(super) fn link(&self, source: &StepFile<'_>) -> Option<u64> {
        if self.kind != RootKind::Tessellated {
            return None;
        }
        let [_, link] = source
            .class_params(self.record, self.tessellated_class(source), 1)
            .ok()?
            .first()
            .ok()?;
        link.reference().ok()
    }

    /// The name parameter of the root.
    pub(super) fn name<'a>(&self, source: &StepFile<'a>) -> Option<Param<'a>> {
        let params = match self.record.keyword {
            Keyword::Complex => source
                .exchange
                .partial(self.record, "REPRESENTATION_ITEM")?,
            _ => source.exchange.params(self.record),
        };
        params.first::<1>().ok().map(|[name]| name)
    }
}

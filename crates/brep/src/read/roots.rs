//! The solids, surface models and sets of surfaces of a file, in file order, and what each names.

use super::error::EntityError;
use super::source::Source;
use crate::part21::{Keyword, Param, ParamError, Record};

/// An entity that shells hang from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    pub(super) record: Record,
    pub(super) kind: RootKind,
}

/// What shells bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RootKind {
    /// `MANIFOLD_SOLID_BREP` and its kin.
    Solid,
    /// `SHELL_BASED_SURFACE_MODEL` or `FACE_BASED_SURFACE_MODEL`.
    SurfaceModel,
    /// `GEOMETRIC_SET`: surfaces that carry their own bounds.
    GeometricSet,
}

/// Every solid and surface model, in file order.
pub(super) fn roots(source: &Source<'_>) -> Vec<Root> {
    let with_kind = |&record| Some(Root { record, kind: root_kind(source, record)? });
    let mut roots: Vec<Root> = source.exchange.records().iter().filter_map(with_kind).collect();
    roots.sort_by_key(|root| root.record.at);
    roots
}

fn root_kind(source: &Source<'_>, record: Record) -> Option<RootKind> {
    match record.keyword {
        Keyword::ManifoldSolidBrep | Keyword::BrepWithVoids | Keyword::FacetedBrep => Some(RootKind::Solid),
        Keyword::ShellBasedSurfaceModel | Keyword::FaceBasedSurfaceModel => Some(RootKind::SurfaceModel),
        Keyword::GeometricSet => Some(RootKind::GeometricSet),
        Keyword::Complex => {
            let is_a = |name| source.exchange.partial(record, name).is_some();
            match () {
                () if is_a("MANIFOLD_SOLID_BREP") => Some(RootKind::Solid),
                () if is_a("SHELL_BASED_SURFACE_MODEL") => Some(RootKind::SurfaceModel),
                () => None,
            }
        }
        _ => None,
    }
}

impl Root {
    /// The shells that the root names, outer shell first; the elements of a geometric set.
    pub(super) fn shells(&self, source: &Source<'_>) -> Result<Vec<u64>, EntityError> {
        let mut shells = Vec::new();
        let list_class = match self.kind {
            RootKind::Solid => None,
            RootKind::SurfaceModel => Some("SHELL_BASED_SURFACE_MODEL"),
            RootKind::GeometricSet => Some("GEOMETRIC_SET"),
        };
        if let Some(class) = list_class {
            let [list] = source.part(self.record, class, 1)?.first()?;
            return Ok(list.list()?.references()?);
        }
        let [outer] = source.part(self.record, "MANIFOLD_SOLID_BREP", 1)?.first()?;
        shells.push(outer.reference()?);
        shells.extend(self.voids(source)?);
        Ok(shells)
    }

    fn voids(&self, source: &Source<'_>) -> Result<Vec<u64>, ParamError> {
        let params = match self.record.keyword {
            Keyword::BrepWithVoids => source.part(self.record, "BREP_WITH_VOIDS", 2)?,
            _ => match source.exchange.partial(self.record, "BREP_WITH_VOIDS") {
                Some(params) => params,
                None => return Ok(Vec::new()),
            },
        };
        let [voids] = params.first()?;
        voids.list()?.references()
    }

    /// The name parameter of the root.
    pub(super) fn name<'a>(&self, source: &Source<'a>) -> Option<Param<'a>> {
        let params = match self.record.keyword {
            Keyword::Complex => source.exchange.partial(self.record, "REPRESENTATION_ITEM")?,
            _ => source.exchange.params(self.record),
        };
        params.first::<1>().ok().map(|[name]| name)
    }
}

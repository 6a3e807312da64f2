//! Solids that a file gives by what makes them (constructive solid geometry, sweeps): each is named, none is evaluated.

use super::error::{EntityError, Problem};
use super::source::Source;
use super::space::Reader;
use super::topology::TopologyBuilder;
use crate::model::LossKind;
use crate::part21::{Keyword, Param, Record};

/// Whether an entity is a solid, or a part of one, that is given by what makes it.
pub(super) fn is_construction(keyword: Keyword) -> bool {
    matches!(
        keyword,
        Keyword::CsgSolid
            | Keyword::BooleanResult
            | Keyword::Block
            | Keyword::RightAngularWedge
            | Keyword::RightCircularCone
            | Keyword::RightCircularCylinder
            | Keyword::Sphere
            | Keyword::Torus
            | Keyword::HalfSpaceSolid
            | Keyword::BoxedHalfSpace
            | Keyword::ExtrudedAreaSolid
            | Keyword::ExtrudedFaceSolid
            | Keyword::RevolvedAreaSolid
            | Keyword::RevolvedFaceSolid
            | Keyword::SurfaceCurveSweptAreaSolid
            | Keyword::SurfaceCurveSweptFaceSolid
            | Keyword::SweptDiskSolid
            | Keyword::SolidReplica
    )
}

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// Names a solid that would have to be evaluated, with what it is made of.
    pub(super) fn add_construction(&mut self, _reader: Reader<'s, 'a>, record: Record) {
        let error = EntityError::from(Problem::Construction(description(self.source, record)));
        self.lose(LossKind::Entity, record.id, &error.within(record.id));
    }
}

/// The class of a construction, and the operator or primitive at the root of its tree.
fn description(source: &Source<'_>, record: Record) -> String {
    let class = source.exchange.class_name(record);
    match tree_root(source, record) {
        Some((id, root)) => format!("a {class} of {root} #{id}"),
        None => format!("a {class}"),
    }
}

/// The expression at the root of a `CSG_SOLID`: a boolean result with its operator, or a primitive.
fn tree_root(source: &Source<'_>, record: Record) -> Option<(u64, String)> {
    if record.keyword == Keyword::BooleanResult {
        return None;
    }
    let [root] = source.part(record, "CSG_SOLID", 1).ok()?.first().ok()?;
    let root = source.record(root.reference().ok()?).ok()?;
    let class = source.exchange.class_name(root);
    if root.keyword != Keyword::BooleanResult {
        return Some((root.id, class));
    }
    let [_, operator] = source.params(root).ok()?;
    let operator = match operator {
        Param::Enum(operator) => String::from_utf8_lossy(operator).to_lowercase(),
        _ => "unknown".to_owned(),
    };
    Some((root.id, format!("{class} ({operator})")))
}

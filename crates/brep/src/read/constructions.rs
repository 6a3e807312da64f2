//! Solids that a file gives by what makes them: a primitive alone becomes a body of faces, everything else (booleans,
//! sweeps, replicas) is named and not evaluated.

use super::error::{EntityError, Problem};
use super::file::StepFile;
use super::primitives::is_primitive;
use super::space::Reader;
use super::topology::TopologyBuilder;
use crate::model::LostKind;
use crate::part21::{Keyword, Param, Record};

/// Whether an entity is a solid, or a part of one, that is given by what makes it.
pub(super) fn is_construction(keyword: Keyword) -> bool {
    is_constructed_solid(keyword) || is_operand(keyword)
}

/// Whether an entity is a solid of the model that is given by what makes it.
pub(super) fn is_constructed_solid(keyword: Keyword) -> bool {
    matches!(
        keyword,
        Keyword::CsgSolid
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

/// Whether an entity may be an operand of a boolean, and is a body only where a representation lists it.
pub(super) fn is_operand(keyword: Keyword) -> bool {
    matches!(
        keyword,
        Keyword::BooleanResult
            | Keyword::Block
            | Keyword::RightAngularWedge
            | Keyword::RightCircularCone
            | Keyword::RightCircularCylinder
            | Keyword::Sphere
            | Keyword::Torus
            | Keyword::HalfSpaceSolid
            | Keyword::BoxedHalfSpace
    )
}

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// Adds a primitive, or names a solid that would have to be evaluated, with what it is made of.
    pub(super) fn add_construction(&mut self, reader: Reader<'s, 'a>, record: Record) {
        let outcome = match self
            .source
            .entity(record.id, |record| tree_root(self.source, record))
        {
            Ok(root) if is_primitive(root.keyword) => self.add_primitive(reader, record, root),
            Ok(root) => Err(Problem::Construction(description(self.source, record, root)).into()),
            Err(error) => Err(error),
        };
        if let Err(error) = outcome {
            self.lose(LostKind::Entity, record.id, &error.within(record.id));
        }
    }
}

/// What a solid is made of: the root of the tree of a `CSG_SOLID`, and any other entity itself.
fn tree_root(source: &StepFile<'_>, record: Record) -> Result<Record, EntityError> {
    let params = match record.keyword {
        Keyword::CsgSolid => source.class_params(record, "CSG_SOLID", 1)?,
        Keyword::Complex => match source.exchange.partial(record, "CSG_SOLID") {
            Some(params) => params,
            None => return Ok(record),
        },
        _ => return Ok(record),
    };
    let [root] = params.first()?;
    source.record(root.reference()?)
}

/// The class of a construction, and the operator at the root of its tree.
fn description(source: &StepFile<'_>, record: Record, root: Record) -> String {
    let (class, of) = (
        source.exchange.class_name(record),
        source.exchange.class_name(root),
    );
    let operator = match source.params(root) {
        Ok([_, Param::Enum(operator)]) if root.keyword == Keyword::BooleanResult => {
            format!(" ({})", String::from_utf8_lossy(operator).to_lowercase())
        }
        _ => String::new(),
    };
    if record.id == root.id {
        format!("{class}{operator}")
    } else {
        format!("{class} of {of} #{}{operator}", root.id)
    }
}

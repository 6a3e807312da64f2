//! Classifies the entities that define a solid by its construction.

use crate::part21::Keyword;

/// Whether an entity is a solid that is defined by its construction, or an operand of one.
pub(super) fn is_construction(keyword: Keyword) -> bool {
    is_constructed_solid(keyword) || is_operand(keyword)
}

/// Whether an entity is a solid of the model that is defined by its construction.
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

/// Whether an entity may be an operand of a Boolean operation. It is a body only if a representation lists it.
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

/// Whether an entity is a primitive that becomes faces.
pub(super) fn is_primitive(keyword: Keyword) -> bool {
    matches!(
        keyword,
        Keyword::Block
            | Keyword::RightAngularWedge
            | Keyword::RightCircularCylinder
            | Keyword::RightCircularCone
            | Keyword::Sphere
            | Keyword::Torus
    )
}

//! Translates the short names of entity classes, which files of the standard's first edition may contain.
//!
//! ISO 10303 registers a short name of at most six characters for each entity. This list has those of shapes, structure, units
//! and styles. A class whose short name is its own name (`PLANE`, `LINE`, `FACE`) is omitted.

/// The length of the longest short name.
pub(super) const LONGEST: usize = 6;

/// The full name of a class, from its short name in capital or small letters.
pub(super) fn long_name(short: &[u8]) -> Option<&'static str> {
    if short.len() > LONGEST {
        return None;
    }
    let mut upper_case = [0; LONGEST];
    let upper_case = &mut upper_case[..short.len()];
    upper_case.copy_from_slice(short);
    upper_case.make_ascii_uppercase();
    of_upper_case(upper_case)
}

macro_rules! short_names {
    ($($short:literal = $long:literal),* $(,)?) => {
        fn of_upper_case(short: &[u8]) -> Option<&'static str> {
            match short {
                $($short => Some($long),)*
                _ => None,
            }
        }

        #[cfg(test)]
        const ALL: &[(&[u8], &str)] = &[$(($short, $long)),*];
    };
}

short_names! {
    b"ABSR" = "ADVANCED_BREP_SHAPE_REPRESENTATION",
    b"ADVFC" = "ADVANCED_FACE",
    b"ARUNT" = "AREA_UNIT",
    b"AX1PLC" = "AXIS1_PLACEMENT",
    b"A2PL2D" = "AXIS2_PLACEMENT_2D",
    b"A2PL3D" = "AXIS2_PLACEMENT_3D",
    b"BZRCRV" = "BEZIER_CURVE",
    b"BZRSRF" = "BEZIER_SURFACE",
    b"BLNRSL" = "BOOLEAN_RESULT",
    b"BNDCR" = "BOUNDARY_CURVE",
    b"BNDCRV" = "BOUNDED_CURVE",
    b"BNDSRF" = "BOUNDED_SURFACE",
    b"BXHLSP" = "BOXED_HALF_SPACE",
    b"BXDMN" = "BOX_DOMAIN",
    b"BRWTVD" = "BREP_WITH_VOIDS",
    b"BSPCR" = "B_SPLINE_CURVE",
    b"BSCWK" = "B_SPLINE_CURVE_WITH_KNOTS",
    b"BSPSR" = "B_SPLINE_SURFACE",
    b"BSSWK" = "B_SPLINE_SURFACE_WITH_KNOTS",
    b"CRTPNT" = "CARTESIAN_POINT",
    b"CRTROP" = "CARTESIAN_TRANSFORMATION_OPERATOR",
    b"CTO2" = "CARTESIAN_TRANSFORMATION_OPERATOR_2D",
    b"CTO3" = "CARTESIAN_TRANSFORMATION_OPERATOR_3D",
    b"CLSSHL" = "CLOSED_SHELL",
    b"CLRRGB" = "COLOUR_RGB",
    b"CLRSPC" = "COLOUR_SPECIFICATION",
    b"CMPCRV" = "COMPOSITE_CURVE",
    b"CCOS" = "COMPOSITE_CURVE_ON_SURFACE",
    b"CMCRSG" = "COMPOSITE_CURVE_SEGMENT",
    b"CMRPIT" = "COMPOUND_REPRESENTATION_ITEM",
    b"CMS0" = "COMPOUND_SHAPE_REPRESENTATION",
    b"CNCSRF" = "CONICAL_SURFACE",
    b"CNEDST" = "CONNECTED_EDGE_SET",
    b"CNFCST" = "CONNECTED_FACE_SET",
    b"CFSS" = "CONNECTED_FACE_SUB_SET",
    b"CNGMRP" = "CONSTRUCTIVE_GEOMETRY_REPRESENTATION",
    b"CGRR" = "CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP",
    b"CDORSI" = "CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM",
    b"CDSR" = "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
    b"CNBSUN" = "CONVERSION_BASED_UNIT",
    b"CSSHRP" = "CSG_SHAPE_REPRESENTATION",
    b"CSGSLD" = "CSG_SOLID",
    b"CRBNSR" = "CURVE_BOUNDED_SURFACE",
    b"CRVRPL" = "CURVE_REPLICA",
    b"CYLSRF" = "CYLINDRICAL_SURFACE",
    b"DFNRPR" = "DEFINITIONAL_REPRESENTATION",
    b"DGNPCR" = "DEGENERATE_PCURVE",
    b"DGTRSR" = "DEGENERATE_TOROIDAL_SURFACE",
    b"DRVUNT" = "DERIVED_UNIT",
    b"DMNEXP" = "DIMENSIONAL_EXPONENTS",
    b"DRCTN" = "DIRECTION",
    b"DRGMDL" = "DRAUGHTING_MODEL",
    b"DMIA" = "DRAUGHTING_MODEL_ITEM_ASSOCIATION",
    b"DPDC" = "DRAUGHTING_PRE_DEFINED_COLOUR",
    b"DRSBRP" = "DRAUGHTING_SUBFIGURE_REPRESENTATION",
    b"EBWM" = "EDGE_BASED_WIREFRAME_MODEL",
    b"EBWSR" = "EDGE_BASED_WIREFRAME_SHAPE_REPRESENTATION",
    b"EDGCRV" = "EDGE_CURVE",
    b"EDGLP" = "EDGE_LOOP",
    b"ELMSRF" = "ELEMENTARY_SURFACE",
    b"ELLPS" = "ELLIPSE",
    b"EVDGPC" = "EVALUATED_DEGENERATE_PCURVE",
    b"EXARSL" = "EXTRUDED_AREA_SOLID",
    b"EXFCSL" = "EXTRUDED_FACE_SOLID",
    b"FCTBR" = "FACETED_BREP",
    b"FBSR" = "FACETED_BREP_SHAPE_REPRESENTATION",
    b"FCBND" = "FACE_BOUND",
    b"FCOTBN" = "FACE_OUTER_BOUND",
    b"FCSRF" = "FACE_SURFACE",
    b"FLARST" = "FILL_AREA_STYLE",
    b"FASC" = "FILL_AREA_STYLE_COLOUR",
    b"FNDFTR" = "FUNCTIONALLY_DEFINED_TRANSFORMATION",
    b"GBSSR" = "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION",
    b"GBWSR" = "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION",
    b"GMCRST" = "GEOMETRIC_CURVE_SET",
    b"GMRPCN" = "GEOMETRIC_REPRESENTATION_CONTEXT",
    b"GMRPIT" = "GEOMETRIC_REPRESENTATION_ITEM",
    b"GMTST" = "GEOMETRIC_SET",
    b"GC" = "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT",
    b"GUAC" = "GLOBAL_UNIT_ASSIGNED_CONTEXT",
    b"HLSPSL" = "HALF_SPACE_SOLID",
    b"HYPRBL" = "HYPERBOLA",
    b"INRPIT" = "INTEGER_REPRESENTATION_ITEM",
    b"INTCRV" = "INTERSECTION_CURVE",
    b"INVSBL" = "INVISIBILITY",
    b"ITDFTR" = "ITEM_DEFINED_TRANSFORMATION",
    b"IIRU" = "ITEM_IDENTIFIED_REPRESENTATION_USAGE",
    b"LMWU" = "LENGTH_MEASURE_WITH_UNIT",
    b"LNGUNT" = "LENGTH_UNIT",
    b"MNSLBR" = "MANIFOLD_SOLID_BREP",
    b"MSSR" = "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
    b"MPPITM" = "MAPPED_ITEM",
    b"MMWU" = "MASS_MEASURE_WITH_UNIT",
    b"MSSUNT" = "MASS_UNIT",
    b"MSRPIT" = "MEASURE_REPRESENTATION_ITEM",
    b"MSWTUN" = "MEASURE_WITH_UNIT",
    b"MDGPA" = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_AREA",
    b"MDGPR" = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION",
    b"NMDUNT" = "NAMED_UNIT",
    b"NAUO" = "NEXT_ASSEMBLY_USAGE_OCCURRENCE",
    b"NMSSR" = "NON_MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
    b"OFCR3D" = "OFFSET_CURVE_3D",
    b"OFFSRF" = "OFFSET_SURFACE",
    b"OPNSHL" = "OPEN_SHELL",
    b"ORCLSH" = "ORIENTED_CLOSED_SHELL",
    b"ORNEDG" = "ORIENTED_EDGE",
    b"ORNFC" = "ORIENTED_FACE",
    b"OROPSH" = "ORIENTED_OPEN_SHELL",
    b"ORNPTH" = "ORIENTED_PATH",
    b"ORNSRF" = "ORIENTED_SURFACE",
    b"OTBNCR" = "OUTER_BOUNDARY_CURVE",
    b"ORSI" = "OVER_RIDING_STYLED_ITEM",
    b"PRBL" = "PARABOLA",
    b"PRRPCN" = "PARAMETRIC_REPRESENTATION_CONTEXT",
    b"PLCMNT" = "PLACEMENT",
    b"PAMWU" = "PLANE_ANGLE_MEASURE_WITH_UNIT",
    b"PLANUN" = "PLANE_ANGLE_UNIT",
    b"PNONCR" = "POINT_ON_CURVE",
    b"PNONSR" = "POINT_ON_SURFACE",
    b"PNTRPL" = "POINT_REPLICA",
    b"PLYLN" = "POLYLINE",
    b"PLYLP" = "POLY_LOOP",
    b"PRSAR" = "PRESENTATION_AREA",
    b"PRLYAS" = "PRESENTATION_LAYER_ASSIGNMENT",
    b"PRSRPR" = "PRESENTATION_REPRESENTATION",
    b"PRSST" = "PRESENTATION_SET",
    b"PRSTAS" = "PRESENTATION_STYLE_ASSIGNMENT",
    b"PSBC" = "PRESENTATION_STYLE_BY_CONTEXT",
    b"PRSVW" = "PRESENTATION_VIEW",
    b"PRITRP" = "PRESENTED_ITEM_REPRESENTATION",
    b"PRDFCL" = "PRE_DEFINED_COLOUR",
    b"PRDCT" = "PRODUCT",
    b"PRDDFN" = "PRODUCT_DEFINITION",
    b"PRDFFR" = "PRODUCT_DEFINITION_FORMATION",
    b"PDFR" = "PRODUCT_DEFINITION_FORMATION_RELATIONSHIP",
    b"PDFWSS" = "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE",
    b"PRDFSH" = "PRODUCT_DEFINITION_SHAPE",
    b"PDWAD" = "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS",
    b"PRPDFN" = "PROPERTY_DEFINITION",
    b"PRDFRP" = "PROPERTY_DEFINITION_REPRESENTATION",
    b"QLRPIT" = "QUALIFIED_REPRESENTATION_ITEM",
    b"QSUNCR" = "QUASI_UNIFORM_CURVE",
    b"QSUNSR" = "QUASI_UNIFORM_SURFACE",
    b"RBSC" = "RATIONAL_B_SPLINE_CURVE",
    b"RBSS" = "RATIONAL_B_SPLINE_SURFACE",
    b"RCCMSR" = "RECTANGULAR_COMPOSITE_SURFACE",
    b"RCTRSR" = "RECTANGULAR_TRIMMED_SURFACE",
    b"RCCS" = "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT",
    b"RPRSNT" = "REPRESENTATION",
    b"RPRCNT" = "REPRESENTATION_CONTEXT",
    b"RPRITM" = "REPRESENTATION_ITEM",
    b"RPRMP" = "REPRESENTATION_MAP",
    b"RPRRLT" = "REPRESENTATION_RELATIONSHIP",
    b"RRWT" = "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION",
    b"RVARSL" = "REVOLVED_AREA_SOLID",
    b"RVFCSL" = "REVOLVED_FACE_SOLID",
    b"RGANWD" = "RIGHT_ANGULAR_WEDGE",
    b"RGCRCN" = "RIGHT_CIRCULAR_CONE",
    b"RGCRCY" = "RIGHT_CIRCULAR_CYLINDER",
    b"SMCRV" = "SEAM_CURVE",
    b"SHDFRP" = "SHAPE_DEFINITION_REPRESENTATION",
    b"SHPRPR" = "SHAPE_REPRESENTATION",
    b"SHRPRL" = "SHAPE_REPRESENTATION_RELATIONSHIP",
    b"SRWP" = "SHAPE_REPRESENTATION_WITH_PARAMETERS",
    b"SBSM" = "SHELL_BASED_SURFACE_MODEL",
    b"SUNT" = "SI_UNIT",
    b"SAMWU" = "SOLID_ANGLE_MEASURE_WITH_UNIT",
    b"SLANUN" = "SOLID_ANGLE_UNIT",
    b"SLDMDL" = "SOLID_MODEL",
    b"SLDRPL" = "SOLID_REPLICA",
    b"SPHSRF" = "SPHERICAL_SURFACE",
    b"STYITM" = "STYLED_ITEM",
    b"SBDG" = "SUBEDGE",
    b"SBFC" = "SUBFACE",
    b"SRFC" = "SURFACE",
    b"SRFCRV" = "SURFACE_CURVE",
    b"SL" = "SURFACE_OF_LINEAR_EXTRUSION",
    b"SROFRV" = "SURFACE_OF_REVOLUTION",
    b"SRFPTC" = "SURFACE_PATCH",
    b"SRFRPL" = "SURFACE_REPLICA",
    b"SRSDST" = "SURFACE_SIDE_STYLE",
    b"SSFA" = "SURFACE_STYLE_FILL_AREA",
    b"SRSTUS" = "SURFACE_STYLE_USAGE",
    b"SWARSL" = "SWEPT_AREA_SOLID",
    b"SWFCSL" = "SWEPT_FACE_SOLID",
    b"SWPSRF" = "SWEPT_SURFACE",
    b"TPRPIT" = "TOPOLOGICAL_REPRESENTATION_ITEM",
    b"TRDSRF" = "TOROIDAL_SURFACE",
    b"TRMCRV" = "TRIMMED_CURVE",
    b"UMWU" = "UNCERTAINTY_MEASURE_WITH_UNIT",
    b"UNFCRV" = "UNIFORM_CURVE",
    b"UNFSRF" = "UNIFORM_SURFACE",
    b"VLRPIT" = "VALUE_REPRESENTATION_ITEM",
    b"VRTLP" = "VERTEX_LOOP",
    b"VRTPNT" = "VERTEX_POINT",
    b"VLMUNT" = "VOLUME_UNIT",
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part21::Keyword;

    #[test]
    fn every_class_has_one_short_name() {
        assert_eq!(long_name(b"ADVFC"), Some("ADVANCED_FACE"));
        assert_eq!(long_name(b"advfc"), Some("ADVANCED_FACE"));
        assert_eq!(long_name(b"ADVFCE"), None);
        assert_eq!(long_name(b"ADVANCED_FACE"), None);
        let longs: std::collections::BTreeSet<&str> = ALL.iter().map(|(_, long)| *long).collect();
        assert_eq!(longs.len(), ALL.len());
        assert!(ALL.iter().all(|(short, long)| short.len() <= LONGEST && long_name(long.as_bytes()).is_none()));
    }

    #[test]
    fn a_short_name_is_the_class_of_its_full_name() {
        for (short, long) in ALL {
            assert_eq!(
                Keyword::from_name(short),
                Keyword::from_name(long.as_bytes()),
                "{long}"
            );
        }
    }
}

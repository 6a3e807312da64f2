//! Lists the entity classes that the B-Rep reader knows by name.

use super::short_names::long_name;

macro_rules! keywords {
    ($($class:ident = $name:literal),* $(,)?) => {
        /// The class of an instance.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Keyword {
            $($class,)*
            /// A class whose name ends in `REPRESENTATION` and that is not listed.
            Representation,
            /// A context that representations name, plain or of several classes.
            Context,
            /// A class of relationships that place one representation in another.
            RelationshipWithTransformation,
            /// An instance of several classes at once, `#1 = (A() B())`.
            Complex,
            /// A class that says nothing about shapes.
            Other,
        }

        impl Keyword {
            fn from_upper_case(name: &[u8]) -> Self {
                match name {
                    $($name => Self::$class,)*
                    _ if name.ends_with(b"REPRESENTATION") => Self::Representation,
                    _ if name.ends_with(b"RELATIONSHIP_WITH_TRANSFORMATION") => Self::RelationshipWithTransformation,
                    _ if name.ends_with(b"REPRESENTATION_CONTEXT") => Self::Context,
                    _ if name.ends_with(b"ASSIGNED_CONTEXT") => Self::Context,
                    _ => long_name(name).map_or(Self::Other, |name| Self::from_upper_case(name.as_bytes())),
                }
            }
        }
    };
}

// The classes that are most frequent in real files come first, because the names are compared from the top.
keywords! {
    CartesianPoint = b"CARTESIAN_POINT",
    Direction = b"DIRECTION",
    OrientedEdge = b"ORIENTED_EDGE",
    EdgeCurve = b"EDGE_CURVE",
    VertexPoint = b"VERTEX_POINT",
    Line = b"LINE",
    Vector = b"VECTOR",
    Axis2Placement3d = b"AXIS2_PLACEMENT_3D",
    EdgeLoop = b"EDGE_LOOP",
    FaceBound = b"FACE_BOUND",
    FaceOuterBound = b"FACE_OUTER_BOUND",
    AdvancedFace = b"ADVANCED_FACE",
    Subface = b"SUBFACE",
    Subedge = b"SUBEDGE",
    Edge = b"EDGE",
    Plane = b"PLANE",
    Circle = b"CIRCLE",
    CylindricalSurface = b"CYLINDRICAL_SURFACE",
    BSplineCurveWithKnots = b"B_SPLINE_CURVE_WITH_KNOTS",
    StyledItem = b"STYLED_ITEM",
    OverRidingStyledItem = b"OVER_RIDING_STYLED_ITEM",
    PresentationLayerAssignment = b"PRESENTATION_LAYER_ASSIGNMENT",
    Ellipse = b"ELLIPSE",
    Parabola = b"PARABOLA",
    Hyperbola = b"HYPERBOLA",
    Polyline = b"POLYLINE",
    TrimmedCurve = b"TRIMMED_CURVE",
    CompositeCurve = b"COMPOSITE_CURVE",
    SurfaceCurve = b"SURFACE_CURVE",
    SeamCurve = b"SEAM_CURVE",
    IntersectionCurve = b"INTERSECTION_CURVE",
    BoundedSurfaceCurve = b"BOUNDED_SURFACE_CURVE",
    BoundaryCurve = b"BOUNDARY_CURVE",
    OuterBoundaryCurve = b"OUTER_BOUNDARY_CURVE",
    OffsetCurve3d = b"OFFSET_CURVE_3D",
    Pcurve = b"PCURVE",
    BezierCurve = b"BEZIER_CURVE",
    UniformCurve = b"UNIFORM_CURVE",
    QuasiUniformCurve = b"QUASI_UNIFORM_CURVE",
    ConicalSurface = b"CONICAL_SURFACE",
    SphericalSurface = b"SPHERICAL_SURFACE",
    ToroidalSurface = b"TOROIDAL_SURFACE",
    DegenerateToroidalSurface = b"DEGENERATE_TOROIDAL_SURFACE",
    BSplineSurfaceWithKnots = b"B_SPLINE_SURFACE_WITH_KNOTS",
    BezierSurface = b"BEZIER_SURFACE",
    UniformSurface = b"UNIFORM_SURFACE",
    QuasiUniformSurface = b"QUASI_UNIFORM_SURFACE",
    SurfaceOfLinearExtrusion = b"SURFACE_OF_LINEAR_EXTRUSION",
    SurfaceOfRevolution = b"SURFACE_OF_REVOLUTION",
    OffsetSurface = b"OFFSET_SURFACE",
    RectangularTrimmedSurface = b"RECTANGULAR_TRIMMED_SURFACE",
    RectangularCompositeSurface = b"RECTANGULAR_COMPOSITE_SURFACE",
    CurveBoundedSurface = b"CURVE_BOUNDED_SURFACE",
    Axis1Placement = b"AXIS1_PLACEMENT",
    Axis2Placement2d = b"AXIS2_PLACEMENT_2D",
    VertexLoop = b"VERTEX_LOOP",
    PolyLoop = b"POLY_LOOP",
    Face = b"FACE",
    FaceSurface = b"FACE_SURFACE",
    OrientedFace = b"ORIENTED_FACE",
    ClosedShell = b"CLOSED_SHELL",
    OpenShell = b"OPEN_SHELL",
    ConnectedFaceSet = b"CONNECTED_FACE_SET",
    ConnectedFaceSubSet = b"CONNECTED_FACE_SUB_SET",
    OrientedClosedShell = b"ORIENTED_CLOSED_SHELL",
    OrientedOpenShell = b"ORIENTED_OPEN_SHELL",
    ManifoldSolidBrep = b"MANIFOLD_SOLID_BREP",
    BrepWithVoids = b"BREP_WITH_VOIDS",
    FacetedBrep = b"FACETED_BREP",
    ShellBasedSurfaceModel = b"SHELL_BASED_SURFACE_MODEL",
    GeometricSet = b"GEOMETRIC_SET",
    FaceBasedSurfaceModel = b"FACE_BASED_SURFACE_MODEL",
    ShapeRepresentationRelationship = b"SHAPE_REPRESENTATION_RELATIONSHIP",
    ItemDefinedTransformation = b"ITEM_DEFINED_TRANSFORMATION",
    CartesianTransformationOperator3d = b"CARTESIAN_TRANSFORMATION_OPERATOR_3D",
    ContextDependentShapeRepresentation = b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
    NextAssemblyUsageOccurrence = b"NEXT_ASSEMBLY_USAGE_OCCURRENCE",
    ShapeDefinitionRepresentation = b"SHAPE_DEFINITION_REPRESENTATION",
    ProductDefinitionShape = b"PRODUCT_DEFINITION_SHAPE",
    ProductDefinition = b"PRODUCT_DEFINITION",
    ProductDefinitionWithAssociatedDocuments = b"PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS",
    ProductDefinitionFormation = b"PRODUCT_DEFINITION_FORMATION",
    ProductDefinitionFormationWithSpecifiedSource = b"PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE",
    Product = b"PRODUCT",
    MappedItem = b"MAPPED_ITEM",
    RepresentationMap = b"REPRESENTATION_MAP",
    PresentationStyleAssignment = b"PRESENTATION_STYLE_ASSIGNMENT",
    PresentationStyleByContext = b"PRESENTATION_STYLE_BY_CONTEXT",
    SurfaceStyleUsage = b"SURFACE_STYLE_USAGE",
    SurfaceSideStyle = b"SURFACE_SIDE_STYLE",
    SurfaceStyleFillArea = b"SURFACE_STYLE_FILL_AREA",
    SurfaceStyleRendering = b"SURFACE_STYLE_RENDERING",
    SurfaceStyleRenderingWithProperties = b"SURFACE_STYLE_RENDERING_WITH_PROPERTIES",
    FillAreaStyle = b"FILL_AREA_STYLE",
    FillAreaStyleColor = b"FILL_AREA_STYLE_COLOUR",
    ColorRgb = b"COLOUR_RGB",
    DraughtingPreDefinedColor = b"DRAUGHTING_PRE_DEFINED_COLOUR",
    PreDefinedColor = b"PRE_DEFINED_COLOUR",
    // Points, curves and surfaces that few files have.
    PointOnCurve = b"POINT_ON_CURVE",
    PointOnSurface = b"POINT_ON_SURFACE",
    PointReplica = b"POINT_REPLICA",
    DegeneratePcurve = b"DEGENERATE_PCURVE",
    EvaluatedDegeneratePcurve = b"EVALUATED_DEGENERATE_PCURVE",
    CurveReplica = b"CURVE_REPLICA",
    SurfaceReplica = b"SURFACE_REPLICA",
    CompositeCurveOnSurface = b"COMPOSITE_CURVE_ON_SURFACE",
    // Data of a part other than its shape.
    ConstructiveGeometryRepresentationRelationship = b"CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP",
    SurfaceStyleTransparent = b"SURFACE_STYLE_TRANSPARENT",
    // Solids that are defined by their construction.
    CsgSolid = b"CSG_SOLID",
    BooleanResult = b"BOOLEAN_RESULT",
    Block = b"BLOCK",
    RightAngularWedge = b"RIGHT_ANGULAR_WEDGE",
    RightCircularCone = b"RIGHT_CIRCULAR_CONE",
    RightCircularCylinder = b"RIGHT_CIRCULAR_CYLINDER",
    Sphere = b"SPHERE",
    Torus = b"TORUS",
    ExtrudedAreaSolid = b"EXTRUDED_AREA_SOLID",
    ExtrudedFaceSolid = b"EXTRUDED_FACE_SOLID",
    RevolvedAreaSolid = b"REVOLVED_AREA_SOLID",
    RevolvedFaceSolid = b"REVOLVED_FACE_SOLID",
    SurfaceCurveSweptAreaSolid = b"SURFACE_CURVE_SWEPT_AREA_SOLID",
    SurfaceCurveSweptFaceSolid = b"SURFACE_CURVE_SWEPT_FACE_SOLID",
    SweptDiskSolid = b"SWEPT_DISK_SOLID",
    HalfSpaceSolid = b"HALF_SPACE_SOLID",
    BoxedHalfSpace = b"BOXED_HALF_SPACE",
    SolidReplica = b"SOLID_REPLICA",
    // Tessellated geometry.
    CoordinatesList = b"COORDINATES_LIST",
    TessellatedSolid = b"TESSELLATED_SOLID",
    TessellatedShell = b"TESSELLATED_SHELL",
    TessellatedGeometricSet = b"TESSELLATED_GEOMETRIC_SET",
    TriangulatedFace = b"TRIANGULATED_FACE",
    ComplexTriangulatedFace = b"COMPLEX_TRIANGULATED_FACE",
    TriangulatedSurfaceSet = b"TRIANGULATED_SURFACE_SET",
    ComplexTriangulatedSurfaceSet = b"COMPLEX_TRIANGULATED_SURFACE_SET",
    CubicBezierTriangulatedFace = b"CUBIC_BEZIER_TRIANGULATED_FACE",
}

/// No known class has a longer name.
const LONGEST_NAME: usize = 64;

impl Keyword {
    /// The class with this name. Letters may be capital or small.
    pub(crate) fn from_name(name: &[u8]) -> Self {
        if name.len() > LONGEST_NAME {
            return Self::Other;
        }
        if !name.iter().any(u8::is_ascii_lowercase) {
            return Self::from_upper_case(name);
        }
        Self::from_upper_case(&name.to_ascii_uppercase())
    }
}

/// The full name of a class that may be written by its short name.
pub(crate) fn full_name(written: &[u8]) -> &[u8] {
    long_name(written).map_or(written, str::as_bytes)
}

/// Whether a class, in capital or small letters and with its short or full name, is the one with this full name.
pub(super) fn is_class(written: &[u8], name: &str) -> bool {
    written.eq_ignore_ascii_case(name.as_bytes()) || long_name(written) == Some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_known_in_any_case() {
        assert_eq!(Keyword::from_name(b"PLANE"), Keyword::Plane);
        assert_eq!(Keyword::from_name(b"Advanced_Face"), Keyword::AdvancedFace);
        assert_eq!(Keyword::from_name(b"PLANES"), Keyword::Other);
        assert_eq!(
            Keyword::from_name(b"ADVANCED_BREP_SHAPE_REPRESENTATION"),
            Keyword::Representation
        );
        assert_eq!(Keyword::from_name(&[b'A'; 1000]), Keyword::Other);
        assert_eq!(Keyword::from_name(b"CRTPNT"), Keyword::CartesianPoint);
        assert_eq!(Keyword::from_name(b"Absr"), Keyword::Representation);
        assert_eq!(
            Keyword::from_name(b"GEOMETRIC_REPRESENTATION_CONTEXT"),
            Keyword::Context
        );
        assert_eq!(Keyword::from_name(b"PRODUCT_CONTEXT"), Keyword::Other);
    }
}

use super::file::StepFile;
use super::roots::roots;
use super::space::{Motion, Reader, Space};
use super::{ReadBudget, ReadError, read};
use crate::fixtures::{CUBE_POLYGONS, StepText, box_corners, cuboid, cylinder, references};
use crate::model::{Brep, Loop, LostKind};
use crate::part21::Exchange;
use partprobe_shape::{Color, FaceType, Point};
use proptest::prelude::*;

#[track_caller]
fn brep_of(text: &StepText) -> Brep {
    read(&text.bytes(), &ReadBudget::default()).unwrap()
}

/// Points, directions and axes that the tables below refer to: `#3` is the identity placement, `#7` a vector.
const GEOMETRY: &str = "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=DIRECTION('',(0.,0.,1.));\
    #3=AXIS2_PLACEMENT_3D('',#1,#2,#4);#4=DIRECTION('',(1.,0.,0.));#5=CARTESIAN_POINT('',(2.,0.,0.));\
    #6=CARTESIAN_POINT('',(2.,3.,0.));#7=VECTOR('',#4,2.);#8=LINE('',#1,#7);#9=AXIS1_PLACEMENT('',#5,#2);\
    #10=CARTESIAN_POINT('',(0.,1.,0.));#11=CIRCLE('',#3,2.);\
    #12=TRIMMED_CURVE('',#8,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);\
    #13=TRIMMED_CURVE('',#11,(#5),(PARAMETER_VALUE(90.)),.T.,.CARTESIAN.);\
    #14=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.F.,#12);#15=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#13);";

/// Reads entity `#99` in millimeters and degrees.
fn with_reader<T>(entity: &str, ask: impl FnOnce(&Reader<'_, '_>) -> T) -> T {
    let text = format!("ISO-10303-21;DATA;{GEOMETRY}#99={entity};ENDSEC;");
    let exchange = Exchange::index(text.as_bytes(), 1000, &mut Vec::new()).unwrap();
    let source = StepFile::new(exchange, 1000);
    let space = Space {
        mm_per_unit: 1.0,
        rad_per_unit: 1_f64.to_radians(),
        motion: None,
    };
    ask(&Reader::new(&source, space))
}

#[track_caller]
fn check_surface(entity: &str, expected: Option<FaceType>) {
    let face_type = with_reader(entity, |reader| {
        reader.surface(99, 0).map(|surface| surface.face_type)
    });
    assert_eq!(face_type.as_ref().ok(), expected.as_ref(), "{face_type:?}");
}

#[test]
fn surfaces_of_every_class() {
    let knots = "(2,2),(2,2),(0.,1.),(0.,1.),.U.";
    let poles = "((#1,#10),(#5,#6))";
    check_surface("PLANE('',#3)", Some(FaceType::Plane));
    check_surface("CYLINDRICAL_SURFACE('',#3,2.)", Some(FaceType::Cylinder));
    check_surface("CONICAL_SURFACE('',#3,0.,45.)", Some(FaceType::Cone));
    check_surface("SPHERICAL_SURFACE('',#3,2.)", Some(FaceType::Sphere));
    check_surface("TOROIDAL_SURFACE('',#3,2.,1.)", Some(FaceType::Torus));
    check_surface(
        "DEGENERATE_TOROIDAL_SURFACE('',#3,1.,2.,.T.)",
        Some(FaceType::Torus),
    );
    check_surface(
        "SURFACE_OF_LINEAR_EXTRUSION('',#11,#7)",
        Some(FaceType::Extrusion),
    );
    check_surface(
        "SURFACE_OF_REVOLUTION('',#8,#9)",
        Some(FaceType::Revolution),
    );
    check_surface("OFFSET_SURFACE('',#98,1.,.F.)", None);
    check_surface(
        &format!("B_SPLINE_SURFACE_WITH_KNOTS('',1,1,{poles},.U.,.F.,.F.,.F.,{knots})"),
        Some(FaceType::Bspline),
    );
    check_surface(
        &format!("BEZIER_SURFACE('',1,1,{poles},.U.,.F.,.F.,.F.)"),
        Some(FaceType::Bezier),
    );
    check_surface(
        &format!("UNIFORM_SURFACE('',1,1,{poles},.U.,.F.,.F.,.F.)"),
        Some(FaceType::Bspline),
    );
    check_surface(
        &format!("QUASI_UNIFORM_SURFACE('',1,1,{poles},.U.,.F.,.F.,.F.)"),
        Some(FaceType::Bspline),
    );
    let rational = "RATIONAL_B_SPLINE_SURFACE(((1.,2.),(1.,1.)))";
    let complex = format!(
        "(BOUNDED_SURFACE(){rational}B_SPLINE_SURFACE_WITH_KNOTS({knots})B_SPLINE_SURFACE(1,1,{poles},.U.,.F.,.F.,.F.))"
    );
    check_surface(&complex, Some(FaceType::Bspline));
    check_surface(
        &format!("(BEZIER_SURFACE()B_SPLINE_SURFACE(1,1,{poles},.U.,.F.,.F.,.F.){rational})"),
        Some(FaceType::Bezier),
    );
}

#[test]
fn invalid_surfaces_are_refused() {
    check_surface("PLANE('',#98)", None);
    check_surface("PLANE('',#99)", None);
    check_surface("SPHERICAL_SURFACE('',#3,0.)", None);
    check_surface("CONICAL_SURFACE('',#3,1.,90.)", None);
    check_surface("OFFSET_SURFACE('',#99,1.,.F.)", None);
    check_surface("CIRCLE('',#3,2.)", None);
    check_surface(
        "BEZIER_SURFACE('',1,1,((#1,#10),(#5)),.U.,.F.,.F.,.F.)",
        None,
    );
    check_surface(
        "BEZIER_SURFACE('',2,1,((#1,#10),(#5,#6)),.U.,.F.,.F.,.F.)",
        None,
    );
    check_surface(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#1,#10),(#5,#6)),.U.,.F.,.F.,.F.,(1000000000,2),(2,2),(0.,1.),(0.,1.),.U.)",
        None,
    );
    check_surface(
        "BEZIER_SURFACE('',1000000000,1,((#1,#10),(#5,#6)),.U.,.F.,.F.,.F.)",
        None,
    );
}

/// Checks the point of a curve at a parameter.
#[track_caller]
fn check_curve(entity: &str, t: f64, expected: Option<Point>) {
    let point = with_reader(entity, |reader| {
        reader.curve(99, 0).map(|directed| directed.curve.point(t))
    });
    match (point, expected) {
        (Ok(point), Some(expected)) => assert!(
            partprobe_shape::distance(point, expected) < 1e-9,
            "{point:?}"
        ),
        (point, expected) => assert_eq!(point.ok(), expected),
    }
}

#[test]
fn curves_of_every_class() {
    check_curve("LINE('',#1,#7)", 1.5, Some([3.0, 0.0, 0.0]));
    check_curve("CIRCLE('',#3,2.)", 0.0, Some([2.0, 0.0, 0.0]));
    check_curve(
        "ELLIPSE('',#3,2.,1.)",
        std::f64::consts::FRAC_PI_2,
        Some([0.0, 1.0, 0.0]),
    );
    check_curve("PARABOLA('',#3,0.5)", 2.0, Some([2.0, 2.0, 0.0]));
    check_curve("HYPERBOLA('',#3,2.,1.)", 0.0, Some([2.0, 0.0, 0.0]));
    check_curve("POLYLINE('',(#1,#5,#6))", 1.5, Some([2.0, 1.5, 0.0]));
    check_curve(
        "SURFACE_CURVE('',#8,(),.CURVE_3D.)",
        1.0,
        Some([2.0, 0.0, 0.0]),
    );
    check_curve(
        "SEAM_CURVE('',#12,(),.CURVE_3D.)",
        1.0,
        Some([2.0, 0.0, 0.0]),
    );
    check_curve(
        "(CURVE()SURFACE_CURVE(#8,(),.CURVE_3D.))",
        1.0,
        Some([2.0, 0.0, 0.0]),
    );
    check_curve(
        "COMPOSITE_CURVE('',(#14,#15),.F.)",
        0.5,
        Some([1.0, 0.0, 0.0]),
    );
    check_curve(
        "COMPOSITE_CURVE('',(#14,#15),.F.)",
        2.0,
        Some([0.0, 2.0, 0.0]),
    );
    check_curve(
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#1,#6),.U.,.F.,.F.,(2,2),(0.,2.),.U.)",
        1.0,
        Some([1.0, 1.5, 0.0]),
    );
    check_curve(
        "BEZIER_CURVE('',2,(#1,#5,#6),.U.,.F.,.F.)",
        0.5,
        Some([1.5, 0.75, 0.0]),
    );
    check_curve(
        "UNIFORM_CURVE('',1,(#1,#5),.U.,.F.,.F.)",
        0.5,
        Some([1.0, 0.0, 0.0]),
    );
    check_curve(
        "QUASI_UNIFORM_CURVE('',1,(#1,#5,#6),.U.,.F.,.F.)",
        1.5,
        Some([2.0, 1.5, 0.0]),
    );
    let rational = "(RATIONAL_B_SPLINE_CURVE((1.,3.))B_SPLINE_CURVE(1,(#1,#5),.U.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((2,2),(0.,1.),.U.))";
    check_curve(rational, 0.5, Some([1.5, 0.0, 0.0]));
    check_curve("TRIMMED_CURVE('',#99,(#1),(#5),.T.,.CARTESIAN.)", 0.0, None);
    check_curve("POLYLINE('',(#1))", 0.0, None);
    check_curve("CIRCLE('',#3,$)", 0.0, None);
    check_curve("PCURVE('',#3,#1)", 0.0, None);
}

#[test]
fn a_trimmed_curve_may_turn_its_basis() {
    let sense = |flag: &str| {
        let entity = format!("TRIMMED_CURVE('',#8,(#1),(#5),{flag},.CARTESIAN.)");
        with_reader(&entity, |reader| reader.curve(99, 0).unwrap().same_sense)
    };
    assert_eq!((sense(".T."), sense(".F.")), (true, false));
    let sense = |u: &str, v: &str| {
        let entity =
            format!("RECTANGULAR_TRIMMED_SURFACE('',#98,0.,1.,0.,1.,{u},{v});#98=PLANE('',#3)");
        with_reader(&entity, |reader| reader.surface(99, 0).unwrap().same_sense)
    };
    assert_eq!(
        [
            sense(".T.", ".T."),
            sense(".F.", ".T."),
            sense(".F.", ".F.")
        ],
        [true, false, true]
    );
}

#[track_caller]
fn check_error(text: &[u8], expected: ReadError) {
    assert_eq!(read(text, &ReadBudget::default()).unwrap_err(), expected);
}

#[test]
fn texts_without_faces_say_why() {
    check_error(b"", ReadError::Empty);
    check_error(b" \r\n", ReadError::Empty);
    check_error(b"\x7fELF\x02\x01", ReadError::NotStep);
    check_error(b"ISO-10303-21;HEADER;ENDSEC;", ReadError::NoData);
    check_error(
        b"ISO-10303-21;DATA;#1=PLANE('',#2);ENDSEC;",
        ReadError::NoFaces { lost: Vec::new() },
    );
    let cut = b"ISO-10303-21;DATA;#1=MANIFOLD_SOLID_BREP('',#2);";
    let error = read(cut, &ReadBudget::default()).unwrap_err();
    assert!(matches!(&error, ReadError::NoFaces { lost } if lost.len() == 1));
    assert_eq!(
        error.to_string(),
        "the file has no readable face; 1 entity was lost, entity #2: it is not in the file"
    );
}

#[test]
fn budgets_are_named_when_they_are_spent() {
    let text = cuboid([1.0; 3]).bytes();
    let with = |budget: ReadBudget| match read(&text, &budget) {
        Err(ReadError::OverBudget { what, limit }) => Some((what, limit)),
        _ => None,
    };
    let all = ReadBudget::default();
    assert_eq!(with(all), None);
    assert_eq!(
        with(ReadBudget {
            max_bytes: 100,
            ..all
        }),
        Some(("bytes", 100))
    );
    assert_eq!(
        with(ReadBudget {
            max_entities: 10,
            ..all
        }),
        Some(("entities", 10))
    );
    let few = ReadBudget {
        max_entities: 10,
        ..all
    };
    assert_eq!(
        read(&text, &few).unwrap_err().to_string(),
        "the file has more than 10 entities; raise label.max_entities to read it"
    );
    let mut text = StepText::in_millimeters();
    let point = text.point([0.0; 3]);
    let poly_loop = text.add(format!(
        "POLY_LOOP('',({}))",
        references(&vec![point; 5000])
    ));
    let bound = text.add(format!("FACE_BOUND('',#{poly_loop},.T.)"));
    let face = text.add(format!("FACE('',(#{bound}))"));
    text.solid(&[face]);
    let error = read(&text.bytes(), &all).unwrap_err();
    assert_eq!(
        error,
        ReadError::OverBudget {
            what: "visits to an entity on average",
            limit: 16
        }
    );
}

#[test]
fn damaged_entities_are_lost_and_the_rest_is_read() {
    let text = String::from_utf8(cuboid([1.0; 3]).bytes()).unwrap();
    let n_faces = |damaged: &str| {
        let brep = read(damaged.as_bytes(), &ReadBudget::default()).unwrap();
        (
            brep.faces.len(),
            brep.lost.iter().map(|loss| loss.kind).collect::<Vec<_>>(),
        )
    };
    assert_eq!(n_faces(&text), (6, vec![]));
    assert_eq!(
        n_faces(&text.replacen("=PLANE", "=PLAIN", 1)),
        (5, vec![LostKind::Face])
    );
    assert_eq!(
        n_faces(&text.replacen("=EDGE_LOOP", "=NO_LOOP", 1)),
        (5, vec![LostKind::Loop, LostKind::Face])
    );
    assert_eq!(n_faces(&text.replacen("PLANE('',", "PLANE('", 1)).0, 5);
}

#[test]
fn cycles_are_reported_as_lost_entities() {
    let mut text = cuboid([1.0; 3]);
    let shell = text.add("ORIENTED_CLOSED_SHELL('',*,#1000,.F.)");
    let solid = text.add(format!("MANIFOLD_SOLID_BREP('',#{shell})"));
    text.add(format!(
        "ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#1)"
    ));
    let text = String::from_utf8(text.bytes())
        .unwrap()
        .replace("#1000", &format!("#{shell}"));
    let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
    assert_eq!(brep.faces.len(), 6);
    assert_eq!(brep.lost.len(), 1);
    assert!(
        brep.lost[0].reason.contains("leads back to itself"),
        "{}",
        brep.lost[0]
    );
}

#[test]
fn units_come_from_the_context() {
    let length = |length: &str, extra: &str| {
        let mut text = StepText::with_units(
            length,
            "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
        );
        text.add(extra);
        text.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
        let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
        text.solid(&faces);
        let brep = brep_of(&text);
        let longest = brep
            .vertices
            .iter()
            .flat_map(|vertex| vertex.point)
            .fold(0.0, f64::max);
        (brep.units.length, longest)
    };
    let none = "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)";
    assert_eq!(
        length("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))", none),
        ("mm".to_owned(), 1.0)
    );
    assert_eq!(
        length("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))", none),
        ("m".to_owned(), 1000.0)
    );
    assert_eq!(
        length("SI_UNIT(*,.CENTI.,.METRE.)", none),
        ("cm".to_owned(), 10.0)
    );
    let inch = "(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(*))";
    assert_eq!(
        length(inch, "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#5)"),
        ("inch".to_owned(), 25.4)
    );
    // A unit that is defined by itself is lost, and millimeters are assumed.
    assert_eq!(
        length(inch, "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#2)"),
        ("mm".to_owned(), 1.0)
    );
}

#[test]
fn reversed_shells_reverse_their_faces() {
    let mut text = StepText::in_millimeters();
    let outer = text.polyhedron(&box_corners([3.0; 3]), &CUBE_POLYGONS);
    let inner = text.polyhedron(
        &box_corners([1.0; 3]).map(|corner| corner.map(|x| x + 1.0)),
        &CUBE_POLYGONS,
    );
    let outer = text.add(format!("CLOSED_SHELL('',({}))", references(&outer)));
    let inner = text.add(format!("CLOSED_SHELL('',({}))", references(&inner)));
    let void = text.add(format!("ORIENTED_CLOSED_SHELL('',*,#{inner},.F.)"));
    let solid = text.add(format!("BREP_WITH_VOIDS('hollow',#{outer},(#{void}))"));
    text.add(format!(
        "ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#1)"
    ));
    let brep = brep_of(&text);
    assert!(
        brep.faces
            .iter()
            .all(|face| face.flipped == (face.shell == 1))
    );
    assert_eq!(
        brep.shells
            .iter()
            .map(|shell| (shell.step_id as usize, shell.solid))
            .collect::<Vec<_>>(),
        [(outer, Some(0)), (inner, Some(0))]
    );
    assert_eq!(brep.solids[0].name.as_deref(), Some("hollow"));
}

#[test]
fn a_bound_against_its_loop_is_walked_backwards() {
    let text = String::from_utf8(cylinder(1.0, 2.0).bytes()).unwrap();
    let first_walk = |text: &str| match &read(text.as_bytes(), &ReadBudget::default())
        .unwrap()
        .faces[2]
        .loops[0]
    {
        Loop::Edges(uses) => uses
            .iter()
            .map(|edge_use| (edge_use.edge, edge_use.forward))
            .collect::<Vec<_>>(),
        Loop::Vertex(_) => Vec::new(),
    };
    assert_eq!(
        first_walk(&text),
        [(0, true), (2, true), (1, false), (2, false)]
    );
    let at = text.rfind("FACE_OUTER_BOUND").unwrap();
    let reversed = format!(
        "{}{}",
        &text[..at],
        text[at..].replacen(",.T.)", ",.F.)", 1)
    );
    assert_eq!(
        first_walk(&reversed),
        [(2, true), (1, true), (2, false), (0, false)]
    );
}

#[test]
fn polygons_share_their_sides() {
    let mut text = StepText::in_millimeters();
    let corners = box_corners([1.0; 3]).map(|corner| text.point(corner));
    let faces: Vec<usize> = CUBE_POLYGONS
        .iter()
        .map(|polygon| {
            let polygon: Vec<usize> = polygon.iter().map(|&corner| corners[corner]).collect();
            let poly_loop = text.add(format!("POLY_LOOP('',({}))", references(&polygon)));
            let bound = text.add(format!("FACE_OUTER_BOUND('',#{poly_loop},.T.)"));
            text.add(format!("FACE('',(#{bound}))"))
        })
        .collect();
    let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
    text.add(format!("FACETED_BREP('',#{shell})"));
    let (graph, flags) = crate::face_graph(&brep_of(&text));
    assert_eq!(
        (graph.edges.len(), flags),
        (12, crate::ShapeFlags::default())
    );
    assert!(
        graph
            .edges
            .iter()
            .all(|edge| (edge.phi - 90.0).abs() < 1e-12)
    );
}

#[test]
fn colors_come_from_the_nearest_style() {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let [shell, _] = text.solid(&faces);
    let mut style = |color: &str| {
        let color = text.add(color);
        let fill = text.add(format!("FILL_AREA_STYLE_COLOUR('',#{color})"));
        let area = text.add(format!("FILL_AREA_STYLE('',(#{fill}))"));
        let surface = text.add(format!("SURFACE_STYLE_FILL_AREA(#{area})"));
        let side = text.add(format!("SURFACE_SIDE_STYLE('',(#{surface}))"));
        let usage = text.add(format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
        text.add(format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"))
    };
    let styles = [
        style("COLOUR_RGB('',1.,0.5,0.)"),
        style("DRAUGHTING_PRE_DEFINED_COLOUR('blue')"),
        style("COLOUR_RGB('',0.,0.,0.)"),
    ];
    let whole = text.add(format!("STYLED_ITEM('',(#{}),#{shell})", styles[0]));
    text.add(format!("STYLED_ITEM('',(#{}),#{})", styles[1], faces[1]));
    text.add(format!("STYLED_ITEM('',(#{}),#{})", styles[1], faces[2]));
    text.add(format!(
        "OVER_RIDING_STYLED_ITEM('',(#{}),#{},#{whole})",
        styles[2], faces[2]
    ));
    let colors: Vec<_> = brep_of(&text)
        .faces
        .iter()
        .map(|face| face.color.map(|Color(rgba)| rgba))
        .collect();
    assert_eq!(
        colors[..3],
        [Some(0xff80_00ff), Some(0x0000_ffff), Some(0x0000_00ff)]
    );
}

#[test]
fn layers_come_from_the_face_its_shell_or_its_solid() {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let [_, solid] = text.solid(&faces);
    let styled = text.add(format!("STYLED_ITEM('',(),#{})", faces[1]));
    text.add(format!(
        "PRESENTATION_LAYER_ASSIGNMENT('walls','',(#{},#{styled}))",
        faces[0]
    ));
    text.add(format!(
        "PRESENTATION_LAYER_ASSIGNMENT('bodies','',(#{solid},#{}))",
        faces[0]
    ));
    let layers: Vec<_> = brep_of(&text)
        .faces
        .into_iter()
        .map(|face| face.layer.unwrap_or_default())
        .collect();
    assert_eq!(
        layers,
        ["walls", "walls", "bodies", "bodies", "bodies", "bodies"]
    );
}

/// A unit cube whose representation is placed in an assembly: moved by (10, 0, 0) and rotated by 90° around z.
fn placed_cube(order: [usize; 2]) -> StepText {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let [_, solid] = text.solid(&faces);
    let component = solid + 1;
    let from = text.axes([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let to = text.axes([10.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let whole = text.add(format!("SHAPE_REPRESENTATION('',(#{to}),#1)"));
    let axes = [from, to];
    let [first, second] = order.map(|i| [component, whole][i]);
    let transformation = text.add(format!(
        "ITEM_DEFINED_TRANSFORMATION('','',#{},#{})",
        axes[order[0]], axes[order[1]]
    ));
    let relation = text.add(format!(
        "(REPRESENTATION_RELATIONSHIP('','',#{first},#{second})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{transformation})SHAPE_REPRESENTATION_RELATIONSHIP())"
    ));
    let mut product = |representation: usize| {
        let product = text.add("PRODUCT('id','bracket','',())");
        let formation = text.add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let definition = text.add(format!("PRODUCT_DEFINITION('','',#{formation},$)"));
        let shape = text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        text.add(format!(
            "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"
        ));
        definition
    };
    let (part, assembly) = (product(component), product(whole));
    let occurrence = text.add(format!(
        "NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','','',#{assembly},#{part},$)"
    ));
    let shape = text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{occurrence})"));
    text.add(format!(
        "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{shape})"
    ));
    text
}

#[test]
fn components_are_placed_by_their_assembly() {
    for order in [[0, 1], [1, 0]] {
        let brep = brep_of(&placed_cube(order));
        let low = brep.vertices.iter().fold([f64::MAX; 3], |low, v| {
            [0, 1, 2].map(|axis| low[axis].min(v.point[axis]))
        });
        assert!(
            partprobe_shape::distance(low, [9.0, 0.0, 0.0]) < 1e-12,
            "{low:?}"
        );
        assert!(brep.lost.is_empty());
    }
}

#[test]
fn a_solid_that_is_listed_twice_is_placed_by_its_assembly() {
    // All numbers are increased, so the added list has the lowest number.
    let text = String::from_utf8(placed_cube([0, 1]).bytes())
        .unwrap()
        .replace('#', "#1000");
    let solid = text
        .lines()
        .find(|line| line.contains("MANIFOLD_SOLID_BREP"))
        .unwrap()
        .split_once('=')
        .unwrap()
        .0;
    let listed = text.replace(
        "DATA;\n",
        &format!("DATA;\n#7=SHAPE_REPRESENTATION('',({solid}),#10001);\n"),
    );
    let points = |text: &str| {
        let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
        assert!(brep.lost.is_empty());
        brep.vertices
            .iter()
            .map(|vertex| vertex.point)
            .collect::<Vec<_>>()
    };
    assert_ne!(text, listed);
    assert_eq!(points(&text), points(&listed));
}

#[test]
fn axes_in_the_other_order_belong_to_the_representations_that_list_them() {
    let text = String::from_utf8(placed_cube([0, 1]).bytes()).unwrap();
    let line = text
        .lines()
        .find(|line| line.contains("ITEM_DEFINED_TRANSFORMATION"))
        .unwrap();
    let (start, axes) = line.split_once("'','',").unwrap();
    let (from, to) = axes.trim_end_matches(");").split_once(',').unwrap();
    let solid = text
        .lines()
        .find(|line| line.contains("MANIFOLD_SOLID_BREP"))
        .unwrap()
        .split_once('=')
        .unwrap()
        .0;
    let exchanged = text
        .replace(line, &format!("{start}'','',{to},{from});"))
        .replace(
            &format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',({solid})"),
            &format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',({solid},{from})"),
        );
    let points = |text: &str| {
        let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
        brep.vertices
            .iter()
            .map(|vertex| vertex.point)
            .collect::<Vec<_>>()
    };
    assert_ne!(text, exchanged);
    assert_eq!(points(&text), points(&exchanged));
}

#[test]
fn solids_are_named_by_themselves_or_by_their_product() {
    let text = String::from_utf8(placed_cube([0, 1]).bytes()).unwrap();
    let name = |text: &str| {
        read(text.as_bytes(), &ReadBudget::default())
            .unwrap()
            .solids[0]
            .name
            .clone()
    };
    assert_eq!(name(&text).as_deref(), Some("body"));
    assert_eq!(
        name(&text.replace("BREP('body'", "BREP(''")).as_deref(),
        Some("bracket")
    );
}

#[test]
fn an_assembly_in_itself_is_a_loss_and_stays_unplaced() {
    let mut text = placed_cube([0, 1]);
    let bytes = String::from_utf8(text.bytes()).unwrap();
    let relation = bytes
        .lines()
        .find(|line| line.contains("_WITH_TRANSFORMATION("))
        .unwrap();
    let ids: Vec<usize> = relation
        .split(['#', ',', ')', '='])
        .filter_map(|word| word.parse().ok())
        .collect();
    text.add(format!(
        "(REPRESENTATION_RELATIONSHIP('','',#{},#{})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{})SHAPE_REPRESENTATION_RELATIONSHIP())",
        ids[2], ids[1], ids[3]
    ));
    let brep = brep_of(&text);
    assert_eq!(brep.faces.len(), 6);
    assert!(
        brep.lost
            .iter()
            .any(|loss| loss.reason.contains("contains itself")),
        "{:?}",
        brep.lost
    );
}

#[test]
fn solids_are_separated() {
    let mut text = StepText::in_millimeters();
    for shift in [0.0, 5.0] {
        let corners = box_corners([1.0; 3]).map(|[x, y, z]| [x + shift, y, z]);
        let faces = text.polyhedron(&corners, &CUBE_POLYGONS);
        text.solid(&faces);
    }
    let brep = brep_of(&text);
    assert_eq!(
        (brep.solids.len(), brep.faces.len(), brep.edges.len()),
        (2, 12, 24)
    );
    let second = brep.for_solid(1);
    assert_eq!(
        (
            second.solids.len(),
            second.faces.len(),
            second.edges.len(),
            second.vertices.len()
        ),
        (1, 6, 12, 8)
    );
    assert!(second.vertices.iter().all(|vertex| vertex.point[0] >= 5.0));
    assert_eq!(crate::face_graph(&second).0.edges.len(), 12);
    assert!(brep.for_solid(2).faces.is_empty());
}

#[test]
fn a_face_of_two_roots_is_read_once() {
    let mut text = cuboid([1.0; 3]);
    let bytes = String::from_utf8(text.bytes()).unwrap();
    let shell: usize = bytes
        .lines()
        .find(|line| line.contains("CLOSED_SHELL"))
        .and_then(|line| line[1..].split('=').next()?.parse().ok())
        .unwrap();
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let brep = brep_of(&text);
    assert_eq!(
        (brep.faces.len(), brep.shells.len(), brep.lost.len()),
        (6, 1, 0)
    );
}

#[test]
fn surfaces_of_a_geometric_set_are_faces() {
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let circle = text.add(format!("CIRCLE('',#{axes},2.)"));
    let disc_edge = text.add(format!(
        "TRIMMED_CURVE('',#{circle},(PARAMETER_VALUE(0.)),(PARAMETER_VALUE({:?})),.T.,.PARAMETER.)",
        std::f64::consts::TAU
    ));
    let segment = text.add(format!(
        "COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{disc_edge})"
    ));
    let boundary = text.add(format!("OUTER_BOUNDARY_CURVE('',(#{segment}),.F.)"));
    let disc = text.add(format!(
        "CURVE_BOUNDED_SURFACE('',#{plane},(#{boundary}),.F.)"
    ));
    let poles = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 1.0],
    ]
    .map(|pole| text.point(pole));
    let patch = text.add(format!(
        "BEZIER_SURFACE('',1,1,((#{},#{}),(#{},#{})),.U.,.F.,.F.,.F.)",
        poles[0], poles[1], poles[2], poles[3]
    ));
    text.add(format!("GEOMETRIC_SET('',(#{disc},#{patch},#{circle}))"));
    let brep = brep_of(&text);
    let faces: Vec<_> = brep
        .faces
        .iter()
        .map(|face| (face.step_id as usize, face.face_type, face.loops.len()))
        .collect();
    assert_eq!(
        faces,
        [(disc, FaceType::Plane, 1), (patch, FaceType::Bezier, 1)]
    );
    assert_eq!(brep.edges.len(), 5);
}

#[test]
fn motions_compose_and_invert() {
    let turn = Motion {
        rows: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        scale: 2.0,
        shift: [1.0, 2.0, 3.0],
    };
    let point = [0.5, -4.0, 7.0];
    assert_eq!(turn.point(point), [9.0, 3.0, 17.0]);
    assert_eq!(turn.inverse().point(turn.point(point)), point);
    assert_eq!(
        turn.after(&turn).point(point),
        turn.point(turn.point(point))
    );
}

#[test]
fn roots_come_in_file_order() {
    let text = b"ISO-10303-21;DATA;#9=MANIFOLD_SOLID_BREP('',#1);#2=SHELL_BASED_SURFACE_MODEL('',());#5=(BREP_WITH_VOIDS(())MANIFOLD_SOLID_BREP(#1));";
    let source = StepFile::new(Exchange::index(text, 10, &mut Vec::new()).unwrap(), 10);
    assert_eq!(
        roots(&source)
            .iter()
            .map(|root| root.record.id)
            .collect::<Vec<_>>(),
        [9, 2, 5]
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_texts_end_in_an_answer(at in 0.0_f64..1.0, byte: u8, cut: bool) {
        let mut text = cylinder(1.0, 2.0).bytes();
        let at = (at * text.len() as f64) as usize;
        text[at] = byte;
        if cut {
            text.truncate(at + 1);
        }
        if let Ok(brep) = read(&text, &ReadBudget::default()) {
            let (graph, _) = crate::face_graph(&brep);
            prop_assert_eq!(graph.faces.len(), brep.faces.len());
        }
    }

    #[test]
    fn the_order_of_instances_does_not_matter(turn in 0_usize..60) {
        let text = String::from_utf8(cylinder(1.0, 2.0).bytes()).unwrap();
        let (head, data) = text.split_once("DATA;\n").unwrap();
        let (data, tail) = data.split_once("ENDSEC;").unwrap();
        let mut lines: Vec<&str> = data.lines().collect();
        let n_lines = lines.len();
        lines.rotate_left(turn % n_lines);
        let reversed = format!("{head}DATA;\n{}\nENDSEC;{tail}", lines.join("\n"));
        let graph = |text: &str| crate::face_graph(&read(text.as_bytes(), &ReadBudget::default()).unwrap());
        let ((a, flags_a), (b, flags_b)) = (graph(&text), graph(&reversed));
        prop_assert_eq!(a.edges, b.edges);
        prop_assert_eq!(flags_a, flags_b);
    }
}

//! Writes a file: header, product, units, bodies and colors.

use super::number::real;
use super::topology::{Scale, ShellNumbers, ShellWriter};
use super::{Entities, references};
use crate::shell::Shell;

/// A body of a file.
#[derive(Clone, Debug)]
pub(crate) enum Body<'a> {
    /// A solid without voids.
    Solid(&'a Shell),
    /// A solid with voids. The shell of a void is oriented as if it bounded a solid of its own.
    Hollow(&'a Shell, Vec<&'a Shell>),
    /// Faces that do not enclose a volume.
    Open(&'a Shell),
}

/// The unit of the lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LengthUnit {
    Millimeter,
    Inch,
    Meter,
}

/// The unit of the angles in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AngleUnit {
    Radian,
    Degree,
}

/// The names and colors of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decoration {
    Bare,
    Named,
    NamedAndColored,
}

/// The properties of a file except its bodies.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    pub(crate) name: String,
    pub(crate) length: LengthUnit,
    pub(crate) angle: AngleUnit,
    pub(crate) decoration: Decoration,
    /// Whether every second edge has the opposite direction of its curve.
    pub(crate) reverse_curves: bool,
}

impl Document {
    /// A file in millimeters and radians, without names and colors of faces.
    pub(crate) fn plain(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            length: LengthUnit::Millimeter,
            angle: AngleUnit::Radian,
            decoration: Decoration::Bare,
            reverse_curves: false,
        }
    }

    fn scale(&self) -> Scale {
        let mm_per_unit = match self.length {
            LengthUnit::Millimeter => 1.0,
            LengthUnit::Inch => 25.4,
            LengthUnit::Meter => 1000.0,
        };
        let rad_per_unit = match self.angle {
            AngleUnit::Radian => 1.0,
            AngleUnit::Degree => RAD_PER_DEG,
        };
        Scale {
            mm_per_unit,
            rad_per_unit,
        }
    }
}

const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Writes a file with these bodies.
pub(crate) fn write(document: &Document, bodies: &[Body<'_>]) -> String {
    let mut entities = Entities::default();
    let shape = add_product(&mut entities, &document.name);
    let context = add_units(&mut entities, document);
    let zero = [0.0; 3];
    let origin = entities.placement(zero, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let mut items = vec![origin];
    for body in bodies {
        let (item, faces) = add_body(&mut entities, document, body);
        items.push(item);
        add_colors(&mut entities, document, &faces, context);
    }
    let has_solids = bodies.iter().all(|body| !matches!(body, Body::Open(_)));
    let kind = if has_solids {
        "ADVANCED_BREP_SHAPE_REPRESENTATION"
    } else {
        "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"
    };
    let representation = entities.add(&format!("{kind}('',{},#{context})", references(&items)));
    entities.add(&format!(
        "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"
    ));
    format!(
        "{}DATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
        header(&document.name),
        entities.text
    )
}

fn header(name: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('parametric part'),'2;1');\n\
         FILE_NAME('{name}.step','2000-01-01T00:00:00',(''),(''),'partprobe','partprobe synth','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\n"
    )
}

/// Writes the product and returns the number of its shape.
fn add_product(entities: &mut Entities, name: &str) -> u64 {
    let application =
        entities.add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')");
    entities.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
    ));
    let product_context = entities.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
    let product = entities.add(&format!(
        "PRODUCT('{name}','{name}','',(#{product_context}))"
    ));
    entities.add(&format!(
        "PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"
    ));
    let formation = entities.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
    let context = entities.add(&format!(
        "PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"
    ));
    let definition = entities.add(&format!(
        "PRODUCT_DEFINITION('design','',#{formation},#{context})"
    ));
    entities.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))
}

/// Writes the units and returns the number of the context that contains them.
fn add_units(entities: &mut Entities, document: &Document) -> u64 {
    let length = add_length_unit(entities, document.length);
    let angle = add_angle_unit(entities, document.angle);
    let solid_angle = entities.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let tolerance = real(1e-6 / document.scale().mm_per_unit);
    let uncertainty = entities.add(&format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({tolerance}),#{length},'distance_accuracy_value','')"
    ));
    entities.add(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{uncertainty}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid_angle}))REPRESENTATION_CONTEXT('',''))"
    ))
}

fn add_length_unit(entities: &mut Entities, unit: LengthUnit) -> u64 {
    match unit {
        LengthUnit::Millimeter => {
            entities.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        }
        LengthUnit::Meter => entities.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))"),
        LengthUnit::Inch => {
            let millimeter = entities.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
            let factor = entities.add(&format!(
                "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{millimeter})"
            ));
            let exponents = entities.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
            entities.add(&format!(
                "(CONVERSION_BASED_UNIT('INCH',#{factor})LENGTH_UNIT()NAMED_UNIT(#{exponents}))"
            ))
        }
    }
}

fn add_angle_unit(entities: &mut Entities, unit: AngleUnit) -> u64 {
    let radian = entities.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    if unit == AngleUnit::Radian {
        return radian;
    }
    let factor = real(RAD_PER_DEG);
    let factor = entities.add(&format!(
        "PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({factor}),#{radian})"
    ));
    let exponents = entities.add("DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.)");
    entities.add(&format!(
        "(CONVERSION_BASED_UNIT('DEGREE',#{factor})NAMED_UNIT(#{exponents})PLANE_ANGLE_UNIT())"
    ))
}

/// Writes a body and returns its number and those of its faces.
fn add_body(entities: &mut Entities, document: &Document, body: &Body<'_>) -> (u64, Vec<u64>) {
    let mut writer = ShellWriter {
        entities,
        scale: document.scale(),
        reverse_curves: document.reverse_curves,
    };
    let name = |face: usize| match document.decoration {
        Decoration::Bare => String::new(),
        Decoration::Named | Decoration::NamedAndColored => format!("face {face}"),
    };
    match body {
        Body::Solid(shell) => {
            let ShellNumbers { shell, faces } = writer.shell(shell, "CLOSED_SHELL", name);
            (
                entities.add(&format!(
                    "MANIFOLD_SOLID_BREP('{}',#{shell})",
                    document.name
                )),
                faces,
            )
        }
        Body::Open(shell) => {
            let ShellNumbers { shell, faces } = writer.shell(shell, "OPEN_SHELL", name);
            (
                entities.add(&format!(
                    "SHELL_BASED_SURFACE_MODEL('{}',(#{shell}))",
                    document.name
                )),
                faces,
            )
        }
        Body::Hollow(outer, voids) => {
            let mut written = writer.shell(outer, "CLOSED_SHELL", name);
            let mut void_ids = Vec::new();
            for void in voids {
                let inner = writer.shell(void, "CLOSED_SHELL", name);
                written.faces.extend(inner.faces);
                void_ids.push(
                    writer
                        .entities
                        .add(&format!("ORIENTED_CLOSED_SHELL('',*,#{},.F.)", inner.shell)),
                );
            }
            let voids = references(&void_ids);
            (
                entities.add(&format!(
                    "BREP_WITH_VOIDS('{}',#{},{voids})",
                    document.name, written.shell
                )),
                written.faces,
            )
        }
    }
}

/// Colors every third face.
fn add_colors(entities: &mut Entities, document: &Document, faces: &[u64], context: u64) {
    if document.decoration != Decoration::NamedAndColored {
        return;
    }
    let color = entities.add("COLOUR_RGB('',0.8,0.25,0.1)");
    let fill = entities.add(&format!("FILL_AREA_STYLE_COLOUR('',#{color})"));
    let area = entities.add(&format!("FILL_AREA_STYLE('',(#{fill}))"));
    let area = entities.add(&format!("SURFACE_STYLE_FILL_AREA(#{area})"));
    let side = entities.add(&format!("SURFACE_SIDE_STYLE('',(#{area}))"));
    let usage = entities.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
    let style = entities.add(&format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"));
    let styled: Vec<u64> = faces
        .iter()
        .step_by(3)
        .map(|face| entities.add(&format!("STYLED_ITEM('color',(#{style}),#{face})")))
        .collect();
    let items = references(&styled);
    entities.add(&format!(
        "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{items},#{context})"
    ));
}

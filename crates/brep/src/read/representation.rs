//! Recognizes representations: lists of items with the context that defines their units.
//!
//! They are recognized by their attributes (a name, a list of items, a context), because each schema has its own subtypes
//! (`SHAPE_REPRESENTATION_WITH_PARAMETERS`, `DRAUGHTING_MODEL`), and not all of their names have the same ending.

use super::file::StepFile;
use crate::part21::{Keyword, Param, Params, Record, full_name};

/// A representation, as its instance defines it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Representation<'a> {
    /// Its instance.
    pub(super) record: Record,
    /// The entities that it lists.
    pub(super) items: Params<'a>,
    /// The `#` number of its context, if it names one.
    pub(super) context: Option<u64>,
}

/// Words in the names of classes of drawings.
const DRAWN: [&[u8]; 6] = [
    b"DRAUGHTING",
    b"DRAWING",
    b"PRESENTATION",
    b"PICTURE",
    b"SYMBOL",
    b"CAMERA",
];

/// Every representation of the file, in the order of their numbers.
pub(super) fn representations<'s, 'a>(
    source: &'s StepFile<'a>,
) -> impl Iterator<Item = Representation<'a>> + use<'s, 'a> {
    source
        .exchange
        .records()
        .iter()
        .filter_map(|&record| representation_of(source, record))
}

/// The representation in an instance. Returns `None` if the instance is not a representation.
pub(super) fn representation_of<'a>(
    source: &StepFile<'a>,
    record: Record,
) -> Option<Representation<'a>> {
    let by_attributes = |params: Params<'a>| {
        let (items, context) = attributes(params)?;
        Some((
            items,
            Some(context.filter(|&context| is_context(source, context))?),
        ))
    };
    let (items, context) = match record.keyword {
        Keyword::Representation => attributes(source.exchange.params(record))?,
        Keyword::Complex => match source.exchange.partial(record, "REPRESENTATION") {
            Some(params) => attributes(params)?,
            // All attributes may be in one of its classes.
            None => source
                .exchange
                .partials(record)
                .find_map(|(_, params)| by_attributes(params))?,
        },
        Keyword::Other => by_attributes(source.exchange.params(record))?,
        _ => return None,
    };
    Some(Representation {
        record,
        items,
        context,
    })
}

/// Whether a representation is a drawing: it shows other representations in a view or on a sheet. Such a representation does not
/// give positions.
pub(super) fn is_drawn(source: &StepFile<'_>, representation: Record) -> bool {
    source
        .exchange
        .partials(representation)
        .any(|(class, _)| draws(full_name(class)))
}

/// The items and the context, if the parameters are a name, a list and possibly a context.
fn attributes(params: Params<'_>) -> Option<(Params<'_>, Option<u64>)> {
    let [name, items, context] = params.first().ok()?;
    let is_name = name.text().is_some() || matches!(name, Param::Unset | Param::Derived);
    let items = items.list().ok().filter(|_| is_name)?;
    Some((items, context.reference().ok()))
}

fn is_context(source: &StepFile<'_>, id: u64) -> bool {
    source
        .exchange
        .record(id)
        .is_some_and(|record| match record.keyword {
            Keyword::Context => true,
            Keyword::Complex => source
                .exchange
                .partial(record, "REPRESENTATION_CONTEXT")
                .is_some(),
            _ => false,
        })
}

fn draws(class: &[u8]) -> bool {
    class
        .split(|&byte| byte == b'_')
        .any(|word| DRAWN.iter().any(|drawn| word.eq_ignore_ascii_case(drawn)))
}

#[cfg(test)]
mod tests {
    use crate::fixtures::cuboid;
    use crate::read::{ReadBudget, read};

    const LISTED: &str = "ADVANCED_BREP_SHAPE_REPRESENTATION('',(";
    const INCHES: &str = "#9001=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#2);\n\
        #9002=(CONVERSION_BASED_UNIT('INCH',#9001)LENGTH_UNIT()NAMED_UNIT(*));\n\
        #9003=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#9002,#3))REPRESENTATION_CONTEXT('',''));\n\
        #9004=GLOBAL_UNIT_ASSIGNED_CONTEXT('','',(#9002,#3));\n";

    /// A cube of side 1 that is listed by this representation. `@` is replaced by the solid. `#1` is a context in millimeters,
    /// `#9003` and `#9004` are contexts in inches.
    fn cube_listed_by(representation: &str) -> String {
        let text = String::from_utf8(cuboid([1.0; 3]).bytes()).unwrap();
        let start = text.find(LISTED).unwrap();
        let end = start + text[start..].find(';').unwrap();
        let (solid, _) = text[start + LISTED.len()..].split_once(')').unwrap();
        format!(
            "{}{};\n{INCHES}{}",
            &text[..start],
            representation.replace('@', solid),
            &text[end + 1..]
        )
    }

    /// Checks the millimeters per unit of that cube.
    #[track_caller]
    fn check(representation: &str, expected: f64) {
        let brep = read(
            cube_listed_by(representation).as_bytes(),
            &ReadBudget::default(),
        )
        .unwrap();
        let far = brep
            .vertices
            .iter()
            .flat_map(|vertex| vertex.point)
            .fold(0.0, f64::max);
        assert_eq!(
            (far, brep.faces.len(), brep.lost.len()),
            (expected, 6, 0),
            "{representation}"
        );
    }

    #[test]
    fn representations_of_every_class_have_their_units() {
        for representation in [
            "ADVANCED_BREP_SHAPE_REPRESENTATION('',(@),#9003)",
            "SHAPE_REPRESENTATION_WITH_PARAMETERS('',(@),#9003)",
            "SHAPE_REPRESENTATION_WITH_PARAMETERS($,(@),#9004)",
            "TESSELLATED_SHAPE_REPRESENTATION_WITH_ACCURACY_PARAMETERS('',(@),#9003,())",
            "FEA_MODEL_3D('',(@),#9003,'','','','')",
            "!MY_MODEL('',(@),#9003)",
            "SRWP('',(@),#9003)",
            "ABSR('',(@),#9003)",
            "(CHARACTERIZED_OBJECT(*,*)REPRESENTATION('',(@),#9003)SHAPE_REPRESENTATION())",
            "(SHAPE_REPRESENTATION()REPRESENTATION('',(@),#9003)SHAPE_REPRESENTATION_WITH_PARAMETERS())",
            "(ITS_OWN('',(@),#9003)SHAPE_REPRESENTATION())",
        ] {
            check(representation, 25.4);
        }
    }

    #[test]
    fn similar_class_names_are_not_representations() {
        // The third attribute is not a context.
        check(
            "ADVANCED_BREP_SHAPE_REPRESENTATION('',(@),#1);\n#9005=GROUP_OF('',(@),#9002)",
            1.0,
        );
        check(
            "SHAPE_REPRESENTATION_WITH_PARAMETERS('',(@),#1);\n#9005=GROUP_OF((@),#9003,'')",
            1.0,
        );
    }

    #[test]
    fn a_drawing_places_a_root_only_if_nothing_else_does() {
        check("DRAUGHTING_MODEL('',(@),#9003)", 25.4);
        for class in [
            "DRAUGHTING_MODEL",
            "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION",
            "PRSRPR",
        ] {
            check(
                &format!(
                    "{class}('',(@),#9003);\n#9005=ADVANCED_BREP_SHAPE_REPRESENTATION('',(@),#1)"
                ),
                1.0,
            );
        }
    }

    #[test]
    fn a_root_that_nothing_lists_has_the_units_of_the_first_context() {
        let text = cube_listed_by("LINE('',$,$)").replacen("((#2,#3))", "((#9002,#3))", 1);
        let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
        assert_eq!(brep.units.mm_per_unit, 25.4);
    }

    #[test]
    fn assemblies_of_representations_of_every_class() {
        // The cube is placed at 3 inches along x in a representation in millimeters.
        let placed = |class: &str, relationship: &str| {
            let text = cube_listed_by(&format!("{class}('',(@),#9003)"));
            let listed = text.find(&format!("={class}(")).unwrap();
            let id = &text[text[..listed].rfind('#').unwrap()..listed];
            let placing = format!(
                "#9010=CARTESIAN_POINT('',(0.,0.,0.));\n#9011=AXIS2_PLACEMENT_3D('',#9010,$,$);\n\
                 #9012=CARTESIAN_POINT('',(3.,0.,0.));\n#9013=AXIS2_PLACEMENT_3D('',#9012,$,$);\n\
                 #9014=ITEM_DEFINED_TRANSFORMATION('','',#9011,#9013);\n\
                 #9015=SHAPE_REPRESENTATION_WITH_PARAMETERS('',(#9013),#1);\n#9016={};\nENDSEC;",
                relationship.replace('@', id)
            );
            let brep = read(
                text.replacen("ENDSEC;\nEND", &format!("{placing}\nEND"), 1)
                    .as_bytes(),
                &ReadBudget::default(),
            );
            brep.unwrap()
                .vertices
                .iter()
                .map(|vertex| vertex.point[0])
                .fold(f64::MAX, f64::min)
        };
        for class in [
            "SHAPE_REPRESENTATION_WITH_PARAMETERS",
            "ADVANCED_BREP_SHAPE_REPRESENTATION",
            "FEA_MODEL_3D",
        ] {
            for relationship in [
                "(REPRESENTATION_RELATIONSHIP('','',@,#9015)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#9014)SHAPE_REPRESENTATION_RELATIONSHIP())",
                "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION('','',@,#9015,#9014)",
                "SHAPE_REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION('','',@,#9015,#9014)",
            ] {
                assert_eq!(placed(class, relationship), 3.0, "{class} {relationship}");
            }
        }
    }
}

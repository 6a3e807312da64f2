//! Reads the units of a representation context: SI prefixes and chains of conversion-based units.

use super::error::{EntityError, Problem};
use super::file::StepFile;
use crate::part21::{Keyword, Param, ParamError, Params, Record, decode_text};
use partprobe_shape::Units;

/// The largest depth of units that are defined by other units. Real files have at most two levels.
const MAX_CHAIN: usize = 8;

const MM_PER_METRE: f64 = 1000.0;

/// The units in which a file without units is read.
pub(super) fn default_units() -> Units {
    Units {
        length: "mm".to_owned(),
        mm_per_unit: 1.0,
        angle: "radian".to_owned(),
        rad_per_unit: 1.0,
    }
}

/// The units that a representation context assigns.
///
/// # Errors
/// If it assigns no length unit that can be read. Without an angle unit, radians are assumed.
pub(super) fn units_of_context(source: &StepFile<'_>, context: u64) -> Result<Units, EntityError> {
    let mut units = default_units();
    let mut has_length = false;
    for unit in assigned_units(source, context)? {
        match read_unit(source, unit)? {
            Some(Unit {
                quantity: Quantity::Length,
                name,
                in_si,
            }) => {
                (units.length, units.mm_per_unit) = (name, in_si * MM_PER_METRE);
                has_length = true;
            }
            Some(Unit {
                quantity: Quantity::Angle,
                name,
                in_si,
            }) => (units.angle, units.rad_per_unit) = (name, in_si),
            None => {}
        }
    }
    if has_length {
        Ok(units)
    } else {
        Err(Problem::Geometry("it assigns no length unit").into())
    }
}

/// Whether an instance is a context that assigns units.
pub(super) fn assigns_units(source: &StepFile<'_>, record: Record) -> bool {
    matches!(record.keyword, Keyword::Context | Keyword::Complex)
        && source
            .exchange
            .partial(record, "GLOBAL_UNIT_ASSIGNED_CONTEXT")
            .is_some()
}

fn assigned_units(source: &StepFile<'_>, context: u64) -> Result<Vec<u64>, EntityError> {
    source.entity(context, |record| {
        let assigned = source
            .exchange
            .partial(record, "GLOBAL_UNIT_ASSIGNED_CONTEXT")
            .ok_or(ParamError::Missing)?;
        // A plain instance has the context's identifier and type before the units.
        let units = assigned
            .iter()
            .find_map(|param| param.ok()?.list().ok())
            .ok_or(ParamError::Missing)?;
        Ok(units.references()?)
    })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Length,
    Angle,
}

struct Unit {
    quantity: Quantity,
    name: String,
    /// Meters or radians per unit.
    in_si: f64,
}

/// The length or angle unit that an instance defines. Returns `None` if it is a unit of another quantity.
fn read_unit(source: &StepFile<'_>, id: u64) -> Result<Option<Unit>, EntityError> {
    let record = source.record(id)?;
    let has = |name| source.exchange.partial(record, name).is_some();
    let definition = definition(source, id);
    let quantity = match &definition {
        _ if has("LENGTH_UNIT") => Quantity::Length,
        _ if has("PLANE_ANGLE_UNIT") => Quantity::Angle,
        _ if has("SOLID_ANGLE_UNIT") => return Ok(None),
        // A plain instance does not state its quantity, but its definition does.
        Ok(Definition {
            base: SiBase::Meter,
            ..
        }) => Quantity::Length,
        Ok(Definition {
            base: SiBase::Radian,
            ..
        }) => Quantity::Angle,
        _ => return Ok(None),
    };
    let Definition { in_si, base } = definition.map_err(|error| error.within(id))?;
    if quantity == Quantity::Length && base != SiBase::Meter {
        return Err(EntityError::from(Problem::Geometry("it is not defined by meters")).within(id));
    }
    Ok(Some(Unit {
        quantity,
        name: unit_name(source, record),
        in_si,
    }))
}

/// The definition of a unit in SI units.
struct Definition {
    /// SI base units per unit.
    in_si: f64,
    base: SiBase,
}

/// Follows conversions down to an SI unit and multiplies their factors.
fn definition(source: &StepFile<'_>, id: u64) -> Result<Definition, EntityError> {
    let mut id = id;
    let mut product = 1.0;
    for _ in 0..MAX_CHAIN {
        let record = source.record(id)?;
        if let Some(params) = source.exchange.partial(record, "SI_UNIT") {
            let symbol =
                SiSymbol::read(params).map_err(|error| EntityError::from(error).within(id))?;
            let in_si = product * symbol.factor;
            let is_positive = in_si > 0.0 && in_si.is_finite();
            return if is_positive {
                Ok(Definition {
                    in_si,
                    base: symbol.base,
                })
            } else {
                Err(Problem::Geometry("its factor is not positive").into())
            };
        }
        let conversion = source.exchange.partial(record, "CONVERSION_BASED_UNIT");
        let conversion = conversion.ok_or(Problem::Geometry(
            "it is not an SI unit, and not defined by one",
        ))?;
        let measure = conversion
            .iter()
            .filter_map(Result::ok)
            .filter_map(|param| param.reference().ok())
            .last();
        let (value, unit) = measure_with_unit(source, measure.ok_or(ParamError::Missing)?)?;
        product *= value;
        id = unit;
    }
    Err(Problem::TooDeep.into())
}

/// The number and the unit of a plain or complex `…_MEASURE_WITH_UNIT`, or of a representation item of this class.
fn measure_with_unit(source: &StepFile<'_>, id: u64) -> Result<(f64, u64), EntityError> {
    source.entity(id, |record| {
        let measure_of = |params: Params<'_>| {
            let params: Vec<Param<'_>> = params.iter().filter_map(Result::ok).take(3).collect();
            params
                .windows(2)
                .find_map(|pair| Some((pair[0].number().ok()?, pair[1].reference().ok()?)))
        };
        let measure = source
            .exchange
            .partials(record)
            .find_map(|(_, params)| measure_of(params));
        Ok(measure.ok_or(ParamError::Kind("a measure with a unit"))?)
    })
}

/// The SI units to which lengths and angles are reduced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SiBase {
    Meter,
    Radian,
    Other,
}

/// The contents of an `SI_UNIT`.
struct SiSymbol {
    /// The letter of the prefix, or an empty text if there is no prefix.
    prefix: &'static str,
    /// Base units per unit.
    factor: f64,
    base: SiBase,
}

impl SiSymbol {
    /// Reads prefix and name. There is no prefix if it is left out or written as `$` or `*`. A plain instance has its dimensions
    /// before them.
    fn read(params: Params<'_>) -> Result<Self, Problem> {
        let symbols = params.iter().filter_map(|param| match param {
            Ok(Param::Enum(name)) => Some(name.to_ascii_uppercase()),
            _ => None,
        });
        let symbols: Vec<Vec<u8>> = symbols.collect();
        let (name, before) = symbols
            .split_last()
            .ok_or(Problem::Geometry("it names no SI unit"))?;
        let base = match name.as_slice() {
            b"METRE" | b"METER" => SiBase::Meter,
            b"RADIAN" => SiBase::Radian,
            _ => SiBase::Other,
        };
        let Some(prefix) = before.last() else {
            return Ok(Self {
                prefix: "",
                factor: 1.0,
                base,
            });
        };
        let known = PREFIXES.iter().find(|(name, ..)| name == prefix);
        let &(_, prefix, factor) =
            known.ok_or(Problem::Geometry("its prefix is not one of SI's"))?;
        Ok(Self {
            prefix,
            factor,
            base,
        })
    }
}

const PREFIXES: [(&[u8], &str, f64); 16] = [
    (b"EXA", "E", 1e18),
    (b"PETA", "P", 1e15),
    (b"TERA", "T", 1e12),
    (b"GIGA", "G", 1e9),
    (b"MEGA", "M", 1e6),
    (b"KILO", "k", 1e3),
    (b"HECTO", "h", 1e2),
    (b"DECA", "da", 1e1),
    (b"DECI", "d", 1e-1),
    (b"CENTI", "c", 1e-2),
    (b"MILLI", "m", 1e-3),
    (b"MICRO", "u", 1e-6),
    (b"NANO", "n", 1e-9),
    (b"PICO", "p", 1e-12),
    (b"FEMTO", "f", 1e-15),
    (b"ATTO", "a", 1e-18),
];

/// `mm`, `m`, `radian`, or the name of a conversion-based unit in lower case.
fn unit_name(source: &StepFile<'_>, record: Record) -> String {
    if let Some(SiSymbol { prefix, base, .. }) = source
        .exchange
        .partial(record, "SI_UNIT")
        .and_then(|params| SiSymbol::read(params).ok())
    {
        return if base == SiBase::Meter {
            format!("{prefix}m")
        } else {
            format!("{prefix}radian")
        };
    }
    let params = source.exchange.partial(record, "CONVERSION_BASED_UNIT");
    let name = params.and_then(|params| params.iter().filter_map(Result::ok).find_map(Param::text));
    name.map_or_else(String::new, |name| decode_text(name).to_lowercase())
}

#[cfg(test)]
mod tests {
    use crate::fixtures::{CUBE_POLYGONS, StepText, box_corners};
    use crate::read::{ReadBudget, read};

    const METRE: &str = "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))";
    const INCH: &str = "(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(*))";
    const OF_METRE: &str = "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.0254),#5)";

    /// Checks the name and the millimeters of a unit, which may refer to `#4` and `#5`, and the number of lost entities.
    #[track_caller]
    fn check(unit: &str, [fourth, fifth]: [&str; 2], expected: (&str, f64), n_lost: usize) {
        let mut text =
            StepText::with_units(unit, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        text.add(fourth);
        text.add(fifth);
        let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
        text.solid(&faces);
        let brep = read(&text.bytes(), &ReadBudget::default()).unwrap();
        let relative = brep.units.mm_per_unit / expected.1 - 1.0;
        assert!(
            brep.units.length == expected.0 && relative.abs() < 1e-14,
            "{unit}: {:?}",
            brep.units
        );
        assert_eq!(brep.lost.len(), n_lost, "{unit}: {:?}", brep.lost);
    }

    #[test]
    fn si_units_with_and_without_a_prefix() {
        let none = [METRE, METRE];
        for unit in [
            METRE,
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(*,.METRE.))",
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(,.METRE.))",
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.METRE.))",
            "(SI_UNIT(*,.metre.)NAMED_UNIT(*)LENGTH_UNIT())",
            "SI_UNIT(*,$,.METRE.)",
            "SI_UNIT(*,*,.METRE.)",
            "SI_UNIT($,$,.METRE.)",
            "SI_UNIT(.METRE.)",
        ] {
            check(unit, none, ("m", 1000.0), 0);
        }
        for (prefix, symbol, factor) in super::PREFIXES {
            let prefix = std::str::from_utf8(prefix).unwrap();
            let unit = format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.{prefix}.,.METRE.))");
            // With larger units, the points of the test file are out of reach.
            if factor < 1e9 {
                check(&unit, none, (&format!("{symbol}m"), factor * 1000.0), 0);
            }
        }
        check("SI_UNIT(*,.milli.,.metre.)", none, ("mm", 1.0), 0);
    }

    #[test]
    fn units_that_cannot_be_read_are_named() {
        let none = [METRE, METRE];
        check(
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.INCH.,.METRE.))",
            none,
            ("mm", 1.0),
            1,
        );
        check(
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.SECOND.))",
            none,
            ("mm", 1.0),
            1,
        );
        check(
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT())",
            none,
            ("mm", 1.0),
            1,
        );
        check(
            "(CONTEXT_DEPENDENT_UNIT('inch')LENGTH_UNIT()NAMED_UNIT(*))",
            none,
            ("mm", 1.0),
            1,
        );
        check(
            INCH,
            ["LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.),#5)", METRE],
            ("mm", 1.0),
            1,
        );
        check(
            INCH,
            ["LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#2)", METRE],
            ("mm", 1.0),
            1,
        );
    }

    #[test]
    fn conversions_in_every_order_of_their_parts() {
        for unit in [
            INCH,
            "(LENGTH_UNIT()NAMED_UNIT(*)CONVERSION_BASED_UNIT('INCH',#4))",
            "(NAMED_UNIT(*)CONVERSION_BASED_UNIT('Inch',#4)LENGTH_UNIT())",
            "CONVERSION_BASED_UNIT(*,'INCH',#4)",
        ] {
            check(unit, [OF_METRE, METRE], ("inch", 25.4), 0);
        }
        for measure in [
            "LENGTH_MEASURE_WITH_UNIT(0.0254,#5)",
            "(LENGTH_MEASURE_WITH_UNIT()MEASURE_WITH_UNIT(LENGTH_MEASURE(0.0254),#5))",
            "MEASURE_REPRESENTATION_ITEM('',POSITIVE_LENGTH_MEASURE(2.54D-2),#5)",
        ] {
            check(INCH, [measure, "SI_UNIT(*,*,.METRE.)"], ("inch", 25.4), 0);
        }
    }
}

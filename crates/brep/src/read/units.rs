//! Units of a representation context: SI prefixes and chains of conversion-based units.

use super::error::{EntityError, Problem};
use super::source::Source;
use crate::part21::{Keyword, Param, ParamError, Record, decode_text};
use carrier::Units;

/// A unit may be defined by a unit so many times; real files stop at two.
const MAX_CHAIN: usize = 8;

const MM_PER_METRE: f64 = 1000.0;

/// What a file without units is read in.
pub(super) fn default_units() -> Units {
    Units { length: "mm".to_owned(), mm_per_unit: 1.0, angle: "radian".to_owned(), rad_per_unit: 1.0 }
}

/// The units that a representation context assigns.
///
/// # Errors
/// If it assigns no length unit that can be read; radians are taken where it has no angle unit.
pub(super) fn units_of_context(source: &Source<'_>, context: u64) -> Result<Units, EntityError> {
    let mut units = default_units();
    let mut has_length = false;
    for unit in assigned_units(source, context)? {
        match read_unit(source, unit)? {
            Some(Unit { quantity: Quantity::Length, name, in_si }) => {
                (units.length, units.mm_per_unit) = (name, in_si * MM_PER_METRE);
                has_length = true;
            }
            Some(Unit { quantity: Quantity::Angle, name, in_si }) => (units.angle, units.rad_per_unit) = (name, in_si),
            None => {}
        }
    }
    if has_length { Ok(units) } else { Err(Problem::Geometry("it assigns no length unit").into()) }
}

fn assigned_units(source: &Source<'_>, context: u64) -> Result<Vec<u64>, EntityError> {
    source.entity(context, |record| {
        let assigned = source.exchange.partial(record, "GLOBAL_UNIT_ASSIGNED_CONTEXT").ok_or(ParamError::Missing)?;
        // A plain instance has the context's identifier and type before the units.
        let units = assigned.iter().find_map(|param| param.ok()?.list().ok()).ok_or(ParamError::Missing)?;
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
    /// Metres or radians in one unit.
    in_si: f64,
}

/// The length or angle unit that an instance defines; none where it is a unit of something else.
fn read_unit(source: &Source<'_>, id: u64) -> Result<Option<Unit>, EntityError> {
    let record = source.record(id)?;
    let has = |name| source.exchange.partial(record, name).is_some();
    let si_name = || source.exchange.partial(record, "SI_UNIT").and_then(si_symbol);
    let quantity = match () {
        () if has("LENGTH_UNIT") => Quantity::Length,
        () if has("PLANE_ANGLE_UNIT") => Quantity::Angle,
        () if has("SOLID_ANGLE_UNIT") => return Ok(None),
        () => match si_name() {
            Some((_, b"METRE")) => Quantity::Length,
            Some((_, b"RADIAN")) => Quantity::Angle,
            _ => return Ok(None),
        },
    };
    let in_si = factor(source, id).map_err(|error| error.within(id))?;
    Ok(Some(Unit { quantity, name: unit_name(source, record), in_si }))
}

/// Follows conversions down to an SI unit and multiplies their factors.
fn factor(source: &Source<'_>, id: u64) -> Result<f64, EntityError> {
    let mut id = id;
    let mut product = 1.0;
    for _ in 0..MAX_CHAIN {
        let record = source.record(id)?;
        if let Some((prefix, _)) = source.exchange.partial(record, "SI_UNIT").and_then(si_symbol) {
            let factor = product * factor_of_prefix(prefix);
            return if factor > 0.0 { Ok(factor) } else { Err(Problem::Geometry("its factor is not positive").into()) };
        }
        let conversion = source.exchange.partial(record, "CONVERSION_BASED_UNIT").ok_or(ParamError::Missing)?;
        let measure = conversion.iter().filter_map(Result::ok).filter_map(|param| param.reference().ok()).last();
        let (value, unit) = measure_with_unit(source, measure.ok_or(ParamError::Missing)?)?;
        product *= value;
        id = unit;
    }
    Err(Problem::TooDeep.into())
}

/// The number and the unit of a `…_MEASURE_WITH_UNIT`, plain or complex.
fn measure_with_unit(source: &Source<'_>, id: u64) -> Result<(f64, u64), EntityError> {
    source.entity(id, |record| {
        let parts = source.exchange.partials(record);
        let measure = parts
            .filter_map(|(_, params)| params.first::<2>().ok())
            .find_map(|[value, unit]| Some((value.number().ok()?, unit.reference().ok()?)));
        Ok(measure.ok_or(ParamError::Kind("a measure with a unit"))?)
    })
}

/// Prefix and name of an `SI_UNIT`; a plain instance has its dimensions before them.
fn si_symbol(params: crate::part21::Params<'_>) -> Option<(&[u8], &[u8])> {
    let mut symbols = params.iter().filter_map(Result::ok).filter(|param| *param != Param::Derived);
    let prefix = match symbols.next()? {
        Param::Enum(prefix) => prefix,
        Param::Unset => b"",
        _ => return None,
    };
    match symbols.next() {
        Some(Param::Enum(name)) => Some((prefix, name)),
        _ => None,
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

fn factor_of_prefix(prefix: &[u8]) -> f64 {
    PREFIXES.iter().find(|(name, ..)| *name == prefix).map_or(1.0, |&(.., factor)| factor)
}

/// `mm`, `m`, `radian`, or the lower-case name that a conversion-based unit gives itself.
fn unit_name(source: &Source<'_>, record: Record) -> String {
    if let Some((prefix, name)) = source.exchange.partial(record, "SI_UNIT").and_then(si_symbol) {
        let symbol = PREFIXES.iter().find(|(name, ..)| *name == prefix).map_or("", |&(_, symbol, _)| symbol);
        return if name == b"METRE" { format!("{symbol}m") } else { format!("{symbol}radian") };
    }
    let params = source.exchange.partial(record, "CONVERSION_BASED_UNIT");
    let name = params.and_then(|params| params.iter().filter_map(Result::ok).find_map(Param::text));
    name.map_or_else(String::new, |name| decode_text(name).to_lowercase())
}

/// The context of a representation: its third parameter.
pub(super) fn context_of(source: &Source<'_>, representation: Record) -> Option<u64> {
    let params = match representation.keyword {
        Keyword::Complex => source.exchange.partial(representation, "REPRESENTATION")?,
        _ => source.exchange.params(representation),
    };
    let [_, _, context] = params.first().ok()?;
    context.reference().ok()
}

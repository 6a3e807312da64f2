//! Reads the attributes of a face: its bounds, its surface and its sense, also those of subfaces and complex instances.

use super::error::{EntityError, Problem};
use super::file::{StepFile, name_of};
use crate::part21::{Keyword, Param, ParamError, Record};

/// The largest depth of oriented shells or faces that name oriented ones. Real files have one level.
const MAX_ORIENTED: usize = 8;

/// The attributes of a face's entity.
pub(super) struct FaceAttributes<'a> {
    pub(super) name: Option<String>,
    pub(super) bounds: Param<'a>,
    pub(super) surface: Option<u64>,
    pub(super) same_sense: bool,
}

/// Follows `ORIENTED_…` entities to the entity that they orient, and says whether they reverse it.
pub(super) fn oriented(source: &StepFile<'_>, id: u64) -> Result<(Record, bool), EntityError> {
    let mut record = source.record(id)?;
    let mut flipped = false;
    for _ in 0..MAX_ORIENTED {
        if !matches!(
            record.keyword,
            Keyword::OrientedClosedShell | Keyword::OrientedOpenShell | Keyword::OrientedFace
        ) {
            return Ok((record, flipped));
        }
        let attributes = || {
            let [_, _, element, orientation] = source.params(record)?;
            Ok((element.reference()?, source.flag(record, orientation)?))
        };
        let (element, orientation) =
            attributes().map_err(|error: ParamError| EntityError::from(error).within(record.id))?;
        flipped ^= !orientation;
        record = source.record(element)?;
    }
    Err(EntityError::from(Problem::TooDeep).within(id))
}

pub(super) fn face_attributes<'a>(
    source: &StepFile<'a>,
    record: Record,
) -> Result<FaceAttributes<'a>, EntityError> {
    if record.keyword == Keyword::Complex {
        return complex_face_attributes(source, record);
    }
    let [name, bounds] = source.params(record)?;
    let (surface, same_sense) = match record.keyword {
        Keyword::AdvancedFace | Keyword::FaceSurface => {
            let [_, _, surface, same_sense] = source.params(record)?;
            match surface {
                // The sense of the bounds refers to the face, so a surface that is made from the bounds does not need a sense.
                Param::Unset => (None, true),
                surface => (Some(surface.reference()?), source.flag(record, same_sense)?),
            }
        }
        // A face of a faceted B-Rep lies in the plane of its polygons.
        Keyword::Face => (None, true),
        Keyword::Subface => parent_surface(source, record)?,
        _ => return Err(source.wrong_class(record, "face")),
    };
    Ok(FaceAttributes {
        name: name_of(name),
        bounds,
        surface,
        same_sense,
    })
}

/// The surface of the parent of a `SUBFACE`.
fn parent_surface(
    source: &StepFile<'_>,
    mut record: Record,
) -> Result<(Option<u64>, bool), EntityError> {
    let mut same_sense = true;
    for _ in 0..MAX_ORIENTED {
        let [_, _, parent] = source.params(record)?;
        let (parent, is_reversed) = oriented(source, parent.reference()?)?;
        same_sense ^= is_reversed;
        if parent.keyword != Keyword::Subface {
            let FaceAttributes {
                surface,
                same_sense: parent_sense,
                ..
            } = face_attributes(source, parent)?;
            return Ok((surface, same_sense == parent_sense));
        }
        record = parent;
    }
    Err(Problem::TooDeep.into())
}

fn complex_face_attributes<'a>(
    source: &StepFile<'a>,
    record: Record,
) -> Result<FaceAttributes<'a>, EntityError> {
    let partial = |name| source.exchange.partial(record, name);
    let wrong_class = || source.wrong_class(record, "face");
    let [bounds] = partial("FACE").ok_or_else(wrong_class)?.first()?;
    let [surface, same_sense] = partial("FACE_SURFACE").ok_or_else(wrong_class)?.first()?;
    let name = partial("REPRESENTATION_ITEM")
        .and_then(|item| item.first::<1>().ok())
        .and_then(|[name]| name_of(name));
    let same_sense = source.flag(record, same_sense)?;
    Ok(FaceAttributes {
        name,
        bounds,
        surface: Some(surface.reference()?),
        same_sense,
    })
}

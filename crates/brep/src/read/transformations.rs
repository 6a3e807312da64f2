//! Reads transformation operators (`CARTESIAN_TRANSFORMATION_OPERATOR` and similar) as motions, and replicas that use them.
//! Nothing here knows about assemblies.

use super::error::{EntityError, Problem};
use super::file::StepFile;
use super::space::{Motion, Reader, Space};
use crate::geometry::Frame;
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::{cross, dot};

/// The largest depth of replicas of replicas.
const MAX_REPLICAS: u32 = 12;

/// The attributes of an operator, from a plain or complex instance.
struct Operator<'a> {
    x: Param<'a>,
    y: Param<'a>,
    origin: Param<'a>,
    scale: Param<'a>,
    z: Param<'a>,
}

impl<'s, 'a> Reader<'s, 'a> {
    /// The motion of a `CARTESIAN_TRANSFORMATION_OPERATOR_3D`, in the reader's own coordinates.
    pub(super) fn transformation_operator(&self, record: Record) -> Result<Motion, EntityError> {
        let Operator {
            x,
            y,
            origin,
            scale,
            z,
        } = operator(self.source, record)?;
        let axis = |param: Param<'_>| {
            param
                .reference()
                .ok()
                .map(|id| self.direction(id))
                .transpose()
        };
        let (x, y, z) = (axis(x)?, axis(y)?, axis(z)?);
        let z = z.or_else(|| Some(cross(x?, y?)));
        let frame = Frame::new(self.point(origin.reference()?)?, z, x);
        let scale = match scale {
            Param::Unset | Param::Derived => 1.0,
            scale => scale.number()?,
        };
        if scale == 0.0 || scale.is_nan() {
            return Err(Problem::Geometry("its scale is 0").into());
        }
        // Left-handed axes mirror the shape, and so does a negative scale.
        let side = |flips: bool| if flips { -1.0 } else { 1.0 };
        let is_left_handed = y.is_some_and(|y| dot(y, frame.y) < 0.0);
        let axes = [
            frame.x,
            frame.y.map(|cell| side(is_left_handed) * cell),
            frame.z,
        ];
        let [x, y, z] = axes.map(|axis| axis.map(|cell| side(scale < 0.0) * cell));
        Ok(Motion {
            scale: scale.abs(),
            ..Motion::onto(&Frame {
                origin: frame.origin,
                x,
                y,
                z,
            })
        })
    }

    /// Follows replicas to the original instance. Returns a reader in the position of the last replica, and the instance.
    ///
    /// `replica` is the class that is followed: `POINT_REPLICA`, `CURVE_REPLICA` or `SURFACE_REPLICA`.
    pub(super) fn without_replicas(
        &self,
        mut id: u64,
        replica: Keyword,
    ) -> Result<(Self, Record), EntityError> {
        let mut reader = *self;
        for _ in 0..MAX_REPLICAS {
            let record = self.source.record(id)?;
            if record.keyword != replica {
                return Ok((reader, record));
            }
            let parts = || -> Result<(u64, u64), ParamError> {
                let [_, parent, transformation] = self.source.params(record)?;
                Ok((parent.reference()?, transformation.reference()?))
            };
            let (parent, transformation) =
                parts().map_err(|error| EntityError::from(error).within(id))?;
            reader = reader.moved_by(transformation)?;
            id = parent;
        }
        Err(EntityError::from(Problem::TooDeep).within(id))
    }

    /// A reader that applies an operator before the representation's own placement.
    fn moved_by(&self, operator: u64) -> Result<Self, EntityError> {
        let unplaced = Reader {
            space: Space {
                motion: None,
                ..self.space
            },
            ..*self
        };
        let motion = self
            .source
            .entity(operator, |record| unplaced.transformation_operator(record))?;
        let motion = self
            .space
            .motion
            .map_or(motion, |outer| outer.after(&motion));
        Ok(Reader {
            space: Space {
                motion: Some(motion),
                ..self.space
            },
            ..*self
        })
    }
}

/// The attributes of an operator. A plain instance has them in one list, and a complex instance has them by class.
fn operator<'a>(source: &StepFile<'a>, record: Record) -> Result<Operator<'a>, EntityError> {
    let wrong_class = || source.wrong_class(record, "transformation");
    if record.keyword != Keyword::Complex {
        if record.keyword != Keyword::CartesianTransformationOperator3d {
            return Err(wrong_class());
        }
        let [_, _, _, x, y, origin, scale, z] = source.params(record)?;
        return Ok(Operator {
            x,
            y,
            origin,
            scale,
            z,
        });
    }
    let partial = |name| source.exchange.partial(record, name);
    let [x, y, origin, scale] = partial("CARTESIAN_TRANSFORMATION_OPERATOR")
        .ok_or_else(wrong_class)?
        .first()?;
    let third = partial("CARTESIAN_TRANSFORMATION_OPERATOR_3D")
        .and_then(|partial| partial.first::<1>().ok());
    Ok(Operator {
        x,
        y,
        origin,
        scale,
        z: third.map_or(Param::Unset, |[z]| z),
    })
}

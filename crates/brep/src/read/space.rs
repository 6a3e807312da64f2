//! Applies the coordinate system and the units of a representation to its points, directions and axes.

use super::error::{EntityError, Problem};
use super::file::StepFile;
use crate::bounds::REACH_MM;
use crate::geometry::Frame;
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::{Point, cross, dot};

/// A motion of space that may scale and mirror: `x ↦ scale · rows · x + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    pub(super) rows: [Point; 3],
    pub(super) scale: f64,
    pub(super) shift: Point,
}

impl Motion {
    pub(super) const IDENTITY: Self = Self {
        rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        scale: 1.0,
        shift: [0.0; 3],
    };

    /// The motion that moves the axes of space onto those of `frame`.
    pub(super) fn onto(frame: &Frame) -> Self {
        let [x, y, z] = [frame.x, frame.y, frame.z];
        let row = |axis: usize| [x[axis], y[axis], z[axis]];
        Self {
            rows: [row(0), row(1), row(2)],
            scale: 1.0,
            shift: frame.origin,
        }
    }

    /// Whether the motion includes a reflection.
    pub(super) fn is_mirror(&self) -> bool {
        let [x, y, z] = self.rows;
        dot(cross(x, y), z) < 0.0
    }

    pub(super) fn direction(&self, vector: Point) -> Point {
        self.rows.map(|row| dot(row, vector))
    }

    pub(super) fn point(&self, point: Point) -> Point {
        let rotated = self.direction(point);
        [0, 1, 2].map(|axis| rotated[axis] * self.scale + self.shift[axis])
    }

    /// The motion that applies `inner` first and then this one.
    pub(super) fn after(&self, inner: &Self) -> Self {
        let column = |axis: usize| self.direction(inner.rows.map(|row| row[axis]));
        let columns = [column(0), column(1), column(2)];
        let row = |axis: usize| columns.map(|column| column[axis]);
        Self {
            rows: [row(0), row(1), row(2)],
            scale: self.scale * inner.scale,
            shift: self.point(inner.shift),
        }
    }

    /// The motion as a matrix that is multiplied by column vectors.
    pub(super) fn matrix(&self) -> [[f64; 4]; 4] {
        let row = |axis: usize| {
            let [x, y, z] = self.rows[axis].map(|cell| cell * self.scale);
            [x, y, z, self.shift[axis]]
        };
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// The inverse motion.
    pub(super) fn inverse(&self) -> Self {
        let row = |axis: usize| self.rows.map(|row| row[axis]);
        let back = Self {
            rows: [row(0), row(1), row(2)],
            scale: 1.0 / self.scale,
            shift: [0.0; 3],
        };
        Self {
            shift: back.point(self.shift).map(|x| -x),
            ..back
        }
    }
}

/// Units and placement: all data that convert a number in the file to millimeters in the result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Space {
    /// Millimeters per length unit of the file.
    pub(super) mm_per_unit: f64,
    /// Radians per angle unit of the file.
    pub(super) rad_per_unit: f64,
    /// The motion that places the representation in its assembly, or `None` if its coordinates do not change.
    pub(super) motion: Option<Motion>,
}

/// Reads points, axes and lengths of one representation.
#[derive(Clone, Copy)]
pub(super) struct Reader<'s, 'a> {
    pub(super) source: &'s StepFile<'a>,
    pub(super) space: Space,
    /// The depth of dependent points: a point may lie on a curve that begins at a point of another curve.
    pub(super) dependence: u32,
}

impl<'s, 'a> Reader<'s, 'a> {
    /// A reader of a representation with these units and this placement.
    pub(super) fn new(source: &'s StepFile<'a>, space: Space) -> Self {
        Self {
            source,
            space,
            dependence: 0,
        }
    }
}

impl<'a> Reader<'_, 'a> {
    /// Whether the representation is mirrored in its assembly. Then its boundaries run in the opposite direction.
    pub(super) fn is_mirrored(&self) -> bool {
        self.space.motion.is_some_and(|motion| motion.is_mirror())
    }

    /// A length of the file in millimeters.
    pub(super) fn length(&self, param: Param<'a>) -> Result<f64, ParamError> {
        let scale = self.space.motion.map_or(1.0, |motion| motion.scale);
        Ok(param.number()? * self.space.mm_per_unit * scale)
    }

    /// A positive length of the file in millimeters.
    pub(super) fn radius(&self, param: Param<'a>) -> Result<f64, ParamError> {
        let radius = self.length(param)?.abs();
        if radius > 0.0 && radius < REACH_MM {
            Ok(radius)
        } else {
            Err(ParamError::Kind("a radius below 1e15 mm"))
        }
    }

    /// The position of a `CARTESIAN_POINT`.
    pub(super) fn cartesian_point(&self, record: Record) -> Result<Point, EntityError> {
        let [_, coordinates] = self.source.params(record)?;
        self.placed(coordinates)
    }

    /// Coordinates of the file as a point in the assembly.
    pub(super) fn placed(&self, coordinates: Param<'a>) -> Result<Point, EntityError> {
        let point = components(coordinates)?.map(|x| x * self.space.mm_per_unit);
        self.in_reach(
            self.space
                .motion
                .map_or(point, |motion| motion.point(point)),
        )
    }

    /// Returns the same point, or an error if it is farther away than [`REACH_MM`].
    pub(super) fn in_reach(&self, point: Point) -> Result<Point, EntityError> {
        let is_in_reach = point.iter().all(|x| x.abs() <= REACH_MM);
        if is_in_reach {
            Ok(point)
        } else {
            Err(Problem::Geometry("it lies beyond 1e15 mm").into())
        }
    }

    /// The components of a `DIRECTION`, not normalized.
    pub(super) fn direction(&self, id: u64) -> Result<Point, EntityError> {
        self.source.entity(id, |record| {
            if record.keyword != Keyword::Direction {
                return Err(self.source.wrong_class(record, "direction"));
            }
            let [_, ratios] = self.source.params(record)?;
            let direction = components(ratios)?;
            Ok(self
                .space
                .motion
                .map_or(direction, |motion| motion.direction(direction)))
        })
    }

    /// The vector of a `VECTOR`: its direction times its magnitude in millimeters.
    pub(super) fn vector(&self, id: u64) -> Result<Point, EntityError> {
        self.source.entity(id, |record| {
            if record.keyword != Keyword::Vector {
                return Err(self.source.wrong_class(record, "vector"));
            }
            let [_, orientation, magnitude] = self.source.params(record)?;
            let direction = self.direction(orientation.reference()?)?;
            let length = dot(direction, direction).sqrt();
            if length == 0.0 {
                return Err(ParamError::Kind("a vector with a direction").into());
            }
            // Some writers set the magnitude to 0 if only the direction matters.
            let magnitude = match self.length(magnitude)? {
                0.0 => self.space.mm_per_unit,
                magnitude => magnitude,
            };
            Ok(direction.map(|x| x / length * magnitude))
        })
    }

    /// The coordinate system of an `AXIS2_PLACEMENT_3D` or `AXIS1_PLACEMENT`, or of an `AXIS2_PLACEMENT_2D` in a plane.
    pub(super) fn frame(&self, id: u64) -> Result<Frame, EntityError> {
        self.source.entity(id, |record| {
            let mut params = self.source.exchange.params(record);
            let is_flat = record.keyword == Keyword::Axis2Placement2d;
            if !is_flat
                && !matches!(
                    record.keyword,
                    Keyword::Axis2Placement3d | Keyword::Axis1Placement
                )
            {
                return Err(self.source.wrong_class(record, "axis placement"));
            }
            params.next_param()?;
            let location = params.next_param()?.ok_or(ParamError::Missing)?;
            let z = if is_flat {
                None
            } else {
                self.optional_direction(params.next_param()?)
            };
            let x = self.optional_direction(params.next_param()?);
            let origin = self.point(location.reference()?)?;
            // An axis that is left out is an axis of the file and not of the assembly.
            let turn = |axis: Point| {
                self.space
                    .motion
                    .map_or(axis, |motion| motion.direction(axis))
            };
            Ok(Frame::new(
                origin,
                z.or(Some(turn([0.0, 0.0, 1.0]))),
                x.or(Some(turn([1.0, 0.0, 0.0]))),
            ))
        })
    }

    /// The same for a conic. Its parameter runs from x to y even if the representation is mirrored.
    pub(super) fn frame_of_conic(&self, id: u64) -> Result<Frame, EntityError> {
        let frame = self.frame(id)?;
        Ok(if self.is_mirrored() {
            Frame::new(frame.origin, Some(frame.z.map(|x| -x)), Some(frame.x))
        } else {
            frame
        })
    }

    fn optional_direction(&self, param: Option<Param<'a>>) -> Option<Point> {
        self.direction(param?.reference().ok()?)
            .ok()
            .filter(|&direction| dot(direction, direction) > 0.0)
    }
}

/// Up to three numbers. Those that are left out are 0.
fn components(param: Param<'_>) -> Result<Point, ParamError> {
    let mut params = param.list()?;
    let mut components = [0.0; 3];
    for component in &mut components {
        match params.next_param()? {
            Some(param) => *component = param.number()?,
            None => break,
        }
    }
    Ok(components)
}

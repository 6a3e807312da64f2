//! Reads the primitives of constructive solid geometry as bodies of faces: `BLOCK`, `RIGHT_ANGULAR_WEDGE`,
//! `RIGHT_CIRCULAR_CYLINDER`, `RIGHT_CIRCULAR_CONE`, `SPHERE` and `TORUS`. Each is exact. Nothing here combines two of them.

use super::error::{EntityError, Problem};
use super::file::name_of;
use super::space::Reader;
use super::topology::{ShellContext, TopologyBuilder};
use crate::geometry::{Curve, Frame, Surface};
use crate::model::{BrepFace, EdgeUse, Loop, Shell, Solid};
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::{FaceType, Point, cross, subtract};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// The corners of each side of a block, counter-clockwise seen from outside. The four lower corners have the lowest numbers.
const BLOCK: [&[usize]; 6] = [
    &[0, 3, 2, 1],
    &[4, 5, 6, 7],
    &[0, 1, 5, 4],
    &[1, 2, 6, 5],
    &[2, 3, 7, 6],
    &[3, 0, 4, 7],
];
/// The same for a wedge that ends in an edge instead of an upper side.
const WEDGE: [&[usize]; 5] = [
    &[0, 2, 1],
    &[3, 4, 5],
    &[0, 1, 4, 3],
    &[1, 2, 5, 4],
    &[2, 0, 3, 5],
];

/// A primitive in millimeters.
enum Primitive {
    /// Corners and sides of a polyhedron.
    Polyhedron(Vec<Point>, Vec<Vec<usize>>),
    /// A cylinder or a cone along the z axis of its frame: height and radius of each end. The lower end comes first.
    Revolved { frame: Frame, ends: [[f64; 2]; 2] },
    /// A sphere or a torus.
    Closed(Surface, FaceType),
}

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// Adds a primitive as a separate solid. `owner` is the `CSG_SOLID` that consists of it, or the primitive itself.
    ///
    /// # Errors
    /// If an attribute is missing, or if the primitive encloses nothing.
    pub(super) fn add_primitive(
        &mut self,
        reader: Reader<'s, 'a>,
        owner: Record,
        primitive: Record,
    ) -> Result<(), EntityError> {
        let body = reader
            .primitive(primitive)
            .map_err(|error| error.within(primitive.id))?;
        let name = self
            .source
            .params(owner)
            .ok()
            .and_then(|[name]| name_of(name));
        let solid = self.brep.solids.len() as u32;
        self.brep.solids.push(Solid {
            step_id: owner.id,
            name,
        });
        let shell = Shell {
            step_id: owner.id,
            solid: Some(solid),
            component: self.component,
        };
        let context = self.push_shell(reader, shell, owner.id);
        let id = primitive.id;
        match body {
            Primitive::Polyhedron(corners, sides) => {
                self.add_polyhedron(context, id, &corners, &sides)
            }
            Primitive::Revolved { frame, ends } => self.add_revolved(context, id, &frame, ends),
            Primitive::Closed(surface, face_type) => {
                self.push_face(context, id, surface, face_type, true, Vec::new())
            }
        }
        Ok(())
    }

    fn add_polyhedron(
        &mut self,
        context: ShellContext<'s, 'a>,
        id: u64,
        corners: &[Point],
        sides: &[Vec<usize>],
    ) {
        let vertices: Vec<u32> = corners
            .iter()
            .map(|&corner| self.edges.push_vertex(corner))
            .collect();
        let mut edges = BTreeMap::new();
        for side in sides {
            let next = side.iter().cycle().skip(1);
            let mut walk = Vec::with_capacity(side.len());
            for (&from, &to) in side.iter().zip(next) {
                let (low, high) = (from.min(to), from.max(to));
                let edge = *edges.entry((low, high)).or_insert_with(|| {
                    let direction = subtract(corners[high], corners[low]);
                    let line = Curve::Line {
                        origin: corners[low],
                        direction,
                    };
                    self.edges
                        .push_edge(0, [vertices[low], vertices[high]], Arc::new(line), true)
                });
                walk.push(EdgeUse {
                    edge,
                    forward: from == low,
                });
            }
            let [a, b, c] = [corners[side[0]], corners[side[1]], corners[side[2]]];
            let plane = Frame::new(
                a,
                Some(cross(subtract(b, a), subtract(c, b))),
                Some(subtract(b, a)),
            );
            self.push_face(
                context,
                id,
                Surface::Plane(plane),
                FaceType::Plane,
                true,
                vec![Loop::Edges(walk)],
            );
        }
    }

    /// Adds two discs and the wall between them. An end with the radius 0 is an apex.
    fn add_revolved(
        &mut self,
        context: ShellContext<'s, 'a>,
        id: u64,
        frame: &Frame,
        ends: [[f64; 2]; 2],
    ) {
        let mut wall_loops = Vec::new();
        for (end, [height, radius]) in ends.into_iter().enumerate() {
            let is_top = end == 1;
            let vertex = self.edges.push_vertex(frame.point(radius, 0.0, height));
            if radius == 0.0 {
                wall_loops.push(Loop::Vertex(vertex));
                continue;
            }
            let level = Frame {
                origin: frame.point(0.0, 0.0, height),
                ..*frame
            };
            let circle = Arc::new(Curve::Ellipse {
                frame: level,
                rx: radius,
                ry: radius,
            });
            let edge = self.edges.push_edge(0, [vertex, vertex], circle, true);
            let disc = vec![Loop::Edges(vec![EdgeUse {
                edge,
                forward: is_top,
            }])];
            self.push_face(
                context,
                id,
                Surface::Plane(level),
                FaceType::Plane,
                is_top,
                disc,
            );
            wall_loops.push(Loop::Edges(vec![EdgeUse {
                edge,
                forward: !is_top,
            }]));
        }
        let [[low, at_low], [high, at_high]] = ends;
        let slope = (at_high - at_low) / (high - low);
        let level = Frame {
            origin: frame.point(0.0, 0.0, low),
            ..*frame
        };
        let (wall, face_type) = if slope == 0.0 {
            (
                Surface::Cylinder {
                    frame: level,
                    radius: at_low,
                },
                FaceType::Cylinder,
            )
        } else {
            (
                Surface::Cone {
                    frame: level,
                    radius: at_low,
                    slope,
                },
                FaceType::Cone,
            )
        };
        self.push_face(context, id, wall, face_type, true, wall_loops);
    }

    fn push_face(
        &mut self,
        context: ShellContext<'s, 'a>,
        step_id: u64,
        surface: Surface,
        face_type: FaceType,
        same_sense: bool,
        loops: Vec<Loop>,
    ) {
        self.brep.faces.push(BrepFace {
            step_id,
            surface: Arc::new(surface),
            face_type,
            same_sense,
            flipped: false,
            loops,
            shell: context.shell,
            name: None,
            color: context.color,
            layer: context.layer.map(str::to_owned),
        });
    }
}

impl<'a> Reader<'_, 'a> {
    fn primitive(&self, record: Record) -> Result<Primitive, EntityError> {
        match record.keyword {
            Keyword::Block => {
                let [_, position, x, y, z] = self.source.params(record)?;
                self.wedge(position, [x, y, z], x)
            }
            Keyword::RightAngularWedge => {
                let [_, position, x, y, z, upper] = self.source.params(record)?;
                self.wedge(position, [x, y, z], upper)
            }
            Keyword::RightCircularCylinder => {
                let [_, position, height, radius] = self.source.params(record)?;
                let (frame, radius) = (self.frame(position.reference()?)?, self.radius(radius)?);
                Ok(Primitive::Revolved {
                    frame,
                    ends: [[0.0, radius], [self.radius(height)?, radius]],
                })
            }
            Keyword::RightCircularCone => self.cone(record),
            Keyword::Sphere => {
                let [_, radius, center] = self.source.params(record)?;
                let frame = Frame::new(self.point(center.reference()?)?, None, None);
                Ok(Primitive::Closed(
                    Surface::Sphere {
                        frame,
                        radius: self.radius(radius)?,
                    },
                    FaceType::Sphere,
                ))
            }
            Keyword::Torus => {
                let [_, position, major, minor] = self.source.params(record)?;
                let (frame, major) = (self.frame(position.reference()?)?, self.radius(major)?);
                let surface = Surface::Torus {
                    frame,
                    major,
                    minor: self.radius(minor)?,
                };
                Ok(Primitive::Closed(surface, FaceType::Torus))
            }
            _ => Err(self.source.wrong_class(record, "primitive")),
        }
    }

    /// A block whose side at the far end of y has the length `upper` along x. It may be as long as the opposite side, or shorter,
    /// or an edge.
    fn wedge(
        &self,
        position: Param<'a>,
        sides: [Param<'a>; 3],
        upper: Param<'a>,
    ) -> Result<Primitive, EntityError> {
        let frame = self.frame(position.reference()?)?;
        let [x, y, z] = [
            self.radius(sides[0])?,
            self.radius(sides[1])?,
            self.radius(sides[2])?,
        ];
        let upper = self.length(upper)?.abs();
        // If the representation is mirrored, its y axis is opposite to that of the right-handed frame.
        let hand = if self.is_mirrored() { -1.0 } else { 1.0 };
        let mut outline = vec![[0.0, 0.0], [x, 0.0], [upper, y], [0.0, y]];
        if upper == 0.0 {
            outline.truncate(3);
        }
        let level = |z: f64| {
            outline
                .iter()
                .map(move |&[x, y]| frame.point(x, hand * y, z))
        };
        let corners = level(0.0).chain(level(z)).collect();
        let polygons: &[&[usize]] = if upper == 0.0 { &WEDGE } else { &BLOCK };
        let mut polygons: Vec<Vec<usize>> =
            polygons.iter().map(|polygon| polygon.to_vec()).collect();
        if self.is_mirrored() {
            polygons.iter_mut().for_each(|polygon| polygon.reverse());
        }
        Ok(Primitive::Polyhedron(corners, polygons))
    }

    /// A cone whose position is its apex, or the middle of its smaller disc. Its base is further along the axis.
    fn cone(&self, record: Record) -> Result<Primitive, EntityError> {
        let [_, position, height, radius, semi_angle] = self.source.params(record)?;
        let (frame, height) = (self.frame(position.reference()?)?, self.radius(height)?);
        let (radius, semi_angle) = (
            self.length(radius)?.abs(),
            semi_angle.number()? * self.space.rad_per_unit,
        );
        if !(0.0..FRAC_PI_2).contains(&semi_angle) {
            return Err(ParamError::Kind("a half angle below a right angle").into());
        }
        let at_base = radius + height * libm::tan(semi_angle);
        if at_base <= 0.0 {
            return Err(Problem::Geometry("it encloses nothing").into());
        }
        Ok(Primitive::Revolved {
            frame,
            ends: [[-height, at_base], [0.0, radius]],
        })
    }
}

//! Writes vertices, curves, surfaces, edges, loops and faces as entities.

use super::number::real;
use super::{Entities, references};
use crate::frame::{Frame, scaled};
use crate::geometry::{Curve, Surface};
use crate::shell::{Edge, Face, Loop, Shell, Walk};
use crate::spline;
use partprobe_carrier::Point;

/// The lengths and angles of one unit of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) mm_per_unit: f64,
    pub(super) rad_per_unit: f64,
}

/// Writes shells that have the same units.
pub(super) struct ShellWriter<'a> {
    pub(super) entities: &'a mut Entities,
    pub(super) scale: Scale,
    /// Whether every second edge has the opposite direction of its curve, as in many real files.
    pub(super) reverse_curves: bool,
}

/// The entity numbers of a written shell and of its faces.
pub(super) struct ShellNumbers {
    pub(super) shell: u64,
    pub(super) faces: Vec<u64>,
}

impl ShellWriter<'_> {
    /// Writes the faces of a shell and the shell itself, as the entity `kind`.
    pub(super) fn shell(
        &mut self,
        shell: &Shell,
        kind: &str,
        face_name: impl Fn(usize) -> String,
    ) -> ShellNumbers {
        let vertices: Vec<u64> = shell
            .vertices
            .iter()
            .map(|&point| self.vertex(point))
            .collect();
        let edges: Vec<u64> = (0..shell.edges.len())
            .map(|i| self.edge(shell, i, &vertices))
            .collect();
        let faces: Vec<u64> = shell
            .faces
            .iter()
            .enumerate()
            .map(|(i, face)| self.face(face, &face_name(i), &vertices, &edges))
            .collect();
        let id = self
            .entities
            .add(&format!("{kind}('',{})", references(&faces)));
        ShellNumbers { shell: id, faces }
    }

    fn length(&self, mm: f64) -> f64 {
        mm / self.scale.mm_per_unit
    }

    fn point(&mut self, point: Point) -> u64 {
        let scale = self.scale.mm_per_unit;
        self.entities.point(point.map(|x| x / scale))
    }

    fn vertex(&mut self, point: Point) -> u64 {
        let point = self.point(point);
        self.entities.add(&format!("VERTEX_POINT('',#{point})"))
    }

    fn placement(&mut self, frame: &Frame) -> u64 {
        let scale = self.scale.mm_per_unit;
        self.entities
            .placement(frame.origin.map(|x| x / scale), frame.z, frame.x)
    }

    fn edge(&mut self, shell: &Shell, idx: usize, vertices: &[u64]) -> u64 {
        let edge = &shell.edges[idx];
        let ends = [shell.vertices[edge.start], shell.vertices[edge.end]];
        let reversed = self.reverse_curves && idx % 2 == 1;
        let curve = match reversed {
            false => self.curve(&edge.curve, ends),
            true => self.curve(&against(edge), [ends[1], ends[0]]),
        };
        let (start, end) = (vertices[edge.start], vertices[edge.end]);
        let sense = if reversed { ".F." } else { ".T." };
        self.entities
            .add(&format!("EDGE_CURVE('',#{start},#{end},#{curve},{sense})"))
    }

    fn curve(&mut self, curve: &Curve, [start, end]: [Point; 2]) -> u64 {
        match curve {
            Curve::Line => {
                let along = crate::frame::unit(partprobe_carrier::subtract(end, start));
                let (point, vector) = (self.point(start), self.entities.vector(along, 1.0));
                self.entities.add(&format!("LINE('',#{point},#{vector})"))
            }
            Curve::Circle { frame, radius } => {
                let placement = self.placement(frame);
                self.entities.add(&format!(
                    "CIRCLE('',#{placement},{})",
                    real(self.length(*radius))
                ))
            }
            Curve::Ellipse {
                frame,
                along_x,
                along_y,
            } => {
                let placement = self.placement(frame);
                let axes = [along_x, along_y]
                    .map(|axis| real(self.length(*axis)))
                    .join(",");
                self.entities
                    .add(&format!("ELLIPSE('',#{placement},{axes})"))
            }
            Curve::Spline(controls) => self.spline(controls),
        }
    }

    fn spline(&mut self, controls: &[Point]) -> u64 {
        let points: Vec<u64> = controls.iter().map(|&point| self.point(point)).collect();
        let (counts, knots) = knot_lists(controls.len());
        let points = references(&points);
        self.entities.add(&format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',{},{points},.UNSPECIFIED.,.F.,.F.,{counts},{knots},.UNSPECIFIED.)",
            spline::DEGREE
        ))
    }

    fn surface(&mut self, surface: &Surface) -> u64 {
        match surface {
            Surface::Plane(frame) => self.elementary("PLANE", frame, &[]),
            Surface::Cylinder { frame, radius } => {
                self.elementary("CYLINDRICAL_SURFACE", frame, &[self.length(*radius)])
            }
            Surface::Cone {
                frame,
                radius,
                half_angle,
            } => {
                let angle = half_angle / self.scale.rad_per_unit;
                self.elementary("CONICAL_SURFACE", frame, &[self.length(*radius), angle])
            }
            Surface::Sphere { frame, radius } => {
                self.elementary("SPHERICAL_SURFACE", frame, &[self.length(*radius)])
            }
            Surface::Torus {
                frame,
                major,
                minor,
            } => self.elementary(
                "TOROIDAL_SURFACE",
                frame,
                &[self.length(*major), self.length(*minor)],
            ),
            Surface::Patch(patch) => self.patch(&patch.controls()),
            Surface::Extrusion { controls, along } => {
                let (curve, vector) = (self.spline(controls), self.entities.vector(*along, 1.0));
                self.entities.add(&format!(
                    "SURFACE_OF_LINEAR_EXTRUSION('',#{curve},#{vector})"
                ))
            }
            Surface::Revolution { controls, axis } => {
                let (curve, origin) = (self.spline(controls), self.point(axis.origin));
                let direction = self.entities.direction(axis.z);
                let axis = self
                    .entities
                    .add(&format!("AXIS1_PLACEMENT('',#{origin},#{direction})"));
                self.entities
                    .add(&format!("SURFACE_OF_REVOLUTION('',#{curve},#{axis})"))
            }
        }
    }

    fn elementary(&mut self, kind: &str, frame: &Frame, sizes: &[f64]) -> u64 {
        let placement = self.placement(frame);
        let sizes: String = sizes
            .iter()
            .map(|&size| format!(",{}", real(size)))
            .collect();
        self.entities
            .add(&format!("{kind}('',#{placement}{sizes})"))
    }

    fn patch(&mut self, controls: &[Vec<Point>]) -> u64 {
        let rows: Vec<String> = controls
            .iter()
            .map(|row| {
                let ids: Vec<u64> = row.iter().map(|&point| self.point(point)).collect();
                references(&ids)
            })
            .collect();
        let (u_counts, u_knots) = knot_lists(controls.len());
        let (v_counts, v_knots) = knot_lists(controls[0].len());
        self.entities.add(&format!(
            "B_SPLINE_SURFACE_WITH_KNOTS('',{degree},{degree},({}),.UNSPECIFIED.,.F.,.F.,.F.,\
             {u_counts},{v_counts},{u_knots},{v_knots},.UNSPECIFIED.)",
            rows.join(","),
            degree = spline::DEGREE
        ))
    }

    fn face(&mut self, face: &Face, name: &str, vertices: &[u64], edges: &[u64]) -> u64 {
        let surface = self.surface(&face.surface);
        let one_outer = face.loops.len() == 1 || matches!(face.surface, Surface::Plane(_));
        let bounds: Vec<u64> = (face.loops.iter().enumerate())
            .map(|(i, walked)| {
                let (id, is_edges) = match walked {
                    Loop::Edges(walks) => (self.edge_loop(walks, edges), true),
                    Loop::Vertex(vertex) => (
                        self.entities
                            .add(&format!("VERTEX_LOOP('',#{})", vertices[*vertex])),
                        false,
                    ),
                };
                let kind = if i == 0 && one_outer && is_edges {
                    "FACE_OUTER_BOUND"
                } else {
                    "FACE_BOUND"
                };
                self.entities.add(&format!("{kind}('',#{id},.T.)"))
            })
            .collect();
        let sense = if face.same_sense { ".T." } else { ".F." };
        self.entities.add(&format!(
            "ADVANCED_FACE('{name}',{},#{surface},{sense})",
            references(&bounds)
        ))
    }

    fn edge_loop(&mut self, walks: &[Walk], edges: &[u64]) -> u64 {
        let oriented: Vec<u64> = walks
            .iter()
            .map(|walk| {
                let sense = if walk.forward { ".T." } else { ".F." };
                self.entities.add(&format!(
                    "ORIENTED_EDGE('',*,*,#{},{sense})",
                    edges[walk.edge]
                ))
            })
            .collect();
        self.entities
            .add(&format!("EDGE_LOOP('',{})", references(&oriented)))
    }
}

/// The edge's curve in the opposite direction, from the edge's end to its start.
fn against(edge: &Edge) -> Curve {
    let reversed = |frame: &Frame| Frame {
        y: scaled(frame.y, -1.0),
        z: scaled(frame.z, -1.0),
        ..*frame
    };
    match &edge.curve {
        Curve::Line => Curve::Line,
        Curve::Circle { frame, radius } => Curve::Circle {
            frame: reversed(frame),
            radius: *radius,
        },
        Curve::Ellipse {
            frame,
            along_x,
            along_y,
        } => Curve::Ellipse {
            frame: reversed(frame),
            along_x: *along_x,
            along_y: *along_y,
        },
        Curve::Spline(controls) => Curve::Spline(controls.iter().rev().copied().collect()),
    }
}

/// The multiplicities and the knots of a spline, as lists.
fn knot_lists(n_points: usize) -> (String, String) {
    let knots = spline::multiplicities(n_points);
    let counts: Vec<String> = knots.iter().map(|(_, count)| count.to_string()).collect();
    let values: Vec<String> = knots.iter().map(|&(knot, _)| real(knot)).collect();
    (
        format!("({})", counts.join(",")),
        format!("({})", values.join(",")),
    )
}

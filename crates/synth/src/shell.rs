//! Builds a shell: vertices, edges and faces that share them, with the areas that are known in closed form.
//!
//! Every edge of a closed shell is walked once in each direction; the tests ask each family for that.

use crate::frame::Frame;
use crate::geometry::{Curve, Surface};
use partprobe_carrier::Point;

/// An edge from one vertex to another, along its curve.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Edge {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) curve: Curve,
}

/// One edge of a loop, walked in its own direction or against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Walk {
    pub(crate) edge: usize,
    pub(crate) forward: bool,
}

/// A boundary of a face; the face is on the left of the walk, seen from outside the solid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Loop {
    /// Edges end to end.
    Edges(Vec<Walk>),
    /// A single vertex, such as the apex of a cone.
    Vertex(usize),
}

/// A bounded surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Face {
    pub(crate) surface: Surface,
    /// The surface's normal points out of the solid.
    pub(crate) same_sense: bool,
    /// The outer boundary first.
    pub(crate) loops: Vec<Loop>,
    /// Area in square millimeters, where a closed form is known.
    pub(crate) area: Option<f64>,
}

/// Edges end to end around a profile, at one height.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ring {
    /// The vertices, one for each side of the profile; all the same where the profile has shrunk to a point.
    pub(crate) corners: Vec<usize>,
    /// The edges, one for each side. There are none if the profile has shrunk to a point.
    pub(crate) edges: Vec<usize>,
    /// The area inside, negative for a hole's profile.
    pub(crate) area: f64,
}

impl Ring {
    /// The ring as the boundary of a face that walks it forward or backward.
    pub(crate) fn walked(&self, forward: Direction) -> Loop {
        match forward {
            Direction::Forward => Loop::Edges(
                self.edges
                    .iter()
                    .map(|&edge| Walk {
                        edge,
                        forward: true,
                    })
                    .collect(),
            ),
            Direction::Backward => Loop::Edges(
                self.edges
                    .iter()
                    .rev()
                    .map(|&edge| Walk {
                        edge,
                        forward: false,
                    })
                    .collect(),
            ),
        }
    }
}

/// Which way a ring is walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Forward,
    Backward,
}

/// Faces and what they share.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shell {
    pub(crate) vertices: Vec<Point>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) faces: Vec<Face>,
    /// Volume inside, in cubic millimeters.
    pub(crate) volume: f64,
}

impl Shell {
    /// Adds a vertex.
    pub(crate) fn vertex(&mut self, point: Point) -> usize {
        self.vertices.push(point);
        self.vertices.len() - 1
    }

    /// Adds an edge.
    pub(crate) fn edge(&mut self, start: usize, end: usize, curve: Curve) -> usize {
        self.edges.push(Edge { start, end, curve });
        self.edges.len() - 1
    }

    /// Adds a face.
    pub(crate) fn face(&mut self, face: Face) -> usize {
        self.faces.push(face);
        self.faces.len() - 1
    }

    /// Closes a ring with a plane whose normal, the frame's z, points out of the solid.
    pub(crate) fn cap(&mut self, plane: &Frame, ring: &Ring, direction: Direction) -> usize {
        self.face(Face {
            surface: Surface::Plane(*plane),
            same_sense: true,
            loops: vec![ring.walked(direction)],
            area: Some(ring.area.abs()),
        })
    }

    /// Cuts a ring out of a planar face: a hole or the foot of a boss begins there.
    pub(crate) fn open(&mut self, face: usize, ring: &Ring, direction: Direction) {
        let face = &mut self.faces[face];
        face.loops.push(ring.walked(direction));
        face.area = face.area.map(|area| area - ring.area.abs());
    }

    /// The faces on each edge with the direction of their walk, in face order.
    pub(crate) fn uses(&self) -> Vec<Vec<(usize, bool)>> {
        let mut uses = vec![Vec::new(); self.edges.len()];
        for (face_idx, face) in self.faces.iter().enumerate() {
            for walk in face.loops.iter().flat_map(walks) {
                uses[walk.edge].push((face_idx, walk.forward));
            }
        }
        uses
    }
}

/// The edges of a loop; none for a single vertex.
pub(crate) fn walks(walked: &Loop) -> &[Walk] {
    match walked {
        Loop::Edges(walks) => walks,
        Loop::Vertex(_) => &[],
    }
}

#[cfg(test)]
impl Shell {
    /// The vertices where a walk starts and ends.
    pub(crate) fn ends(&self, walk: Walk) -> (usize, usize) {
        let edge = &self.edges[walk.edge];
        if walk.forward {
            (edge.start, edge.end)
        } else {
            (edge.end, edge.start)
        }
    }

    /// What keeps the shell from being closed and consistent: open loops, edges not walked once in each direction.
    pub(crate) fn defects(&self) -> Vec<String> {
        let open_loops = self.faces.iter().enumerate().flat_map(|(idx, face)| {
            let open = |walked: &&Loop| !self.is_closed(walked);
            face.loops
                .iter()
                .filter(open)
                .map(move |_| format!("face {idx} has an open loop"))
        });
        let uses = self.uses();
        let bad_uses = uses.iter().enumerate().filter(|(_, uses)| {
            let forward = uses.iter().filter(|(_, forward)| *forward).count();
            uses.len() != 2 || forward != 1
        });
        open_loops
            .chain(bad_uses.map(|(idx, uses)| format!("edge {idx} is used as {uses:?}")))
            .collect()
    }

    fn is_closed(&self, walked: &Loop) -> bool {
        let walks = walks(walked);
        (0..walks.len()).all(|i| self.ends(walks[i]).1 == self.ends(walks[(i + 1) % walks.len()]).0)
    }
}

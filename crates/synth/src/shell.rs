//! Builds a shell: vertices, edges, and faces that share them, with the areas that are known in closed form.
//!
//! The loops of a closed shell walk every edge once in each direction. Tests check this for each family.

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

/// A boundary of a face. Seen from outside the solid, the face is on the left of the walk.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Loop {
    /// Connected edges.
    Edges(Vec<Walk>),
    /// A single vertex, such as the apex of a cone.
    Vertex(usize),
}

/// A bounded surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Face {
    pub(crate) surface: Surface,
    /// Whether the surface's normal points out of the solid.
    pub(crate) same_sense: bool,
    /// The boundaries, the outer one first.
    pub(crate) loops: Vec<Loop>,
    /// Area in square millimeters. `None` if no closed form is known.
    pub(crate) area: Option<f64>,
}

/// The connected edges around a profile, at one height.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ring {
    /// The vertices, one per side of the profile. They are all the same if the profile has shrunk to a point.
    pub(crate) corners: Vec<usize>,
    /// The edges, one per side. Empty if the profile has shrunk to a point.
    pub(crate) edges: Vec<usize>,
    /// The area inside. It is negative for a hole's profile.
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

/// The direction in which a ring is walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Forward,
    Backward,
}

/// Faces, and the vertices and edges that they share.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shell {
    pub(crate) vertices: Vec<Point>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) faces: Vec<Face>,
    /// The enclosed volume, in cubic millimeters.
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

    /// Closes a ring with a plane. Its normal, the frame's z axis, points out of the solid.
    pub(crate) fn cap(&mut self, plane: &Frame, ring: &Ring, direction: Direction) -> usize {
        self.face(Face {
            surface: Surface::Plane(*plane),
            same_sense: true,
            loops: vec![ring.walked(direction)],
            area: Some(ring.area.abs()),
        })
    }

    /// Cuts a ring out of a planar face, where a hole or a boss starts.
    pub(crate) fn open(&mut self, face: usize, ring: &Ring, direction: Direction) {
        let face = &mut self.faces[face];
        face.loops.push(ring.walked(direction));
        face.area = face.area.map(|area| area - ring.area.abs());
    }

    /// The faces at each edge, in face order, and whether they walk the edge forward.
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

/// The edges of a loop. Empty for a single vertex.
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

    /// The defects of a shell that is not closed: open loops, and edges that are not walked once in each direction.
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

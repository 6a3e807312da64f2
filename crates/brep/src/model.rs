//! Defines the B-Rep of a file or of one solid.

use crate::geometry::{Curve, Surface};
use partprobe_shape::{Color, FaceType, Instance, Point, Units};
use std::fmt;
use std::sync::Arc;

/// A vertex of the topology.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// `#` number of the `VERTEX_POINT` (or of the `CARTESIAN_POINT` of a poly loop).
    pub step_id: u64,
    /// Position in millimeters.
    pub point: Point,
}

/// An edge of the topology: a piece of a curve between two vertices.
#[derive(Clone, Debug)]
pub struct BrepEdge {
    /// `#` number of the `EDGE_CURVE`, or 0 for a side of a poly loop.
    pub step_id: u64,
    /// Index of the vertex where the edge starts.
    pub start: u32,
    /// Index of the vertex where the edge ends. It is equal to `start` if the edge is closed.
    pub end: u32,
    /// The curve that the edge lies on.
    pub curve: Arc<Curve>,
    /// Whether the edge runs in the direction of its curve.
    pub same_sense: bool,
}

/// One use of an edge by a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeUse {
    /// Index of the edge.
    pub edge: u32,
    /// Whether the loop walks from the edge's start to its end.
    pub forward: bool,
}

/// A boundary of a face. The walk keeps the face on its left, seen against the *face* normal (the surface normal, reversed if
/// `same_sense` is false). The bound's own orientation flag is already applied.
#[derive(Clone, Debug, PartialEq)]
pub enum Loop {
    /// Edges end to end.
    Edges(Vec<EdgeUse>),
    /// A single vertex, for example a cone's apex or a sphere's pole.
    Vertex(u32),
}

/// A face: a surface and the loops that bound it.
#[derive(Clone, Debug)]
pub struct BrepFace {
    /// `#` number of the face's entity.
    pub step_id: u64,
    /// The surface itself, without the trimming that the file may add to it.
    pub surface: Arc<Surface>,
    /// The class that the file gives the surface.
    pub face_type: FaceType,
    /// Whether the face's normal is the surface's normal.
    pub same_sense: bool,
    /// Whether the shell uses the face against its own orientation (`ORIENTED_CLOSED_SHELL … .F.`, `ORIENTED_FACE … .F.`).
    pub flipped: bool,
    /// The boundaries. A whole sphere or torus has none.
    pub loops: Vec<Loop>,
    /// Index of the shell in [`Brep::shells`].
    pub shell: u32,
    /// Name of the `ADVANCED_FACE`, if it has one.
    pub name: Option<String>,
    /// Color by `STYLED_ITEM`.
    pub color: Option<Color>,
    /// Layer by `PRESENTATION_LAYER_ASSIGNMENT`.
    pub layer: Option<String>,
}

impl BrepFace {
    /// Whether the surface's own normal points into the shape.
    pub(crate) fn is_inward(&self) -> bool {
        self.same_sense == self.flipped
    }
}

/// A shell and the solid that it bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Shell {
    /// `#` number of the shell's entity.
    pub step_id: u64,
    /// Index of the solid in [`Brep::solids`], or `None` in a surface model.
    pub solid: Option<u32>,
    /// Index of the component in [`Brep::components`].
    pub component: u32,
}

/// A unit that an assembly moves as a whole: the shells of one product.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Every occurrence in the assembly, in file order. The faces are at the first occurrence.
    pub occurrences: Vec<Instance>,
    /// The style of each occurrence. It applies to faces that have no style of their own.
    pub styles: Vec<InstanceStyle>,
}

/// The style of an occurrence. It is the style of the `MAPPED_ITEM` that puts a shape into its assembly.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InstanceStyle {
    /// Color by `STYLED_ITEM`.
    pub color: Option<Color>,
    /// Layer by `PRESENTATION_LAYER_ASSIGNMENT`.
    pub layer: Option<String>,
}

/// A solid of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// `#` number of the solid's entity.
    pub step_id: u64,
    /// Its name, if it has one.
    pub name: Option<String>,
}

/// The kind of a lost entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum LostKind {
    /// A face that could not be read, or has no triangles.
    Face,
    /// A loop of a face that was read without it.
    Loop,
    /// Any other entity: an instance that does not parse, a shell, an edge.
    Entity,
}

impl fmt::Display for LostKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Face => "face",
            Self::Loop => "loop",
            Self::Entity => "entity",
        })
    }
}

/// An entity that is in the file but not in the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LostEntity {
    /// The kind of the entity.
    pub kind: LostKind,
    /// Its `#` number, or 0 if the message is not about a single entity.
    pub step_id: u64,
    /// Why it was lost.
    pub reason: String,
}

impl fmt::Display for LostEntity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.step_id {
            0 => f.write_str(&self.reason),
            id => write!(f, "{} #{id}: {}", self.kind, self.reason),
        }
    }
}

/// A remark about a file that its user should know and that is not about a lost entity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The `#` number of the entity that the note is about, or 0 if it is not about a single entity.
    pub step_id: u64,
    /// The text of the note.
    pub text: String,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.step_id {
            0 => f.write_str(&self.text),
            id => write!(f, "#{id}: {}", self.text),
        }
    }
}

/// Faces, edges and their nesting, in millimeters, with everything that was lost on the way.
///
/// Faces are in the order of the file's shells. Each product is included once, at the position of its first occurrence.
#[derive(Clone, Debug)]
pub struct Brep {
    /// Vertices that edges refer to.
    pub vertices: Vec<Vertex>,
    /// Edges that loops refer to.
    pub edges: Vec<BrepEdge>,
    /// Faces, in shell order.
    pub faces: Vec<BrepFace>,
    /// Shells, in file order.
    pub shells: Vec<Shell>,
    /// Solids, in file order.
    pub solids: Vec<Solid>,
    /// Components, in the order of their shells.
    pub components: Vec<Component>,
    /// The entities that could not be read.
    pub lost: Vec<LostEntity>,
    /// Notes about what was left out on purpose, and about faces that the file gives as triangles.
    pub notes: Vec<Note>,
    /// The units of the first context in the file that has faces.
    pub units: Units,
}

impl Brep {
    /// The faces of one solid as a separate B-Rep, with the lost entities and the units of the whole.
    ///
    /// An index beyond [`Brep::solids`] gives a B-Rep without faces.
    #[must_use]
    pub fn for_solid(&self, solid: u32) -> Self {
        let belongs = |face: &&BrepFace| self.shells[face.shell as usize].solid == Some(solid);
        let mut faces: Vec<BrepFace> = self.faces.iter().filter(belongs).cloned().collect();
        let mut kept = Kept::none_of(self);
        for face in &mut faces {
            kept.renumber_face(face);
        }
        // Edges come first, because their ends are also vertices that are kept.
        let edges = kept.edges_of(self);
        let vertices = kept.vertices.kept.iter();
        let shells: Vec<&Shell> = kept
            .shells
            .kept
            .iter()
            .map(|&shell| &self.shells[shell as usize])
            .collect();
        // The shells of a solid are of one product.
        let component = shells
            .first()
            .and_then(|shell| self.components.get(shell.component as usize));
        let own_shell = |shell: &&Shell| Shell {
            step_id: shell.step_id,
            solid: Some(0),
            component: 0,
        };
        Self {
            faces,
            edges,
            vertices: vertices
                .map(|&vertex| self.vertices[vertex as usize])
                .collect(),
            components: component.cloned().into_iter().collect(),
            shells: shells.iter().map(own_shell).collect(),
            solids: self
                .solids
                .get(solid as usize)
                .cloned()
                .into_iter()
                .collect(),
            ..self.without_faces()
        }
    }

    /// A B-Rep with the lost entities and the units only.
    fn without_faces(&self) -> Self {
        Self {
            vertices: Vec::new(),
            edges: Vec::new(),
            faces: Vec::new(),
            shells: Vec::new(),
            solids: Vec::new(),
            components: Vec::new(),
            lost: self.lost.clone(),
            notes: self.notes.clone(),
            units: self.units.clone(),
        }
    }
}

/// The items of a B-Rep that are kept, with their new indices.
struct Kept {
    shells: Renumbering,
    edges: Renumbering,
    vertices: Renumbering,
}

impl Kept {
    fn none_of(brep: &Brep) -> Self {
        Self {
            shells: Renumbering::new(brep.shells.len()),
            edges: Renumbering::new(brep.edges.len()),
            vertices: Renumbering::new(brep.vertices.len()),
        }
    }

    /// Keeps the items to which a face refers, and renumbers them in the face.
    fn renumber_face(&mut self, face: &mut BrepFace) {
        face.shell = self.shells.index(face.shell);
        for boundary in &mut face.loops {
            match boundary {
                Loop::Edges(uses) => {
                    for edge_use in uses {
                        edge_use.edge = self.edges.index(edge_use.edge);
                    }
                }
                Loop::Vertex(vertex) => *vertex = self.vertices.index(*vertex),
            }
        }
    }

    /// Returns the edges that are kept, and keeps their ends.
    fn edges_of(&mut self, brep: &Brep) -> Vec<BrepEdge> {
        let edges = self.edges.kept.iter().map(|&edge| {
            let edge = brep.edges[edge as usize].clone();
            BrepEdge {
                start: self.vertices.index(edge.start),
                end: self.vertices.index(edge.end),
                ..edge
            }
        });
        edges.collect()
    }
}

/// New indices for the kept members of a list, in the order in which they are first requested.
struct Renumbering {
    new_index: Vec<Option<u32>>,
    kept: Vec<u32>,
}

impl Renumbering {
    fn new(len: usize) -> Self {
        Self {
            new_index: vec![None; len],
            kept: Vec::new(),
        }
    }

    fn index(&mut self, old: u32) -> u32 {
        *self.new_index[old as usize].get_or_insert_with(|| {
            self.kept.push(old);
            self.kept.len() as u32 - 1
        })
    }
}

//! Reads bodies that a file gives as triangles: tessellated solids, shells, faces and sets.
//!
//! If the exact geometry of the same product was read, its tessellation is the same shape again and is left out.

use super::error::{EntityError, Problem};
use super::facet_edges::{FaceUse, FacetEdge, NumberedFace, curve_of, facet_edges};
use super::file::StepFile;
use super::roots::Root;
use super::space::Reader;
use super::tessellation::{Corners, TessellatedFace, geometric_link, is_triangulated};
use super::topology::{ShellContext, TopologyBuilder};
use crate::geometry::{Facets, Surface};
use crate::model::{BrepFace, EdgeUse, Loop, LostKind, Note, Shell};
use crate::part21::{Keyword, Record};
use partprobe_shape::FaceType;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Sets of triangles may contain sets. No more entities than this are read.
const MAX_ELEMENTS: usize = 10_000_000;

/// A face whose corners are numbered within its body.
struct Tessellated {
    record: Record,
    face: TessellatedFace,
}

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// Whether a tessellated body is left out because its exact shape was read. `has_exact_product` says whether its product has
    /// exact faces.
    pub(super) fn is_replaced_by_exact(&mut self, root: &Root, has_exact_product: bool) -> bool {
        let elements = root.shells(self.source).unwrap_or_default();
        let mut links = elements.iter().filter_map(|&element| {
            let record = self.source.exchange.record(element)?;
            geometric_link(self.source, record)
        });
        let has_body = root
            .link(self.source)
            .is_some_and(|link| self.has_faces_of(link));
        let is_linked = has_body || links.any(|link| self.has_face(link));
        if has_exact_product && !is_linked {
            let text =
                "it is a tessellation of a product that also has exact faces, and is left out"
                    .to_owned();
            self.brep.notes.push(Note {
                step_id: root.record.id,
                text,
            });
        }
        is_linked || has_exact_product
    }

    /// Whether a representation lists a face or shell that has not yet been read as part of a body.
    pub(super) fn lists_unread_items(&self, root: &Root) -> bool {
        let is_tried = |&item: &u64| {
            self.source
                .exchange
                .slot(item)
                .is_some_and(|slot| self.is_read[slot])
        };
        let is_shell = |&item: &u64| self.brep.shells.iter().any(|shell| shell.step_id == item);
        root.shells(self.source).map_or(true, |items| {
            !items.iter().all(|item| is_tried(item) || is_shell(item))
        })
    }

    /// Whether a face of the file is among those that were read.
    fn has_face(&self, id: u64) -> bool {
        self.source
            .exchange
            .slot(id)
            .is_some_and(|slot| self.has_face[slot])
    }

    /// Whether a face of this solid or shell is among those that were read.
    fn has_faces_of(&self, id: u64) -> bool {
        self.brep.faces.iter().any(|face| {
            let Shell { step_id, solid, .. } = self.brep.shells[face.shell as usize];
            step_id == id
                || solid.is_some_and(|solid| self.brep.solids[solid as usize].step_id == id)
        })
    }

    /// Adds the faces of triangles among the elements of a body, and the edges between them.
    pub(super) fn add_facets(
        &mut self,
        reader: Reader<'s, 'a>,
        body: Record,
        elements: &[u64],
        solid: Option<u32>,
    ) {
        let reader = match reader.repositioned(body) {
            Ok(reader) => reader,
            Err(error) => return self.lose(LostKind::Entity, body.id, &error),
        };
        let shell = Shell {
            step_id: body.id,
            solid,
            component: self.component,
        };
        let context = self.push_shell(reader, shell, body.id);
        let mut corners = Corners::default();
        let n_losses = self.brep.lost.len();
        let faces = self.tessellated_faces(reader, elements, &mut corners);
        if faces.is_empty() {
            if self.brep.lost.len() == n_losses {
                self.lose(
                    LostKind::Entity,
                    body.id,
                    &Problem::Geometry("it has no triangle").into(),
                );
            }
            return;
        }
        let text = format!(
            "{} faces are triangles of the file, not of a surface; their type is other",
            faces.len()
        );
        self.brep.notes.push(Note {
            step_id: body.id,
            text,
        });
        let loops = self.facet_loops(&faces, &corners);
        for (face, loops) in faces.into_iter().zip(loops) {
            let face = self.facet_face(context, face, loops, &corners);
            self.brep.faces.push(face);
        }
    }

    /// Reads the elements in file order. The elements of a set are read in place of the set.
    fn tessellated_faces(
        &mut self,
        reader: Reader<'s, 'a>,
        elements: &[u64],
        corners: &mut Corners,
    ) -> Vec<Tessellated> {
        let mut faces = Vec::new();
        let mut open: Vec<(u64, Reader<'s, 'a>)> = elements
            .iter()
            .rev()
            .map(|&element| (element, reader))
            .collect();
        let mut n_seen = 0;
        while let Some((id, reader)) = open.pop() {
            n_seen += 1;
            if n_seen > MAX_ELEMENTS {
                let error = EntityError::from(Problem::OverBudget);
                self.lose(LostKind::Entity, id, &error);
                break;
            }
            match self.element(reader, id, corners) {
                Ok(Element::Face(face)) => {
                    if face.face.numbers_coordinates {
                        let text = "its triangles name members that its own list of points lacks; they are taken to number \
                            the list of coordinates";
                        self.brep.notes.push(Note {
                            step_id: id,
                            text: text.to_owned(),
                        });
                    }
                    faces.push(face);
                }
                Ok(Element::Set(reader, children)) => {
                    open.extend(children.into_iter().rev().map(|child| (child, reader)));
                }
                Ok(Element::Nothing) => {}
                Err(error) => self.lose(LostKind::Face, id, &error.within(id)),
            }
        }
        faces
    }

    fn element(
        &mut self,
        reader: Reader<'s, 'a>,
        id: u64,
        corners: &mut Corners,
    ) -> Result<Element<'s, 'a>, EntityError> {
        let record = self.source.record(id)?;
        let slot = self.source.exchange.slot(id).ok_or(Problem::Missing)?;
        if std::mem::replace(&mut self.is_read[slot], true) {
            return Ok(Element::Nothing);
        }
        let here = reader.repositioned(record)?;
        if here.space != reader.space {
            corners.forget_lists();
        }
        if is_triangulated(self.source, record) {
            let face = here.tessellated_face(record, corners);
            if here.space != reader.space {
                corners.forget_lists();
            }
            return Ok(Element::Face(Tessellated {
                record,
                face: face?,
            }));
        }
        match children(self.source, record)? {
            Some(children) => Ok(Element::Set(here, children)),
            None if record.keyword == Keyword::CubicBezierTriangulatedFace => {
                Err(self.source.wrong_class(record, "face of plane triangles"))
            }
            // Edges, vertices and curves of a tessellation do not bound anything.
            None => Ok(Element::Nothing),
        }
    }

    /// Adds the edges between the faces, and gives each face its walks along them.
    fn facet_loops(&mut self, faces: &[Tessellated], corners: &Corners) -> Vec<Vec<Loop>> {
        let numbered: Vec<NumberedFace> = faces
            .iter()
            .map(|face| NumberedFace {
                triangles: face.face.triangles.clone(),
            })
            .collect();
        let mut vertex_of: BTreeMap<u32, u32> = BTreeMap::new();
        let mut uses: Vec<Vec<(EdgeUse, [u32; 2])>> = vec![Vec::new(); faces.len()];
        for FacetEdge {
            corners: along,
            walks,
        } in facet_edges(&numbered, corners.points.len())
        {
            let (Some(&start), Some(&end)) = (along.first(), along.last()) else {
                continue;
            };
            let ends = [start, end].map(|corner| {
                let point = corners.points[corner as usize];
                *vertex_of
                    .entry(corner)
                    .or_insert_with(|| self.edges.push_vertex(point))
            });
            let edge = self
                .edges
                .push_edge(0, ends, curve_of(&along, &corners.points), true);
            for FaceUse { face, forward } in walks {
                let ends = if forward { ends } else { [ends[1], ends[0]] };
                uses[face as usize].push((EdgeUse { edge, forward }, ends));
            }
        }
        uses.into_iter().map(end_to_end).collect()
    }

    fn facet_face(
        &self,
        context: ShellContext<'s, 'a>,
        Tessellated { record, face }: Tessellated,
        loops: Vec<Loop>,
        corners: &Corners,
    ) -> BrepFace {
        let surface = Arc::new(Surface::Facets(Box::new(facets_of(&face, corners))));
        BrepFace {
            step_id: record.id,
            surface,
            face_type: FaceType::Other,
            same_sense: true,
            flipped: false,
            loops,
            shell: context.shell,
            name: face.name,
            color: self.colors.of(record.id).or(context.color),
            layer: self
                .layers
                .of(record.id)
                .or(context.layer)
                .map(str::to_owned),
        }
    }
}

/// An element of a tessellated body.
enum Element<'s, 'a> {
    Face(Tessellated),
    /// Further elements, and a reader in their coordinate system.
    Set(Reader<'s, 'a>, Vec<u64>),
    Nothing,
}

/// The elements of a set, or of a body inside a set.
fn children(source: &StepFile<'_>, record: Record) -> Result<Option<Vec<u64>>, EntityError> {
    let class = match record.keyword {
        Keyword::TessellatedGeometricSet => "TESSELLATED_GEOMETRIC_SET",
        Keyword::TessellatedSolid => "TESSELLATED_SOLID",
        Keyword::TessellatedShell => "TESSELLATED_SHELL",
        Keyword::Complex => {
            let classes = [
                "TESSELLATED_GEOMETRIC_SET",
                "TESSELLATED_SOLID",
                "TESSELLATED_SHELL",
            ];
            match classes
                .into_iter()
                .find(|class| source.exchange.partial(record, class).is_some())
            {
                Some(class) => class,
                None => return Ok(None),
            }
        }
        _ => return Ok(None),
    };
    let [children] = source.class_params(record, class, 1)?.first()?;
    Ok(Some(children.list()?.references()?))
}

/// The triangles of a face. Its corners are renumbered in the order of their first use.
fn facets_of(face: &TessellatedFace, corners: &Corners) -> Facets {
    let mut own: BTreeMap<u32, u32> = BTreeMap::new();
    let mut facets = Facets {
        points: Vec::new(),
        triangles: Vec::new(),
        normals: Vec::new(),
    };
    let has_normals = !face.normals.is_empty();
    for triangle in &face.triangles {
        let triangle = triangle.map(|corner| {
            *own.entry(corner).or_insert_with(|| {
                facets.points.push(corners.points[corner as usize]);
                if has_normals {
                    facets
                        .normals
                        .push(face.normals.get(&corner).copied().unwrap_or_default());
                }
                facets.points.len() as u32 - 1
            })
        });
        facets.triangles.push(triangle);
    }
    facets
}

/// Joins uses of edges into walks, which are closed if possible. Each walk continues with the first use that begins where the
/// previous one ends.
fn end_to_end(uses: Vec<(EdgeUse, [u32; 2])>) -> Vec<Loop> {
    let mut from: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, (_, [start, _])) in uses.iter().enumerate().rev() {
        from.entry(*start).or_default().push(index);
    }
    let mut is_taken = vec![false; uses.len()];
    let mut loops = Vec::new();
    for first in 0..uses.len() {
        let mut walk = Vec::new();
        let mut next = (!is_taken[first]).then_some(first);
        while let Some(index) = next {
            is_taken[index] = true;
            let (use_, [_, end]) = uses[index];
            walk.push(use_);
            let candidates = from.entry(end).or_default();
            while candidates
                .last()
                .is_some_and(|&candidate| is_taken[candidate])
            {
                candidates.pop();
            }
            next = candidates
                .last()
                .copied()
                .filter(|_| end != uses[first].1[0]);
        }
        if !walk.is_empty() {
            loops.push(Loop::Edges(walk));
        }
    }
    loops
}

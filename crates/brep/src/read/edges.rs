//! Bounds of the file become loops over one list of edges, in which faces of one root share what the file shares.

use super::curves::MAX_NESTING;
use super::error::{EntityError, Problem};
use super::memo::Memo;
use super::space::Reader;
use crate::geometry::{Curve, trim};
use crate::model::{EdgeUse, Loop, TopoEdge, Vertex};
use crate::part21::{Keyword, Record};
use carrier::{Point, distance, subtract};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Vertices and edges, and which instances they were read from.
pub(super) struct EdgeTable {
    vertices: Vec<Vertex>,
    edges: Vec<TopoEdge>,
    vertex_memo: Memo,
    edge_memo: Memo,
    curve_memo: Memo,
    curves: Vec<(Arc<Curve>, bool)>,
    /// Sides of polygons by root and the lower and higher of their vertices.
    sides: BTreeMap<(u32, u32, u32), u32>,
}

impl EdgeTable {
    /// An empty table for a file of so many instances.
    pub(super) fn new(n_records: usize) -> Self {
        Self {
            vertices: Vec::new(),
            edges: Vec::new(),
            vertex_memo: Memo::new(n_records),
            edge_memo: Memo::new(n_records),
            curve_memo: Memo::new(n_records),
            curves: Vec::new(),
            sides: BTreeMap::new(),
        }
    }

    /// The vertices and the edges.
    pub(super) fn into_lists(self) -> (Vec<Vertex>, Vec<TopoEdge>) {
        (self.vertices, self.edges)
    }

    /// The points at which the edges of a loop begin.
    pub(super) fn corners(&self, boundary: &Loop) -> Vec<Point> {
        let start = |edge_use: &EdgeUse| {
            let edge = &self.edges[edge_use.edge as usize];
            self.vertices[if edge_use.forward { edge.start } else { edge.end } as usize].point
        };
        match boundary {
            Loop::Edges(uses) => uses.iter().map(start).collect(),
            Loop::Vertex(vertex) => vec![self.vertices[*vertex as usize].point],
        }
    }

    /// The points at which the edges of a loop begin, and the middles of the edges.
    pub(super) fn corners_and_middles(&self, boundary: &Loop) -> Vec<Point> {
        let Loop::Edges(uses) = boundary else { return self.corners(boundary) };
        let middle = |edge_use: &EdgeUse| {
            let edge = &self.edges[edge_use.edge as usize];
            let (start, end) = trim(edge, &self.vertices);
            edge.curve.point(0.5 * (start + end))
        };
        self.corners(boundary).into_iter().zip(uses).flat_map(|(corner, use_)| [corner, middle(use_)]).collect()
    }

    /// The loop of a `FACE_BOUND`, its orientation flag applied.
    pub(super) fn bound(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<Loop, EntityError> {
        reader.source.entity(id, |record| {
            let [_, boundary, orientation] = reader.source.params(record)?;
            let boundary =
                reader.source.entity(boundary.reference()?, |boundary| self.loop_of(reader, root, boundary))?;
            Ok(if orientation.flag()? != reader.is_mirrored() { boundary } else { reversed(boundary) })
        })
    }

    fn loop_of(&mut self, reader: &Reader<'_, '_>, root: u32, record: Record) -> Result<Loop, EntityError> {
        match record.keyword {
            Keyword::EdgeLoop => {
                let [_, edges] = reader.source.params(record)?;
                let uses = edges.list()?.iter().map(|edge| self.edge_use(reader, root, edge?.reference()?));
                not_empty(uses.collect::<Result<_, EntityError>>()?)
            }
            Keyword::VertexLoop => {
                let [_, vertex] = reader.source.params(record)?;
                Ok(Loop::Vertex(self.vertex(reader, root, vertex.reference()?)?))
            }
            Keyword::PolyLoop => self.polygon(reader, root, record),
            Keyword::Complex => {
                let path = reader.source.exchange.partial(record, "PATH");
                let [edges] = path.ok_or_else(|| reader.source.wrong_class(record, "loop"))?.first()?;
                let uses = edges.list()?.iter().map(|edge| self.edge_use(reader, root, edge?.reference()?));
                not_empty(uses.collect::<Result<_, EntityError>>()?)
            }
            _ => Err(reader.source.wrong_class(record, "loop")),
        }
    }

    fn edge_use(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<EdgeUse, EntityError> {
        reader.source.entity(id, |record| {
            if matches!(record.keyword, Keyword::EdgeCurve | Keyword::Subedge) {
                return Ok(EdgeUse { edge: self.edge(reader, root, id)?, forward: true });
            }
            if record.keyword != Keyword::OrientedEdge {
                return Err(reader.source.wrong_class(record, "oriented edge"));
            }
            let [_, _, _, element, orientation] = reader.source.params(record)?;
            Ok(EdgeUse { edge: self.edge(reader, root, element.reference()?)?, forward: orientation.flag()? })
        })
    }

    fn edge(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<u32, EntityError> {
        reader.source.entity(id, |record| {
            let slot = reader.source.exchange.slot(id).ok_or(Problem::Missing)?;
            if let Some(edge) = self.edge_memo.index(root, slot) {
                return Ok(edge);
            }
            let [_, start, end] = reader.source.params(record)?;
            let (curve, same_sense) = self.edge_geometry(reader, root, record)?;
            let start = self.vertex(reader, root, start.reference()?)?;
            let end = self.vertex(reader, root, end.reference()?)?;
            let edge = self.push_edge(id, [start, end], curve, same_sense);
            self.edge_memo.remember(root, slot, edge);
            Ok(edge)
        })
    }

    /// The curve of an edge, and whether the edge runs along it; a `SUBEDGE` is a piece of its parent's.
    fn edge_geometry(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        mut record: Record,
    ) -> Result<(Arc<Curve>, bool), EntityError> {
        for _ in 0..MAX_NESTING {
            match record.keyword {
                Keyword::EdgeCurve => {
                    let [_, _, _, curve, same_sense] = reader.source.params(record)?;
                    let (curve, curve_sense) = self.curve(reader, root, curve.reference()?)?;
                    return Ok((curve, same_sense.flag()? == curve_sense));
                }
                Keyword::Subedge => {
                    let [_, _, _, parent] = reader.source.params(record)?;
                    record = reader.source.record(parent.reference()?)?;
                }
                _ => return Err(reader.source.wrong_class(record, "edge")),
            }
        }
        Err(Problem::TooDeep.into())
    }

    fn curve(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<(Arc<Curve>, bool), EntityError> {
        let slot = reader.source.exchange.slot(id);
        let slot = slot.ok_or_else(|| EntityError::from(Problem::Missing).within(id))?;
        if let Some(index) = self.curve_memo.index(root, slot) {
            return Ok(self.curves[index as usize].clone());
        }
        let directed = reader.curve(id, 0)?;
        let shared = (Arc::new(directed.curve), directed.same_sense);
        self.curve_memo.remember(root, slot, self.curves.len() as u32);
        self.curves.push(shared.clone());
        Ok(shared)
    }

    /// The vertex of a `VERTEX_POINT`, or of the point itself where a polygon names it.
    fn vertex(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<u32, EntityError> {
        reader.source.entity(id, |record| {
            let slot = reader.source.exchange.slot(id).ok_or(Problem::Missing)?;
            if let Some(vertex) = self.vertex_memo.index(root, slot) {
                return Ok(vertex);
            }
            let point = match record.keyword {
                Keyword::CartesianPoint => reader.point(id)?,
                Keyword::VertexPoint => {
                    let [_, point] = reader.source.params(record)?;
                    reader.point(point.reference()?)?
                }
                _ => return Err(reader.source.wrong_class(record, "vertex")),
            };
            let vertex = self.vertices.len() as u32;
            self.vertices.push(Vertex { step_id: id, point });
            self.vertex_memo.remember(root, slot, vertex);
            Ok(vertex)
        })
    }

    /// Adds a vertex that no instance stands for.
    pub(super) fn push_vertex(&mut self, point: Point) -> u32 {
        self.vertices.push(Vertex { step_id: 0, point });
        self.vertices.len() as u32 - 1
    }

    /// Adds an edge between two vertices.
    pub(super) fn push_edge(
        &mut self,
        step_id: u64,
        [start, end]: [u32; 2],
        curve: Arc<Curve>,
        same_sense: bool,
    ) -> u32 {
        self.edges.push(TopoEdge { step_id, start, end, curve, same_sense });
        self.edges.len() as u32 - 1
    }

    fn polygon(&mut self, reader: &Reader<'_, '_>, root: u32, record: Record) -> Result<Loop, EntityError> {
        let [_, corners] = reader.source.params(record)?;
        let corners = corners.list()?.iter().map(|corner| self.vertex(reader, root, corner?.reference()?));
        let mut corners: Vec<u32> = corners.collect::<Result<_, EntityError>>()?;
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            return Err(Problem::Geometry("a polygon needs three corners").into());
        }
        let ends = corners.iter().zip(corners.iter().cycle().skip(1));
        Ok(Loop::Edges(ends.map(|(&from, &to)| self.side(root, from, to)).collect()))
    }

    /// The side of a polygon between two vertices; polygons that name the same points share it.
    fn side(&mut self, root: u32, from: u32, to: u32) -> EdgeUse {
        let (start, end) = (from.min(to), from.max(to));
        let edge = *self.sides.entry((root, start, end)).or_insert_with(|| {
            let [origin, target] = [start, end].map(|vertex| self.vertices[vertex as usize].point);
            // Two points in one place leave a line without direction; any direction does for an edge without length.
            let apart = distance(origin, target) > 0.0;
            let direction = if apart { subtract(target, origin) } else { [1.0, 0.0, 0.0] };
            let curve = Arc::new(Curve::Line { origin, direction });
            self.edges.push(TopoEdge { step_id: 0, start, end, curve, same_sense: true });
            self.edges.len() as u32 - 1
        });
        EdgeUse { edge, forward: from == start }
    }
}

fn not_empty(uses: Vec<EdgeUse>) -> Result<Loop, EntityError> {
    if uses.is_empty() { Err(Problem::Geometry("it has no edges").into()) } else { Ok(Loop::Edges(uses)) }
}

/// The loop walked the other way.
pub(super) fn reversed(boundary: Loop) -> Loop {
    match boundary {
        Loop::Edges(uses) => {
            let turned = uses.into_iter().rev().map(|EdgeUse { edge, forward }| EdgeUse { edge, forward: !forward });
            Loop::Edges(turned.collect())
        }
        vertex @ Loop::Vertex(_) => vertex,
    }
}

//! Reads bounds into loops over one list of edges. Faces of one root share the edges that the file shares.

use super::curves::{DirectedCurve, MAX_NESTING};
use super::error::{EntityError, Problem};
use super::memo::Memo;
use super::space::Reader;
use super::surface_table::{SharedSurface, SurfaceTable};
use crate::geometry::{Curve, Surface, SurfaceCurve, trim};
use crate::model::{BrepEdge, EdgeUse, Loop, Vertex};
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::{Point, distance, subtract};
use std::collections::BTreeMap;
use std::sync::Arc;

/// If an edge has no curve, it is assumed to be straight. It may then leave its surface by this fraction of its length.
const LARGEST_SAG: f64 = 1e-3;

/// Vertices and edges, and the instances from which they were read.
pub(super) struct EdgeTable {
    vertices: Vec<Vertex>,
    edges: Vec<BrepEdge>,
    vertex_memo: Memo,
    edge_memo: Memo,
    curve_memo: Memo,
    curves: Vec<(Arc<Curve>, bool)>,
    /// The surfaces of faces and of curves on surfaces.
    pub(super) surfaces: SurfaceTable,
    /// Edges without a curve, which are assumed to be straight.
    assumed: Vec<u32>,
    /// Sides of polygons, by root and by the lower and the higher of their vertices.
    sides: BTreeMap<(u32, u32, u32), u32>,
}

impl EdgeTable {
    /// An empty table for a file of `n_records` instances.
    pub(super) fn new(n_records: usize) -> Self {
        Self {
            vertices: Vec::new(),
            edges: Vec::new(),
            vertex_memo: Memo::new(n_records),
            edge_memo: Memo::new(n_records),
            curve_memo: Memo::new(n_records),
            curves: Vec::new(),
            surfaces: SurfaceTable::new(n_records),
            assumed: Vec::new(),
            sides: BTreeMap::new(),
        }
    }

    /// The vertices and the edges.
    pub(super) fn into_lists(self) -> (Vec<Vertex>, Vec<BrepEdge>) {
        (self.vertices, self.edges)
    }

    /// The points at which the edges of a loop begin.
    pub(super) fn corners(&self, boundary: &Loop) -> Vec<Point> {
        let start = |edge_use: &EdgeUse| {
            let edge = &self.edges[edge_use.edge as usize];
            self.vertices[if edge_use.forward {
                edge.start
            } else {
                edge.end
            } as usize]
                .point
        };
        match boundary {
            Loop::Edges(uses) => uses.iter().map(start).collect(),
            Loop::Vertex(vertex) => vec![self.vertices[*vertex as usize].point],
        }
    }

    /// The points that divide each edge of a loop into `n_pieces` equal pieces, in walking order.
    pub(super) fn points_along(&self, boundary: &Loop, n_pieces: usize) -> Vec<Point> {
        let Loop::Edges(uses) = boundary else {
            return self.corners(boundary);
        };
        let inner = |edge_use: &EdgeUse| {
            let edge = &self.edges[edge_use.edge as usize];
            let (start, end) = trim(edge, &self.vertices);
            let (from, to) = if edge_use.forward {
                (start, end)
            } else {
                (end, start)
            };
            let curve = Arc::clone(&edge.curve);
            (1..n_pieces).map(move |i| curve.point(from + (to - from) * i as f64 / n_pieces as f64))
        };
        let corners = self.corners(boundary).into_iter().zip(uses);
        corners
            .flat_map(|(corner, edge_use)| std::iter::once(corner).chain(inner(edge_use)))
            .collect()
    }

    /// The loop of a `FACE_BOUND`. Its orientation flag is applied.
    pub(super) fn bound(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        id: u64,
    ) -> Result<Loop, EntityError> {
        reader.source.entity(id, |record| {
            let [_, boundary, orientation] = reader.source.params(record)?;
            let boundary = reader.source.entity(boundary.reference()?, |boundary| {
                self.loop_of(reader, root, boundary)
            })?;
            Ok(
                if reader.source.flag(record, orientation)? != reader.is_mirrored() {
                    boundary
                } else {
                    reversed(boundary)
                },
            )
        })
    }

    fn loop_of(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        record: Record,
    ) -> Result<Loop, EntityError> {
        match record.keyword {
            Keyword::EdgeLoop => {
                let [_, edges] = reader.source.params(record)?;
                let uses = edges
                    .list()?
                    .iter()
                    .map(|edge| self.edge_use(reader, root, edge?.reference()?));
                not_empty(uses.collect::<Result<_, EntityError>>()?)
            }
            Keyword::VertexLoop => {
                let [_, vertex] = reader.source.params(record)?;
                Ok(Loop::Vertex(self.vertex(
                    reader,
                    root,
                    vertex.reference()?,
                )?))
            }
            Keyword::PolyLoop => self.polygon(reader, root, record),
            Keyword::Complex => {
                let path = reader.source.exchange.partial(record, "PATH");
                let [edges] = path
                    .ok_or_else(|| reader.source.wrong_class(record, "loop"))?
                    .first()?;
                let uses = edges
                    .list()?
                    .iter()
                    .map(|edge| self.edge_use(reader, root, edge?.reference()?));
                not_empty(uses.collect::<Result<_, EntityError>>()?)
            }
            _ => Err(reader.source.wrong_class(record, "loop")),
        }
    }

    fn edge_use(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        id: u64,
    ) -> Result<EdgeUse, EntityError> {
        reader.source.entity(id, |record| {
            if matches!(
                record.keyword,
                Keyword::EdgeCurve | Keyword::Subedge | Keyword::Edge
            ) {
                return Ok(EdgeUse {
                    edge: self.edge(reader, root, id)?,
                    forward: true,
                });
            }
            if record.keyword != Keyword::OrientedEdge {
                return Err(reader.source.wrong_class(record, "oriented edge"));
            }
            let [_, _, _, element, orientation] = reader.source.params(record)?;
            let forward = reader.source.flag(record, orientation)?;
            Ok(EdgeUse {
                edge: self.edge(reader, root, element.reference()?)?,
                forward,
            })
        })
    }

    fn edge(&mut self, reader: &Reader<'_, '_>, root: u32, id: u64) -> Result<u32, EntityError> {
        reader.source.entity(id, |record| {
            let slot = reader.source.exchange.slot(id).ok_or(Problem::Missing)?;
            if let Some(edge) = self.edge_memo.index(root, slot) {
                return Ok(edge);
            }
            let [_, start, end] = reader.source.params(record)?;
            let geometry = self.edge_geometry(reader, root, record)?;
            let start = self.vertex(reader, root, start.reference()?)?;
            let end = self.vertex(reader, root, end.reference()?)?;
            let (curve, same_sense) = match geometry {
                Some(geometry) => geometry,
                None => {
                    self.assumed.push(self.edges.len() as u32);
                    (
                        straight(&self.vertices, [start, end])
                            .ok_or(Problem::Geometry("it has no curve"))?,
                        true,
                    )
                }
            };
            let edge = self.push_edge(id, [start, end], curve, same_sense);
            self.edge_memo.remember(root, slot, edge);
            Ok(edge)
        })
    }

    /// The curve of an edge, and whether the edge runs along it. A `SUBEDGE` is a piece of its parent's curve. Returns `None` for
    /// an edge that is defined by its vertices only.
    fn edge_geometry(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        mut record: Record,
    ) -> Result<Option<(Arc<Curve>, bool)>, EntityError> {
        for _ in 0..MAX_NESTING {
            match record.keyword {
                Keyword::EdgeCurve => {
                    let [_, _, _, curve, same_sense] = reader.source.params(record)?;
                    if curve == Param::Unset {
                        return Ok(None);
                    }
                    let (curve, curve_sense) = self.curve(reader, root, curve.reference()?)?;
                    return Ok(Some((
                        curve,
                        reader.source.flag(record, same_sense)? == curve_sense,
                    )));
                }
                Keyword::Edge => return Ok(None),
                Keyword::Subedge => {
                    let [_, _, _, parent] = reader.source.params(record)?;
                    record = reader.source.record(parent.reference()?)?;
                }
                _ => return Err(reader.source.wrong_class(record, "edge")),
            }
        }
        Err(Problem::TooDeep.into())
    }

    fn curve(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        id: u64,
    ) -> Result<(Arc<Curve>, bool), EntityError> {
        let slot = reader.source.exchange.slot(id);
        let slot = slot.ok_or_else(|| EntityError::from(Problem::Missing).within(id))?;
        if let Some(index) = self.curve_memo.index(root, slot) {
            return Ok(self.curves[index as usize].clone());
        }
        let directed = match reader.curve(id, 0) {
            Ok(curve) => curve,
            Err(error) => self.curve_on_surface(reader, root, id)?.ok_or(error)?,
        };
        let shared = (Arc::new(directed.curve), directed.same_sense);
        self.curve_memo
            .remember(root, slot, self.curves.len() as u32);
        self.curves.push(shared.clone());
        Ok(shared)
    }

    /// A curve on a surface, for a curve that has no curve in space. Returns `None` if it does not name a surface either.
    fn curve_on_surface(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        id: u64,
    ) -> Result<Option<DirectedCurve>, EntityError> {
        let Some((surface, DirectedCurve { curve, same_sense })) = reader.parameter_curve(id)?
        else {
            return Ok(None);
        };
        let SharedSurface { surface, .. } = self.surfaces.surface(reader, root, surface)?;
        let scale = reader.parameter_scales(&surface);
        let on_surface = SurfaceCurve {
            surface,
            curve,
            scale,
        };
        // In a plane, a line remains a line, and it then needs no division.
        let curve = match (&*on_surface.surface, &on_surface.curve) {
            (Surface::Plane(_), Curve::Line { .. }) => {
                let (origin, direction) = on_surface.derivative(0.0);
                Curve::Line { origin, direction }
            }
            _ => Curve::OnSurface(Box::new(on_surface)),
        };
        Ok(Some(DirectedCurve { curve, same_sense }))
    }

    /// Refuses edges that were assumed to be straight but would leave the face's surface.
    pub(super) fn check_assumed(
        &self,
        surface: &Surface,
        loops: &[Loop],
    ) -> Result<(), EntityError> {
        if self.assumed.is_empty() {
            return Ok(());
        }
        let uses = loops.iter().flat_map(|boundary| match boundary {
            Loop::Edges(uses) => uses.as_slice(),
            Loop::Vertex(_) => &[],
        });
        for edge in uses.filter(|edge_use| self.assumed.binary_search(&edge_use.edge).is_ok()) {
            let BrepEdge {
                step_id,
                start,
                end,
                ..
            } = self.edges[edge.edge as usize];
            let [from, to] = [start, end].map(|vertex| self.vertices[vertex as usize].point);
            let middle = [0, 1, 2].map(|axis| 0.5 * (from[axis] + to[axis]));
            if surface.project(middle, None).distance > LARGEST_SAG * distance(from, to) {
                let problem = Problem::Geometry(
                    "it has no curve, and a straight one would leave the surface",
                );
                return Err(EntityError::from(problem).within(step_id));
            }
        }
        Ok(())
    }

    /// The vertex of a `VERTEX_POINT`, or of a point that a polygon names directly.
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

    /// Adds a vertex that has no instance in the file.
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
        self.edges.push(BrepEdge {
            step_id,
            start,
            end,
            curve,
            same_sense,
        });
        self.edges.len() as u32 - 1
    }

    fn polygon(
        &mut self,
        reader: &Reader<'_, '_>,
        root: u32,
        record: Record,
    ) -> Result<Loop, EntityError> {
        let [_, corners] = reader.source.params(record)?;
        let corners = corners
            .list()?
            .iter()
            .map(|corner| self.vertex(reader, root, corner?.reference()?));
        let mut corners: Vec<u32> = corners.collect::<Result<_, EntityError>>()?;
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            return Err(Problem::Geometry("a polygon needs three corners").into());
        }
        let ends = corners.iter().zip(corners.iter().cycle().skip(1));
        Ok(Loop::Edges(
            ends.map(|(&from, &to)| self.side(root, from, to)).collect(),
        ))
    }

    /// The side of a polygon between two vertices. Polygons that name the same points share it.
    fn side(&mut self, root: u32, from: u32, to: u32) -> EdgeUse {
        let (start, end) = (from.min(to), from.max(to));
        let edge = *self.sides.entry((root, start, end)).or_insert_with(|| {
            // Two equal points give a line without direction. An edge without length may have any direction.
            let origin = self.vertices[start as usize].point;
            let without_length = || {
                Arc::new(Curve::Line {
                    origin,
                    direction: [1.0, 0.0, 0.0],
                })
            };
            let curve = straight(&self.vertices, [start, end]).unwrap_or_else(without_length);
            self.edges.push(BrepEdge {
                step_id: 0,
                start,
                end,
                curve,
                same_sense: true,
            });
            self.edges.len() as u32 - 1
        });
        EdgeUse {
            edge,
            forward: from == start,
        }
    }
}

/// The line between two vertices. Returns `None` if they coincide.
fn straight(vertices: &[Vertex], ends: [u32; 2]) -> Option<Arc<Curve>> {
    let [origin, target] = ends.map(|vertex| vertices[vertex as usize].point);
    (distance(origin, target) > 0.0).then(|| {
        Arc::new(Curve::Line {
            origin,
            direction: subtract(target, origin),
        })
    })
}

fn not_empty(uses: Vec<EdgeUse>) -> Result<Loop, EntityError> {
    if uses.is_empty() {
        Err(Problem::Geometry("it has no edges").into())
    } else {
        Ok(Loop::Edges(uses))
    }
}

/// The loop in the opposite direction.
pub(super) fn reversed(boundary: Loop) -> Loop {
    match boundary {
        Loop::Edges(uses) => {
            let reversed = uses
                .into_iter()
                .rev()
                .map(|EdgeUse { edge, forward }| EdgeUse {
                    edge,
                    forward: !forward,
                });
            Loop::Edges(reversed.collect())
        }
        vertex @ Loop::Vertex(_) => vertex,
    }
}

//! Roots, shells and faces of the file become those of the B-Rep, with every loss named.

use super::bounded_surfaces::{is_bounded_surface, loops_of};
use super::constructions::is_construction;
use super::edges::EdgeTable;
use super::error::{EntityError, Problem};
use super::file::{StepFile, name_of};
use super::implicit_bounds::revolved_between_ends;
use super::layers::Layers;
use super::roots::{Root, RootKind};
use super::space::{Reader, Space};
use super::styles::Colors;
use super::surface_table::SharedSurface;
use crate::geometry::{
    Curve, Frame, Surface, half_of_covered_twice, revolution_sheets, revolved_sphere,
};
use crate::model::{Brep, BrepFace, Loop, LostEntity, LostKind, Shell, Solid};
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::{Color, FaceType, Point, bounding_diagonal, cross, dot, subtract};
use std::f64::consts::PI;
use std::sync::Arc;

/// An oriented shell may name an oriented shell, and so may faces; real files stop at one.
const MAX_ORIENTED: usize = 8;

/// Pieces of each edge whose ends must lie on a patch: an odd number, as half an edge may follow a patch's side.
const PLACES_ON_PATCH: usize = 5;

/// Pieces of each edge of a face without a surface that are looked at, and how far they may lie beside a plane, as a fraction of
/// the face's size.
const PLACES_IN_PLANE: usize = 8;
const FLAT: f64 = 1e-6;

/// Builds the faces of a file, root by root.
pub(super) struct TopologyBuilder<'s, 'a> {
    pub(super) source: &'s StepFile<'a>,
    pub(super) colors: &'s Colors,
    pub(super) layers: &'s Layers,
    pub(super) brep: Brep,
    pub(super) edges: EdgeTable,
    /// Faces that are there already, by their instances' slots.
    pub(super) is_read: Vec<bool>,
    /// Those of them that became faces.
    pub(super) has_face: Vec<bool>,
    root: u32,
    /// The component of the root at work.
    pub(super) component: u32,
    /// The root at work and its representation: what styles and layers may name instead of a shell.
    owners: [Option<u64>; 2],
}

/// Where a root stands.
pub(super) struct Site {
    pub(super) product_name: Option<String>,
    pub(super) space: Space,
    pub(super) component: u32,
    pub(super) representation: Option<u64>,
}

/// Where a face hangs: what its reader needs beside its own entity.
#[derive(Clone, Copy)]
pub(super) struct ShellContext<'s, 'a> {
    pub(super) reader: Reader<'s, 'a>,
    pub(super) shell: u32,
    /// The color of the shell, of its body or of its representation, for faces without their own.
    pub(super) color: Option<Color>,
    /// The layer of the same, for faces without their own.
    pub(super) layer: Option<&'s str>,
}

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// A builder that adds to `brep`.
    pub(super) fn new(
        source: &'s StepFile<'a>,
        colors: &'s Colors,
        layers: &'s Layers,
        brep: Brep,
    ) -> Self {
        let n_records = source.exchange.records().len();
        Self {
            source,
            colors,
            layers,
            brep,
            edges: EdgeTable::new(n_records),
            is_read: vec![false; n_records],
            has_face: vec![false; n_records],
            root: 0,
            component: 0,
            owners: [None; 2],
        }
    }

    /// What was built.
    pub(super) fn finish(mut self) -> Brep {
        (self.brep.vertices, self.brep.edges) = self.edges.into_lists();
        self.brep
    }

    /// Adds the faces of a root, and says whether there were any; a root whose faces are all there already adds nothing.
    pub(super) fn add_root(&mut self, root: &Root, site: Site) -> bool {
        self.root += 1;
        self.component = site.component;
        self.owners = [Some(root.record.id), site.representation];
        let step_id = root.record.id;
        let (n_faces, n_losses) = (self.brep.faces.len(), self.brep.lost.len());
        let (n_shells, n_solids) = (self.brep.shells.len(), self.brep.solids.len());
        let solid = root.bounds_solid(self.source).then_some(n_solids as u32);
        if solid.is_some() {
            let name = root
                .name(self.source)
                .and_then(name_of)
                .or(site.product_name);
            self.brep.solids.push(Solid { step_id, name });
        }
        let reader = Reader::new(self.source, site.space);
        match root.shells(self.source) {
            Ok(elements) => self.add_elements(reader, root, &elements, solid),
            Err(error) => self.lose(LostKind::Entity, step_id, &error),
        }
        if self.brep.faces.len() == n_faces && self.brep.lost.len() == n_losses {
            self.brep.shells.truncate(n_shells);
            self.brep.solids.truncate(n_solids);
        }
        self.brep.faces.len() > n_faces
    }

    fn add_elements(
        &mut self,
        reader: Reader<'s, 'a>,
        root: &Root,
        elements: &[u64],
        solid: Option<u32>,
    ) {
        match root.kind {
            RootKind::Solid | RootKind::SurfaceModel => {
                elements
                    .iter()
                    .for_each(|&shell| self.add_shell(reader, shell, solid));
            }
            RootKind::GeometricSet => self.add_surfaces(reader, root.record.id, elements),
            RootKind::Bare => self.add_bare(reader, root.record.id, elements),
            RootKind::Construction => self.add_construction(reader, root.record),
            RootKind::Tessellated | RootKind::BareFacets => {
                self.add_facets(reader, root.record, elements, solid)
            }
        }
    }

    fn add_shell(&mut self, reader: Reader<'s, 'a>, id: u64, solid: Option<u32>) {
        let (record, flipped, faces) = match self.oriented(id).and_then(|(record, flipped)| {
            let faces = self
                .faces_of_shell(record)
                .map_err(|error| error.within(record.id))?;
            Ok((record, flipped, faces))
        }) {
            Ok(shell) => shell,
            Err(error) => return self.lose(LostKind::Entity, id, &error),
        };
        let context = self.push_shell(
            reader,
            Shell {
                step_id: record.id,
                solid,
                component: self.component,
            },
            id,
        );
        for face in faces {
            match face {
                Ok(face) => self.add_face(context, face, flipped),
                Err(error) => self.lose(
                    LostKind::Face,
                    record.id,
                    &EntityError::from(error).within(record.id),
                ),
            }
        }
    }

    /// Adds a shell without faces, and returns the context of its faces. `id` is the shell as its owner names it.
    pub(super) fn push_shell(
        &mut self,
        reader: Reader<'s, 'a>,
        shell: Shell,
        id: u64,
    ) -> ShellContext<'s, 'a> {
        let (colors, layers) = (self.colors, self.layers);
        let owners = [Some(id), Some(shell.step_id)]
            .into_iter()
            .chain(self.owners)
            .flatten();
        let color = owners.clone().find_map(|owner| colors.of(owner));
        let layer = owners.clone().find_map(|owner| layers.of(owner));
        let context = ShellContext {
            reader,
            shell: self.brep.shells.len() as u32,
            color,
            layer,
        };
        self.brep.shells.push(shell);
        context
    }

    /// Adds the bounded surfaces among the elements of a geometric set; curves and points are no faces.
    fn add_surfaces(&mut self, reader: Reader<'s, 'a>, set: u64, elements: &[u64]) {
        let context = self.push_shell(
            reader,
            Shell {
                step_id: set,
                solid: None,
                component: self.component,
            },
            set,
        );
        for &element in elements {
            let Ok(record) = self.source.record(element) else {
                continue;
            };
            if is_bounded_surface(&reader, record) {
                self.add_surface(context, record);
            }
        }
    }

    fn add_surface(&mut self, context: ShellContext<'s, 'a>, record: Record) {
        let Some(slot) = self.source.exchange.slot(record.id) else {
            return;
        };
        if std::mem::replace(&mut self.is_read[slot], true) {
            return;
        }
        match self.surface_face(context, record) {
            Ok(face) => {
                self.has_face[slot] = true;
                self.brep.faces.push(face);
            }
            Err(error) => self.lose(LostKind::Face, record.id, &error),
        }
    }

    /// Adds what a representation lists without a body around it: its faces make one shell, and so does each of its shells.
    fn add_bare(&mut self, reader: Reader<'s, 'a>, representation: u64, items: &[u64]) {
        let shell = Shell {
            step_id: representation,
            solid: None,
            component: self.component,
        };
        let context = self.push_shell(reader, shell, representation);
        let n_faces = self.brep.faces.len();
        let mut shells = Vec::new();
        for &item in items {
            match self.source.record(item) {
                Ok(record) if is_bounded_surface(&reader, record) => {
                    self.add_surface(context, record)
                }
                Ok(record) if is_construction(record.keyword) => {
                    self.add_construction(reader, record)
                }
                Ok(record) if self.is_shell(record) => shells.push(item),
                Ok(_) => self.add_face(context, item, false),
                Err(error) => self.lose(LostKind::Face, item, &error),
            }
        }
        if self.brep.faces.len() == n_faces {
            self.brep.shells.pop();
        }
        shells
            .into_iter()
            .for_each(|shell| self.add_shell(reader, shell, None));
    }

    fn is_shell(&self, record: Record) -> bool {
        match record.keyword {
            Keyword::ClosedShell
            | Keyword::OpenShell
            | Keyword::OrientedClosedShell
            | Keyword::OrientedOpenShell
            | Keyword::ConnectedFaceSet
            | Keyword::ConnectedFaceSubSet => true,
            Keyword::Complex => self
                .source
                .exchange
                .partial(record, "CONNECTED_FACE_SET")
                .is_some(),
            _ => false,
        }
    }

    fn surface_face(
        &mut self,
        context: ShellContext<'s, 'a>,
        record: Record,
    ) -> Result<BrepFace, EntityError> {
        let SharedSurface {
            surface,
            face_type,
            same_sense,
        } = self.surface(context.reader, record.id)?;
        let ended = revolved_between_ends(&context.reader, &surface, record);
        let surface = ended.map_or(surface, Arc::new);
        let loops = loops_of(
            &context.reader,
            &mut self.edges,
            record,
            &surface,
            same_sense,
        );
        let loops = loops.map_err(|error| error.within(record.id))?;
        Ok(BrepFace {
            step_id: record.id,
            surface,
            face_type,
            same_sense,
            flipped: false,
            loops,
            shell: context.shell,
            name: None,
            color: self.colors.of(record.id).or(context.color),
            layer: self
                .layers
                .of(record.id)
                .or(context.layer)
                .map(str::to_owned),
        })
    }

    /// The faces that a shell names. One that is written as no instance can be is an error among them.
    fn faces_of_shell(&self, record: Record) -> Result<Vec<Result<u64, ParamError>>, EntityError> {
        match record.keyword {
            Keyword::ClosedShell
            | Keyword::OpenShell
            | Keyword::ConnectedFaceSet
            | Keyword::ConnectedFaceSubSet
            | Keyword::Complex => {
                let [faces] = self
                    .source
                    .class_params(record, "CONNECTED_FACE_SET", 1)?
                    .first()?;
                let faces: Vec<_> = faces.list()?.iter().map(|face| face?.reference()).collect();
                // A list that breaks off is the shell's fault, and so is one that names something else.
                match faces
                    .iter()
                    .find_map(|face| face.err().filter(|error| *error != ParamError::LargeId))
                {
                    Some(error) => Err(error.into()),
                    None => Ok(faces),
                }
            }
            _ => Err(self.source.wrong_class(record, "shell")),
        }
    }

    /// Follows `ORIENTED_…` entities to what they orient, and says whether they turn it over.
    fn oriented(&self, id: u64) -> Result<(Record, bool), EntityError> {
        let mut record = self.source.record(id)?;
        let mut flipped = false;
        for _ in 0..MAX_ORIENTED {
            if !matches!(
                record.keyword,
                Keyword::OrientedClosedShell | Keyword::OrientedOpenShell | Keyword::OrientedFace
            ) {
                return Ok((record, flipped));
            }
            let attributes = || {
                let [_, _, element, orientation] = self.source.params(record)?;
                Ok((element.reference()?, self.source.flag(record, orientation)?))
            };
            let (element, orientation) = attributes()
                .map_err(|error: ParamError| EntityError::from(error).within(record.id))?;
            flipped ^= !orientation;
            record = self.source.record(element)?;
        }
        Err(EntityError::from(Problem::TooDeep).within(id))
    }

    fn add_face(&mut self, context: ShellContext<'s, 'a>, id: u64, shell_flipped: bool) {
        let (record, face_flipped) = match self.oriented(id) {
            Ok(face) => face,
            Err(error) => return self.lose(LostKind::Face, id, &error),
        };
        let Some(slot) = self.source.exchange.slot(record.id) else {
            return;
        };
        if std::mem::replace(&mut self.is_read[slot], true) {
            return;
        }
        match self.face(context, record) {
            Ok(face) => {
                self.has_face[slot] = true;
                self.brep.faces.push(BrepFace {
                    flipped: shell_flipped != face_flipped,
                    ..face
                });
            }
            Err(error) => self.lose(LostKind::Face, record.id, &error.within(record.id)),
        }
    }

    fn face(
        &mut self,
        context: ShellContext<'s, 'a>,
        record: Record,
    ) -> Result<BrepFace, EntityError> {
        let attributes = self.face_attributes(record)?;
        let mut loops = Vec::new();
        let mut n_bounds = 0;
        let mut first_error = None;
        for bound in attributes.bounds.list()?.iter() {
            let bound = bound?.reference()?;
            n_bounds += 1;
            match self.edges.bound(&context.reader, self.root, bound) {
                Ok(boundary) => loops.push(boundary),
                Err(error) => {
                    self.lose(LostKind::Loop, bound, &error);
                    first_error.get_or_insert(error);
                }
            }
        }
        match first_error {
            Some(error) if loops.is_empty() && n_bounds > 0 => return Err(error),
            _ => {}
        }
        let SharedSurface {
            surface,
            face_type,
            same_sense,
        } = match attributes.surface {
            Some(surface) => {
                let shared = self.surface(context.reader, surface)?;
                let shared = self.covered_once(context, shared, surface, &loops);
                self.on_its_patch(
                    self.on_its_sheet(shared, attributes.same_sense, &loops),
                    &loops,
                )
            }
            None if record.keyword == Keyword::Face => self.plane_of_loops(&loops)?,
            None => self.plane_of_flat_loops(&loops)?,
        };
        self.edges.check_assumed(&surface, &loops)?;
        Ok(BrepFace {
            step_id: record.id,
            surface,
            face_type,
            same_sense: attributes.same_sense == same_sense,
            flipped: false,
            loops,
            shell: context.shell,
            name: attributes.name,
            color: self.colors.of(record.id).or(context.color),
            layer: self
                .layers
                .of(record.id)
                .or(context.layer)
                .map(str::to_owned),
        })
    }

    fn face_attributes(&self, record: Record) -> Result<FaceAttributes<'a>, EntityError> {
        if record.keyword == Keyword::Complex {
            return self.complex_face_attributes(record);
        }
        let [name, bounds] = self.source.params(record)?;
        let (surface, same_sense) = match record.keyword {
            Keyword::AdvancedFace | Keyword::FaceSurface => {
                let [_, _, surface, same_sense] = self.source.params(record)?;
                match surface {
                    // Bounds have their sense from the face, so that a surface made of them needs none.
                    Param::Unset => (None, true),
                    surface => (
                        Some(surface.reference()?),
                        self.source.flag(record, same_sense)?,
                    ),
                }
            }
            // A face of a faceted B-Rep is the plane of its polygons.
            Keyword::Face => (None, true),
            Keyword::Subface => self.parent_surface(record)?,
            _ => return Err(self.source.wrong_class(record, "face")),
        };
        Ok(FaceAttributes {
            name: name_of(name),
            bounds,
            surface,
            same_sense,
        })
    }

    /// What a `SUBFACE` is a piece of: the surface of its parent.
    fn parent_surface(&self, mut record: Record) -> Result<(Option<u64>, bool), EntityError> {
        let mut same_sense = true;
        for _ in 0..MAX_ORIENTED {
            let [_, _, parent] = self.source.params(record)?;
            let (parent, is_reversed) = self.oriented(parent.reference()?)?;
            same_sense ^= is_reversed;
            if parent.keyword != Keyword::Subface {
                let FaceAttributes {
                    surface,
                    same_sense: parent_sense,
                    ..
                } = self.face_attributes(parent)?;
                return Ok((surface, same_sense == parent_sense));
            }
            record = parent;
        }
        Err(Problem::TooDeep.into())
    }

    fn complex_face_attributes(&self, record: Record) -> Result<FaceAttributes<'a>, EntityError> {
        let partial = |name| self.source.exchange.partial(record, name);
        let wrong_class = || self.source.wrong_class(record, "face");
        let [bounds] = partial("FACE").ok_or_else(wrong_class)?.first()?;
        let [surface, same_sense] = partial("FACE_SURFACE").ok_or_else(wrong_class)?.first()?;
        let name = partial("REPRESENTATION_ITEM")
            .and_then(|item| item.first::<1>().ok())
            .and_then(|[name]| name_of(name));
        let same_sense = self.source.flag(record, same_sense)?;
        Ok(FaceAttributes {
            name,
            bounds,
            surface: Some(surface.reference()?),
            same_sense,
        })
    }

    /// One half of a revolved curve that covers its surface twice, such as an ellipse about its own axis; the sphere, if it is a
    /// circle. A face without edges is all of what the file's own curve turns into.
    fn covered_once(
        &self,
        context: ShellContext<'s, 'a>,
        shared: SharedSurface,
        id: u64,
        loops: &[Loop],
    ) -> SharedSurface {
        let Surface::Revolution { axis, curve } = &*shared.surface else {
            return shared;
        };
        if curve.period().is_none()
            || loops
                .iter()
                .all(|boundary| matches!(boundary, Loop::Vertex(_)))
        {
            return shared;
        }

        // Where the file trims the curve, its middle tells which half is meant.
        let record = self.source.record(id).ok();
        let ended = record
            .and_then(|record| revolved_between_ends(&context.reader, &shared.surface, record));
        let middle = ended.and_then(|surface| match surface {
            Surface::Revolution { curve, .. } => middle_of_arc(&curve),
            _ => None,
        });
        if let Some((sphere, is_outward)) = revolved_sphere(axis, curve, middle) {
            return SharedSurface {
                surface: Arc::new(sphere),
                same_sense: shared.same_sense == is_outward,
                ..shared
            };
        }
        match half_of_covered_twice(axis, curve, middle) {
            Some(half) => SharedSurface {
                surface: Arc::new(half),
                ..shared
            },
            None => shared,
        }
    }

    /// A torus that meets itself has two sheets, and its parameters do not say which a face lies on: its corners do.
    fn on_its_sheet(
        &self,
        shared: SharedSurface,
        same_sense: bool,
        loops: &[Loop],
    ) -> SharedSurface {
        if let Surface::Revolution { axis, curve } = &*shared.surface {
            let Some(sheets) = revolution_sheets(axis, curve) else {
                return shared;
            };
            return if loops
                .iter()
                .all(|boundary| matches!(boundary, Loop::Vertex(_)))
            {
                let looks_outward = same_sense == shared.same_sense;
                let sheet = sheets
                    .into_iter()
                    .find(|sheet| faces_away(axis, sheet) == looks_outward);
                sheet.map_or(shared.clone(), |sheet| SharedSurface {
                    surface: Arc::new(sheet),
                    ..shared
                })
            } else {
                self.on_nearer_sheet(shared, sheets, loops)
            };
        }
        let Surface::Torus {
            frame,
            major,
            minor,
        } = *shared.surface
        else {
            return shared;
        };
        if major <= 0.0 || major >= minor {
            return shared;
        }
        let corners: Vec<Point> = loops
            .iter()
            .flat_map(|boundary| self.edges.corners(boundary))
            .collect();
        let gap = |surface: &Surface| {
            corners
                .iter()
                .map(|&corner| surface.project(corner, None).distance)
                .fold(0.0, f64::max)
        };
        let inner = Surface::Torus {
            frame,
            major: -major,
            minor,
        };
        // The sheets meet in the tips, where neither is nearer.
        let beside = gap(&shared.surface);
        if beside > 1e-6 * minor && gap(&inner) < 0.5 * beside {
            // There `∂u × ∂v` of the whole torus points the other way.
            SharedSurface {
                surface: Arc::new(inner),
                same_sense: !shared.same_sense,
                ..shared
            }
        } else {
            shared
        }
    }

    /// The sheet of a surface of revolution that the face's edges lie on; the whole surface where neither is nearer.
    fn on_nearer_sheet(
        &self,
        shared: SharedSurface,
        sheets: [Surface; 2],
        loops: &[Loop],
    ) -> SharedSurface {
        let along = |boundary| self.edges.points_along(boundary, PLACES_ON_PATCH);
        let points: Vec<Point> = loops.iter().flat_map(along).collect();
        let gap = |sheet: &Surface| {
            points
                .iter()
                .map(|&point| sheet.project(point, None).distance)
                .fold(0.0, f64::max)
        };
        let [one, other] = sheets;
        let (beside_one, beside_other) = (gap(&one), gap(&other));
        let size = bounding_diagonal(&points);
        match [
            (beside_one, beside_other, one),
            (beside_other, beside_one, other),
        ]
        .into_iter()
        .find(|(near, far, _)| *far > 1e-6 * size && *near < 0.5 * far)
        {
            Some((_, _, sheet)) => SharedSurface {
                surface: Arc::new(sheet),
                ..shared
            },
            None => shared,
        }
    }

    /// A face that lies on one patch of a composite is a face of that patch's surface.
    fn on_its_patch(&self, shared: SharedSurface, loops: &[Loop]) -> SharedSurface {
        let Surface::Composite(composite) = &*shared.surface else {
            return shared;
        };
        let along = |boundary| self.edges.points_along(boundary, PLACES_ON_PATCH);
        let points: Vec<Point> = loops.iter().flat_map(along).collect();
        match composite
            .patches
            .iter()
            .find(|patch| !points.is_empty() && patch.covers(&points))
        {
            Some(patch) => SharedSurface {
                surface: Arc::new(patch.surface.clone()),
                face_type: patch.face_type,
                same_sense: shared.same_sense != patch.is_reversed(),
            },
            None => shared,
        }
    }

    fn surface(&mut self, reader: Reader<'s, 'a>, id: u64) -> Result<SharedSurface, EntityError> {
        self.edges.surfaces.surface(&reader, self.root, id)
    }

    /// The plane through the polygons of a face that names no surface, its normal by the first that has one.
    fn plane_of_loops(&self, loops: &[Loop]) -> Result<SharedSurface, EntityError> {
        let corners = loops.iter().map(|boundary| self.edges.corners(boundary));
        let plane = corners.filter_map(|corners| {
            let normal = newell_normal(&corners);
            (partprobe_shape::norm(normal) > 0.0)
                .then(|| Frame::new(corners[0], Some(normal), None))
        });
        let plane = plane
            .into_iter()
            .next()
            .ok_or(Problem::Geometry("its polygons span no plane"))?;
        let surface = Arc::new(Surface::Plane(plane));
        Ok(SharedSurface {
            surface,
            face_type: FaceType::Plane,
            same_sense: true,
        })
    }

    /// The same for a face whose surface is left out: all its edges have to lie in the plane.
    fn plane_of_flat_loops(&self, loops: &[Loop]) -> Result<SharedSurface, EntityError> {
        let problem = || {
            EntityError::from(Problem::Geometry(
                "it names no surface, and its boundary lies in no plane",
            ))
        };
        let walks: Vec<Vec<Point>> = loops
            .iter()
            .map(|boundary| self.edges.points_along(boundary, PLACES_IN_PLANE))
            .collect();
        let normals = walks.iter().map(|walk| newell_normal(walk));
        let outer = normals
            .max_by(|a, b| partprobe_shape::norm(*a).total_cmp(&partprobe_shape::norm(*b)))
            .ok_or_else(problem)?;
        let frame = Frame::new(
            walks[0].first().copied().unwrap_or_default(),
            Some(outer),
            None,
        );
        let size = bounding_diagonal(&walks.concat());
        let is_flat = walks
            .iter()
            .flatten()
            .all(|&point| frame.local(point)[2].abs() <= FLAT * size);
        if partprobe_shape::norm(outer) > 0.0 && is_flat {
            let surface = Arc::new(Surface::Plane(frame));
            Ok(SharedSurface {
                surface,
                face_type: FaceType::Plane,
                same_sense: true,
            })
        } else {
            Err(problem())
        }
    }

    pub(super) fn lose(&mut self, kind: LostKind, step_id: u64, error: &EntityError) {
        self.brep.lost.push(LostEntity {
            kind,
            step_id,
            reason: error.reason(step_id),
        });
    }
}

/// What a face's entity says.
struct FaceAttributes<'a> {
    name: Option<String>,
    bounds: Param<'a>,
    surface: Option<u64>,
    same_sense: bool,
}

/// The parameter of the basis in the middle of a curve of one piece that is no longer than half a turn. A longer arc covers
/// a part of both halves.
fn middle_of_arc(curve: &Curve) -> Option<f64> {
    let Curve::Composite(segments) = curve else {
        return None;
    };
    let [segment] = &segments[..] else {
        return None;
    };
    let is_in_one_half = (segment.end - segment.start).abs() <= PI + 1e-6;
    is_in_one_half.then_some(0.5 * (segment.start + segment.end))
}

/// Whether the normal `∂u × ∂v` of a revolved arc leaves its axis. A face without an edge is the sheet that has material
/// inside: a whole apple or a whole lemon.
fn faces_away(axis: &Frame, sheet: &Surface) -> bool {
    let [x, y, _] = axis.local(sheet.point(0.0, 0.5));
    sheet
        .unit_normal(0.0, 0.5)
        .is_some_and(|normal| dot(normal, axis.vector(x, y, 0.0)) > 0.0)
}

/// Twice the area vector of a closed polygon.
fn newell_normal(corners: &[Point]) -> Point {
    let Some(&origin) = corners.first() else {
        return [0.0; 3];
    };
    let mut normal = [0.0; 3];
    for pair in corners.windows(2) {
        let area = cross(subtract(pair[0], origin), subtract(pair[1], origin));
        normal = [0, 1, 2].map(|axis| normal[axis] + area[axis]);
    }
    normal
}

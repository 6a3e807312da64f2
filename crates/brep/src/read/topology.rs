//! Reads the roots, shells and faces of a file into a B-Rep, and names everything that is lost.
//!
//! The classes and their attributes are those of ISO 10303-42, topology schema: `EDGE_CURVE`, `ORIENTED_EDGE`, `EDGE_LOOP`,
//! `FACE_BOUND`, `ADVANCED_FACE`, and the shells and models that contain them.

use super::bounded_surfaces::{is_bounded_surface, loops_of};
use super::construction_classes::is_construction;
use super::edges::EdgeTable;
use super::error::EntityError;
use super::face_attributes::{face_attributes, oriented};
use super::file::{StepFile, name_of};
use super::implicit_bounds::revolved_between_ends;
use super::layers::Layers;
use super::roots::{Root, RootKind};
use super::space::{Reader, Space};
use super::styles::Colors;
use super::surface_table::SharedSurface;
use crate::model::{Brep, BrepFace, LostEntity, LostKind, Shell, Solid};
use crate::part21::{Keyword, ParamError, Record};
use partprobe_shape::Color;
use std::sync::Arc;

/// Builds the faces of a file, root by root.
pub(super) struct TopologyBuilder<'s, 'a> {
    pub(super) source: &'s StepFile<'a>,
    pub(super) colors: &'s Colors,
    pub(super) layers: &'s Layers,
    pub(super) brep: Brep,
    pub(super) edges: EdgeTable,
    /// For each instance, whether it was already read as a face.
    pub(super) is_read: Vec<bool>,
    /// For each instance, whether it became a face.
    pub(super) has_face: Vec<bool>,
    root: u32,
    /// The component of the current root.
    pub(super) component: u32,
    /// The current root and its representation. Styles and layers may name them instead of a shell.
    owners: [Option<u64>; 2],
}

/// The product and the position of a root.
pub(super) struct Site {
    pub(super) product_name: Option<String>,
    pub(super) space: Space,
    pub(super) component: u32,
    pub(super) representation: Option<u64>,
}

/// The data of its shell that reading a face needs in addition to its entity.
#[derive(Clone, Copy)]
pub(super) struct ShellContext<'s, 'a> {
    pub(super) reader: Reader<'s, 'a>,
    pub(super) shell: u32,
    /// The color of the shell, of its body or of its representation, for faces without their own.
    pub(super) color: Option<Color>,
    /// The layer of the shell, of its body or of its representation, for faces without their own.
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

    /// Returns the B-Rep.
    pub(super) fn finish(mut self) -> Brep {
        (self.brep.vertices, self.brep.edges) = self.edges.into_lists();
        self.brep
    }

    /// Adds the faces of a root, and returns whether there were any. If all its faces have already been read, it adds nothing.
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
        let (record, flipped, faces) =
            match oriented(self.source, id).and_then(|(record, flipped)| {
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

    /// Adds a shell without faces, and returns the context of its faces. `id` is the number by which its owner names the shell.
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

    /// Adds the bounded surfaces of a geometric set as faces. Curves and points are not faces.
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

    /// Adds the items that a representation lists without a body around them. All faces together make one shell, and each listed
    /// shell makes another one.
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

    /// The faces that a shell names. A reference with too large a number is an error in the list.
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
                // If the list breaks off or names something else, the shell is faulty.
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

    fn add_face(&mut self, context: ShellContext<'s, 'a>, id: u64, shell_flipped: bool) {
        let (record, face_flipped) = match oriented(self.source, id) {
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
        let attributes = face_attributes(self.source, record)?;
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

    fn surface(&mut self, reader: Reader<'s, 'a>, id: u64) -> Result<SharedSurface, EntityError> {
        self.edges.surfaces.surface(&reader, self.root, id)
    }

    pub(super) fn lose(&mut self, kind: LostKind, step_id: u64, error: &EntityError) {
        self.brep.lost.push(LostEntity {
            kind,
            step_id,
            reason: error.reason(step_id),
        });
    }
}

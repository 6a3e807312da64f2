//! Defines the labels of one shape without its geometry, and makes columns of them.
//!
//! A carrier goes in. The result has `#` numbers, types, labels and angles, but no coordinates and no areas.

use crate::table::{Column, ListCell, Table, TableError, Text};
use partprobe_carrier::{Carrier, FaceType, LabelLayer, STEP_PARTS, STEP_PARTS_RAW};
use std::collections::{BTreeMap, BTreeSet};

/// The prefix of the name of a column with a further layer of labels. The name of its source follows.
const LAYER_PREFIX: &str = "face_label_";

/// The labels of the faces and shared edges of one shape.
///
/// All lists of faces have one entry per face, and all lists of edges one per shared edge, in the order of the carrier.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeLabels {
    /// The `#` number of each face.
    pub step_id: Vec<u64>,
    /// The occurrence of its product that each face belongs to.
    pub instance: Vec<i32>,
    /// The primitive type of each face.
    pub face_type: Vec<FaceType>,
    /// The type after recognition of primitives that are written as splines.
    pub canonical_type: Vec<FaceType>,
    /// The part of each face before small parts were absorbed.
    pub part: Vec<i32>,
    /// The part of each face after small parts were absorbed.
    pub label: Vec<i32>,
    /// The labels by further sources, by the name of the source.
    pub layers: BTreeMap<String, Vec<i32>>,
    /// The two faces of each shared edge, the lower index first.
    pub edge_faces: Vec<[i32; 2]>,
    /// The dihedral angle of each shared edge, in degrees from 0 to 180. It is `None` if it is undefined.
    pub phi_deg: Vec<Option<f64>>,
}

/// The names of the layers that get their own columns: all except the two that every carrier with a B-Rep has.
#[must_use]
pub fn layers_of(carrier: &Carrier) -> BTreeSet<String> {
    further_layers(carrier)
        .map(|(name, _)| name.clone())
        .collect()
}

fn further_layers(carrier: &Carrier) -> impl Iterator<Item = (&String, &LabelLayer)> {
    carrier
        .layers()
        .iter()
        .filter(|(name, _)| ![STEP_PARTS, STEP_PARTS_RAW].contains(&name.as_str()))
}

impl ShapeLabels {
    /// The labels of a carrier.
    #[must_use]
    pub fn of(carrier: &Carrier) -> Self {
        let (faces, edges) = (&carrier.graph().faces, &carrier.graph().edges);
        Self {
            step_id: faces.iter().map(|face| face.step_id).collect(),
            instance: faces
                .iter()
                .map(|face| face.instance.cast_signed())
                .collect(),
            face_type: faces.iter().map(|face| face.face_type).collect(),
            canonical_type: faces.iter().map(|face| face.canonical_type).collect(),
            part: carrier.raw_part_of_face().to_vec(),
            label: carrier.part_of_face().to_vec(),
            layers: further_layers(carrier)
                .map(|(name, layer)| (name.clone(), layer.of_face().to_vec()))
                .collect(),
            edge_faces: edges
                .iter()
                .map(|edge| edge.faces.map(u32::cast_signed))
                .collect(),
            phi_deg: edges
                .iter()
                .map(|edge| Some(edge.phi).filter(|phi| phi.is_finite()))
                .collect(),
        }
    }
}

/// The columns of faces: `face_step_id`, `face_instance`, `face_type`, `face_canonical_type`, `face_part`, `face_label`, and
/// `face_label_<source>` for each of these layers. A row without labels, or without a layer, has no list.
#[must_use]
pub fn face_columns(rows: &[Option<&ShapeLabels>], layers: &BTreeSet<String>) -> Vec<Column> {
    let types = |types: &[FaceType]| {
        let name = |kind: &FaceType| Some(Text::Borrowed(kind.name()));
        types.iter().map(name).collect()
    };
    let mut columns = vec![
        lists("face_step_id", rows, |row| full(&row.step_id)),
        lists("face_instance", rows, |row| full(&row.instance)),
        lists("face_type", rows, |row| types(&row.face_type)),
        lists("face_canonical_type", rows, |row| {
            types(&row.canonical_type)
        }),
        lists("face_part", rows, |row| full(&row.part)),
        lists("face_label", rows, |row| full(&row.label)),
    ];
    for layer in layers {
        let of_row = |row: &ShapeLabels| row.layers.get(layer).map(|list| full(list));
        let cells = rows.iter().map(|row| row.and_then(of_row));
        columns.push(Column::of_lists(format!("{LAYER_PREFIX}{layer}"), cells));
    }
    columns
}

/// The columns of shared edges: `edge_face_a` and `edge_face_b`, which count the faces of the row from 0, and `edge_phi_deg`.
#[must_use]
pub fn edge_columns(rows: &[Option<&ShapeLabels>]) -> Vec<Column> {
    let side = |row: &ShapeLabels, side: usize| {
        let of_edge = |faces: &[i32; 2]| Some(faces[side]);
        row.edge_faces.iter().map(of_edge).collect()
    };
    vec![
        lists("edge_face_a", rows, |row| side(row, 0)),
        lists("edge_face_b", rows, |row| side(row, 1)),
        lists("edge_phi_deg", rows, |row| row.phi_deg.clone()),
    ]
}

fn lists<T: crate::Element>(
    name: &str,
    rows: &[Option<&ShapeLabels>],
    list: impl Fn(&ShapeLabels) -> Vec<Option<T>>,
) -> Column {
    Column::of_lists(name, rows.iter().map(|row| row.map(&list)))
}

pub(crate) fn full<T: Copy>(values: &[T]) -> Vec<Option<T>> {
    values.iter().copied().map(Some).collect()
}

/// The reason why a row of a table is not the labels of a shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LabelRowError {
    /// A column is missing or of another type.
    #[error(transparent)]
    Table(#[from] TableError),
    /// An element is missing in a list without missing elements.
    #[error("row {row}: an element of `{column}` is missing")]
    MissingElement {
        /// The row, counted from 0.
        row: usize,
        /// The column.
        column: &'static str,
    },
    /// A face has a type that this version does not know.
    #[error("row {row}: `{name}` is not a primitive type")]
    FaceType {
        /// The row, counted from 0.
        row: usize,
        /// The text that should name a type.
        name: String,
    },
    /// Lists that describe the same faces or edges have different lengths.
    #[error("row {row}: the lists of faces or edges have different lengths")]
    Lengths {
        /// The row, counted from 0.
        row: usize,
    },
}

/// The labels in the columns that [`face_columns`] and [`edge_columns`] made. A row without labels gives `None`.
///
/// # Errors
/// If a column is missing, or the lists of a row contradict each other.
pub fn labels_of_table(mut table: Table) -> Result<Vec<Option<ShapeLabels>>, LabelRowError> {
    let names = table.columns().iter().map(Column::name);
    let layer_names: Vec<String> = names
        .filter_map(|name| name.strip_prefix(LAYER_PREFIX))
        .map(str::to_owned)
        .collect();
    let mut layers = Vec::new();
    for layer in layer_names {
        let lists = table.take_lists::<i32>(&format!("{LAYER_PREFIX}{layer}"))?;
        layers.push((layer, lists.into_iter()));
    }
    let mut ints = |name| Ok::<_, TableError>(table.take_lists::<i32>(name)?.into_iter());
    let (mut instance, mut part) = (ints("face_instance")?, ints("face_part")?);
    let mut label = ints("face_label")?;
    let (mut edge_a, mut edge_b) = (ints("edge_face_a")?, ints("edge_face_b")?);
    let mut face_type = table.take_lists::<Text>("face_type")?.into_iter();
    let mut canonical = table.take_lists::<Text>("face_canonical_type")?.into_iter();
    let mut phi = table.take_lists::<f64>("edge_phi_deg")?.into_iter();
    let step_ids = table.take_lists::<u64>("face_step_id")?;

    let mut rows = Vec::with_capacity(step_ids.len());
    for (row, step_id) in step_ids.into_iter().enumerate() {
        let next_layer = |(name, lists): &mut (String, std::vec::IntoIter<ListCell<i32>>)| {
            Some((name.clone(), lists.next().flatten()?))
        };
        let row_layers: Vec<_> = layers.iter_mut().filter_map(next_layer).collect();
        let labels = ShapeLabels {
            instance: complete_list(row, "face_instance", instance.next().flatten())?,
            part: complete_list(row, "face_part", part.next().flatten())?,
            label: complete_list(row, "face_label", label.next().flatten())?,
            face_type: types_of(row, "face_type", face_type.next().flatten())?,
            canonical_type: types_of(row, "face_canonical_type", canonical.next().flatten())?,
            layers: row_layers
                .into_iter()
                .map(|(name, list)| Ok((name, complete_list(row, "face_label_…", Some(list))?)))
                .collect::<Result<_, LabelRowError>>()?,
            edge_faces: pairs(
                complete_list(row, "edge_face_a", edge_a.next().flatten())?,
                complete_list(row, "edge_face_b", edge_b.next().flatten())?,
            )
            .ok_or(LabelRowError::Lengths { row })?,
            phi_deg: phi.next().flatten().unwrap_or_default(),
            step_id: complete_list(row, "face_step_id", step_id.clone())?,
        };
        if !labels.fits() {
            return Err(LabelRowError::Lengths { row });
        }
        rows.push(step_id.is_some().then_some(labels));
    }
    Ok(rows)
}

impl ShapeLabels {
    /// Whether all lists of faces have the same length, and all lists of edges too.
    fn fits(&self) -> bool {
        let n_faces = self.step_id.len();
        let of_faces = [
            self.instance.len(),
            self.face_type.len(),
            self.canonical_type.len(),
            self.part.len(),
            self.label.len(),
        ];
        let layers = self.layers.values().map(Vec::len);
        of_faces.into_iter().chain(layers).all(|n| n == n_faces)
            && self.phi_deg.len() == self.edge_faces.len()
    }
}

fn complete_list<T>(
    row: usize,
    column: &'static str,
    list: ListCell<T>,
) -> Result<Vec<T>, LabelRowError> {
    let missing = LabelRowError::MissingElement { row, column };
    let list: Option<Vec<T>> = list.unwrap_or_default().into_iter().collect();
    list.ok_or(missing)
}

fn types_of(
    row: usize,
    column: &'static str,
    list: ListCell<Text>,
) -> Result<Vec<FaceType>, LabelRowError> {
    let parse = |name: Text| {
        name.parse().map_err(|_| LabelRowError::FaceType {
            row,
            name: name.into_owned(),
        })
    };
    complete_list(row, column, list)?
        .into_iter()
        .map(parse)
        .collect()
}

fn pairs(first: Vec<i32>, second: Vec<i32>) -> Option<Vec<[i32; 2]>> {
    let is_even = first.len() == second.len();
    is_even.then(|| {
        let pairs = first.into_iter().zip(second);
        pairs.map(|(a, b)| [a, b]).collect()
    })
}

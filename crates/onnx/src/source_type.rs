//! Defines the type `onnx` of label sources: it opens a model and labels shapes with it.

use crate::clustering::{Algorithm, Clustered, Rows};
use crate::error::OnnxError;
use crate::features::FeatureModel;
use crate::items::Items;
use crate::model::Model;
use crate::runtime::open_model;
use crate::settings::{KEYS, Per, Settings};
use partprobe_carrier::{Carrier, Embeddings, Partition, sha256_hex, weld};
use partprobe_imports::{
    Import, ImportError, ImportType, JoinProblem, JoinReport, JoinedLabels, parameters,
};
use partprobe_sources::{Origin, PieceLabels, Pieces, SourceContext, SourceLabels, welded_borders};
use partprobe_transfer::{Limits, NearestPoint, Query, for_all};
use std::sync::Arc;

/// Labels that are clusters of the features of an ONNX model.
pub const ONNX: ImportType = ImportType {
    name: "onnx",
    description: "clusters of the features that an ONNX model gives to points or triangles",
    keys: KEYS,
    check_values: |context| Settings::of(context).map(drop),
    make: |context| {
        let path = context.parameter("path").unwrap_or_default();
        let settings = Settings::of(context)?;
        let bytes = parameters::files(context)?
            .read(path)
            .map_err(|error| ImportError::Unreadable(error.to_string()))?;
        let model_hash = sha256_hex(&bytes);
        let model = open_model(path, bytes, context.parameter("runtime")).map_err(unusable)?;
        Ok(Box::new(ModelLabels {
            path: path.to_owned(),
            model_hash,
            model: FeatureModel::new(path, model, settings).map_err(unusable)?,
        }))
    },
};

/// The number of sampled points if neither the config nor the model gives it.
const N_POINTS: usize = 4096;

/// A small triangle gets the features of the nearest point whose normal differs by at most this angle, if there is one.
const MAX_ANGLE_DEG: f64 = 45.0;

/// Labels by a model of a runtime of your own, with the keys of the type [`ONNX`].
///
/// `model_hash` identifies the model, for example by the SHA-256 of its bytes.
///
/// # Errors
/// If a key or value is not possible, or the tensors of the model do not fit them.
pub fn labels_by_model(
    model: Box<dyn Model>,
    model_hash: &str,
    context: &SourceContext,
) -> Result<Box<dyn Import>, ImportError> {
    ONNX.check(context)?;
    let path = context.parameter("path").unwrap_or_default();
    let settings = Settings::of(context)?;
    Ok(Box::new(ModelLabels {
        path: path.to_owned(),
        model_hash: model_hash.to_owned(),
        model: FeatureModel::new(path, model, settings).map_err(unusable)?,
    }))
}

fn unusable(error: OnnxError) -> ImportError {
    ImportError::Unreadable(error.to_string())
}

struct ModelLabels {
    path: String,
    model_hash: String,
    model: FeatureModel,
}

/// The features of a shape, and the elements to which they belong.
struct Featured {
    items: Items,
    features: Embeddings,
    /// The mesh whose triangles get labels.
    pieces: Pieces,
    /// The triangles of that mesh.
    triangles: Items,
}

impl Featured {
    /// The features of the items at these indices.
    fn features_of(&self, items: &[u32]) -> Embeddings {
        self.features
            .rows_at(items.iter().map(|&item| item as usize))
    }
}

impl Import for ModelLabels {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let featured = self
            .featured(carrier)
            .map_err(|error| JoinProblem::Refused(error.to_string()))?;
        let n_items = featured.items.len();
        let dim = featured.features.dim();
        let labeled = match self.algorithm() {
            Algorithm::KMeans => self.by_items(carrier, featured),
            Algorithm::Ward => self.by_triangles(carrier, featured),
            Algorithm::WardFaces => self.by_faces(carrier, featured),
        }?;

        let per = match self.model.settings().per {
            Per::Point { .. } => "points",
            Per::Triangle { .. } => "triangles",
        };
        let rule = &labeled.rule;
        let runtime = self.model.runtime();
        let report = JoinReport {
            entries: vec![self.path.clone()],
            by: format!("{rule} on {dim} features of {n_items} {per} from {runtime}"),
            items: labeled.items,
            n_items: labeled.of_items.len(),
            n_matched: labeled.of_items.len(),
            ..JoinReport::default()
        };
        let origin = Origin {
            content_hash: labeled.content_hash(&self.model_hash),
            join: report.to_string(),
        };
        Ok(JoinedLabels {
            labels: labeled.labels.with_origin(origin),
            report,
        })
    }

    fn labels_faces(&self) -> bool {
        self.algorithm() == Algorithm::WardFaces
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(vec![self.path.clone()])
    }

    /// The model is for all shapes.
    fn entries_of(&self, _id: &str) -> Vec<String> {
        vec![self.path.clone()]
    }
}

/// The labels of a shape.
struct Labeled {
    labels: SourceLabels,
    /// The label of each small triangle or face.
    of_items: Vec<u32>,
    /// The kind of elements that have labels.
    items: &'static str,
    /// The way in which the number of clusters was found.
    rule: String,
}

impl Labeled {
    /// SHA-256 of the model and the labels. It detects another model, and a runtime that gives other labels.
    fn content_hash(&self, model_hash: &str) -> String {
        let labels = self.of_items.iter().flat_map(|label| label.to_le_bytes());
        let bytes: Vec<u8> = model_hash.bytes().chain(labels).collect();
        sha256_hex(&bytes)
    }
}

impl ModelLabels {
    fn algorithm(&self) -> Algorithm {
        self.model.settings().clustering.algorithm
    }

    fn featured(&self, carrier: &Carrier) -> Result<Featured, OnnxError> {
        let mesh = carrier.mesh();
        let settings = self.model.settings();
        let pieces = match settings.per {
            Per::Triangle { refined: false } => Pieces::whole(mesh),
            _ => Pieces::of(mesh),
        };
        let triangles = Items::of_triangles(&pieces.fine);
        if triangles.len() == 0 {
            return Err(OnnxError::NoSurface("it has no triangle".to_owned()));
        }
        let items = match settings.per {
            Per::Triangle { .. } => triangles.clone(),
            Per::Point { n_points } => {
                let n_points = n_points.or(self.model.n_rows()).unwrap_or(N_POINTS);
                Items::of_points(mesh, n_points, settings.seed, &carrier.meta().id)?
            }
        };
        let features = self.model.features(&items, &mesh.vertices)?;
        Ok(Featured {
            items,
            features,
            pieces,
            triangles,
        })
    }

    fn clustered(&self, rows: Rows, neighbors: &[[u32; 2]], carrier: &Carrier) -> Clustered {
        let settings = self.model.settings();
        let n_parts = carrier.n_parts();
        let key = &carrier.meta().id;
        settings
            .clustering
            .of_rows(rows, neighbors, n_parts, settings.seed, key)
    }

    /// Clusters the items with features. A small triangle has the cluster of the nearest point.
    fn by_items(&self, carrier: &Carrier, featured: Featured) -> Result<Labeled, JoinProblem> {
        let item_of_triangle = self.item_of_triangle(&featured)?;
        let rows = Rows {
            features: featured.features,
            weights: featured.items.areas,
        };
        let clustered = self.clustered(rows, &[], carrier);
        let clusters: Vec<u32> = item_of_triangle
            .iter()
            .map(|&item| clustered.of_row[item as usize])
            .collect();
        Ok(labeled_triangles(
            carrier,
            featured.pieces,
            &clusters,
            clustered.rule,
        ))
    }

    /// Clusters small triangles, each with the features of the nearest point.
    fn by_triangles(&self, carrier: &Carrier, featured: Featured) -> Result<Labeled, JoinProblem> {
        let item_of_triangle = self.item_of_triangle(&featured)?;
        let borders = welded_borders(&weld(&featured.pieces.fine));
        let neighbors: Vec<[u32; 2]> = borders.iter().map(|border| border.between).collect();
        let rows = Rows {
            features: featured.features_of(&item_of_triangle),
            weights: featured.triangles.areas,
        };
        let clustered = self.clustered(rows, &neighbors, carrier);
        let Clustered { of_row, rule } = clustered;
        Ok(labeled_triangles(carrier, featured.pieces, &of_row, rule))
    }

    /// Clusters B-Rep faces, each with the mean features of its small triangles by area.
    fn by_faces(&self, carrier: &Carrier, featured: Featured) -> Result<Labeled, JoinProblem> {
        let item_of_triangle = self.item_of_triangle(&featured)?;
        let n_faces = carrier.graph().faces.len();
        let face_of_triangle = &featured.pieces.fine.tri_face;
        let of_triangles = featured.features_of(&item_of_triangle);
        let rows = mean_rows(
            &of_triangles,
            &featured.triangles.areas,
            face_of_triangle,
            n_faces,
        );
        let edges = carrier.graph().edges.iter();
        let neighbors: Vec<[u32; 2]> = edges.map(|edge| edge.faces).collect();
        let clustered = self.clustered(rows, &neighbors, carrier);
        let labels: Vec<i32> = clustered.of_row.iter().map(|&label| label as i32).collect();
        Ok(Labeled {
            labels: SourceLabels::on_faces(carrier.mesh(), &labels),
            of_items: clustered.of_row,
            items: "faces",
            rule: clustered.rule,
        })
    }

    /// The item whose features each small triangle gets: the triangle itself, or the nearest point whose normal agrees, or
    /// otherwise the nearest point.
    fn item_of_triangle(&self, featured: &Featured) -> Result<Vec<u32>, JoinProblem> {
        let triangles = &featured.triangles;
        if let Per::Triangle { .. } = self.model.settings().per {
            return Ok((0..).take(triangles.len()).collect());
        }
        let items = &featured.items;
        let nearest = NearestPoint::new(&items.positions, &items.normals)
            .map_err(|error| JoinProblem::Refused(error.to_string()))?;
        let queries: Vec<Query> = triangles
            .positions
            .iter()
            .zip(&triangles.normals)
            .map(|(&position, &normal)| Query {
                position,
                normal: Some(normal),
            })
            .collect();
        let agreeing = Limits::NONE.with_normals_within(MAX_ANGLE_DEG);
        let find = |query: &Query| {
            let found = nearest.nearest(query, &agreeing);
            found.or_else(|| nearest.nearest(query, &Limits::NONE))
        };
        // A triangle without a finite position has no nearest point. It gets the first one.
        let found = for_all(&queries, |query| find(query).map_or(0, |found| found.item));
        Ok(found)
    }
}

/// Labels of small triangles, numbered by the lowest triangle of each, as labels of the carrier.
fn labeled_triangles(carrier: &Carrier, pieces: Pieces, clusters: &[u32], rule: String) -> Labeled {
    let labels = Partition::from_keys(clusters).parts().to_vec();
    let of_pieces = PieceLabels {
        pieces,
        labels: labels.clone(),
    };
    Labeled {
        labels: SourceLabels::on_points(carrier.mesh(), Arc::new(of_pieces)),
        of_items: labels,
        items: "small triangles",
        rule,
    }
}

/// The weighted mean of the rows of each group, and its weight. A group without weight has zeros.
fn mean_rows(
    features: &Embeddings,
    weights: &[f64],
    group_of_row: &[u32],
    n_groups: usize,
) -> Rows {
    let dim = features.dim();
    let mut sums = vec![0.0; n_groups * dim];
    let mut totals = vec![0.0; n_groups];
    for ((row, &weight), &group) in features.rows().zip(weights).zip(group_of_row) {
        let group = group as usize;
        totals[group] += weight;
        let sums = &mut sums[group * dim..][..dim];
        for (sum, &value) in sums.iter_mut().zip(row) {
            *sum += weight * f64::from(value);
        }
    }
    let values = sums
        .iter()
        .enumerate()
        .map(|(at, &sum)| {
            let total: f64 = totals[at / dim];
            if total > 0.0 {
                (sum / total) as f32
            } else {
                0.0
            }
        })
        .collect();
    Rows {
        features: Embeddings::new(dim, values).unwrap_or_else(|_| features.clone()),
        weights: totals,
    }
}

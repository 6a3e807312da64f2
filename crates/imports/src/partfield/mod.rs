//! Imports the results of PartField's clustering scripts: type `partfield`.
//!
//! A run writes `cluster_out/<uid>_0_<KK>.npy` with one label per triangle for each level KK, and `input_<uid>_0.ply` with the
//! mesh whose triangles they are. That mesh was moved and scaled into a cube, and neither the translation nor the scale is
//! stored. They are computed from the bounding boxes, and the result is verified on the surface. For shapes that `partprobe
//! export partfield-input` wrote, the map of the export contains them, and labels are joined by index.

mod agreement;
mod export_map;
mod level;
mod pose;
mod tiles;

use crate::entries::{Content, Entries, Entry};
use crate::import::{Import, ImportError, JoinProblem, JoinedLabels, named};
use crate::import_type::{ImportType, ParameterKey};
use crate::mesh::{JoinBy, Joining, Overlap, mesh_of, triangle_labels};
use crate::parameters;
use crate::shape_key::ShapeKey;
use agreement::agreement_by_area;
use export_map::{ExportMap, ExportedShape};
use level::Level;
use partprobe_carrier::{Carrier, Mesh, sha256_hex};
use partprobe_sources::SourceContext;
use tiles::Tiles;

/// Results of PartField.
pub(crate) const PARTFIELD: ImportType = ImportType {
    name: "partfield",
    description: "result folders of PartField: one level of its clusters per triangle",
    keys: &[
        ParameterKey::required(
            "path",
            "the folder with cluster_out/<uid>_0_<KK>.npy and input_<uid>_0.ply",
        ).path(),
        ParameterKey::optional(
            "map",
            "the folder that `partprobe export partfield-input` wrote, if the shapes were exported by it",
        ).path(),
        ParameterKey::optional(
            "k",
            "which level to take: max, match (as many as the shape has STEP parts), best (optimistic: the one that agrees best with the STEP parts), or a number",
        ),
        ParameterKey::optional(
            "max_distance",
            "how far the nearest triangle may be, as a fraction of the diagonal (0.01)",
        ),
        ParameterKey::optional(
            "max_angle_deg",
            "how far normals may differ, in degrees (45)",
        ),
    ],
    check_values: |context| Settings::of(context).map(drop),
    make: open_partfield,
};

struct PartField {
    levels: Entries<()>,
    meshes: Entries<()>,
    map: Option<ExportMap>,
    settings: Settings,
}

/// The level that is taken, and the settings of the join.
struct Settings {
    level: Level,
    joining: Joining,
}

impl Settings {
    fn of(context: &SourceContext) -> Result<Self, ImportError> {
        Ok(Self {
            level: Level::of(context.parameter("k").unwrap_or("max"))?,
            joining: Joining {
                by: JoinBy::Auto,
                tolerance: 1e-5,
                max_distance: parameters::number(context, "max_distance", 0.0..=1.0, 0.01)?,
                max_angle_deg: parameters::number(context, "max_angle_deg", 0.0..=180.0, 45.0)?,
            },
        })
    }
}

fn open_partfield(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
    let settings = Settings::of(context)?;
    let files = parameters::files(context)?;
    let path = context.parameter("path").unwrap_or_default();
    let one_file = |path: &str, _: Vec<u8>| -> Result<Vec<Entry<()>>, String> {
        Err(format!("{path} is a file; give the result folder"))
    };
    Ok(Box::new(PartField {
        levels: Entries::at(
            path,
            files.clone(),
            |below| Some(uid_and_level(below)?.0),
            one_file,
        )?,
        meshes: Entries::at(path, files.clone(), key_of_mesh, one_file)?,
        map: context
            .parameter("map")
            .map(|folder| ExportMap::open(folder, files))
            .transpose()?,
        settings,
    }))
}

/// The shape and the level of `<uid>_0_<KK>.npy`.
fn uid_and_level(below: &str) -> Option<(ShapeKey, u32)> {
    let name = below.rsplit('/').next()?.strip_suffix(".npy")?;
    let (uid, level) = name.rsplit_once("_0_")?;
    Some((ShapeKey::of_step_path(uid), level.parse().ok()?))
}

/// The shape of `input_<uid>_0.ply`.
fn key_of_mesh(below: &str) -> Option<ShapeKey> {
    let name = below.rsplit('/').next()?;
    let uid = name.strip_prefix("input_")?.strip_suffix("_0.ply")?;
    Some(ShapeKey::of_step_path(uid))
}

/// One level of the clusters of a shape.
struct LevelFile {
    level: u32,
    path: String,
}

/// The considered levels of a shape, and the names of all its levels.
struct LevelFiles {
    wanted: Vec<LevelFile>,
    names: Vec<String>,
}

/// The relation of the triangles of PartField's mesh to the carrier.
enum MeshRelation {
    /// Each triangle is a tile of one triangle of the carrier.
    Tiles(Tiles),
    /// They are related by position. The note describes how the position was found.
    Position { mesh: Mesh, note: String },
}

impl PartField {
    /// The file of the requested level, or the files of all levels if the best one is requested.
    fn level_files(&self, name: &str, n_parts: usize) -> Result<LevelFiles, JoinProblem> {
        let found = self.levels.of_shape(name)?;
        let names = found.iter().map(|entry| entry.name.clone()).collect();
        let mut paths: Vec<(u32, String)> = Vec::new();
        for entry in found {
            if let (Some((_, level)), Content::File(path)) =
                (uid_and_level(&entry.name), &entry.content)
            {
                paths.push((level, path.clone()));
            }
        }
        paths.sort();
        if let Some(pair) = paths.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(JoinProblem::Refused(format!(
                "two files hold level {}: {}; give the folder of one run",
                pair[0].0,
                named(&[pair[0].1.clone(), pair[1].1.clone()])
            )));
        }
        let levels: Vec<u32> = paths.iter().map(|&(level, _)| level).collect();
        let candidates = self.settings.level.candidates(&levels, n_parts)?;
        let wanted = paths
            .into_iter()
            .filter(|(level, _)| candidates.contains(level));
        let wanted = wanted
            .map(|(level, path)| LevelFile { level, path })
            .collect();
        Ok(LevelFiles { wanted, names })
    }

    fn mesh_path(&self, name: &str) -> Result<String, JoinProblem> {
        let found = self
            .meshes
            .of_shape(name)
            .map_err(|problem| match problem {
                JoinProblem::NoLabels => JoinProblem::Refused(
                    "there are clusters, but no input_<uid>_0.ply, which has their triangles"
                        .to_owned(),
                ),
                other => other,
            })?;
        crate::entries::one_path(&found)
    }

    /// The relation of the triangles of the mesh to the carrier. The bytes of the map that determine it are appended to `bytes`.
    fn relation(
        &self,
        carrier: &Carrier,
        exported: Option<&ExportedShape<'_>>,
        mesh: Mesh,
        bytes: &mut Vec<u8>,
    ) -> Result<MeshRelation, JoinProblem> {
        let mut reason = None;
        if let (Some(map), Some(exported)) = (&self.map, exported) {
            let parents = map.parents_file(exported)?;
            bytes.extend(&parents);
            match Tiles::new(
                carrier,
                exported.in_carrier_position(&mesh),
                exported.parents(&parents)?,
            ) {
                Ok(tiles) => return Ok(MeshRelation::Tiles(tiles)),
                Err(found) => reason = Some(found),
            }
        }
        let (mesh, rotation) = pose::in_carrier_position(carrier, mesh)?;
        let note = match reason {
            Some(reason) => format!("{rotation} (not by the map: {reason})"),
            None => rotation.to_owned(),
        };
        Ok(MeshRelation::Position { mesh, note })
    }

    /// Joins one level, and measures its agreement with the STEP parts.
    fn join_level(
        &self,
        shape: &ShapeResults<'_>,
        path: &str,
    ) -> Result<(f64, JoinedLabels), JoinProblem> {
        let mut bytes = self.levels.read(path)?;
        let labels = triangle_labels(path, &bytes, Overlap::Refuse)
            .map_err(|reason| JoinProblem::Unreadable(format!("{path}: {reason}")))?;
        bytes.extend(&shape.of_mesh);
        let hash = sha256_hex(&bytes);
        let entries = shape.names.clone();
        let carrier = shape.carrier;
        let parts = carrier.triangle_labels();

        let (agreement, joined) = match &shape.relation {
            MeshRelation::Tiles(tiles) => {
                let joined = tiles.join(carrier, labels.clone(), entries, hash)?;
                let parts = tiles.labels_of_parents(parts.of_triangle());
                (agreement_by_area(tiles.mesh(), &labels, &parts), joined)
            }
            MeshRelation::Position { mesh, .. } => {
                let joined =
                    self.settings
                        .joining
                        .join(carrier, &labels, Some(mesh), entries, hash)?;
                let own = joined.labels.of_triangles().of_triangle();
                let agreement = agreement_by_area(carrier.mesh(), own, parts.of_triangle());
                (agreement, joined)
            }
        };
        Ok((agreement.unwrap_or_default(), joined))
    }
}

/// The data that all levels of a shape have in common.
struct ShapeResults<'a> {
    carrier: &'a Carrier,
    relation: MeshRelation,
    /// The bytes that determine the way. They are hashed together with the labels.
    of_mesh: Vec<u8>,
    /// The names of all levels.
    names: Vec<String>,
}

impl Import for PartField {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let unreadable =
            |path: &str, reason: String| JoinProblem::Unreadable(format!("{path}: {reason}"));
        let id = &carrier.meta().id;
        let exported = self.map.as_ref().map(|map| map.shape(id)).transpose()?;
        let name = exported.as_ref().map_or(id.as_str(), |shape| shape.name);
        let files = self.level_files(name, carrier.n_parts())?;
        let mesh_path = self.mesh_path(name)?;
        let mut of_mesh = self.meshes.read(&mesh_path)?;
        let mesh =
            mesh_of(&mesh_path, &of_mesh).map_err(|reason| unreadable(&mesh_path, reason))?;
        let relation = self.relation(carrier, exported.as_ref(), mesh, &mut of_mesh)?;
        let shape = ShapeResults {
            carrier,
            relation,
            of_mesh,
            names: files.names,
        };

        let n_levels = files.wanted.len();
        let mut best: Option<(f64, u32, JoinedLabels)> = None;
        for LevelFile { level, path } in files.wanted {
            let (agreement, joined) = self.join_level(&shape, &path)?;
            if best.as_ref().is_none_or(|(most, ..)| agreement > *most) {
                best = Some((agreement, level, joined));
            }
        }
        let (_, level, joined) = best.ok_or(JoinProblem::NoLabels)?;
        let optimistic = match self.settings.level {
            Level::Best => format!(", optimistic: the best of {n_levels} by the STEP parts"),
            _ => String::new(),
        };
        let note = match &shape.relation {
            MeshRelation::Tiles(_) => "",
            MeshRelation::Position { note, .. } => note,
        };
        let by = format!("{}, level {level}{note}{optimistic}", joined.report.by);
        Ok(joined.with_join_text(by))
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self.levels.names())
    }

    fn entries_of(&self, id: &str) -> Vec<String> {
        let exported = self.map.as_ref().and_then(|map| map.shape(id).ok());
        let name = exported.as_ref().map_or(id, |shape| shape.name);
        self.levels.names_of_shape(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_name_their_shape_and_level() {
        let (key, level) = uid_and_level("cluster_out/bolt_0_07.npy").unwrap();
        assert_eq!((key, level), (ShapeKey::of_step_path("bolt"), 7));
        assert!(uid_and_level("part_feat_bolt_0_batch.npy").is_none());
        assert_eq!(
            key_of_mesh("x/input_bolt_0.ply"),
            Some(ShapeKey::of_step_path("bolt"))
        );
        assert!(key_of_mesh("feat_pca_bolt_0.ply").is_none());
    }
}

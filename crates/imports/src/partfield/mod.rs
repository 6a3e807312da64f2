//! Imports what PartField's clustering scripts leave on disk: type `partfield`.
//!
//! A run writes `cluster_out/<uid>_0_<KK>.npy` with a label per triangle for each level KK, and
//! `input_<uid>_0.ply` with the mesh whose triangles they are. That mesh was moved and scaled into a cube, and neither the
//! move nor the scale is stored. They are found again from the bounding boxes, and the result is verified on the surface.

mod agreement;
mod level;
mod pose;

use crate::entries::{Content, Entries, Entry};
use crate::import::{Import, ImportError, JoinProblem, JoinedLabels, named};
use crate::import_type::{ImportType, ParameterKey};
use crate::mesh::{JoinBy, Joining, Overlap, mesh_of, triangle_labels};
use crate::parameters;
use crate::shape_key::ShapeKey;
use agreement::agreement_by_area;
use level::Level;
use partprobe_carrier::{Carrier, Mesh, sha256_hex};
use partprobe_sources::SourceContext;

/// Results of PartField.
pub(crate) const PARTFIELD: ImportType = ImportType {
    name: "partfield",
    description: "result folders of PartField: one level of its clusters per triangle",
    keys: &[
        ParameterKey {
            name: "path",
            description: "the folder with cluster_out/<uid>_0_<KK>.npy and input_<uid>_0.ply",
            is_required: true,
        },
        ParameterKey {
            name: "k",
            description: "which level to take: max, match (as many as the shape has STEP parts), best (optimistic: the one that agrees best with the STEP parts), or a number",
            is_required: false,
        },
        ParameterKey {
            name: "max_distance",
            description: "how far the nearest triangle may be, as a fraction of the diagonal (0.01)",
            is_required: false,
        },
        ParameterKey {
            name: "max_angle_deg",
            description: "how far normals may differ, in degrees (45)",
            is_required: false,
        },
    ],
    make: open_partfield,
};

struct PartField {
    levels: Entries<()>,
    meshes: Entries<()>,
    level: Level,
    joining: Joining,
}

fn open_partfield(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
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
        meshes: Entries::at(path, files, key_of_mesh, one_file)?,
        level: Level::of(context.parameter("k").unwrap_or("max"))?,
        joining: Joining {
            by: JoinBy::Auto,
            tolerance: 1e-5,
            max_distance: parameters::number(context, "max_distance", 0.0..=1.0, 0.01)?,
            max_angle_deg: parameters::number(context, "max_angle_deg", 0.0..=180.0, 45.0)?,
        },
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

impl PartField {
    /// The file of the level that is asked for; those of all levels if the best one is.
    fn level_paths(&self, carrier: &Carrier) -> Result<Vec<(u32, String)>, JoinProblem> {
        let found = self.levels.of_shape(&carrier.meta().id)?;
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
        let candidates = self.level.candidates(&levels, carrier.n_parts())?;
        paths.retain(|(level, _)| candidates.contains(level));
        Ok(paths)
    }

    fn mesh_path(&self, id: &str) -> Result<String, JoinProblem> {
        let found = self.meshes.of_shape(id).map_err(|problem| match problem {
            JoinProblem::NoLabels => JoinProblem::Refused(
                "there are clusters, but no input_<uid>_0.ply, which has their triangles"
                    .to_owned(),
            ),
            other => other,
        })?;
        crate::entries::one_path(&found)
    }
}

impl PartField {
    fn join_level(
        &self,
        carrier: &Carrier,
        path: &str,
        mesh: &Mesh,
        of_mesh: &[u8],
    ) -> Result<JoinedLabels, JoinProblem> {
        let mut bytes = self.levels.read(path)?;
        let labels = triangle_labels(path, &bytes, Overlap::Refuse)
            .map_err(|reason| JoinProblem::Unreadable(format!("{path}: {reason}")))?;
        bytes.extend(of_mesh);
        let entries = vec![path.to_owned()];
        self.joining
            .join(carrier, &labels, Some(mesh), entries, sha256_hex(&bytes))
    }
}

impl Import for PartField {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let unreadable =
            |path: &str, reason: String| JoinProblem::Unreadable(format!("{path}: {reason}"));
        let paths = self.level_paths(carrier)?;
        let mesh_path = self.mesh_path(&carrier.meta().id)?;
        let of_mesh = self.meshes.read(&mesh_path)?;
        let mesh =
            mesh_of(&mesh_path, &of_mesh).map_err(|reason| unreadable(&mesh_path, reason))?;
        let (mesh, rotation) = pose::in_place(carrier, mesh)?;

        let reference = carrier.triangle_labels();
        let n_levels = paths.len();
        let mut best: Option<(f64, u32, JoinedLabels)> = None;
        for (level, path) in paths {
            let joined = self.join_level(carrier, &path, &mesh, &of_mesh)?;
            let own = joined.labels.of_triangles().of_triangle();
            let agreement = agreement_by_area(carrier.mesh(), own, reference.of_triangle());
            let agreement = agreement.unwrap_or_default();
            if best.as_ref().is_none_or(|(most, ..)| agreement > *most) {
                best = Some((agreement, level, joined));
            }
        }
        let (_, level, joined) = best.ok_or(JoinProblem::NoLabels)?;
        let optimistic = match self.level {
            Level::Best => format!(", optimistic: the best of {n_levels} by the STEP parts"),
            _ => String::new(),
        };
        let by = format!("{}, level {level}{rotation}{optimistic}", joined.report.by);
        Ok(joined.with_way(by))
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self.levels.names())
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

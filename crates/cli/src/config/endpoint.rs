//! Reads `[[endpoints]]`: conditions other than those of the training under which a run's backbones are scored again.

use super::training_tables::Voxels;
use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One condition. Settings that it does not have are those of the run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EndpointConfig {
    /// The name of its folder and of its tables.
    pub(crate) name: String,
    /// A labeled data set other than the run's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) data: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "EndpointShapes::is_default")]
    pub(crate) shapes: EndpointShapes,
    /// With `shapes = "all"`: the largest number of shapes, or 0 for all.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) max_shapes: usize,
    /// With `shapes = "all"`: the smallest number of STEP parts of a shape.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) min_parts: usize,
    /// With `shapes = "all"`: the largest number of STEP parts of a shape, or 0 for any number.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) max_parts: usize,
    /// The label sources to score against. If there are none, those of the run are used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) references: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) normals: Option<EndpointNormals>,
    /// The standard deviation of the noise on each coordinate, as a fraction of the diagonal.
    #[serde(default, skip_serializing_if = "is_none")]
    pub(crate) position_noise: f64,
    /// The standard deviation of each of the two tilts of a normal, in degrees.
    #[serde(default, skip_serializing_if = "is_none")]
    pub(crate) normal_noise_deg: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) voxels: Option<Voxels>,
    /// A label source with classes of faces, for which embeddings are probed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) probe: Option<String>,
}

/// Which shapes an endpoint has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EndpointShapes {
    /// The test shapes of the run.
    #[default]
    Test,
    /// All shapes of the endpoint's own data set that differ from each other and from all training shapes.
    All,
}

impl EndpointShapes {
    fn is_default(&self) -> bool {
        *self == Self::Test
    }
}

/// Which normals the points of an endpoint have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EndpointNormals {
    /// Those of the triangles.
    Triangle,
    /// Those of the true surface, which the data set must have.
    Analytic,
    /// None: all are zero.
    None,
}

impl EndpointConfig {
    /// Refuses invalid values.
    ///
    /// # Errors
    /// If a value is out of its range, or keys contradict each other.
    pub(crate) fn check(&self) -> Result<()> {
        let name = &self.name;
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-';
        ensure!(
            !name.is_empty() && name.bytes().all(is_plain),
            "endpoints: the name `{name}` must consist of letters, digits and `-`"
        );
        let ranges = [
            ("position_noise", self.position_noise, 1.0),
            ("normal_noise_deg", self.normal_noise_deg, 180.0),
        ];
        for (key, value, most) in ranges {
            ensure!(
                (0.0..=most).contains(&value),
                "endpoints.{name}.{key} must be from 0 to {most}"
            );
        }
        ensure!(
            self.shapes == EndpointShapes::Test || self.data.is_some(),
            "endpoints.{name}.shapes = \"all\" needs a data set of its own; set endpoints.{name}.data"
        );
        let limits = [
            ("max_shapes", self.max_shapes),
            ("min_parts", self.min_parts),
            ("max_parts", self.max_parts),
        ];
        for (key, limit) in limits {
            ensure!(
                limit == 0 || self.shapes == EndpointShapes::All,
                "endpoints.{name}.{key} chooses shapes, but test shapes are not chosen again; set endpoints.{name}.shapes = \"all\" or \
                 leave it out"
            );
        }
        ensure!(
            self.max_parts == 0 || self.min_parts <= self.max_parts,
            "endpoints.{name}: min_parts = {} is above max_parts = {}",
            self.min_parts,
            self.max_parts
        );
        ensure!(
            self.normals != Some(EndpointNormals::None) || self.normal_noise_deg == 0.0,
            "endpoints.{name} has no normals, so they can have no noise; leave one of the two out"
        );
        Ok(())
    }
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
fn is_none(noise: &f64) -> bool {
    *noise == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: Option<&str>) {
        let message = toml::from_str::<EndpointConfig>(text)
            .map_err(|error| error.to_string())
            .and_then(|endpoint| endpoint.check().map_err(|error| error.to_string()));
        match expected {
            None => assert_eq!(message, Ok(())),
            Some(part) => assert!(
                message.clone().is_err_and(|message| message.contains(part)),
                "{message:?}"
            ),
        }
    }

    #[test]
    fn impossible_values_are_refused() {
        check("name = \"T1\"\ndata = \"t1\"", None);
        check(
            "name = \"noisy\"\nposition_noise = 0.01\nnormal_noise_deg = 10",
            None,
        );
        check("name = \"a/b\"", Some("must consist of letters"));
        check(
            "name = \"n\"\nposition_noise = 2.0",
            Some("position_noise must be from 0 to 1"),
        );
        check("name = \"n\"\nshapes = \"all\"", Some("needs a data set"));
        check(
            "name = \"n\"\ndata = \"d\"\nshapes = \"all\"\nmin_parts = 2\nmax_parts = 20",
            None,
        );
        check(
            "name = \"n\"\ndata = \"d\"\nshapes = \"all\"\nmin_parts = 9\nmax_parts = 4",
            Some("is above max_parts = 4"),
        );
        check(
            "name = \"n\"\ndata = \"d\"\nmax_parts = 20",
            Some("test shapes are not chosen again"),
        );
        check(
            "name = \"n\"\nnormals = \"none\"\nnormal_noise_deg = 1",
            Some("has no normals"),
        );
        check("name = \"n\"\nnoise = 1", Some("unknown field"));
    }
}

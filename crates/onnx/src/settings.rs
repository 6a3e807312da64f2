//! Reads the keys of `[sources.NAME]` with `type = "onnx"` into checked values.

use crate::clustering::{Algorithm, ClusterCount, Clustering, Metric};
use crate::frame::Frame;
use crate::layout::Layout;
use partprobe_imports::parameters::{choice, integer_parameter, number};
use partprobe_imports::{ImportError, ParameterKey};
use partprobe_sources::SourceContext;

/// The largest number of clusters that may be requested.
const MAX_CLUSTERS: u64 = 1000;

/// Every key, for `partprobe check labels` and messages.
pub(crate) const KEYS: &[ParameterKey] = &[
    ParameterKey::required("path", "the model, an ONNX file").path(),
    ParameterKey::optional(
        "runtime",
        "what runs it: the path of the library of ONNX Runtime (the one that is found)",
    )
    .path(),
    ParameterKey::optional(
        "per",
        "what has features: point (of a sample) or triangle (point)",
    ),
    ParameterKey::optional(
        "points",
        "with per = point: how many points are sampled (as many as the model is made for, or 4096)",
    ),
    ParameterKey::optional(
        "triangles",
        "with per = triangle: refined (the small triangles of the refined mesh) or plain (refined)",
    ),
    ParameterKey::optional("positions", "the input that gets positions"),
    ParameterKey::optional("normals", "the input that gets unit normals"),
    ParameterKey::optional(
        "areas",
        "the input that gets areas, as fractions of the surface",
    ),
    ParameterKey::optional("count", "the input that gets the number of rows, as int64"),
    ParameterKey::optional("features", "the output with the features (the only one)"),
    ParameterKey::optional(
        "layout",
        "rows or columns: how inputs are laid out (what their dimensions say)",
    ),
    ParameterKey::optional(
        "features_layout",
        "rows or columns: how the features are laid out (what their dimensions say)",
    ),
    ParameterKey::optional(
        "frame",
        "where positions are: unit-box, unit-sphere or millimeters (unit-box)",
    ),
    ParameterKey::optional(
        "factor",
        "what positions in this frame are multiplied by (1)",
    ),
    ParameterKey::optional(
        "cluster",
        "ward (over small triangles), ward-faces (over B-Rep faces) or k-means (ward)",
    ),
    ParameterKey::optional(
        "k",
        "how many clusters: a number, silhouette, or match (as many as the shape has STEP parts) (silhouette)",
    ),
    ParameterKey::optional(
        "max_k",
        "with k = silhouette: the largest number that is tried (20)",
    ),
    ParameterKey::optional("metric", "cosine or euclidean: what is compared (cosine)"),
    ParameterKey::optional("seed", "what the sample and k-means are drawn with (0)"),
];

/// The items that have features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Per {
    /// The points of a sample. With `None`, their number is the one for which the model is made.
    Point { n_points: Option<usize> },
    /// Triangles, of the refined mesh or of the carrier's own.
    Triangle { refined: bool },
}

/// The inputs that get data. Two of them may be the same.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct InputNames {
    pub(crate) positions: Option<String>,
    pub(crate) normals: Option<String>,
    pub(crate) areas: Option<String>,
    pub(crate) count: Option<String>,
}

/// All keys except `path` and `runtime`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(crate) per: Per,
    pub(crate) inputs: InputNames,
    pub(crate) features: Option<String>,
    pub(crate) layout: Option<Layout>,
    pub(crate) features_layout: Option<Layout>,
    pub(crate) frame: Frame,
    pub(crate) factor: f64,
    pub(crate) clustering: Clustering,
    pub(crate) seed: u64,
}

impl Settings {
    /// Reads the keys.
    ///
    /// # Errors
    /// If a value is not possible, or a key has no meaning together with the others.
    pub(crate) fn of(context: &SourceContext) -> Result<Self, ImportError> {
        let text = |key: &str| context.parameter(key).map(str::to_owned);
        Ok(Self {
            per: per(context)?,
            inputs: InputNames {
                positions: text("positions"),
                normals: text("normals"),
                areas: text("areas"),
                count: text("count"),
            },
            features: text("features"),
            layout: layout(context, "layout")?,
            features_layout: layout(context, "features_layout")?,
            frame: choice(
                context,
                "frame",
                &[
                    ("unit-box", Frame::UnitBox),
                    ("unit-sphere", Frame::UnitSphere),
                    ("millimeters", Frame::Millimeters),
                ],
            )?,
            factor: number(context, "factor", 1e-9..=1e9, 1.0)?,
            clustering: clustering(context)?,
            seed: integer_parameter(context, "seed", 0..=u64::MAX, 0)?,
        })
    }
}

fn per(context: &SourceContext) -> Result<Per, ImportError> {
    let is_point = choice(context, "per", &[("point", true), ("triangle", false)])?;
    if is_point {
        ensure_unset(context, "triangles", "unset if `per` is `point`")?;
        let n_points = match context.parameter("points") {
            None => None,
            Some(_) => Some(integer_parameter(context, "points", 1..=10_000_000, 0)? as usize),
        };
        return Ok(Per::Point { n_points });
    }
    ensure_unset(context, "points", "unset if `per` is `triangle`")?;
    let refined = choice(context, "triangles", &[("refined", true), ("plain", false)])?;
    Ok(Per::Triangle { refined })
}

fn ensure_unset(
    context: &SourceContext,
    key: &'static str,
    expected: &str,
) -> Result<(), ImportError> {
    match context.parameter(key) {
        None => Ok(()),
        Some(value) => Err(ImportError::Value {
            key,
            value: value.to_owned(),
            expected: expected.to_owned(),
        }),
    }
}

fn layout(context: &SourceContext, key: &'static str) -> Result<Option<Layout>, ImportError> {
    choice(
        context,
        key,
        &[
            ("auto", None),
            ("rows", Some(Layout::Rows)),
            ("columns", Some(Layout::Columns)),
        ],
    )
}

fn clustering(context: &SourceContext) -> Result<Clustering, ImportError> {
    let max_k = integer_parameter(context, "max_k", 2..=MAX_CLUSTERS, 20)? as usize;
    Ok(Clustering {
        algorithm: choice(
            context,
            "cluster",
            &[
                ("ward", Algorithm::Ward),
                ("ward-faces", Algorithm::WardFaces),
                ("k-means", Algorithm::KMeans),
            ],
        )?,
        count: cluster_count(context.parameter("k").unwrap_or("silhouette"), max_k)?,
        metric: choice(
            context,
            "metric",
            &[("cosine", Metric::Cosine), ("euclidean", Metric::Euclidean)],
        )?,
    })
}

fn cluster_count(text: &str, max_k: usize) -> Result<ClusterCount, ImportError> {
    match (text, text.parse::<u64>()) {
        ("silhouette", _) => Ok(ClusterCount::Silhouette { max_k }),
        ("match", _) => Ok(ClusterCount::Match),
        (_, Ok(k)) if (1..=MAX_CLUSTERS).contains(&k) => Ok(ClusterCount::Fixed(k as usize)),
        _ => Err(ImportError::Value {
            key: "k",
            value: text.to_owned(),
            expected: format!("silhouette, match, or a whole number from 1 to {MAX_CLUSTERS}"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(parameters: &[(&str, &str)]) -> Result<Settings, String> {
        let context = parameters
            .iter()
            .fold(SourceContext::default(), |context, &(key, value)| {
                context.with(key, value)
            });
        Settings::of(&context).map_err(|error| error.to_string())
    }

    #[test]
    fn an_empty_table_has_the_defaults_of_the_reference() {
        let settings = settings(&[]).unwrap();
        assert_eq!(settings.per, Per::Point { n_points: None });
        assert_eq!(settings.frame, Frame::UnitBox);
        assert_eq!(
            settings.clustering,
            Clustering {
                algorithm: Algorithm::Ward,
                count: ClusterCount::Silhouette { max_k: 20 },
                metric: Metric::Cosine,
            }
        );
    }

    #[test]
    fn values_that_are_not_possible_are_named() {
        for (parameters, expected) in [
            (
                &[("per", "face")][..],
                "`per` is `face`; it must be one of point, triangle",
            ),
            (
                &[("points", "0")],
                "`points` is `0`; it must be a whole number from 1 to 10000000",
            ),
            (
                &[("k", "0")],
                "`k` is `0`; it must be silhouette, match, or a whole number from 1 to 1000",
            ),
            (
                &[("k", "best")],
                "`k` is `best`; it must be silhouette, match, or a whole number from 1 to 1000",
            ),
            (
                &[("per", "triangle"), ("points", "9")],
                "`points` is `9`; it must be unset if `per` is `triangle`",
            ),
            (
                &[("layout", "rowwise")],
                "`layout` is `rowwise`; it must be one of auto, rows, columns",
            ),
        ] {
            assert_eq!(settings(parameters), Err(expected.to_owned()));
        }
    }
}

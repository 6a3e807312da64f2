//! Defines sources outside the library, through its public API alone.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot label its own part has failed"
)]

use partprobe_carrier::{Carrier, Labels, cross, keyed_rng, sample_by_area, subtract};
use partprobe_label::{LabelOptions, label};
use partprobe_sources::{
    LabelSource, SOURCES, SourceContext, SourceError, SourceFactory, SourceLabels, source_among,
};

/// Whether a triangle looks up or down.
struct Upward;

impl LabelSource for Upward {
    fn name(&self) -> &str {
        "upward"
    }

    fn labels(&self, carrier: &Carrier, _seed: u64) -> Result<SourceLabels, SourceError> {
        Ok(SourceLabels::on_plain(above(carrier, 0.0)))
    }
}

/// A similar source as a factory with a number: the smallest z component of a triangle's normal, in percent of its length.
const STEEP: SourceFactory = SourceFactory::numbered_rule(
    "steep-<PERCENT>",
    "triangles whose normal has at least this much of z",
    0..=100,
    |carrier, percent, _| {
        Ok(SourceLabels::on_plain(above(
            carrier,
            f64::from(percent) / 100.0,
        )))
    },
);

fn above(carrier: &Carrier, least: f64) -> Labels {
    let mesh = carrier.mesh();
    let is_above = |triangle| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = cross(subtract(b, a), subtract(c, a));
        i32::from(normal[2] > least * partprobe_carrier::norm(normal))
    };
    let raw: Vec<i32> = (0..mesh.triangles.len()).map(is_above).collect();
    Labels::compacted(&raw)
}

fn block() -> Carrier {
    let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
    let file = label(text.as_bytes(), "block", &LabelOptions::default()).unwrap();
    file.shapes.into_iter().next().unwrap().carrier.unwrap()
}

/// Points of the block and their labels by a source; labels must follow the normals' z.
#[track_caller]
fn check(source: &dyn LabelSource) {
    let carrier = block();
    let labels = source.labels(&carrier, 0).unwrap();
    assert_eq!(labels.n_labels(), 2, "{}", source.name());

    let mut rng = keyed_rng(0, &["test"]);
    let sample = sample_by_area(
        carrier.mesh(),
        500,
        partprobe_carrier::NormalKind::Triangle,
        &mut rng,
    )
    .unwrap();
    let expected: Vec<i32> = sample
        .normals
        .iter()
        .map(|normal| i32::from(normal[2] > 0.5))
        .collect();
    assert_eq!(
        labels.label_of_points(&sample).unwrap(),
        expected,
        "{}",
        source.name()
    );
}

#[test]
fn a_custom_trait_object_labels_points() {
    check(&Upward);
}

#[test]
fn a_custom_factory_is_listed_with_the_built_in_ones() {
    let context = SourceContext::default();
    let named = |name| source_among(SOURCES.iter().chain([&STEEP]), name, &context);
    check(&*named("steep-50").unwrap());

    assert_eq!(
        named("brep-face")
            .unwrap()
            .labels(&block(), 0)
            .unwrap()
            .n_labels(),
        6
    );
    let error = named("steep-101").err().unwrap();
    assert_eq!(
        error,
        SourceError::Number {
            name: "steep-101".to_owned(),
            min: 0,
            max: 100
        }
    );
    assert!(named("sleep").err().unwrap().to_string().ends_with(
        "steep-<PERCENT>, step-merged-to-<SOURCE>, step-split-to-<SOURCE>, capped-<SOURCE>"
    ));
}

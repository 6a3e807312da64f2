//! Labels a mesh or a point cloud by the labels in its file: `given`.

use crate::factory::SourceFactory;
use crate::source::{SourceError, SourceLabels};
use partprobe_carrier::{Carrier, STEP_PARTS};

/// The labels of the file that a mesh or a cloud was read from.
pub(crate) const GIVEN: SourceFactory = SourceFactory::rule(
    partprobe_carrier::GIVEN,
    "the labels that a mesh or a point cloud came with; a STEP file has none",
    labels,
)
.labeling_faces();

fn labels(carrier: &Carrier, _: u64) -> Result<SourceLabels, SourceError> {
    let unfit = |reason: String| SourceError::Unfit { reason };
    let layer = carrier.layer(partprobe_carrier::GIVEN).ok_or_else(|| {
        unfit(format!(
            "a STEP file gives no labels of its own; use another source, for example `{STEP_PARTS}`"
        ))
    })?;
    if layer.n_labels() == 0 {
        return Err(unfit(format!(
            "the file of this {} came without labels; use another source, for example `normal-kmeans-20`",
            carrier.kind().name()
        )));
    }
    Ok(SourceLabels::on_faces(carrier.mesh(), layer.of_face()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::tests::{carrier_of_faces, plain_face};
    use crate::{SOURCES, source_named};
    use partprobe_carrier::{GivenShape, ShapeKind, carrier_of_given};

    const SQUARE: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    fn carrier(triangles: &[[u32; 3]], labels: &[i32]) -> Carrier {
        let shape = GivenShape {
            vertices: SQUARE.to_vec(),
            triangles: triangles.to_vec(),
            labels: labels.to_vec(),
            ..GivenShape::default()
        };
        carrier_of_given(shape, "a", "00").unwrap()
    }

    #[test]
    fn triangles_and_points_have_the_labels_that_they_came_with() {
        let of = |carrier: &Carrier| {
            let labels = source_named("given").unwrap().labels(carrier, 0);
            labels
                .map(|labels| labels.of_triangles().of_triangle().to_vec())
                .map_err(|error| error.to_string())
        };
        let two = [[0, 1, 2], [0, 2, 3]];
        assert_eq!(of(&carrier(&two, &[7, 3])), Ok(vec![1, 0]));
        assert_eq!(of(&carrier(&[], &[7, 3, -1, 7])), Ok(vec![1, 0, -1, 1]));
        let refusal = of(&carrier(&two, &[])).unwrap_err();
        assert!(refusal.contains("came without labels"), "{refusal}");
        let refusal = of(&carrier_of_faces(vec![plain_face()])).unwrap_err();
        assert!(refusal.contains("use another source"), "{refusal}");
    }

    /// Every source either labels every triangle, or says which kind of shape it needs.
    #[test]
    fn a_source_refuses_the_shapes_that_lack_what_it_needs() {
        let shapes = [
            carrier_of_faces(vec![plain_face(), plain_face()]),
            carrier(&[[0, 1, 2], [0, 2, 3]], &[0, 1]),
            carrier(&[], &[0, 0, 1, 1]),
        ];
        assert_eq!(
            shapes.each_ref().map(Carrier::kind),
            [ShapeKind::Brep, ShapeKind::Mesh, ShapeKind::Cloud]
        );
        for factory in SOURCES {
            let number = factory.numbers().map(|numbers| numbers.start().to_string());
            let stem = factory.pattern().split('<').next().unwrap();
            let name = format!("{stem}{}", number.unwrap_or_default());
            let source = source_named(&name).unwrap();
            for shape in &shapes {
                let labels = source.labels(shape, 0);
                let is_refused = factory.needs() < shape.kind();
                assert_eq!(
                    matches!(labels, Err(SourceError::Kind { .. })),
                    is_refused,
                    "{name}: {labels:?}"
                );
                if let Ok(labels) = labels {
                    let n_triangles = shape.mesh().triangles.len();
                    assert_eq!(labels.of_triangles().of_triangle().len(), n_triangles);
                }
            }
        }
    }
}

//! Measures one shape: the labels of each source on three tessellations, and their agreement at the same points.

use super::carriers::{TESSELLATIONS, TessellatedShape};
use crate::config::{NormalConfig, SampleConfig};
use crate::points::points_of;
use crate::verbs::compare::positions_of;
use anyhow::Result;
use partprobe_carrier::{Carrier, PointSample};
use partprobe_eval::{AgreementRow, CeilingScores, RefusedShape, agreement};
use partprobe_sources::{BoxedSource, SourceLabels};
use partprobe_transfer::{
    Channel, LabeledSurface, Limits, Query, Surface, Target, carry, queries_of,
};

/// The settings with which every shape is measured.
pub(super) struct Consistency {
    pub(super) sources: Vec<BoxedSource>,
    /// The τ_min of the settings.
    pub(super) tau_min: u32,
    pub(super) n_points: usize,
    pub(super) seed: u64,
}

/// The measurements of one shape.
#[derive(Debug, Default)]
pub(super) struct MeasuredShape {
    pub(super) rows: Vec<AgreementRow>,
    pub(super) refused: Vec<RefusedShape>,
}

/// The points of a shape, on its first tessellation.
pub(super) struct FixedPoints<'a> {
    carrier: &'a Carrier,
    sample: PointSample,
    queries: Vec<Query>,
}

/// The name of a comparison of T0 with another tessellation.
pub(super) fn pair_name(tessellation: &str, tau_min: u32) -> String {
    if tau_min == 0 {
        format!("{tessellation}-no-tau-min")
    } else {
        tessellation.to_owned()
    }
}

/// Whether the labels of a source depend on τ_min. Other sources do not use the labels of the faces.
fn depends_on_tau_min(source: &str) -> bool {
    source == "canonical" || source.starts_with("step-")
}

impl Consistency {
    /// Compares T0 with T1 and T2 by every source, with and without absorption of small parts.
    ///
    /// # Errors
    /// If the shape has no area, or its carriers contradict themselves.
    pub(super) fn measure(
        &self,
        tessellated: &TessellatedShape,
        shape: &str,
        group: &str,
    ) -> Result<MeasuredShape> {
        let mut measured = MeasuredShape::default();
        let mut thresholds = vec![self.tau_min, 0];
        thresholds.dedup();
        for (idx, tau_min) in thresholds.into_iter().enumerate() {
            let carriers = tessellated.at_tau_min(tau_min)?;
            let points = self.points(&carriers[0])?;
            for source in &self.sources {
                if idx > 0 && !depends_on_tau_min(source.name()) {
                    continue;
                }
                match self.rows_of(source, &carriers, &points, tau_min, [shape, group]) {
                    Ok(rows) => measured.rows.extend(rows),
                    Err(error) => measured.refused.push(RefusedShape {
                        source: source.name().to_owned(),
                        shape: shape.to_owned(),
                        reason: format!("{error:#}"),
                    }),
                }
            }
        }
        measured.refused.dedup();
        Ok(measured)
    }

    /// The points at which all tessellations of a shape are compared.
    ///
    /// # Errors
    /// If the mesh has no area.
    pub(super) fn points<'a>(&self, carrier: &'a Carrier) -> Result<FixedPoints<'a>> {
        let config = SampleConfig {
            n_points: self.n_points,
            normals: NormalConfig::Triangle,
            seed: self.seed,
        };
        let sample = points_of(&carrier.meta().id, carrier, &config)?;
        Ok(FixedPoints {
            carrier,
            queries: queries_of(&sample),
            sample,
        })
    }

    fn rows_of(
        &self,
        source: &BoxedSource,
        carriers: &[Carrier],
        points: &FixedPoints<'_>,
        tau_min: u32,
        [shape, group]: [&str; 2],
    ) -> Result<Vec<AgreementRow>> {
        let first = source.labels(&carriers[0], self.seed)?;
        let own = first.label_of_points(&points.sample)?;
        let positions = positions_of(
            points.carrier,
            &points.sample,
            first.of_triangles().of_triangle(),
        );
        let through_itself = points.labels_on(&carriers[0], &first)?;
        let ceiling = CeilingScores::of(&agreement(&through_itself, &own, positions.lists())?);

        let mut rows = Vec::new();
        for ((name, _), carrier) in TESSELLATIONS.into_iter().zip(carriers).skip(1) {
            let labels = source.labels(carrier, self.seed)?;
            let carried = points.labels_on(carrier, &labels)?;
            rows.push(AgreementRow {
                shape: shape.to_owned(),
                group: group.to_owned(),
                source: source.name().to_owned(),
                channel: pair_name(name, tau_min),
                agreement: agreement(&carried, &own, positions.lists())?,
                ceiling,
            });
        }
        Ok(rows)
    }
}

impl FixedPoints<'_> {
    /// The label that each point has on the nearest triangle of a tessellation.
    ///
    /// # Errors
    /// If a coordinate of the mesh is not a finite number.
    pub(super) fn labels_on(&self, carrier: &Carrier, labels: &SourceLabels) -> Result<Vec<i32>> {
        let surface = Surface::of_mesh(carrier.mesh())?;
        let labeled = LabeledSurface::new(surface, labels.of_triangles().of_triangle())?;
        let target = Target {
            surface: Surface::of_mesh(self.carrier.mesh())?,
            points: &self.queries,
            triangles: &self.sample.triangles,
        };
        Ok(carry(Channel::NnSurface, &labeled, &target, &Limits::NONE)?.labels)
    }
}

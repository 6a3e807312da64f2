//! Measures one shape: its points, its labels by each source through each channel, and their agreement with the
//! reference.

use crate::config::{NormalConfig, SampleConfig};
use crate::points::points_of;
use anyhow::Result;
use partprobe_carrier::{Carrier, PointSample, weld};
use partprobe_eval::{
    AgreementRow, BorderTree, CeilingScores, PointPositions, RefusedShape, ShapeAgreement,
    TriangleTree, agreement, label_borders,
};
use partprobe_sources::{BoxedSource, SourceLabels};
use partprobe_transfer::{
    Channel, LabeledSurface, Limits, Query, Surface, Target, carry, queries_of,
};

/// The settings with which every shape is measured.
pub(super) struct Comparison {
    pub(super) reference: BoxedSource,
    pub(super) sources: Vec<BoxedSource>,
    pub(super) channels: Vec<Channel>,
    pub(super) n_points: usize,
    pub(super) seed: u64,
}

/// The measurements of one shape, or of all shapes together.
#[derive(Debug, Default)]
pub(super) struct MeasuredShape {
    pub(super) rows: Vec<AgreementRow>,
    pub(super) refused: Vec<RefusedShape>,
    /// The number of damaged carriers.
    pub(super) n_damaged: usize,
}

/// A shape that cannot be compared at all, and the source that refuses it, if there is one.
#[derive(Debug)]
pub(super) struct MeasureError {
    pub(super) source: Option<String>,
    pub(super) reason: String,
}

/// The positions of points on a shape, with all measures of them.
pub(crate) struct Positions {
    border_distance: Vec<f64>,
    thickness: Vec<f64>,
}

impl Positions {
    /// The lists that the agreement needs.
    pub(crate) fn lists(&self) -> PointPositions<'_> {
        PointPositions {
            border_distance: &self.border_distance,
            thickness: &self.thickness,
        }
    }
}

impl Comparison {
    /// Compares all sources on one shape. `group` is the group of related shapes.
    ///
    /// # Errors
    /// If the shape has no area, or the reference refuses it.
    pub(super) fn measure(
        &self,
        carrier: &Carrier,
        group: &str,
    ) -> Result<MeasuredShape, MeasureError> {
        let id = &carrier.meta().id;
        let sample = self.sample(carrier).map_err(without_source)?;
        let reference = self.reference.labels(carrier, self.seed);
        let reference = reference.map_err(|error| self.refused_by_reference(error))?;
        let own = reference.label_of_points(&sample);
        let own = own.map_err(|error| self.refused_by_reference(error))?;

        let shape = ComparedShape {
            carrier,
            surface: Surface::of_mesh(carrier.mesh()).map_err(without_source)?,
            queries: queries_of(&sample),
            positions: positions_of(carrier, &sample, reference.of_triangles().of_triangle()),
            sample,
            own,
        };
        let mut ceilings = Vec::new();
        for &channel in &self.channels {
            let through = shape.agreement(&reference, channel);
            let through = through.map_err(|error| self.refused_by_reference(error))?;
            ceilings.push(CeilingScores::of(&through));
        }

        let mut measured = MeasuredShape::default();
        for source in &self.sources {
            match self.rows_of(source, &shape, &ceilings, group) {
                Ok(rows) => measured.rows.extend(rows),
                Err(error) => measured.refused.push(RefusedShape {
                    source: source.name().to_owned(),
                    shape: id.clone(),
                    reason: format!("{error:#}"),
                }),
            }
        }
        Ok(measured)
    }

    /// One row per channel.
    fn rows_of(
        &self,
        source: &BoxedSource,
        shape: &ComparedShape<'_>,
        ceilings: &[CeilingScores],
        group: &str,
    ) -> Result<Vec<AgreementRow>> {
        let labels = source.labels(shape.carrier, self.seed)?;
        let mut rows = Vec::new();
        for (&channel, &ceiling) in self.channels.iter().zip(ceilings) {
            rows.push(AgreementRow {
                shape: shape.carrier.meta().id.clone(),
                group: group.to_owned(),
                source: source.name().to_owned(),
                channel: channel.name().to_owned(),
                agreement: shape.agreement(&labels, channel)?,
                ceiling,
            });
        }
        Ok(rows)
    }

    fn sample(&self, carrier: &Carrier) -> Result<PointSample, partprobe_carrier::SampleError> {
        let config = SampleConfig {
            n_points: self.n_points,
            normals: NormalConfig::Triangle,
            seed: self.seed,
        };
        points_of(&carrier.meta().id, carrier, &config)
    }

    fn refused_by_reference(&self, error: impl std::fmt::Display) -> MeasureError {
        MeasureError {
            source: Some(self.reference.name().to_owned()),
            reason: error.to_string(),
        }
    }
}

fn without_source(error: impl std::fmt::Display) -> MeasureError {
    MeasureError {
        source: None,
        reason: error.to_string(),
    }
}

/// A shape with its points and the reference's labels of them.
struct ComparedShape<'a> {
    carrier: &'a Carrier,
    surface: Surface<'a>,
    sample: PointSample,
    queries: Vec<Query>,
    positions: Positions,
    own: Vec<i32>,
}

impl ComparedShape<'_> {
    /// The agreement of labels that come through a channel with the reference's own labels.
    fn agreement(&self, labels: &SourceLabels, channel: Channel) -> Result<ShapeAgreement> {
        let of_points = self.through(labels, channel)?;
        Ok(agreement(&of_points, &self.own, self.positions.lists())?)
    }

    /// The labels of the points. With `index`, a rule that divides triangles is evaluated at each point.
    fn through(&self, labels: &SourceLabels, channel: Channel) -> Result<Vec<i32>> {
        if channel == Channel::Index {
            return Ok(labels.label_of_points(&self.sample)?);
        }
        let labeled = LabeledSurface::new(self.surface, labels.of_triangles().of_triangle())?;
        let target = Target {
            surface: self.surface,
            points: &self.queries,
            triangles: &self.sample.triangles,
        };
        Ok(carry(channel, &labeled, &target, &Limits::NONE)?.labels)
    }
}

/// The distance of points to the borders between labels of triangles, and the thickness below them, as fractions of the
/// diagonal.
pub(crate) fn positions_of(carrier: &Carrier, sample: &PointSample, labels: &[i32]) -> Positions {
    let mesh = carrier.mesh();
    let diagonal = mesh.diagonal();
    let borders = BorderTree::new(&label_borders(&weld(mesh), labels));
    let triangles = TriangleTree::new(mesh);
    let fraction = |length: Option<f64>| length.map_or(f64::NAN, |length| length / diagonal);
    let distance = |point: &[f32; 3]| fraction(borders.distance(point.map(f64::from)));
    let thickness = |(point, normal): (&[f32; 3], &[f32; 3])| {
        fraction(triangles.thickness(point.map(f64::from), normal.map(f64::from)))
    };
    Positions {
        border_distance: sample.points.iter().map(distance).collect(),
        thickness: sample
            .points
            .iter()
            .zip(&sample.normals)
            .map(thickness)
            .collect(),
    }
}

//! Defines the surface of a network in millimeters, with points on it and the nearest points of the reference.

use crate::geometry::Reference;
use crate::network::Network;
use crate::surface::{Resolution, SurfaceError, surface};
use partprobe_carrier::{Mesh, NormalKind, Point, PointSample, keyed_rng, sample_by_area};
use partprobe_transfer::Nearest;

/// A reconstructed surface.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The triangles, in millimeters.
    pub mesh: Mesh,
    /// The label of each triangle, at its centroid. All labels are 0 without a head.
    pub label_of_triangle: Vec<i32>,
    /// Points on it, in millimeters.
    pub sample: PointSample,
    /// The label of each point.
    pub labels: Vec<u32>,
    /// The nearest triangle of the reference to each point.
    pub nearest: Vec<Nearest>,
}

impl Reconstruction {
    /// Extracts the surface of a network, and draws `n_points` points on it. `key` names the shape.
    ///
    /// # Errors
    /// If the network has no surface.
    pub fn new(
        network: &Network,
        reference: &Reference,
        resolution: Resolution,
        n_points: usize,
        key: &str,
    ) -> Result<Self, SurfaceError> {
        let mut mesh = surface(network, resolution)?;
        let frame = reference.frame();
        let centroids: Vec<[f32; 3]> = (0..mesh.triangles.len())
            .map(|triangle| partprobe_carrier::centroid(mesh.corners(triangle)).map(|x| x as f32))
            .collect();
        let label_of_triangle = network
            .labels(&centroids)
            .into_iter()
            .map(|label| label as i32)
            .collect();
        for vertex in &mut mesh.vertices {
            *vertex = frame.to_millimeters(*vertex);
        }
        let rng = &mut keyed_rng(0, &["implicit", "reconstruction", key]);
        let sample = sample_by_area(&mesh, n_points, NormalKind::Triangle, rng)
            .map_err(|_| SurfaceError::Empty)?;
        let labels = network.labels(&reference.in_frame(&sample));
        let nearest = reference.nearest(&positions(&sample));
        // A reference has at least one triangle, so every point has a nearest one.
        let nearest: Vec<Nearest> = nearest.into_iter().flatten().collect();
        Ok(Self {
            mesh,
            label_of_triangle,
            sample,
            labels,
            nearest,
        })
    }

    /// The points with the nearest triangles of the reference instead of their own. A label source can label these points.
    #[must_use]
    pub fn projected(&self) -> PointSample {
        PointSample {
            triangles: self.nearest.iter().map(|nearest| nearest.item).collect(),
            ..self.sample.clone()
        }
    }
}

/// Points on the reference, in millimeters. `key` names the shape, and `index` distinguishes samples of one shape.
#[must_use]
pub fn reference_sample(
    reference: &Reference,
    n_points: usize,
    key: &str,
    index: u32,
) -> PointSample {
    let rng = &mut keyed_rng(u64::from(index), &["implicit", "reference", key]);
    // A reference has a volume, so it has an area.
    sample_by_area(reference.mesh(), n_points, NormalKind::Triangle, rng).unwrap_or_default()
}

pub(super) fn positions(sample: &PointSample) -> Vec<Point> {
    sample
        .points
        .iter()
        .map(|point| point.map(f64::from))
        .collect()
}

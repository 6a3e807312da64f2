//! Changes the points of a shape like a scan: it adds noise to positions and normals, or removes the normals.

use crate::config::{EndpointConfig, EndpointNormals};
use partprobe_carrier::{PointSample, Rng, keyed_rng, unit_interval};
use std::f64::consts::TAU;

/// The points of the endpoint. The noise depends only on the id of the shape.
pub(super) fn disturbed(
    mut sample: PointSample,
    id: &str,
    endpoint: &EndpointConfig,
) -> PointSample {
    let mut rng = keyed_rng(0, &["endpoint-noise", id]);
    let sigma = endpoint.position_noise * diagonal(&sample.points);
    if sigma > 0.0 {
        for coordinate in sample.points.iter_mut().flatten() {
            *coordinate += (sigma * standard_normal(&mut rng)) as f32;
        }
    }
    let tilt = endpoint.normal_noise_deg.to_radians();
    if tilt > 0.0 {
        for normal in &mut sample.normals {
            *normal = tilted(*normal, tilt, &mut rng);
        }
    }
    if endpoint.normals == Some(EndpointNormals::None) {
        sample.normals.fill([0.0; 3]);
    }
    sample
}

fn diagonal(points: &[[f32; 3]]) -> f64 {
    let extent = |axis: usize| {
        let values = points.iter().map(|point| f64::from(point[axis]));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        (high - low).max(0.0)
    };
    (0..3).map(|axis| extent(axis).powi(2)).sum::<f64>().sqrt()
}

/// The normal with noise on each coordinate, as a unit vector. The noise along the normal only changes its length.
fn tilted(normal: [f32; 3], sigma: f64, rng: &mut Rng) -> [f32; 3] {
    let noisy = normal.map(|x| f64::from(x) + sigma * standard_normal(rng));
    let length = noisy.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        noisy.map(|x| (x / length) as f32)
    } else {
        normal
    }
}

/// A number of the standard normal distribution.
fn standard_normal(rng: &mut Rng) -> f64 {
    let [u, v] = [(); 2].map(|()| unit_interval(rng));
    // Box–Muller; 1 − u is never 0.
    (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn endpoint(keys: &str) -> EndpointConfig {
        toml::from_str(&format!("name = \"n\"\n{keys}")).unwrap()
    }

    fn sample() -> PointSample {
        PointSample {
            points: (0..4000).map(|x| [x as f32 / 4000.0, 0.0, 0.0]).collect(),
            normals: vec![[0.0, 0.0, 1.0]; 4000],
            ..PointSample::default()
        }
    }

    #[test]
    fn noise_has_the_requested_size() {
        let noisy = disturbed(
            sample(),
            "a",
            &endpoint("position_noise = 0.01\nnormal_noise_deg = 5.0"),
        );
        let deviation = |values: Vec<f64>| {
            (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
        };
        let off = deviation(
            noisy
                .points
                .iter()
                .map(|point| f64::from(point[1]))
                .collect(),
        );
        assert!((off - 0.01).abs() < 0.001, "{off}");
        let tilts = deviation(
            noisy
                .normals
                .iter()
                .map(|normal| f64::from(normal[0]))
                .collect(),
        );
        assert!((tilts.to_degrees() - 5.0).abs() < 0.5, "{tilts}");
        assert_eq!(
            noisy,
            disturbed(
                sample(),
                "a",
                &endpoint("position_noise = 0.01\nnormal_noise_deg = 5.0")
            )
        );
        assert_ne!(
            noisy,
            disturbed(
                sample(),
                "b",
                &endpoint("position_noise = 0.01\nnormal_noise_deg = 5.0")
            )
        );
    }

    #[test]
    fn without_settings_points_stay_and_normals_can_be_removed() {
        assert_eq!(disturbed(sample(), "a", &endpoint("")), sample());
        let without = disturbed(sample(), "a", &endpoint("normals = \"none\""));
        assert_eq!(without.points, sample().points);
        assert!(without.normals.iter().all(|normal| *normal == [0.0; 3]));
    }
}

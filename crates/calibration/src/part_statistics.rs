//! Computes the five statistics of one shape's parts at one threshold.
//!
//! The paper (STEP-Parts) names these statistics without formulas. The formulas here are our own.

use partprobe_carrier::{
    Carrier, FaceGraph, FaceType, Mesh, Partition, Point, cross, dot, norm, subtract,
};
use partprobe_sources::partition_by_type_and_angle;

/// If the sum of a part's normals is below this fraction of its area, the normals cancel out and the part has no mean
/// normal.
const NO_DIRECTION: f64 = 1e-9;

/// The parts of one shape in five numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct PartStatistics {
    /// Number of parts, P.
    pub n_parts: u32,
    /// Boundary sharpness, S: mean φ over the edges between two parts, weighted by length, in degrees. `None` if there are
    /// no such edges.
    pub sharpness_deg: Option<f64>,
    /// Intra-part deviation, D: mean angle between a triangle's normal and its part's mean normal, weighted by area,
    /// in degrees. A part whose normals cancel out (a whole cylinder) counts 90°.
    pub deviation_deg: f64,
    /// Part-size entropy, H = −Σ aₖ ln aₖ, where aₖ is the fraction of the area that belongs to part k.
    pub entropy: f64,
    /// Number of parts of each primitive type, indexed by the type's code.
    pub components: [u32; FaceType::ALL.len()],
}

/// Measures the parts of a carrier at `theta_deg`, before small parts are absorbed.
#[must_use]
pub fn part_statistics(carrier: &Carrier, theta_deg: f64) -> PartStatistics {
    let graph = carrier.graph();
    let partition = partition_by_type_and_angle(graph, theta_deg);
    let mut components = [0; FaceType::ALL.len()];
    let mut seen = vec![false; partition.n_parts() as usize];
    for (face, &part) in graph.faces.iter().zip(partition.parts()) {
        if !std::mem::replace(&mut seen[part as usize], true) {
            components[usize::from(face.face_type.code())] += 1;
        }
    }
    PartStatistics {
        n_parts: partition.n_parts(),
        sharpness_deg: sharpness(graph, &partition),
        deviation_deg: deviation(carrier.mesh(), &partition),
        entropy: entropy(graph, &partition),
        components,
    }
}

fn sharpness(graph: &FaceGraph, partition: &Partition) -> Option<f64> {
    let part = |face: u32| partition.parts()[face as usize];
    let (mut sum, mut length) = (0.0, 0.0);
    for edge in graph
        .edges
        .iter()
        .filter(|edge| !edge.phi.is_nan() && part(edge.faces[0]) != part(edge.faces[1]))
    {
        sum += edge.length * edge.phi;
        length += edge.length;
    }
    (length > 0.0).then(|| sum / length)
}

fn entropy(graph: &FaceGraph, partition: &Partition) -> f64 {
    let mut areas = vec![0.0; partition.n_parts() as usize];
    for (face, &part) in graph.faces.iter().zip(partition.parts()) {
        areas[part as usize] += face.area;
    }
    let all: f64 = areas.iter().sum();
    let shares = areas
        .iter()
        .map(|area| area / all)
        .filter(|&share| share > 0.0);
    shares
        .map(|share| -share * share.ln())
        .sum::<f64>()
        .max(0.0)
}

fn deviation(mesh: &Mesh, partition: &Partition) -> f64 {
    // The cross product of two sides is a normal whose length is twice the area.
    let normals: Vec<Point> = (0..mesh.triangles.len())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            cross(subtract(b, a), subtract(c, a))
        })
        .collect();
    let n_parts = partition.n_parts() as usize;
    let (mut means, mut areas) = (vec![[0.0; 3]; n_parts], vec![0.0; n_parts]);
    let part = |face: u32| partition.parts()[face as usize] as usize;
    for (normal, &face) in normals.iter().zip(&mesh.tri_face) {
        areas[part(face)] += norm(*normal);
        (0..3).for_each(|axis| means[part(face)][axis] += normal[axis]);
    }
    let mut sum = 0.0;
    for (normal, &face) in normals.iter().zip(&mesh.tri_face) {
        let (mean, area) = (means[part(face)], areas[part(face)]);
        let angle = if norm(mean) > NO_DIRECTION * area {
            angle_deg(*normal, mean)
        } else {
            90.0
        };
        sum += norm(*normal) * angle;
    }
    let all: f64 = areas.iter().sum();
    if all > 0.0 { sum / all } else { 0.0 }
}

fn angle_deg(a: Point, b: Point) -> f64 {
    norm(cross(a, b)).atan2(dot(a, b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angles::tests::graph;
    use FaceType::{Cylinder, Plane};
    use partprobe_carrier::{CarrierMeta, Units};
    use partprobe_sources::StepParts;

    /// Three unit squares in a row. The second is tilted against the first by `tilt` degrees. The third has the type
    /// cylinder and is at 90° to the second.
    fn strip(tilt: f64) -> Carrier {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let quad = |from: [f64; 2], to: [f64; 2]| {
            [
                [from[0], 0.0, from[1]],
                [to[0], 0.0, to[1]],
                [to[0], 1.0, to[1]],
                [from[0], 1.0, from[1]],
            ]
        };
        let places = [
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0 + cos, sin],
            [1.0 + cos - sin, sin + cos],
        ];
        let vertices: Vec<Point> = (0..3)
            .flat_map(|i| quad(places[i], places[i + 1]))
            .collect();
        let mesh = Mesh {
            vertices,
            vertex_face: (0..3).flat_map(|face| [face; 4]).collect(),
            triangles: (0..3)
                .flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]])
                .collect(),
            tri_face: (0..3).flat_map(|face| [face; 2]).collect(),
            vertex_normal: Vec::new(),
        };
        let meta = CarrierMeta {
            id: "strip".to_owned(),
            source_sha256: String::new(),
            theta_deg: 8.0,
            tau_min: 0,
            chord_mm: 0.01,
            angle_rad: 0.3,
            diagonal_mm: 3.0,
            units: Units::millimeters_and_radians(),
            lost: Vec::new(),
            notes: Vec::new(),
            instances: Vec::new(),
        };
        let graph = graph(&[Plane, Plane, Cylinder], &[(0, 1, tilt), (1, 2, 90.0)]);
        let rule = StepParts {
            theta_deg: 8.0,
            tau_min: 0,
        };
        let layers = rule.layers(&mesh, &graph);
        Carrier::new(mesh, graph, layers, meta).unwrap()
    }

    #[track_caller]
    fn check(theta_deg: f64, n_parts: u32, sharpness: f64, deviation: f64, shares: &[f64]) {
        let found = part_statistics(&strip(6.0), theta_deg);
        assert_eq!(
            (found.n_parts, found.components[0], found.components[1]),
            (n_parts, n_parts - 1, 1)
        );
        assert!((found.sharpness_deg.unwrap() - sharpness).abs() < 1e-12);
        assert!(
            (found.deviation_deg - deviation).abs() < 1e-9,
            "{}",
            found.deviation_deg
        );
        let entropy: f64 = shares.iter().map(|share| -share * share.ln()).sum();
        assert!((found.entropy - entropy).abs() < 1e-12);
    }

    #[test]
    fn statistics_have_their_closed_forms() {
        check(4.0, 3, 48.0, 0.0, &[1.0 / 3.0; 3]);
        // The two joined squares are 3° off their mean normal, and the third has no deviation.
        check(8.0, 2, 90.0, 2.0, &[2.0 / 3.0, 1.0 / 3.0]);
    }
}

//! Chooses, orders and quantizes the points of a shape for the page. Positions are relative to a box, and normals have two bytes.

use crate::kept_points::spread_indices;
use partprobe_carrier::{NearestPoints, distance};

/// The number of points per shape in the 3D view.
pub(crate) const N_POINTS: usize = 5000;

/// The kept points in an order along a curve through space, which compresses well.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct KeptPoints {
    /// From 0 to 65535 along the largest extent of the shape. The other axes have the same scale.
    pub(crate) positions: Vec<[u16; 3]>,
    /// Unit normals in octahedral coordinates (Meyer et al. 2010).
    pub(crate) normals: Vec<[u8; 2]>,
    /// The face of each point as an index in the faces of the digest. It is empty if faces are not known.
    pub(crate) faces: Vec<u16>,
}

/// The box of a shape.
pub(crate) struct Frame {
    low: [f32; 3],
    extent: f32,
    /// In the units of the points.
    pub(crate) diagonal: f64,
}

impl Frame {
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
        for point in points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if points.is_empty() {
            (low, high) = ([0.0; 3], [1.0; 3]);
        }
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let diagonal = sides
            .iter()
            .map(|side| f64::from(*side).powi(2))
            .sum::<f64>()
            .sqrt();
        Self {
            low,
            extent: sides.into_iter().fold(f32::MIN_POSITIVE, f32::max),
            diagonal,
        }
    }

    pub(crate) fn quantized(&self, point: [f32; 3]) -> [u16; 3] {
        [0, 1, 2].map(|axis| {
            let fraction = (point[axis] - self.low[axis]) / self.extent;
            (fraction * 65_535.0).round().clamp(0.0, 65_535.0) as u16
        })
    }
}

/// At most [`N_POINTS`] points in the order of a curve through space, and the radius of discs that cover the surface, if known.
pub(crate) fn kept_indices(
    points: &[[f32; 3]],
    normals: &[[f32; 3]],
    frame: &Frame,
) -> (Vec<usize>, Option<f64>) {
    let in_units =
        |point: &[f32; 3]| [0, 1, 2].map(|axis| (point[axis] - frame.low[axis]) / frame.extent);
    let positions: Vec<[f32; 3]> = points.iter().map(in_units).collect();
    let (mut kept, radius) = spread_indices(&positions, normals, N_POINTS);
    kept.sort_by_key(|&idx| (morton(frame.quantized(points[idx])), idx));
    (kept, radius)
}

/// The interleaved bits of the coordinates.
fn morton(position: [u16; 3]) -> u64 {
    let mut code = 0;
    for bit in (0..16).rev() {
        for axis in position {
            code = code << 1 | u64::from(axis >> bit & 1);
        }
    }
    code
}

/// A unit vector as a point of the unfolded octahedron, each coordinate in a byte.
pub(crate) fn octahedral([x, y, z]: [f32; 3]) -> [u8; 2] {
    let sum = (x.abs() + y.abs() + z.abs()).max(f32::MIN_POSITIVE);
    let (mut u, mut v) = (x / sum, y / sum);
    if z < 0.0 {
        let sign = |value: f32| if value < 0.0 { -1.0 } else { 1.0 };
        (u, v) = ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v));
    }
    [u, v].map(|value| (127.0 + 127.0 * value).round().clamp(0.0, 254.0) as u8)
}

/// The radius if all points were kept: four fifths of the median distance to the sixth nearest point.
pub(crate) fn disc_radius(positions: &[[u16; 3]]) -> f64 {
    const N_NEIGHBORS: usize = 6;
    let points: Vec<[f64; 3]> = positions
        .iter()
        .map(|position| position.map(|x| f64::from(x) / 65_535.0))
        .collect();
    if points.len() <= N_NEIGHBORS {
        return 0.05;
    }
    let tree = NearestPoints::new(&points);
    let farthest = |idx: u32| {
        let neighbors = tree.nearest_of(idx, N_NEIGHBORS);
        let own = points[idx as usize];
        let each = neighbors
            .iter()
            .map(|&other| distance(own, points[other as usize]));
        each.fold(0.0, f64::max)
    };
    // A seventh of the points gives the median with sufficient accuracy.
    let mut distances: Vec<f64> = (0..points.len() as u32).step_by(7).map(farthest).collect();
    distances.sort_by(f64::total_cmp);
    0.8 * distances[distances.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn normals_round_trip(x in -1f32..1.0, y in -1f32..1.0, z in -1f32..1.0) {
            let length = (x * x + y * y + z * z).sqrt();
            prop_assume!(length > 0.1);
            let normal = [x, y, z].map(|value| value / length);
            let [u, v] = octahedral(normal).map(|byte| f32::from(byte) / 127.0 - 1.0);
            // The page decodes normals in this way.
            let mut back = [u, v, 1.0 - u.abs() - v.abs()];
            if back[2] < 0.0 {
                let sign = |value: f32| if value < 0.0 { -1.0 } else { 1.0 };
                (back[0], back[1]) = ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v));
            }
            let length = back.iter().map(|x| x * x).sum::<f32>().sqrt();
            let cosine: f32 = (0..3).map(|axis| back[axis] * normal[axis] / length).sum();
            prop_assert!(cosine > 0.999, "{cosine}");
        }
    }
}

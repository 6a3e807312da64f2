//! Cuts random parts of STEP-Parts by planes until there are K: `step-split-<K>`.
//!
//! Every true boundary is kept, and some false boundaries are added. A cut goes through triangles, so labels belong to points.

use crate::degraded::{below, step_parts};
use crate::factory::SourceFactory;
use crate::source::{PointRule, SourceLabels};
use partprobe_carrier::{
    Carrier, NormalKind, Point, Rng, ShapeKind, dot, keyed_rng, sample_by_area, subtract,
};
use std::sync::Arc;

/// Cuts are placed between points of a sample of this size, so that both sides have some area.
const N_POINTS: usize = 8192;

/// The number of draws of a pair of points for one cut. After that, the shape counts as too small to be cut again.
const N_DRAWS: usize = 100;

/// The parts of a larger K are pieces of those of a smaller one. A shape with K parts or more does not change.
pub(crate) const STEP_SPLIT: SourceFactory = SourceFactory::numbered_rule(
    "step-split-<K>",
    "step-parts with random parts cut by random planes until there are K",
    1..=1000,
    |carrier, n_wanted, seed| Ok(split_to(carrier, n_wanted, seed)),
)
.needing(ShapeKind::Brep);

/// The STEP-Parts after pieces were cut until there are `n_wanted`.
pub(crate) fn split_to(carrier: &Carrier, n_wanted: u32, seed: u64) -> SourceLabels {
    let mut rng = keyed_rng(seed, &["step-split", &carrier.meta().id]);
    let rule = SplitParts::new(carrier, n_wanted, &mut rng);
    SourceLabels::on_points(carrier.mesh(), Arc::new(rule))
}

/// A plane that divides one piece of surface.
#[derive(Clone, Copy, Debug)]
struct Cut {
    piece: u32,
    /// The label of the region in the direction of the normal.
    beyond: u32,
    normal: Point,
    through: Point,
}

impl Cut {
    fn label(&self, label: u32, point: Point) -> u32 {
        let is_beyond =
            label == self.piece && dot(self.normal, subtract(point, self.through)) > 0.0;
        if is_beyond { self.beyond } else { label }
    }
}

#[derive(Debug)]
struct SplitParts {
    part_of_triangle: Vec<u32>,
    /// The cuts in the order in which they were made, because a later cut may divide a piece of an earlier one.
    cuts: Vec<Cut>,
}

impl SplitParts {
    fn new(carrier: &Carrier, n_wanted: u32, rng: &mut Rng) -> Self {
        let parts = step_parts(carrier);
        let mesh = carrier.mesh();
        let part_of_triangle: Vec<u32> = mesh
            .tri_face
            .iter()
            .map(|&face| parts.parts()[face as usize])
            .collect();
        // Without an area, there is nothing to cut.
        let sample = sample_by_area(mesh, N_POINTS, NormalKind::Triangle, rng).unwrap_or_default();
        let points: Vec<Point> = sample
            .points
            .iter()
            .map(|point| point.map(f64::from))
            .collect();

        let mut labels: Vec<u32> = sample
            .triangles
            .iter()
            .map(|&triangle| part_of_triangle[triangle as usize])
            .collect();
        let mut cuts = Vec::new();
        for beyond in parts.n_parts()..n_wanted {
            let Some(cut) = random_cut(&points, &labels, beyond, rng) else {
                break;
            };
            for (label, &point) in labels.iter_mut().zip(&points) {
                *label = cut.label(*label, point);
            }
            cuts.push(cut);
        }
        Self {
            part_of_triangle,
            cuts,
        }
    }
}

impl PointRule for SplitParts {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let part = self.part_of_triangle.get(triangle as usize).copied();
        part.map_or(partprobe_carrier::IGNORE, |part| {
            self.cuts
                .iter()
                .fold(part, |label, cut| cut.label(label, point)) as i32
        })
    }
}

/// The plane halfway between two random points of one piece. The probability of a piece is proportional to its area.
fn random_cut(points: &[Point], labels: &[u32], beyond: u32, rng: &mut Rng) -> Option<Cut> {
    (0..N_DRAWS).find_map(|_| {
        let first = below(rng, points.len());
        let &piece = labels.get(first)?;
        let others: Vec<usize> = (0..points.len())
            .filter(|&idx| labels[idx] == piece)
            .collect();
        let second = others[below(rng, others.len())];
        let (a, b) = (points[first], points[second]);
        let through = [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis]));
        (a != b).then(|| Cut {
            piece,
            beyond,
            normal: subtract(b, a),
            through,
        })
    })
}

//! Computes the number of steps along u and v in which a surface must be divided so that triangles follow it.

use super::edge_points::{Tolerance, angle_between};
use crate::geometry::{BsplineSurface, Curve, Frame, Surface};
use partprobe_shape::{Point, dot, subtract};

/// The largest number of steps along one parameter, and the largest number of cells of one face.
const MAX_STEPS: usize = 2000;
const MAX_CELLS: usize = 100_000;

/// The smallest and the largest number of samples along one parameter of a spline, and the largest number of samples of the grid
/// of both.
const FEWEST_SAMPLES: usize = 6;
const MOST_SAMPLES: usize = 24;
const MOST_GRID_SAMPLES: usize = 1152;

/// A rectangle of the parameter plane: `[low, high]` of u and of v.
pub(crate) type Bounds = [[f64; 2]; 2];

/// The number of steps along u and v, each at least 1.
pub(crate) fn steps(surface: &Surface, bounds: Bounds, tolerance: Tolerance) -> [usize; 2] {
    let region = Region {
        surface,
        bounds,
        tolerance,
    };
    let mut steps = region.steps();
    while steps[0].saturating_mul(steps[1]) > MAX_CELLS {
        let larger = usize::from(steps[1] > steps[0]);
        steps[larger] = steps[larger] * 3 / 4;
    }
    steps
}

/// The rectangle of a surface that is divided, and how closely triangles must follow it there.
#[derive(Clone, Copy)]
struct Region<'a> {
    surface: &'a Surface,
    bounds: Bounds,
    tolerance: Tolerance,
}

impl Region<'_> {
    /// The number of steps along u and v, without a limit on the number of cells.
    fn steps(self) -> [usize; 2] {
        match self.surface {
            Surface::Plane(_) | Surface::Facets(_) => [1, 1],
            Surface::Cylinder { radius, .. } => [self.turn(*radius, 0), 1],
            Surface::Cone { radius, slope, .. } => [self.turn(self.widest(*radius, *slope), 0), 1],
            Surface::Sphere { radius, .. } => [self.turn(*radius, 0), self.turn(*radius, 1)],
            Surface::Torus { major, minor, .. } => {
                [self.turn(major.abs() + minor, 0), self.turn(*minor, 1)]
            }
            Surface::Extrusion { curve, .. } => [self.along_extruded(curve), 1],
            Surface::Revolution { axis, curve } => self.of_revolution(axis, curve),
            Surface::Bspline(spline) => self.of_spline(spline),
            Surface::Offset { .. } => self.sampled([12, 12]),
            Surface::Composite(composite) => {
                let patches = [composite.n_u, composite.n_v];
                self.sampled(patches.map(|patches| (6 * patches).clamp(12, 48)))
            }
        }
    }

    /// Steps around a circle with this radius, which the given parameter runs along as an angle.
    fn turn(self, radius: f64, axis: usize) -> usize {
        let [low, high] = self.bounds[axis];
        whole((high - low).abs() / self.tolerance.step(radius))
    }

    /// The radius of the wider end of a cone.
    fn widest(self, radius: f64, slope: f64) -> f64 {
        self.bounds[1]
            .iter()
            .map(|v| (radius + v * slope).abs())
            .fold(0.0, f64::max)
    }

    /// Steps along the curve of an extrusion.
    fn along_extruded(self, curve: &Curve) -> usize {
        match curve {
            Curve::Line { .. } => 1,
            _ => self.sampled([curve_samples(curve, self.bounds[0]), 1])[0],
        }
    }

    fn of_revolution(self, axis: &Frame, curve: &Curve) -> [usize; 2] {
        let n_v = curve_samples(curve, self.bounds[1]);
        let [along_u, along_v] = self.sampled([12, n_v]);
        // If the surface is a flat disc, its normal does not change, but its circles must still be divided.
        let widest = (0..=n_v)
            .map(|i| {
                let [x, y, _] = axis.local(curve.point(self.at(1, i, n_v)));
                libm::hypot(x, y)
            })
            .fold(0.0, f64::max);
        [along_u.max(self.turn(widest, 0)), along_v]
    }

    fn of_spline(self, spline: &BsplineSurface) -> [usize; 2] {
        let spans = spline.breaks().map(|breaks| breaks.len() - 1);
        let few = spans.map(|spans| (2 * spans).clamp(FEWEST_SAMPLES, MOST_SAMPLES));
        let many = samples(spans, few);
        let coarse = self.sampled(few);
        if many == few {
            return coarse;
        }
        // A sharp bend at one point must not make all steps of a long surface short. So the finer samples count with their total
        // only.
        let total = Needs::of(self, many).total.map(whole);
        [coarse[0].max(total[0]), coarse[1].max(total[1])]
    }

    /// The number of steps along u and v, from the rotation of the normal and the sag between `n_u` times `n_v` samples.
    fn sampled(self, [n_u, n_v]: [usize; 2]) -> [usize; 2] {
        let [need_u, need_v] = Needs::of(self, [n_u, n_v]).most;
        [whole(need_u * n_u as f64), whole(need_v * n_v as f64)]
    }

    /// The parameter of a sample.
    fn at(self, axis: usize, i: usize, n: usize) -> f64 {
        let [low, high] = self.bounds[axis];
        low + (high - low) * i as f64 / n as f64
    }
}

fn whole(steps: f64) -> usize {
    // If the last step ends short of the boundary by a rounding error, no further step is needed.
    ((steps - 1e-9).ceil().max(1.0) as usize).min(MAX_STEPS)
}

/// The number of samples along u and v of a spline with the given number of spans. A long thin surface, such as the wire of a
/// spring, needs more samples along it: if the normal rotates too far between two samples, it seems to rotate backwards.
fn samples(spans: [usize; 2], few: [usize; 2]) -> [usize; 2] {
    [0, 1].map(|axis| {
        (2 * spans[axis])
            .min(MOST_GRID_SAMPLES / few[1 - axis])
            .max(few[axis])
    })
}

fn curve_samples(curve: &Curve, [low, high]: [f64; 2]) -> usize {
    match curve {
        Curve::Line { .. } => 2,
        _ => (2 * (curve.breaks(low, high).len() + 1)).clamp(12, 100),
    }
}

/// The steps that a surface needs along u and along v.
struct Needs {
    /// For the sampled interval that needs most.
    most: [f64; 2],
    /// For all intervals of the parameter line that needs most.
    total: [f64; 2],
}

impl Needs {
    fn of(region: Region<'_>, [n_u, n_v]: [usize; 2]) -> Self {
        let Region {
            surface, tolerance, ..
        } = region;
        let points: Vec<(Point, Option<Point>)> = (0..=n_u)
            .flat_map(|i| (0..=n_v).map(move |j| (i, j)))
            .map(|(i, j)| surface.point_and_normal(region.at(0, i, n_u), region.at(1, j, n_v)))
            .collect();
        let row = n_v + 1;
        let mut most = [0.0_f64; 2];
        let (mut along_u, mut along_v) = (vec![0.0; n_v + 1], vec![0.0; n_u + 1]);
        for (i, along_v) in along_v.iter_mut().enumerate() {
            for (j, along_u) in along_u.iter_mut().enumerate() {
                let point = |i: usize, j: usize| points[i * row + j];
                if i < n_u {
                    let after = (i + 2 <= n_u).then(|| point(i + 2, j));
                    let need_u = need(point(i, j), point(i + 1, j), after, tolerance);
                    most[0] = most[0].max(need_u);
                    *along_u += need_u;
                }
                if j < n_v {
                    let after = (j + 2 <= n_v).then(|| point(i, j + 2));
                    let need_v = need(point(i, j), point(i, j + 1), after, tolerance);
                    most[1] = most[1].max(need_v);
                    *along_v += need_v;
                }
            }
        }
        let total = [along_u, along_v].map(|lines| lines.into_iter().fold(0.0, f64::max));
        Self { most, total }
    }
}

/// The number of steps that one sampled interval needs. It need not be an integer.
fn need(
    a: (Point, Option<Point>),
    b: (Point, Option<Point>),
    after: Option<(Point, Option<Point>)>,
    tolerance: Tolerance,
) -> f64 {
    let (Some(normal_a), Some(normal_b)) = (a.1, b.1) else {
        return 0.0;
    };
    let reach = subtract(b.0, a.0);
    // An interval much shorter than the chord tolerance cannot be seen.
    if dot(reach, reach) < (0.05 * tolerance.chord) * (0.05 * tolerance.chord) {
        return 0.0;
    }
    let turn = angle_between(normal_a, normal_b) / tolerance.angle;
    let sag = after.map_or(0.0, |after| {
        let bow = dot(subtract(subtract(after.0, b.0), reach), normal_b).abs() / 2.0;
        0.5 * (bow / tolerance.chord).sqrt()
    });
    turn.max(sag)
}

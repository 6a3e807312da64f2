//! Chooses points that are evenly spread over a surface, so that small discs around them cover it.
//!
//! This is dart throwing: each point is taken unless it is near a point that was taken before (Cook 1986, "Stochastic sampling in
//! computer graphics"). A search finds the distance that keeps the wanted number of points.

/// Discs with a radius of this many distances leave no holes, although the original points have gaps.
const COVER: f64 = 1.4;

/// The number of steps of the search for the distance.
const N_STEPS: usize = 5;

/// The largest number of cells along an axis of the grid in which near points are looked up.
const MAX_CELLS: usize = 96;

/// Indices of at most `n` points, ascending, and a radius at which discs around them cover the surface. The radius is `None` if
/// all points are kept.
///
/// Positions are in units of the largest extent. Points whose normals differ by more than 60° do not exclude each other, so
/// that both sides of a thin plate are kept.
pub(crate) fn spread_indices(
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
    n: usize,
) -> (Vec<usize>, Option<f64>) {
    if positions.len() <= n {
        return ((0..positions.len()).collect(), None);
    }
    let mut distance = (1.0 / n as f32).sqrt();
    let mut kept = Vec::new();
    let mut radius = 0.0;
    for _ in 0..N_STEPS {
        let found = chosen_by_distance(positions, normals, distance);
        let n_found = found.len();
        if n_found <= n && n_found > kept.len() {
            (kept, radius) = (found, distance);
        }
        // Twice the distance keeps a quarter of the points. The distance is slightly increased, so that the result is below the
        // number.
        let factor = (n_found as f32 / n as f32).sqrt() * if n_found > n { 1.01 } else { 0.998 };
        distance *= factor.clamp(0.5, 2.0);
        if n_found <= n && 49 * n < 50 * n_found {
            break;
        }
    }
    // The search ends slightly below the number. Evenly chosen other points fill the list.
    let mut is_kept = vec![false; positions.len()];
    for &idx in &kept {
        is_kept[idx] = true;
    }
    let n_missing = n - kept.len();
    let others: Vec<usize> = (0..positions.len()).filter(|&idx| !is_kept[idx]).collect();
    kept.extend((0..n_missing).map(|idx| others[idx * others.len() / n_missing]));
    kept.sort_unstable();
    (kept, Some(COVER * f64::from(radius)))
}

/// The points that have no earlier kept point within the distance.
fn chosen_by_distance(positions: &[[f32; 3]], normals: &[[f32; 3]], distance: f32) -> Vec<usize> {
    let mut grid = Grid::new(distance, positions.len());
    let mut kept = Vec::new();
    for (idx, &position) in positions.iter().enumerate() {
        let is_near = |other: usize| {
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let gap = [0, 1, 2].map(|axis| positions[other][axis] - position[axis]);
            dot(gap, gap) < distance * distance && dot(normals[other], normals[idx]) > 0.5
        };
        if !grid.has_near(position, is_near) {
            grid.insert(position, idx);
            kept.push(idx);
        }
    }
    kept
}

/// A grid over the unit cube whose cells are at least as large as a distance. Each cell has a list of points.
struct Grid {
    n_cells: usize,
    /// The last point of each cell, and the point before each point; `u32::MAX` ends a list.
    last: Vec<u32>,
    before: Vec<u32>,
}

impl Grid {
    fn new(distance: f32, n_points: usize) -> Self {
        let n_cells = ((1.0 / distance.max(1e-6)) as usize).clamp(1, MAX_CELLS);
        Self {
            n_cells,
            last: vec![u32::MAX; n_cells.pow(3)],
            before: vec![u32::MAX; n_points],
        }
    }

    fn cell(&self, position: [f32; 3]) -> [usize; 3] {
        position.map(|x| ((x * self.n_cells as f32) as usize).min(self.n_cells - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.n_cells + y) * self.n_cells + z
    }

    fn insert(&mut self, position: [f32; 3], point: usize) {
        let index = self.index(self.cell(position));
        self.before[point] = std::mem::replace(&mut self.last[index], point as u32);
    }

    /// Whether a point in the cell of the position, or in a cell next to it, is near.
    fn has_near(&self, position: [f32; 3], is_near: impl Fn(usize) -> bool) -> bool {
        let [xs, ys, zs] = self
            .cell(position)
            .map(|at| at.saturating_sub(1)..=(at + 1).min(self.n_cells - 1));
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    let mut point = self.last[self.index([x, y, z])];
                    while point != u32::MAX {
                        if is_near(point as usize) {
                            return true;
                        }
                        point = self.before[point as usize];
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{keyed_rng, unit_interval};

    #[test]
    fn discs_around_the_kept_points_cover_the_others_on_both_sides_of_a_plate() {
        let mut rng = keyed_rng(0, &["plate"]);
        let positions: Vec<[f32; 3]> = (0..8000)
            .map(|idx| {
                [
                    unit_interval(&mut rng) as f32,
                    unit_interval(&mut rng) as f32,
                    0.001 * (idx % 2) as f32,
                ]
            })
            .collect();
        let normals: Vec<[f32; 3]> = (0..8000)
            .map(|idx| [0.0, 0.0, if idx % 2 == 1 { 1.0 } else { -1.0 }])
            .collect();
        let (kept, radius) = spread_indices(&positions, &normals, 2000);
        let radius = (radius.unwrap() / COVER) as f32;
        assert_eq!(kept.len(), 2000);
        assert!(kept.is_sorted_by(|a, b| a < b));
        let n_up = kept.iter().filter(|&&idx| idx % 2 == 1).count();
        assert!((900..1100).contains(&n_up), "{n_up}");
        // Random points would need twice the radius for this.
        for (idx, position) in positions.iter().enumerate().step_by(37) {
            let gap = kept
                .iter()
                .filter(|&&other| other % 2 == idx % 2)
                .map(|&other| {
                    (0..2)
                        .map(|axis| (positions[other][axis] - position[axis]).powi(2))
                        .sum::<f32>()
                        .sqrt()
                });
            assert!(gap.fold(f32::MAX, f32::min) <= radius);
        }
        assert!(radius < 0.045, "{radius}");
    }

    #[test]
    fn few_points_are_all_kept() {
        assert_eq!(
            spread_indices(&[[0.0; 3]; 3], &[[0.0, 0.0, 1.0]; 3], 3),
            (vec![0, 1, 2], None)
        );
        // Points at the same position exclude each other, but the list is still filled.
        let (kept, _) = spread_indices(&[[0.5; 3]; 9], &[[0.0, 0.0, 1.0]; 9], 4);
        assert_eq!(kept.len(), 4);
    }
}

//! Measures the information of rows of numbers about classes: by a linear map and by the nearest row, each learned on one half.
//!
//! Rows with their classes go in, and the accuracy on the other half comes out. No clustering and no number of parts is involved,
//! so neither a coarse nor a fine source of labels has an advantage.

use partprobe_carrier::Embeddings;
use serde::Serialize;
use std::collections::BTreeMap;

/// The ridge of the linear probe, per row.
const RIDGE: f64 = 1e-3;

/// How well a probe predicts classes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProbeScore {
    /// The fraction of the rows whose class is right.
    pub accuracy: f64,
    /// The mean of that fraction over the classes, so that a rare class counts as much as a frequent one.
    pub balanced_accuracy: f64,
}

/// The scores of both probes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProbeScores {
    /// Least squares onto one column per class, with a constant and a small ridge. The class with the largest value is predicted.
    pub linear: ProbeScore,
    /// The class of the learned row with the largest cosine.
    pub nearest: ProbeScore,
    /// The most frequent class of the learned rows, predicted for every row. A useful probe must be better than this.
    pub majority: ProbeScore,
    /// Rows that were learned.
    pub n_learned: usize,
    /// Rows that were scored.
    pub n_scored: usize,
    /// Classes among the scored rows.
    pub n_classes: usize,
}

/// Learns on the rows for which `is_learned` is true, and scores the others. Returns `None` if one of the two has no rows.
///
/// # Shapes
/// - rows: `[row, dim]`
/// - classes and `is_learned`: `[row]`
#[must_use]
pub fn probe(rows: &Embeddings, classes: &[u32], is_learned: &[bool]) -> Option<ProbeScores> {
    let n_rows = rows.n_rows().min(classes.len()).min(is_learned.len());
    let side = |learned: bool| -> Vec<usize> {
        (0..n_rows)
            .filter(|&row| is_learned[row] == learned)
            .collect()
    };
    let (learned, scored) = (side(true), side(false));
    if learned.is_empty() || scored.is_empty() {
        return None;
    }
    let n_classes = classes.iter().max().map_or(0, |&last| last as usize + 1);
    let map = LinearMap::fitted(rows, classes, &learned, n_classes);
    let by_map: Vec<u32> = scored.iter().map(|&row| map.class(rows.row(row))).collect();
    let by_nearest: Vec<u32> = scored
        .iter()
        .map(|&row| classes[nearest(rows, row, &learned)])
        .collect();
    let by_majority = vec![most_frequent(&learned, classes); scored.len()];
    let truth: Vec<u32> = scored.iter().map(|&row| classes[row]).collect();
    let mut distinct = truth.clone();
    distinct.sort_unstable();
    distinct.dedup();
    Some(ProbeScores {
        linear: score(&by_map, &truth, &distinct),
        nearest: score(&by_nearest, &truth, &distinct),
        majority: score(&by_majority, &truth, &distinct),
        n_learned: learned.len(),
        n_scored: scored.len(),
        n_classes: distinct.len(),
    })
}

/// The class that most of these rows have. If several are equal, it is the smallest number.
fn most_frequent(rows: &[usize], classes: &[u32]) -> u32 {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for &row in rows {
        *counts.entry(classes[row]).or_default() += 1;
    }
    let most = counts.iter().rev().max_by_key(|&(_, n)| n);
    most.map_or(0, |(&class, _)| class)
}

fn score(predicted: &[u32], truth: &[u32], distinct: &[u32]) -> ProbeScore {
    let right = |class: Option<u32>| {
        let of_class = predicted.iter().zip(truth);
        let of_class = of_class.filter(|(_, truth)| class.is_none_or(|class| **truth == class));
        let (n_right, n) = of_class.fold((0usize, 0usize), |(right, n), (predicted, truth)| {
            (right + usize::from(predicted == truth), n + 1)
        });
        n_right as f64 / n.max(1) as f64
    };
    let of_classes: f64 = distinct.iter().map(|&class| right(Some(class))).sum();
    ProbeScore {
        accuracy: right(None),
        balanced_accuracy: of_classes / distinct.len().max(1) as f64,
    }
}

/// The learned row with the largest cosine. If several are equal, it is the first one.
fn nearest(rows: &Embeddings, row: usize, learned: &[usize]) -> usize {
    let dot = |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let own = rows.row(row);
    let mut best = learned[0];
    let mut largest = f32::NEG_INFINITY;
    for &other in learned {
        let candidate = rows.row(other);
        let cosine = dot(own, candidate) / dot(candidate, candidate).sqrt().max(f32::MIN_POSITIVE);
        if largest < cosine {
            best = other;
            largest = cosine;
        }
    }
    best
}

/// One column of weights per class, the last weight of each for a constant.
struct LinearMap {
    columns: Vec<Vec<f64>>,
}

impl LinearMap {
    fn fitted(rows: &Embeddings, classes: &[u32], learned: &[usize], n_classes: usize) -> Self {
        let size = rows.dim() + 1;
        let mut products = vec![vec![0.0; size]; size];
        let mut columns = vec![vec![0.0; size]; n_classes];
        for &row in learned {
            let inputs = with_constant(rows.row(row));
            for (idx, &x) in inputs.iter().enumerate() {
                for (sum, &y) in products[idx][..=idx].iter_mut().zip(&inputs) {
                    *sum += x * y;
                }
                columns[classes[row] as usize][idx] += x;
            }
        }
        for (idx, row) in products.iter_mut().enumerate() {
            row[idx] += RIDGE * learned.len() as f64;
        }
        factorize(&mut products);
        columns
            .iter_mut()
            .for_each(|column| solve(&products, column));
        Self { columns }
    }

    /// The class with the largest value. If several are equal, it is the first one.
    fn class(&self, row: &[f32]) -> u32 {
        let inputs = with_constant(row);
        let mut best = 0;
        let mut largest = f64::NEG_INFINITY;
        for (class, column) in (0..).zip(&self.columns) {
            let value: f64 = column.iter().zip(&inputs).map(|(w, x)| w * x).sum();
            if largest < value {
                best = class;
                largest = value;
            }
        }
        best
    }
}

fn with_constant(row: &[f32]) -> Vec<f64> {
    row.iter().map(|&x| f64::from(x)).chain([1.0]).collect()
}

/// Replaces the lower half of a positive definite matrix by its Cholesky factor.
fn factorize(matrix: &mut [Vec<f64>]) {
    for row in 0..matrix.len() {
        for column in 0..=row {
            let product: f64 = (0..column)
                .map(|k| matrix[row][k] * matrix[column][k])
                .sum();
            let rest = matrix[row][column] - product;
            matrix[row][column] = if row == column {
                rest.max(f64::MIN_POSITIVE).sqrt()
            } else {
                rest / matrix[column][column]
            };
        }
    }
}

/// Solves with the factor of the matrix, in place.
fn solve(factor: &[Vec<f64>], column: &mut [f64]) {
    for row in 0..column.len() {
        let known: f64 = (0..row).map(|k| factor[row][k] * column[k]).sum();
        column[row] = (column[row] - known) / factor[row][row];
    }
    for row in (0..column.len()).rev() {
        let known: f64 = (row + 1..column.len())
            .map(|k| factor[k][row] * column[k])
            .sum();
        column[row] = (column[row] - known) / factor[row][row];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separated_classes_are_found_by_both_probes() {
        // Three bundles, of which every second row is learned. The last row is in the bundle of class 0 but has class 1.
        let row = |degrees: f32| [degrees.to_radians().cos(), degrees.to_radians().sin()];
        let degrees = [0.0, 2.0, 4.0, 6.0, 120.0, 121.0, 122.0, 240.0, 243.0, 3.0];
        let classes = [0, 0, 0, 0, 1, 1, 1, 2, 2, 1];
        let is_learned = [
            true, false, true, false, true, false, true, true, false, false,
        ];
        let rows = Embeddings::from_rows(degrees.map(row));
        let found = probe(&rows, &classes, &is_learned).unwrap();
        for score in [found.linear, found.nearest] {
            assert_eq!(score.accuracy, 0.8);
            assert!((score.balanced_accuracy - (1.0 + 0.5 + 1.0) / 3.0).abs() < 1e-12);
        }
        assert_eq!(
            (found.n_learned, found.n_scored, found.n_classes),
            (5, 5, 3)
        );
        assert_eq!(probe(&rows, &classes, &[true; 10]), None);
        assert_eq!(probe(&rows, &classes, &[false; 10]), None);
    }

    #[test]
    fn a_factorization_solves_its_system() {
        let mut matrix = vec![vec![4.0, 0.0], vec![2.0, 3.0]];
        factorize(&mut matrix);
        // 4x + 2y = 10 and 2x + 3y = 9.
        let mut column = [10.0, 9.0];
        solve(&matrix, &mut column);
        assert!((column[0] - 1.5).abs() < 1e-12 && (column[1] - 2.0).abs() < 1e-12);
    }
}

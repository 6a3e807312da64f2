//! Computes the cosine discriminative loss `cosdisc` of one shape, and its gradient with respect to the embeddings.
//!
//! Pull and push are those of the discriminative loss (De Brabandere et al., 2017), with cosines instead of distances, on the
//! unit sphere as in Kong and Fowlkes (CVPR 2018).
//!
//! With e_i = z_i/‖z_i‖, S_k = Σ_{i∈k} e_i over the n_k tokens of part k, and c_k = S_k/‖S_k‖:
//! - pull: (1/K) Σ_k (1/n_k) Σ_{i∈k} [(1 − m_v) − e_i·c_k]₊
//! - push: 2/(K(K−1)) Σ_{a<b} [c_a·c_b − m_d]₊
//! - prototype cross-entropy: (1/K) Σ_k (1/n_k) Σ_{i∈k} −log softmax_k(e_i·c/τ)
//!
//! `pull = "chord"` replaces the bracket of the pull by [√(2 − 2 e_i·c_k) − m_v]₊. `hinge = "squared"` squares the brackets.
//! `weight = "point"` replaces 1/(K·n_k) by 1/Σn_k. stands.
//!
//! Sums are f64, and the backward pass is written by hand without a tensor library. A shape with fewer than two labeled parts has
//! no loss, because with one part there is only pull, and all embeddings would collapse.

use crate::config::{Hinge, LossConfig, LossWeight, Pull};
use crate::kernels::fused::{Kernel, vectorised};

/// An embedding before normalization counts as at least this long.
const MIN_NORM: f64 = 1e-6;
/// A chord counts as at least this long when the slope is divided by it.
const MIN_CHORD: f64 = 1e-6;
/// If the sum of a part's embeddings is shorter than this fraction of their count, the part has no direction.
const MIN_CONCENTRATION: f64 = 1e-4;

/// The loss and its terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossTerms {
    /// The weighted sum of the terms.
    pub total: f64,
    /// The pull, before its weight.
    pub pull: f64,
    /// The push, before its weight.
    pub push: f64,
    /// The prototype cross-entropy, before its weight.
    pub ce: f64,
}

impl LossTerms {
    /// The mean over several shapes, term by term. It is 0 if there are no shapes.
    pub(crate) fn mean(all: &[Self]) -> Self {
        let mean =
            |term: fn(&Self) -> f64| all.iter().map(term).sum::<f64>() / all.len().max(1) as f64;
        Self {
            total: mean(|terms| terms.total),
            pull: mean(|terms| terms.pull),
            push: mean(|terms| terms.push),
            ce: mean(|terms| terms.ce),
        }
    }
}

/// The loss of one shape, and its gradient.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loss {
    pub(crate) terms: LossTerms,
    /// ∂total/∂z, row by row.
    pub(crate) gradient: Vec<f64>,
}

/// Tokens of one shape as unit vectors, with the parts that occur numbered 0..K.
struct Parts {
    dim: usize,
    /// Unit embeddings of the labeled tokens.
    unit: Vec<f64>,
    /// Lengths of the embeddings before normalization.
    norm: Vec<f64>,
    /// Part of each labeled token.
    part: Vec<usize>,
    /// Row of each labeled token in the input.
    row: Vec<usize>,
    /// Labeled tokens of each part.
    size: Vec<f64>,
}

/// The direction of each part, and the factor of its gradient with respect to the sum of its embeddings.
struct Centers {
    /// Unit vectors, row by row.
    unit: Vec<f64>,
    /// 1/‖S_k‖, or 0 if the center is only a substitute, through which no gradient passes.
    inverse_norm: Vec<f64>,
}

/// The loss of embeddings `z` (rows of `dim`, not normalized) with one label per row. Negative labels are ignored.
///
/// Returns `None` if fewer than two parts occur.
pub(crate) fn cosdisc<Z: Copy + Into<f64>>(
    z: &[Z],
    dim: usize,
    labels: &[i32],
    config: &LossConfig,
) -> Option<Loss> {
    let mut loss = None;
    vectorised(Cosdisc {
        z,
        dim,
        labels,
        config,
        loss: &mut loss,
    });
    loss
}

struct Cosdisc<'a, Z> {
    z: &'a [Z],
    dim: usize,
    labels: &'a [i32],
    config: &'a LossConfig,
    loss: &'a mut Option<Loss>,
}

impl<Z: Copy + Into<f64>> Kernel for Cosdisc<'_, Z> {
    #[inline(always)]
    fn run(self) {
        let Self {
            z,
            dim,
            labels,
            config,
            loss,
        } = self;
        let parts = Parts::new(z, dim, labels);
        if parts.size.len() < 2 {
            return;
        }
        let centers = parts.centers();
        let mut terms = Terms::new(&parts, &centers, config, z.len());
        let (pull, ce) = terms.add_token_terms();
        let push = terms.add_push();
        let total =
            config.pull_weight * pull + config.push_weight * push + config.proto_ce_weight * ce;
        *loss = Some(Loss {
            terms: LossTerms {
                total,
                pull,
                push,
                ce,
            },
            gradient: terms.into_gradient(),
        });
    }
}

/// The scalar product, summed in eight lanes so that a product does not wait for the previous one.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a_lanes, a_rest), (b_lanes, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (x, y) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

#[inline(always)]
fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (x, y) in sum.iter_mut().zip(row) {
        *x += factor * y;
    }
}

impl Parts {
    #[inline(always)]
    fn new<Z: Copy + Into<f64>>(z: &[Z], dim: usize, labels: &[i32]) -> Self {
        let mut present: Vec<i32> = labels.iter().copied().filter(|&label| label >= 0).collect();
        present.sort_unstable();
        present.dedup();
        let mut parts = Self {
            dim,
            unit: Vec::with_capacity(z.len()),
            norm: Vec::new(),
            part: Vec::new(),
            row: Vec::new(),
            size: vec![0.0; present.len()],
        };
        for (row, (label, values)) in labels.iter().zip(z.chunks_exact(dim)).enumerate() {
            let Ok(part) = present.binary_search(label) else {
                continue;
            };
            let start = parts.unit.len();
            parts.unit.resize(start + dim, 0.0);
            let unit = &mut parts.unit[start..];
            for (unit, &x) in unit.iter_mut().zip(values) {
                *unit = x.into();
            }
            let norm = dot(unit, unit).sqrt().max(MIN_NORM);
            unit.iter_mut().for_each(|x| *x /= norm);
            parts.norm.push(norm);
            parts.part.push(part);
            parts.row.push(row);
            parts.size[part] += 1.0;
        }
        parts
    }

    #[inline(always)]
    fn embedding(&self, token: usize) -> &[f64] {
        &self.unit[token * self.dim..][..self.dim]
    }

    #[inline(always)]
    fn centers(&self) -> Centers {
        let mut unit = vec![0.0; self.size.len() * self.dim];
        for (&part, embedding) in self.part.iter().zip(self.unit.chunks_exact(self.dim)) {
            add_scaled(&mut unit[part * self.dim..][..self.dim], 1.0, embedding);
        }
        let mut inverse_norm = vec![0.0; self.size.len()];
        for (part, sum) in unit.chunks_exact_mut(self.dim).enumerate() {
            let norm = dot(sum, sum).sqrt();
            if norm >= MIN_CONCENTRATION * self.size[part] {
                inverse_norm[part] = 1.0 / norm;
                sum.iter_mut().for_each(|x| *x /= norm);
            } else if let Some(token) = self.medoid(part, sum) {
                sum.copy_from_slice(self.embedding(token));
            }
        }
        Centers { unit, inverse_norm }
    }

    /// The token of a part with the largest sum of cosines to the others. In a tie, it is the first one.
    fn medoid(&self, part: usize, sum: &[f64]) -> Option<usize> {
        let members = (0..self.part.len()).filter(|&token| self.part[token] == part);
        let scored = members.map(|token| (dot(self.embedding(token), sum), token));
        scored
            .reduce(|best, next| if next.0 > best.0 { next } else { best })
            .map(|(_, token)| token)
    }
}

/// Gradients with respect to unit embeddings and centers, summed term by term.
struct Terms<'a> {
    parts: &'a Parts,
    centers: &'a Centers,
    config: &'a LossConfig,
    /// The gradient, row by row of the input. At first it is with respect to the unit embeddings, and in the end with respect to
    /// the rows themselves.
    gradient: Vec<f64>,
    by_center: Vec<f64>,
}

impl<'a> Terms<'a> {
    fn new(
        parts: &'a Parts,
        centers: &'a Centers,
        config: &'a LossConfig,
        n_values: usize,
    ) -> Self {
        Self {
            parts,
            centers,
            config,
            gradient: vec![0.0; n_values],
            by_center: vec![0.0; centers.unit.len()],
        }
    }

    fn n_parts(&self) -> usize {
        self.parts.size.len()
    }

    #[inline(always)]
    fn center(&self, part: usize) -> &'a [f64] {
        &self.centers.unit[part * self.parts.dim..][..self.parts.dim]
    }

    /// Adds pull and prototype cross-entropy, which depend on a token's cosines with all centers.
    #[inline(always)]
    fn add_token_terms(&mut self) -> (f64, f64) {
        let (mut pull, mut ce) = (0.0, 0.0);
        let mut slopes = vec![0.0; self.n_parts()];
        for (token, &own) in self.parts.part.iter().enumerate() {
            let share = self.share_of_token(own);
            let embedding = self.parts.embedding(token);
            for (cosine, center) in slopes
                .iter_mut()
                .zip(self.centers.unit.chunks_exact(self.parts.dim))
            {
                *cosine = dot(embedding, center);
            }
            let (gap, slope) = pull_of(slopes[own], self.config);
            pull += share * gap;
            ce += share * cross_entropy(&mut slopes, own, self.config.temperature);
            slopes
                .iter_mut()
                .for_each(|slope| *slope *= self.config.proto_ce_weight);
            slopes[own] -= slope * self.config.pull_weight;
            self.add_cosine_slopes(token, share, &slopes);
        }
        (pull, ce)
    }

    /// The weight of a token of this part.
    #[inline(always)]
    fn share_of_token(&self, part: usize) -> f64 {
        match self.config.weight {
            LossWeight::Part => 1.0 / (self.n_parts() as f64 * self.parts.size[part]),
            LossWeight::Point => 1.0 / self.parts.part.len() as f64,
        }
    }

    /// Adds ∂L/∂(e_i·c_k) to the gradients of the embedding and the centers.
    #[inline(always)]
    fn add_cosine_slopes(&mut self, token: usize, share: f64, slopes: &[f64]) {
        let dim = self.parts.dim;
        let embedding = self.parts.embedding(token);
        let by_embedding = &mut self.gradient[self.parts.row[token] * dim..][..dim];
        let centers = self
            .centers
            .unit
            .chunks_exact(dim)
            .zip(self.by_center.chunks_exact_mut(dim));
        for ((center, by_center), slope) in centers.zip(slopes) {
            add_scaled(by_embedding, share * slope, center);
            add_scaled(by_center, share * slope, embedding);
        }
    }

    fn add_push(&mut self) -> f64 {
        let (n, dim) = (self.n_parts(), self.parts.dim);
        let share = 2.0 / (n * (n - 1)) as f64;
        let mut push = 0.0;
        for a in 0..n {
            for b in a + 1..n {
                let (first, second) = (self.center(a), self.center(b));
                let (excess, slope) = hinge(
                    dot(first, second) - self.config.push_margin,
                    self.config.hinge,
                );
                if slope > 0.0 {
                    push += share * excess;
                    let weight = slope * share * self.config.push_weight;
                    add_scaled(&mut self.by_center[a * dim..][..dim], weight, second);
                    add_scaled(&mut self.by_center[b * dim..][..dim], weight, first);
                }
            }
        }
        push
    }

    /// Converts the gradients of the centers to those of the embeddings, and these to the gradients of the rows before
    /// normalization.
    #[inline(always)]
    fn into_gradient(mut self) -> Vec<f64> {
        let dim = self.parts.dim;
        for part in 0..self.n_parts() {
            let (center, by_sum) = (self.center(part), &mut self.by_center[part * dim..][..dim]);
            project_out(by_sum, center, self.centers.inverse_norm[part]);
        }
        for (token, (&row, &part)) in self.parts.row.iter().zip(&self.parts.part).enumerate() {
            let target = &mut self.gradient[row * dim..][..dim];
            add_scaled(target, 1.0, &self.by_center[part * dim..][..dim]);
            project_out(
                target,
                self.parts.embedding(token),
                1.0 / self.parts.norm[token],
            );
        }
        self.gradient
    }
}

/// The backward pass of u = v/‖v‖: removes the component along `unit` and divides by the length.
#[inline(always)]
fn project_out(gradient: &mut [f64], unit: &[f64], inverse_norm: f64) {
    let along = dot(gradient, unit);
    for (g, u) in gradient.iter_mut().zip(unit) {
        *g = (*g - along * u) * inverse_norm;
    }
}

/// The pull of an embedding with this cosine to its center, and the rate at which it decreases with the cosine.
#[inline(always)]
fn pull_of(cosine: f64, config: &LossConfig) -> (f64, f64) {
    match config.pull {
        Pull::Cosine => hinge(1.0 - config.pull_margin - cosine, config.hinge),
        Pull::Chord => {
            let squared = 2.0 - 2.0 * cosine;
            // Rounding can make it negative. A NaN is kept, because the training must detect it.
            let length = if squared < 0.0 { 0.0 } else { squared.sqrt() };
            let (gap, slope) = hinge(length - config.pull_margin, config.hinge);
            (gap, slope / length.max(MIN_CHORD))
        }
    }
}

/// `[excess]`₊ or its square, and its slope.
#[inline(always)]
fn hinge(excess: f64, hinge: Hinge) -> (f64, f64) {
    let excess_or_0 = excess.max(0.0);
    match hinge {
        // A NaN is kept, because the training must detect it.
        _ if excess.is_nan() => (excess, excess),
        Hinge::Linear => (excess_or_0, f64::from(u8::from(excess > 0.0))),
        Hinge::Squared => (excess_or_0.powi(2), 2.0 * excess_or_0),
    }
}

/// −log softmax(cosines/τ) at `own`. Replaces each cosine by the derivative with respect to it.
#[inline(always)]
fn cross_entropy(cosines: &mut [f64], own: usize, temperature: f64) -> f64 {
    let highest = cosines.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let gap = (cosines[own] - highest) / temperature;
    let mut total = 0.0;
    for cosine in cosines.iter_mut() {
        *cosine = ((*cosine - highest) / temperature).exp();
        total += *cosine;
    }
    for (part, weight) in cosines.iter_mut().enumerate() {
        *weight = (*weight / total - f64::from(u8::from(part == own))) / temperature;
    }
    total.ln() - gap
}

#[cfg(test)]
mod tests;

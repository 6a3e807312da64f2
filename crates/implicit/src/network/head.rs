//! Computes the segmentation head: from the last hidden layer of a trunk to one score per label, by one hidden layer with ReLU.

use super::block::{BLOCK, PreparedNetwork, Workspace};
use super::layout::{HEAD_WIDTH, Layout};
use crate::kernels::{
    Kernel, add_column_sums, add_outer_products, exp_of_negative, multiply, vectorized,
};

/// The rows of a block in the head.
#[derive(Clone, Debug)]
pub(crate) struct HeadRows {
    hidden: Vec<f32>,
    by_hidden: Vec<f32>,
    /// One score per label and, after [`Workspace::cross_entropy`], the derivative of the loss by it, `[BLOCK, label_columns]`.
    scores: Vec<f32>,
}

impl HeadRows {
    pub(super) fn new(layout: &Layout) -> Self {
        Self {
            hidden: vec![0.0; BLOCK * HEAD_WIDTH],
            by_hidden: vec![0.0; BLOCK * HEAD_WIDTH],
            scores: vec![0.0; BLOCK * layout.label_columns()],
        }
    }
}

impl PreparedNetwork {
    pub(super) fn prepare_head(&mut self) {
        let layout = self.layout;
        let columns = layout.label_columns();
        let [first, second, first_back, second_back] = &mut self.head;
        let hidden = &self.parameters[layout.head_weights()];
        let labels = &self.parameters[layout.label_weights()];
        first.set(hidden, layout.width, HEAD_WIDTH);
        second.set(labels, HEAD_WIDTH, columns);
        first_back.set_transpose(hidden, HEAD_WIDTH, layout.width);
        second_back.set_transpose(labels, columns, HEAD_WIDTH);
    }
}

impl Workspace {
    /// Computes the scores of the labels, after [`forward`](Self::forward).
    pub(super) fn score_labels(&mut self, network: &PreparedNetwork) {
        vectorized(ScoreLabels(self, network));
    }

    #[inline(always)]
    fn score_labels_by<const N: usize>(&mut self, network: &PreparedNetwork) {
        let layout = &network.layout;
        let mut head = std::mem::replace(&mut self.head, HeadRows::empty());
        let biases = network.slice(layout.head_biases());
        multiply::<N>(self.last(), &network.head[0], biases, &mut head.hidden);
        for x in &mut head.hidden {
            *x = if *x > 0.0 { *x } else { 0.0 };
        }
        let biases = network.slice(layout.label_biases());
        multiply::<N>(&head.hidden, &network.head[1], biases, &mut head.scores);
        self.head = head;
    }

    /// The label with the highest score of each point. If several are equal, it is the lowest one.
    pub(super) fn best_labels(&self, layout: &Layout) -> impl Iterator<Item = u32> {
        let n_labels = layout.n_labels;
        let rows = self.head.scores.chunks_exact(layout.label_columns().max(1));
        rows.map(move |row| {
            let mut best = 0;
            for label in 1..n_labels {
                if row[label] > row[best] {
                    best = label;
                }
            }
            best as u32
        })
    }

    /// The weighted cross-entropy of the block. Adds its derivatives to the head's sums, and stores the derivatives by the last
    /// hidden layer in `by_last`. A negative label has no loss.
    pub(crate) fn cross_entropy(
        &mut self,
        network: &PreparedNetwork,
        labels: &[i32],
        weights: &[f32],
    ) -> f64 {
        self.score_labels(network);
        let mut total = 0.0;
        vectorized(CrossEntropy {
            workspace: self,
            network,
            labels,
            weights,
            total: &mut total,
        });
        total
    }

    #[inline(always)]
    fn cross_entropy_by<const N: usize>(
        &mut self,
        network: &PreparedNetwork,
        labels: &[i32],
        weights: &[f32],
    ) -> f64 {
        let layout = &network.layout;
        let columns = layout.label_columns();
        let mut head = std::mem::replace(&mut self.head, HeadRows::empty());
        let mut total = 0.0;
        for ((row, &label), &weight) in head
            .scores
            .chunks_exact_mut(columns)
            .zip(labels)
            .zip(weights)
        {
            total += to_derivative(row, layout.n_labels, label, weight);
        }
        let sums = &mut self.sums;
        let dims = [HEAD_WIDTH, columns];
        add_outer_products::<N>(
            &head.hidden,
            &head.scores,
            dims,
            &mut sums[layout.label_weights()],
        );
        add_column_sums(&head.scores, &mut sums[layout.label_biases()]);
        multiply::<N>(&head.scores, &network.head[3], &[], &mut head.by_hidden);
        for (by, &x) in head.by_hidden.iter_mut().zip(&head.hidden) {
            *by = if x > 0.0 { *by } else { 0.0 };
        }
        let dims = [layout.width, HEAD_WIDTH];
        let last = self.values.last().map_or(&[][..], |last| last);
        add_outer_products::<N>(
            last,
            &head.by_hidden,
            dims,
            &mut sums[layout.head_weights()],
        );
        add_column_sums(&head.by_hidden, &mut sums[layout.head_biases()]);
        multiply::<N>(&head.by_hidden, &network.head[2], &[], &mut self.by_last);
        self.head = head;
        total
    }
}

struct ScoreLabels<'a>(&'a mut Workspace, &'a PreparedNetwork);

impl Kernel for ScoreLabels<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        self.0.score_labels_by::<N>(self.1);
    }
}

struct CrossEntropy<'a> {
    workspace: &'a mut Workspace,
    network: &'a PreparedNetwork,
    labels: &'a [i32],
    weights: &'a [f32],
    total: &'a mut f64,
}

impl Kernel for CrossEntropy<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        let found = self
            .workspace
            .cross_entropy_by::<N>(self.network, self.labels, self.weights);
        *self.total = found;
    }
}

impl HeadRows {
    /// A placeholder for the rows while they are in use. It allocates nothing.
    fn empty() -> Self {
        Self {
            hidden: Vec::new(),
            by_hidden: Vec::new(),
            scores: Vec::new(),
        }
    }
}

/// Replaces the scores of a point by the derivatives of its loss, and returns the loss.
#[inline(always)]
fn to_derivative(row: &mut [f32], n_labels: usize, label: i32, weight: f32) -> f64 {
    let Some(label) = usize::try_from(label)
        .ok()
        .filter(|&label| label < n_labels)
    else {
        row.fill(0.0);
        return 0.0;
    };
    let (scores, beyond) = row.split_at_mut(n_labels);
    let highest = scores.iter().fold(
        f32::NEG_INFINITY,
        |most, &x| if most < x { x } else { most },
    );
    let own = scores[label] - highest;
    let mut total = 0.0;
    for x in &mut *scores {
        *x = exp_of_negative(*x - highest);
        total += *x;
    }
    for x in &mut *scores {
        *x *= weight / total;
    }
    scores[label] -= weight;
    beyond.fill(0.0);
    f64::from(weight) * (libm::log(f64::from(total)) - f64::from(own))
}

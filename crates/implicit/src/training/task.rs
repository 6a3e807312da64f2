//! Defines the work of one thread in an update: some blocks, one after the other, with the sums of their gradients and losses.

use super::batch::{Block, Kind};
use super::losses::{Factors, Losses};
use super::settings::{Mode, SegGrad};
use super::update::PointLabels;
use crate::geometry::Pools;
use crate::network::{BackwardParts, Layout, PreparedNetwork, Workspace};

/// The data that all blocks of an update share.
pub(super) struct Shared<'a> {
    pub(super) network: &'a PreparedNetwork,
    pub(super) pools: &'a Pools,
    pub(super) labels: Option<&'a PointLabels>,
    pub(super) mode: Mode,
    pub(super) seg_grad: SegGrad,
    pub(super) factors: Factors,
}

/// The workspaces of one task, and its losses.
#[derive(Clone, Debug)]
pub(super) struct Task {
    pub(super) main: Workspace,
    /// The points around a point, for second derivatives by differences.
    pub(super) around: Option<Workspace>,
    pub(super) losses: Losses,
    labels: Vec<i32>,
    label_weights: Vec<f32>,
}

impl Task {
    pub(super) fn new(layout: &Layout, mode: Mode) -> Self {
        let needs_around = mode == Mode::FlatCad;
        Self {
            main: Workspace::new(layout),
            around: needs_around.then(|| Workspace::new(layout)),
            losses: Losses::default(),
            labels: Vec::new(),
            label_weights: Vec::new(),
        }
    }

    /// Resets the sums of the previous update.
    pub(super) fn reset(&mut self) {
        self.main.sums.fill(0.0);
        if let Some(around) = &mut self.around {
            around.sums.fill(0.0);
        }
        self.losses = Losses::default();
    }

    /// Adds a block.
    pub(super) fn add(&mut self, block: &Block, shared: &Shared<'_>) {
        let positions = match block.kind {
            Kind::Surface => &shared.pools.surface.positions,
            Kind::Near => &shared.pools.near.positions,
            Kind::Uniform => &shared.pools.uniform.positions,
        };
        let (targets, _) = self.main.positions.as_chunks_mut::<3>();
        for (target, &point) in targets.iter_mut().zip(&block.points) {
            *target = positions[point as usize];
        }
        self.main.forward(shared.network);
        let has_gradient = match (shared.mode, block.kind) {
            (Mode::OracleSdf, Kind::Surface) => self.oracle_surface(block, shared),
            (Mode::OracleSdf, Kind::Near) => self.oracle_near(block, shared),
            (Mode::OracleSdf, Kind::Uniform) => self.oracle_uniform(block, shared),
            (Mode::FlatCad, Kind::Surface) => self.flatcad_surface(shared),
            (Mode::FlatCad, Kind::Near) => self.flatcad_near(block, shared),
            (Mode::FlatCad, Kind::Uniform) => self.flatcad_uniform(shared),
        };
        let has_head = block.kind == Kind::Surface && self.segment(block, shared);
        if has_gradient {
            self.main.pull_back_gradient(shared.network);
        }
        let parts = BackwardParts {
            has_head,
            has_gradient,
        };
        self.main.backward(shared.network, parts);
    }

    /// Adds the segmentation loss of surface points. Returns whether its gradient goes into the trunk.
    fn segment(&mut self, block: &Block, shared: &Shared<'_>) -> bool {
        let Some(labels) = shared.labels else {
            return false;
        };
        let factor = shared.factors.segmentation as f32;
        self.labels.clear();
        self.label_weights.clear();
        for &point in &block.points {
            let label = labels.of_point(point);
            self.labels.push(label);
            self.label_weights.push(factor * labels.weight(label));
        }
        let total = self
            .main
            .cross_entropy(shared.network, &self.labels, &self.label_weights);
        // The reported mean is without the weight of the term.
        self.losses.segmentation += total / f64::from(factor) * shared.factors.means.surface;
        shared.seg_grad == SegGrad::Trunk
    }
}

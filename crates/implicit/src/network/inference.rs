//! Defines a network with its weights, which computes distances and labels at any position.

use super::block::{BLOCK, PreparedNetwork, Workspace};
use super::initial::initial_parameters;
use super::layout::Layout;
use super::trunk::Trunk;
use rayon::prelude::*;

/// The number of blocks that one thread processes at a time.
const BLOCKS_AT_ONCE: usize = 16;

/// A trunk with its head, and their weights.
///
/// Positions are in the frame of the [`Reference`](crate::Reference): the shape fills the cube from −1 to 1 along its longest
/// side. Distances are in the same unit, negative inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    trunk: Trunk,
    n_labels: usize,
    parameters: Vec<f32>,
}

impl Network {
    /// A network with initial weights. `n_labels` is 0 for a network without a head. The weights of the trunk do not depend on
    /// it.
    #[must_use]
    pub fn new(trunk: Trunk, n_labels: usize, seed: u64) -> Self {
        Self {
            trunk,
            n_labels,
            parameters: initial_parameters(trunk, n_labels, seed),
        }
    }

    /// The trunk.
    #[must_use]
    pub fn trunk(&self) -> Trunk {
        self.trunk
    }

    /// The number of labels of the head. It is 0 without a head.
    #[must_use]
    pub fn n_labels(&self) -> usize {
        self.n_labels
    }

    /// The weights of the trunk: for each layer, its matrix, with one row per input, and its biases.
    #[must_use]
    pub fn trunk_parameters(&self) -> &[f32] {
        &self.parameters[..self.layout().n_trunk_parameters()]
    }

    /// The distance at each position.
    #[must_use]
    pub fn distances(&self, positions: &[[f32; 3]]) -> Vec<f32> {
        self.for_blocks(positions, |network, workspace, positions, found| {
            workspace.place(positions);
            workspace.forward(network);
            found.extend_from_slice(&workspace.outputs[..positions.len()]);
        })
    }

    /// The distance at each position and its gradient.
    #[must_use]
    pub fn distances_and_gradients(&self, positions: &[[f32; 3]]) -> Vec<(f32, [f32; 3])> {
        self.for_blocks(positions, |network, workspace, positions, found| {
            workspace.place(positions);
            workspace.forward(network);
            workspace.gradient(network);
            let (gradients, _) = workspace.gradients.as_chunks::<3>();
            let all = workspace
                .outputs
                .iter()
                .copied()
                .zip(gradients.iter().copied());
            found.extend(all.take(positions.len()));
        })
    }

    /// The label at each position. All labels are 0 without a head.
    #[must_use]
    pub fn labels(&self, positions: &[[f32; 3]]) -> Vec<u32> {
        if self.n_labels == 0 {
            return vec![0; positions.len()];
        }
        let layout = self.layout();
        self.for_blocks(positions, |network, workspace, positions, found| {
            workspace.place(positions);
            workspace.forward(network);
            workspace.score_labels(network);
            found.extend(workspace.best_labels(&layout).take(positions.len()));
        })
    }

    pub(crate) fn layout(&self) -> Layout {
        Layout::new(self.trunk.width(), self.n_labels)
    }

    pub(crate) fn prepared(&self) -> PreparedNetwork {
        let activation = self.trunk.activation();
        PreparedNetwork::new(self.layout(), activation, self.parameters.clone())
    }

    pub(crate) fn set_parameters(&mut self, parameters: Vec<f32>) {
        self.parameters = parameters;
    }

    /// Calls `work` for each block of positions. The results are in their order.
    fn for_blocks<T: Send>(
        &self,
        positions: &[[f32; 3]],
        work: impl Fn(&PreparedNetwork, &mut Workspace, &[[f32; 3]], &mut Vec<T>) + Sync,
    ) -> Vec<T> {
        let network = self.prepared();
        let found: Vec<Vec<T>> = positions
            .par_chunks(BLOCK * BLOCKS_AT_ONCE)
            .map_init(
                || Workspace::new(&network.layout),
                |workspace, positions| {
                    let mut found = Vec::with_capacity(positions.len());
                    for block in positions.chunks(BLOCK) {
                        work(&network, workspace, block, &mut found);
                    }
                    found
                },
            )
            .collect();
        found.into_iter().flatten().collect()
    }
}

impl Workspace {
    /// Stores up to [`BLOCK`] positions. The rest of the block is at the origin.
    fn place(&mut self, positions: &[[f32; 3]]) {
        self.positions.fill(0.0);
        for (target, position) in self.positions.iter_mut().zip(positions.iter().flatten()) {
            *target = *position;
        }
    }
}

//! Gathers rows by index, and takes the maximum over the rows of each cluster.

use super::tile::{Kernel, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use burn::tensor::Tensor;
use std::sync::Arc;

/// One row per index. Returns `None` if the tensor is not of the flex backend.
///
/// # Shapes
/// - rows: `[row, channel]`
/// - indices: `[n]`, each below the number of rows
/// - output: `[n, channel]`
pub(crate) fn gather(rows: &Tensor<2>, indices: &Arc<[u32]>) -> Option<Tensor<2>> {
    let [n, dim] = rows.dims();
    let inputs = [flexible(rows)?];
    let [x] = inputs.each_ref().map(Flexible::values);
    let x = slice(&x);
    let mut y = Vec::with_capacity(indices.len() * dim);
    for &row in indices.iter() {
        y.extend_from_slice(&x[row as usize * dim..][..dim]);
    }
    let indices = Arc::clone(indices);
    record(
        inputs,
        tensor_of(y, [indices.len(), dim]),
        move |by_output, _| {
            let mut by_rows = vec![0.0; n * dim];
            vectorised(AddRows {
                rows: slice(by_output),
                indices: &indices,
                dim,
                sums: &mut by_rows,
            });
            [tensor_of(by_rows, [n, dim])]
        },
    )
}

/// Adds each row to the row with its index.
///
/// # Shapes
/// - rows: `[n, dim]`
/// - indices: `[n]`
/// - sums: `[row, dim]`
struct AddRows<'a> {
    rows: &'a [f32],
    indices: &'a [u32],
    dim: usize,
    sums: &'a mut [f32],
}

impl Kernel for AddRows<'_> {
    #[inline(always)]
    fn run(self) {
        for (row, &target) in self.rows.chunks_exact(self.dim.max(1)).zip(self.indices) {
            for (sum, x) in self.sums[target as usize * self.dim..][..self.dim]
                .iter_mut()
                .zip(row)
            {
                *sum += x;
            }
        }
    }
}

/// The maximum over each group of `group` rows, channel by channel. If several rows have the maximum, the first one gets the
/// gradient.
///
/// Returns `None` if the tensor is not of the flex backend.
///
/// # Shapes
/// - rows: `[token, channel]`
/// - members: `[cluster, group]`, indices of rows
/// - output: `[cluster, channel]`
pub(crate) fn cluster_max(rows: &Tensor<2>, members: &[u32], group: usize) -> Option<Tensor<2>> {
    let [n, dim] = rows.dims();
    let inputs = [flexible(rows)?];
    let [x] = inputs.each_ref().map(Flexible::values);
    let n_clusters = members.len() / group.max(1);
    let (mut y, mut winners) = (vec![0.0; n_clusters * dim], vec![0u32; n_clusters * dim]);
    vectorised(Maximum {
        x: slice(&x),
        members,
        group,
        dim,
        y: &mut y,
        winners: &mut winners,
    });
    record(
        inputs,
        tensor_of(y, [n_clusters, dim]),
        move |by_output, _| {
            let mut by_rows = vec![0.0; n * dim];
            for (idx, (&g, &winner)) in slice(by_output).iter().zip(&winners).enumerate() {
                by_rows[winner as usize * dim + idx % dim] += g;
            }
            [tensor_of(by_rows, [n, dim])]
        },
    )
}

/// # Shapes
/// - x: `[token, dim]`
/// - members: `[cluster, group]`
/// - y and winners: `[cluster, dim]`; a winner is the token with the maximum
struct Maximum<'a> {
    x: &'a [f32],
    members: &'a [u32],
    group: usize,
    dim: usize,
    y: &'a mut [f32],
    winners: &'a mut [u32],
}

impl Kernel for Maximum<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            x,
            members,
            group,
            dim,
            y,
            winners,
        } = self;
        let outputs = y
            .chunks_exact_mut(dim.max(1))
            .zip(winners.chunks_exact_mut(dim.max(1)));
        for (members, (y, winners)) in members.chunks_exact(group.max(1)).zip(outputs) {
            let first = members[0];
            y.copy_from_slice(&x[first as usize * dim..][..dim]);
            winners.fill(first);
            for &member in &members[1..] {
                let row = &x[member as usize * dim..][..dim];
                for ((y, winner), &x) in y.iter_mut().zip(winners.iter_mut()).zip(row) {
                    let wins = *y < x;
                    *y = if wins { x } else { *y };
                    *winner = if wins { member } else { *winner };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::data::rows::Rows;
    use crate::kernels::ops::{composed_cluster_max, composed_gather};

    #[test]
    fn fused_and_composed_agree() {
        for [n, dim] in [[1, 3], [9, 33], [40, 16]] {
            let indices: Vec<u32> = (0..8 * n as u32).map(|at| at * at % n as u32).collect();
            let rows = Rows::new(&indices, 8);
            let x = [input([n, dim], "x")];
            check(
                &x,
                |[x]| gather(&x, &rows.indices).unwrap(),
                |[x]| composed_gather(x, &rows),
            );
            check(
                &x,
                |[x]| cluster_max(&x, &rows.indices, 8).unwrap(),
                |[x]| composed_cluster_max(x, &rows),
            );
        }
    }
}

//! Composes the tensor operations of the backbones from burn's own operations. They run on every backend.
//!
//! On the flex backend the faster operations of `fused` are used instead.

use crate::data::neighbors::Neighbors;
use crate::data::patches::Patches;
use crate::data::rows::Rows;
use crate::kernels::fused::{self, MlpWeights};
use crate::kernels::rotary_axes::RotaryAxes;
use burn::tensor::{Device, Int, Tensor, TensorData, activation};
use std::sync::Arc;

/// The number that layer normalization adds to the variance. It is PyTorch's default.
const NORM_EPSILON: f64 = 1e-5;

/// A number whose gradient with respect to `rows` is `gradient`.
pub(crate) fn with_gradient(rows: Tensor<2>, gradient: Vec<f32>) -> Tensor<1> {
    let gradient = TensorData::new(gradient, rows.dims());
    fused::with_gradient(&rows, &gradient).unwrap_or_else(|| composed_with_gradient(rows, gradient))
}

/// The sum of rows · constant has exactly this gradient.
pub(crate) fn composed_with_gradient(rows: Tensor<2>, gradient: TensorData) -> Tensor<1> {
    let constant = Tensor::from_data(gradient, &rows.device());
    (rows * constant).sum()
}

fn select(rows: Tensor<2>, indices: &[u32]) -> Tensor<2> {
    let wide: Vec<i64> = indices.iter().map(|&idx| i64::from(idx)).collect();
    let indices =
        Tensor::<1, Int>::from_data(TensorData::new(wide, [indices.len()]), &rows.device());
    rows.select(0, indices)
}

/// Rows times `weight`, plus `bias`.
pub(crate) fn linear(rows: Tensor<2>, weight: Tensor<2>, bias: Option<Tensor<1>>) -> Tensor<2> {
    fused::linear(&rows, &weight, bias.as_ref())
        .unwrap_or_else(|| composed_linear(rows, weight, bias))
}

pub(crate) fn composed_linear(
    rows: Tensor<2>,
    weight: Tensor<2>,
    bias: Option<Tensor<1>>,
) -> Tensor<2> {
    let product = rows.matmul(weight);
    match bias {
        Some(bias) => product + bias.unsqueeze(),
        None => product,
    }
}

/// Layer norm, linear map, GELU, linear map.
pub(crate) fn mlp(rows: Tensor<2>, weights: MlpWeights) -> Tensor<2> {
    fused::mlp(&rows, &weights, NORM_EPSILON as f32).unwrap_or_else(|| composed_mlp(rows, weights))
}

pub(crate) fn composed_mlp(rows: Tensor<2>, weights: MlpWeights) -> Tensor<2> {
    let MlpWeights {
        norm: [scale, shift],
        hidden,
        out,
    } = weights;
    let hidden = activation::gelu(composed_linear(
        composed_layer_norm(rows, scale, shift),
        hidden.0,
        hidden.1,
    ));
    composed_linear(hidden, out.0, out.1)
}

/// Normalizes each row to mean 0 and variance 1, then scales and shifts each channel.
pub(crate) fn layer_norm(rows: Tensor<2>, scale: Tensor<1>, shift: Tensor<1>) -> Tensor<2> {
    fused::layer_norm(&rows, &scale, &shift, NORM_EPSILON as f32)
        .unwrap_or_else(|| composed_layer_norm(rows, scale, shift))
}

pub(crate) fn composed_layer_norm(
    rows: Tensor<2>,
    scale: Tensor<1>,
    shift: Tensor<1>,
) -> Tensor<2> {
    let centered = rows.clone() - rows.mean_dim(1);
    let variance = (centered.clone() * centered.clone()).mean_dim(1);
    centered / (variance + NORM_EPSILON).sqrt() * scale.unsqueeze() + shift.unsqueeze()
}

/// x·Φ(x), with the error function.
pub(crate) fn gelu(rows: Tensor<2>) -> Tensor<2> {
    fused::gelu(&rows).unwrap_or_else(|| activation::gelu(rows))
}

/// One row per index.
pub(crate) fn gather(rows: Tensor<2>, indices: &Rows) -> Tensor<2> {
    fused::gather(&rows, &indices.indices).unwrap_or_else(|| composed_gather(rows, indices))
}

pub(crate) fn composed_gather(rows: Tensor<2>, indices: &Rows) -> Tensor<2> {
    select(rows, &indices.indices)
}

/// The maximum over each group of rows, channel by channel.
pub(crate) fn cluster_max(rows: Tensor<2>, members: &Rows) -> Tensor<2> {
    fused::cluster_max(&rows, &members.indices, members.group)
        .unwrap_or_else(|| composed_cluster_max(rows, members))
}

pub(crate) fn composed_cluster_max(rows: Tensor<2>, members: &Rows) -> Tensor<2> {
    let [_, dim] = rows.dims();
    let n_clusters = members.indices.len() / members.group;
    select(rows, &members.indices)
        .reshape([n_clusters, members.group, dim])
        .max_dim(1)
        .squeeze_dim(1)
}

/// A submanifold convolution: the concatenated rows around each token (zeros for empty cells) times `weight`.
///
/// # Shapes
/// - rows: `[token, in]`
/// - weight: `[offset × in, out]`
pub(crate) fn convolution(
    rows: Tensor<2>,
    neighbors: &Neighbors,
    weight: Tensor<2>,
    bias: Option<Tensor<1>>,
) -> Tensor<2> {
    fused::convolution(&rows, &neighbors.pairs, &weight, bias.as_ref())
        .unwrap_or_else(|| composed_convolution(rows, neighbors, weight, bias))
}

pub(crate) fn composed_convolution(
    rows: Tensor<2>,
    neighbors: &Neighbors,
    weight: Tensor<2>,
    bias: Option<Tensor<1>>,
) -> Tensor<2> {
    let [n, dim] = rows.dims();
    let n_offsets = neighbors.pairs.n_offsets();
    let table = neighbors.pairs.to_table(neighbors.n_tokens);
    let empty = Tensor::zeros([1, dim], &rows.device());
    let around = select(Tensor::cat(vec![rows, empty], 0), &table).reshape([n, n_offsets * dim]);
    composed_linear(around, weight, bias)
}

/// Scaled dot-product attention within each patch.
///
/// # Shapes
/// - qkv: `[token, 3 × head × channel]`
/// - output: `[token, head × channel]`
pub(crate) fn patch_attention(qkv: Tensor<2>, patches: &Arc<Patches>, n_heads: usize) -> Tensor<2> {
    fused::patch_attention(&qkv, patches, n_heads)
        .unwrap_or_else(|| composed_patch_attention(qkv, patches, n_heads))
}

pub(crate) fn composed_patch_attention(
    qkv: Tensor<2>,
    patches: &Arc<Patches>,
    n_heads: usize,
) -> Tensor<2> {
    let width = qkv.dims()[1] / 3;
    let Patches {
        size,
        order,
        position,
    } = patches.as_ref();
    let (size, dim) = (*size, width / n_heads);
    let n_patches = order.len() / size;
    let by_patch = select(qkv, order)
        .reshape([n_patches, size, 3, n_heads, dim])
        .permute([2, 0, 3, 1, 4]);
    let [query, key, value] = [0, 1, 2].map(|third| {
        by_patch
            .clone()
            .slice_dim(0, third..third + 1)
            .squeeze_dim::<4>(0)
    });
    let scores = query.matmul(key.swap_dims(2, 3));
    let mixed = activation::softmax(scores * (dim as f64).powf(-0.5), 3).matmul(value);
    select(
        mixed
            .permute([0, 2, 1, 3])
            .reshape([n_patches * size, width]),
        position,
    )
}

/// Queries and keys, rotated by the positions of their tokens, and unchanged values.
///
/// # Shapes
/// - qkv and output: `[token, 3 × head × channel]`
/// - coordinates: `[token, head × 3]`
pub(crate) fn rotary(qkv: Tensor<2>, coordinates: Tensor<2>, axes: RotaryAxes) -> Tensor<2> {
    fused::rotary(&qkv, &coordinates, axes)
        .unwrap_or_else(|| composed_rotary(qkv, coordinates, axes))
}

pub(crate) fn composed_rotary(
    qkv: Tensor<2>,
    coordinates: Tensor<2>,
    axes: RotaryAxes,
) -> Tensor<2> {
    let device = qkv.device();
    let tables = RotaryTables::new(axes, &device);
    let angles = coordinates.matmul(tables.frequencies);
    let (cos, sin) = (angles.clone().cos(), angles.sin());

    let width = axes.width();
    let third = |idx: usize| qkv.clone().slice_dim(1, idx * width..(idx + 1) * width);
    let turned = |rows: Tensor<2>| {
        let (u, v) = (
            rows.clone().matmul(tables.first.clone()),
            rows.clone().matmul(tables.second.clone()),
        );
        let new_u = u.clone() * cos.clone() - v.clone() * sin.clone();
        let new_v = v * cos.clone() + u * sin.clone();
        new_u.matmul(tables.first.clone().transpose())
            + new_v.matmul(tables.second.clone().transpose())
            + rows * tables.stays.clone()
    };
    Tensor::cat(vec![turned(third(0)), turned(third(1)), third(2)], 1)
}

/// Matrices that are mostly zero. [`composed_rotary`] computes angles and selects channels with them.
struct RotaryTables {
    /// `[head × 3, head × pair]`: from coordinates to angles.
    frequencies: Tensor<2>,
    /// `[head × channel, head × pair]`: the first channel of each pair.
    first: Tensor<2>,
    /// The second channel of each pair.
    second: Tensor<2>,
    /// `[1, head × channel]`: 1 for channels without a partner.
    stays: Tensor<2>,
}

impl RotaryTables {
    fn new(axes: RotaryAxes, device: &Device) -> Self {
        let pairs = axes.pairs();
        let (n_columns, width) = (axes.n_heads * pairs.len(), axes.width());
        let mut frequencies = vec![0.0_f32; 3 * axes.n_heads * n_columns];
        let [mut first, mut second] = [(); 2].map(|()| vec![0.0_f32; width * n_columns]);
        let mut stays = vec![1.0_f32; width];
        for head in 0..axes.n_heads {
            for (idx, pair) in pairs.iter().enumerate() {
                let column = head * pairs.len() + idx;
                frequencies[(3 * head + pair.axis) * n_columns + column] = pair.frequency;
                for (table, channel) in [(&mut first, pair.first), (&mut second, pair.second)] {
                    let channel = head * axes.head_dim + channel;
                    table[channel * n_columns + column] = 1.0;
                    stays[channel] = 0.0;
                }
            }
        }
        let tensor = |values: Vec<f32>, n_rows: usize| -> Tensor<2> {
            let n_columns = values.len() / n_rows.max(1);
            Tensor::from_data(TensorData::new(values, [n_rows, n_columns]), device)
        };
        Self {
            frequencies: tensor(frequencies, 3 * axes.n_heads),
            first: tensor(first, width),
            second: tensor(second, width),
            stays: tensor(stays, 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Voxels;
    use crate::data::curve::Curve;
    use crate::data::hierarchy::{Hierarchy, fixed_orders};
    use crate::data::tokens::tokenize;
    use crate::model::parameters::host_values;
    use crate::testing::labeled_box;

    /// A matrix of small numbers that repeat only after a long period.
    fn matrix([n, dim]: [usize; 2]) -> Vec<f32> {
        (0..n * dim)
            .map(|i| ((i * 37 % 101) as f32 - 50.0) / 50.0)
            .collect()
    }

    fn tensor(dims: [usize; 2]) -> Tensor<2> {
        Tensor::from_data(TensorData::new(matrix(dims), dims), &Device::flex())
    }

    fn rows(values: &[f32], dim: usize) -> Vec<&[f32]> {
        values.chunks_exact(dim).collect()
    }

    #[track_caller]
    fn assert_close(found: &[f32], expected: &[f32]) {
        assert_eq!(found.len(), expected.len());
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-4),
            "{found:?} {expected:?}"
        );
    }

    #[test]
    fn a_convolution_sums_over_the_occupied_cells() {
        let (n, dim_in, dim_out) = (3, 2, 2);
        // Three offsets; 3 stands for an empty cell.
        let neighbors = [3, 0, 1, 0, 1, 2, 1, 2, 3];
        let weight = matrix([3 * dim_in, dim_out]);
        let x = matrix([n, dim_in]);
        let mut expected = vec![0.0; n * dim_out];
        for (slot, &from) in neighbors.iter().enumerate().filter(|(_, from)| **from < 3) {
            let (token, offset) = (slot / 3, slot % 3);
            for (c_in, c_out) in
                (0..dim_in).flat_map(|c_in| (0..dim_out).map(move |c_out| (c_in, c_out)))
            {
                expected[token * dim_out + c_out] += x[from as usize * dim_in + c_in]
                    * weight[(offset * dim_in + c_in) * dim_out + c_out];
            }
        }
        let table = Neighbors::new(&neighbors, 3);
        let found = convolution(
            tensor([n, dim_in]),
            &table,
            tensor([3 * dim_in, dim_out]),
            None,
        );
        assert_close(&host_values(found), &expected);
    }

    #[test]
    fn pooling_takes_the_maximum_of_each_channel() {
        let rows = Tensor::from_data([[1.0, 5.0], [2.0, -3.0], [-4.0, -6.0]], &Device::flex());
        let members = Rows::new(&[0, 1, 2, 2], 2);
        assert_eq!(
            host_values(cluster_max(rows, &members)),
            [2.0, 5.0, -4.0, -6.0]
        );
    }

    #[test]
    fn attention_mixes_the_values_of_a_tokens_own_patch() {
        let tokens = tokenize(&labeled_box(2.0, 300).sample, 40, Voxels::NormalKeyed).unwrap();
        let hierarchy = Hierarchy::new(&tokens, 16, &fixed_orders(1, &Curve::ALL));
        let (n, n_heads, dim) = (tokens.n(), 2, 4);
        let width = n_heads * dim;
        let qkv = matrix([n, 3 * width]);
        let qkv_rows = rows(&qkv, 3 * width);
        for patches in &hierarchy.levels[0].patches {
            let found = host_values(patch_attention(tensor([n, 3 * width]), patches, n_heads));
            for token in 0..n {
                let patch = patches.position[token] as usize / patches.size;
                let others = &patches.order[patch * patches.size..][..patches.size];
                for head in 0..n_heads {
                    let part = |of: u32, part: usize| {
                        &qkv_rows[of as usize][part * width + head * dim..][..dim]
                    };
                    let score = |of: u32| {
                        part(token as u32, 0)
                            .iter()
                            .zip(part(of, 1))
                            .map(|(q, k)| q * k)
                            .sum::<f32>()
                            / 2.0
                    };
                    let weights: Vec<f32> = others.iter().map(|&of| score(of).exp()).collect();
                    let total: f32 = weights.iter().sum();
                    let expected: Vec<f32> = (0..dim)
                        .map(|c| {
                            others
                                .iter()
                                .zip(&weights)
                                .map(|(&of, w)| w * part(of, 2)[c])
                                .sum::<f32>()
                                / total
                        })
                        .collect();
                    assert_close(&found[token * width + head * dim..][..dim], &expected);
                }
            }
        }
    }
}

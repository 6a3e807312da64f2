//! Multiplies rows by a matrix and adds a bias.

use super::lanes::LANES;
use super::tile::{
    CHUNK, Kernel, Lane, OUTER_CHUNK, Panels, ROWS, RowPairs, add_outer_products, extend_zeroed,
    rows_of, store_tile, tile, vectorised,
};
use super::{Flexible, flexible, record, slice, tensor_of};
use burn::tensor::Tensor;

/// `rows · weight + bias`. Returns `None` if a tensor is not of the flex backend.
///
/// # Shapes
/// - rows: `[token, in]`
/// - weight: `[in, out]`
/// - bias: `[out]`
/// - output: `[token, out]`
pub(crate) fn linear(
    rows: &Tensor<2>,
    weight: &Tensor<2>,
    bias: Option<&Tensor<1>>,
) -> Option<Tensor<2>> {
    let n = rows.dims()[0];
    let [depth, n_columns] = weight.dims();
    let inputs = [
        flexible(rows)?,
        flexible(weight)?,
        bias_or_empty(bias, rows)?,
    ];
    let [x, w, b] = inputs.each_ref().map(Flexible::values);
    let y = product(
        slice(&x),
        &Panels::of(slice(&w), depth, n_columns),
        slice(&b),
    );
    record(
        inputs,
        tensor_of(y, [n, n_columns]),
        move |by_output, wanted| {
            let shape = LinearShape { depth, n_columns };
            shape.pull_back(slice(&x), slice(&w), slice(by_output), wanted)
        },
    )
}

/// The bias, or an empty vector on the same device.
pub(super) fn bias_or_empty(bias: Option<&Tensor<1>>, rows: &Tensor<2>) -> Option<Flexible> {
    match bias {
        Some(bias) => flexible(bias),
        None => flexible(&Tensor::<1>::zeros([0], &rows.device())),
    }
}

#[derive(Clone, Copy)]
struct LinearShape {
    depth: usize,
    n_columns: usize,
}

impl LinearShape {
    /// Gradients with respect to rows, weight and bias. A gradient that is not needed is empty.
    ///
    /// # Shapes
    /// - x: `[token, in]`
    /// - w: `[in, out]`
    /// - by_output: `[token, out]`
    /// - output: those of rows, weight and bias
    fn pull_back(
        self,
        x: &[f32],
        w: &[f32],
        by_output: &[f32],
        [by_x, by_w, by_b]: [bool; 3],
    ) -> [burn::backend::flex::FlexTensor; 3] {
        let Self { depth, n_columns } = self;
        let rows = if by_x {
            product(by_output, &Panels::of_transpose(w, n_columns, depth), &[])
        } else {
            Vec::new()
        };
        let mut weight = vec![0.0; if by_w { depth * n_columns } else { 0 }];
        if by_w {
            vectorised(OuterProducts {
                x,
                g: by_output,
                shape: self,
                sum: &mut weight,
            });
        }
        let bias = if by_b {
            column_sums(by_output, n_columns)
        } else {
            Vec::new()
        };
        let (n_rows, n_weights, n_biases) = (rows.len(), weight.len(), bias.len());
        [
            tensor_of(rows, [n_rows / depth.max(1), depth]),
            tensor_of(weight, [n_weights / n_columns.max(1), n_columns]),
            tensor_of(bias, [n_biases]),
        ]
    }
}

/// The sum over all rows, column by column.
///
/// # Shapes
/// - rows: `[row, n_columns]`
/// - output: `[n_columns]`
pub(super) fn column_sums(rows: &[f32], n_columns: usize) -> Vec<f32> {
    let mut sums = vec![0.0; n_columns];
    vectorised(ColumnSums {
        rows,
        sums: &mut sums,
    });
    sums
}

struct ColumnSums<'a> {
    rows: &'a [f32],
    sums: &'a mut [f32],
}

impl Kernel for ColumnSums<'_> {
    #[inline(always)]
    fn run(self) {
        add_rows(self.rows, self.sums);
    }
}

/// Adds each row to the sums.
///
/// # Shapes
/// - rows: `[row, column]`
/// - sums: `[column]`
#[inline(always)]
pub(super) fn add_rows(rows: &[f32], sums: &mut [f32]) {
    for row in rows.chunks_exact(sums.len().max(1)) {
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += x;
        }
    }
}

/// `x · panels + bias`. An empty bias means that there is none.
///
/// # Shapes
/// - x: `[row, depth]`
/// - panels: `[depth, column]`
/// - bias: `[column]`
/// - output: `[row, column]`
fn product(x: &[f32], panels: &Panels, bias: &[f32]) -> Vec<f32> {
    let mut y = Vec::with_capacity(x.len() / panels.depth().max(1) * panels.n_columns());
    vectorised(RowProduct {
        x,
        panels,
        bias,
        y: &mut y,
    });
    y
}

struct RowProduct<'a> {
    x: &'a [f32],
    panels: &'a Panels,
    bias: &'a [f32],
    y: &'a mut Vec<f32>,
}

impl Kernel for RowProduct<'_> {
    #[inline(always)]
    fn run(self) {
        let depth = self.panels.depth().max(1);
        for x in self.x.chunks(CHUNK * depth) {
            multiply(
                x,
                self.panels,
                self.bias,
                extend_zeroed(self.y, x.len() / depth * self.panels.n_columns()),
            );
        }
    }
}

/// `y = x · panels + bias` for as many rows as the cache holds. An empty bias means that there is none.
///
/// # Shapes
/// - x: `[row, depth]`
/// - panels: `[depth, column]`
/// - bias: `[column]`
/// - y: `[row, column]`
#[inline(always)]
pub(super) fn multiply(x: &[f32], panels: &Panels, bias: &[f32], y: &mut [f32]) {
    let (depth, width) = (panels.depth().max(1), panels.n_columns().max(1));
    for (columns, panel) in panels.iter() {
        let mut start = [0.0; LANES];
        if let Some(bias) = bias.get(columns.clone()) {
            start[..columns.len()].copy_from_slice(bias);
        }
        let n_full = x.len() / (ROWS * depth);
        let (x, x_rest) = x.split_at(n_full * ROWS * depth);
        let (y, y_rest) = y.split_at_mut(n_full * ROWS * width);
        for (x, y) in x
            .chunks_exact(ROWS * depth)
            .zip(y.chunks_exact_mut(ROWS * width))
        {
            rows_of_product::<ROWS>(x, panel, &start, &columns, y, width);
        }
        for (x, y) in x_rest
            .chunks_exact(depth)
            .zip(y_rest.chunks_exact_mut(width))
        {
            rows_of_product::<1>(x, panel, &start, &columns, y, width);
        }
    }
}

/// R rows and 16 columns of a product.
///
/// # Shapes
/// - x: `[R, depth]`
/// - panel: `[depth, 16]`
/// - y: `[R, width]`, of which `columns` are written
#[inline(always)]
fn rows_of_product<const R: usize>(
    x: &[f32],
    panel: &[Lane],
    start: &Lane,
    columns: &std::ops::Range<usize>,
    y: &mut [f32],
    width: usize,
) {
    let sums = tile::<R>(rows_of(x, panel.len()), panel, [*start; R]);
    store_tile(sums, y, width, columns);
}

/// `sum += xᵀ g`.
///
/// # Shapes
/// - x: `[row, depth]`
/// - g: `[row, column]`
/// - sum: `[depth, column]`
struct OuterProducts<'a> {
    x: &'a [f32],
    g: &'a [f32],
    shape: LinearShape,
    sum: &'a mut [f32],
}

impl Kernel for OuterProducts<'_> {
    #[inline(always)]
    fn run(self) {
        let LinearShape { depth, n_columns } = self.shape;
        for (x, g) in self
            .x
            .chunks(OUTER_CHUNK * depth)
            .zip(self.g.chunks(OUTER_CHUNK * n_columns))
        {
            add_outer_products(
                RowPairs {
                    a: x,
                    b: g,
                    widths: [depth, n_columns],
                },
                [depth, n_columns],
                self.sum,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::kernels::ops::composed_linear;

    #[test]
    fn fused_and_composed_agree() {
        for [n, depth, width] in [[1, 1, 1], [7, 5, 3], [13, 32, 48], [131, 33, 20]] {
            let inputs = [
                input([n, depth], "x"),
                input([depth, width], "w"),
                input([1, width], "b"),
            ];
            check(
                &inputs,
                |[x, w, b]| linear(&x, &w, Some(&b.flatten(0, 1))).unwrap(),
                |[x, w, b]| composed_linear(x, w, Some(b.flatten(0, 1))),
            );
            let [x, w, _] = inputs;
            check(
                &[x, w],
                |[x, w]| linear(&x, &w, None).unwrap(),
                |[x, w]| composed_linear(x, w, None),
            );
        }
    }
}

//! Holds rows of numbers: one embedding per token or point.

/// A row-major matrix with one embedding per row.
#[derive(Clone, Debug, PartialEq)]
pub struct Embeddings {
    dim: usize,
    values: Vec<f32>,
}

/// The number of values is not a multiple of the dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{n_values} values do not fill whole rows of {dim}")]
pub struct EmbeddingsError {
    /// The number of given values.
    pub n_values: usize,
    /// The length of a row.
    pub dim: usize,
}

impl Embeddings {
    /// Takes `values` as rows of `dim` numbers.
    ///
    /// # Errors
    /// If `dim` is 0 or does not divide the number of values.
    pub fn new(dim: usize, values: Vec<f32>) -> Result<Self, EmbeddingsError> {
        if dim == 0 || !values.len().is_multiple_of(dim) {
            return Err(EmbeddingsError {
                n_values: values.len(),
                dim,
            });
        }
        Ok(Self { dim, values })
    }

    /// Takes rows whose length is fixed by the type.
    #[must_use]
    pub fn from_rows<const DIM: usize>(rows: impl IntoIterator<Item = [f32; DIM]>) -> Self {
        const { assert!(DIM > 0, "a row holds at least one number") };
        Self {
            dim: DIM,
            values: rows.into_iter().flatten().collect(),
        }
    }

    /// The length of a row.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.values.len() / self.dim
    }

    /// The row at this index.
    #[must_use]
    pub fn row(&self, idx: usize) -> &[f32] {
        &self.values[idx * self.dim..][..self.dim]
    }

    /// The rows, in order.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.dim)
    }

    /// The rows at these indices, in their order.
    #[must_use]
    pub fn rows_at(&self, indices: impl IntoIterator<Item = usize>) -> Self {
        Self {
            dim: self.dim,
            values: indices
                .into_iter()
                .flat_map(|idx| self.row(idx).iter().copied())
                .collect(),
        }
    }

    /// All values, row after row.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

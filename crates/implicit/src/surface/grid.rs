//! Defines the grid on which a distance is computed, and its coarse cells.

/// The number of cells of the grid along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution(usize);

/// The number of coarse cells along each axis.
pub(super) const COARSE: usize = 32;

/// The size of the grid's cube relative to the frame's cube. It is larger because the surface of a network may be slightly
/// outside of its shape.
pub(super) const EXTENT: f32 = 1.1;

impl Resolution {
    /// A resolution of this number of cells. It must be a multiple of 32, from 32 to 512.
    #[must_use]
    pub fn new(n_cells: usize) -> Option<Self> {
        let fits = n_cells.is_multiple_of(COARSE) && (COARSE..=512).contains(&n_cells);
        fits.then_some(Self(n_cells))
    }

    /// The number of cells along each axis.
    #[must_use]
    pub fn n_cells(self) -> usize {
        self.0
    }

    /// The number of cells of a coarse cell along each axis.
    pub(super) fn per_coarse(self) -> usize {
        self.0 / COARSE
    }

    /// The coordinate of a grid point.
    pub(super) fn coordinate(self, index: usize) -> f32 {
        EXTENT * (2.0 * index as f32 / self.0 as f32 - 1.0)
    }

    /// The index of a grid point among all of them.
    pub(super) fn point(self, [x, y, z]: [usize; 3]) -> usize {
        let n = self.0 + 1;
        (z * n + y) * n + x
    }
}

/// Half the diagonal of a coarse cell.
pub(super) fn coarse_radius() -> f32 {
    3.0f32.sqrt() * EXTENT / COARSE as f32
}

/// The middle of a coarse cell.
pub(super) fn coarse_center(cell: [usize; 3]) -> [f32; 3] {
    cell.map(|index| EXTENT * ((2 * index + 1) as f32 / COARSE as f32 - 1.0))
}

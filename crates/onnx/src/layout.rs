//! Finds where the rows and the numbers of each row are in a tensor.
//!
//! A tensor of n points with c numbers each is (n, c), (1, n, c), (c, n) or (1, c, n). The declared or the actual dimensions, or
//! the user, determine which one it is.

use crate::tensor::Dimensions;

/// The dimension of the points or triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// The numbers of one point are next to each other: (n, c).
    Rows,
    /// The points of one number are next to each other: (c, n).
    Columns,
}

impl Layout {
    /// Both, in the order in which messages list them.
    const ALL: [Self; 2] = [Self::Rows, Self::Columns];

    /// The number of rows and the length of a row, in a pair of dimensions.
    fn rows_and_length<T: Copy>(self, [first, second]: [T; 2]) -> [T; 2] {
        match self {
            Self::Rows => [first, second],
            Self::Columns => [second, first],
        }
    }

    /// The values in this layout.
    ///
    /// `rows` has the numbers row by row. Each row has `length` of them.
    pub(crate) fn pack(self, rows: Vec<f32>, length: usize) -> Vec<f32> {
        match self {
            Self::Rows => rows,
            Self::Columns => transposed(&rows, length),
        }
    }

    /// The numbers row by row, from values in this layout.
    pub(crate) fn unpack(self, values: Vec<f32>, n_rows: usize) -> Vec<f32> {
        match self {
            Self::Rows => values,
            Self::Columns => transposed(&values, n_rows),
        }
    }
}

/// The transpose of a matrix whose rows have this length.
fn transposed(values: &[f32], length: usize) -> Vec<f32> {
    let column = |at: usize| values.iter().skip(at).step_by(length.max(1)).copied();
    (0..length).flat_map(column).collect()
}

/// The reason why a layout cannot be determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoLayout {
    /// Neither fits.
    Unfit,
    /// Both fit, and it is not known which one is meant.
    Both,
}

/// The placement of a matrix in a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Placement {
    /// Whether there is a dimension of 1 in front.
    pub(crate) has_batch: bool,
    pub(crate) layout: Layout,
    /// The number of rows for which the model was made, or `None` if it accepts any number.
    pub(crate) n_rows: Option<usize>,
}

impl Placement {
    /// The placement of rows of `length` numbers in an input with these declared dimensions.
    pub(crate) fn of_input(
        declared: &[Option<usize>],
        length: usize,
        requested: Option<Layout>,
    ) -> Result<Self, NoLayout> {
        let (has_batch, pair) = without_batch(declared).ok_or(NoLayout::Unfit)?;
        // If one dimension is fixed and the other is not, the fixed one is the length, unless the user says otherwise.
        let may_be = |layout: Layout| {
            let [n_rows, length] = layout.rows_and_length(pair);
            length.is_none() && (n_rows.is_none() || requested.is_some())
        };
        // A dimension that is fixed to the length has priority over one that may have any size.
        let is_fixed = |layout: Layout| layout.rows_and_length(pair)[1] == Some(length);
        let layout = match only_layout(requested, is_fixed) {
            Err(NoLayout::Unfit) => only_layout(requested, may_be),
            found => found,
        }?;
        Ok(Self {
            has_batch,
            layout,
            n_rows: layout.rows_and_length(pair)[0],
        })
    }

    /// The dimensions of a tensor with `n_rows` rows.
    pub(crate) fn shape(&self, n_rows: usize, length: usize) -> Vec<usize> {
        let pair = self.layout.rows_and_length([n_rows, length]);
        let batch = self.has_batch.then_some(1);
        batch.into_iter().chain(pair).collect()
    }
}

/// The layout of an output with these dimensions that has `n_rows` rows, and the length of a row.
pub(crate) fn layout_of_output(
    shape: &[usize],
    n_rows: usize,
    requested: Option<Layout>,
) -> Result<(Layout, usize), NoLayout> {
    let declared: Vec<Option<usize>> = shape.iter().copied().map(Some).collect();
    let (_, pair) = without_batch(&declared).ok_or(NoLayout::Unfit)?;
    let fits = |layout: Layout| layout.rows_and_length(pair)[0] == Some(n_rows);
    let layout = only_layout(requested, fits)?;
    let length = layout.rows_and_length(pair)[1].unwrap_or_default();
    if length == 0 {
        return Err(NoLayout::Unfit);
    }
    Ok((layout, length))
}

/// The two dimensions of the matrix, and whether a dimension of 1 is in front of them.
fn without_batch(shape: &[Option<usize>]) -> Option<(bool, [Option<usize>; 2])> {
    match *shape {
        [first, second] => Some((false, [first, second])),
        [None | Some(1), first, second] => Some((true, [first, second])),
        _ => None,
    }
}

/// The only layout that fits, among both or among the requested one.
fn only_layout(
    requested: Option<Layout>,
    fits: impl Fn(Layout) -> bool,
) -> Result<Layout, NoLayout> {
    let candidates = Layout::ALL
        .into_iter()
        .filter(|&layout| requested.is_none_or(|requested| requested == layout) && fits(layout));
    match candidates.collect::<Vec<Layout>>()[..] {
        [only] => Ok(only),
        [] => Err(NoLayout::Unfit),
        _ => Err(NoLayout::Both),
    }
}

/// The dimensions that a matrix with rows of this length may have, for messages.
pub(crate) fn possible_shapes(n_rows: Option<usize>, length: Option<usize>) -> String {
    let shapes = Layout::ALL.map(|layout| layout.rows_and_length([n_rows, length]));
    let texts = shapes.map(|[first, second]| {
        let with_batch = [Some(1), first, second];
        format!(
            "{} or {}",
            Dimensions(&with_batch[1..]),
            Dimensions(&with_batch)
        )
    });
    texts.join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ANY: Option<usize> = None;

    #[track_caller]
    fn check_input(
        declared: &[Option<usize>],
        requested: Option<Layout>,
        expected: Result<&[usize], NoLayout>,
    ) {
        let placement = Placement::of_input(declared, 6, requested);
        let shape = placement.map(|placement| placement.shape(50, 6));
        assert_eq!(shape.as_deref(), expected.as_deref());
    }

    #[test]
    fn an_input_is_laid_out_as_it_is_declared() {
        use Layout::{Columns, Rows};
        check_input(&[ANY, Some(6)], None, Ok(&[50, 6]));
        check_input(&[Some(1), ANY, Some(6)], None, Ok(&[1, 50, 6]));
        check_input(&[ANY, Some(6), ANY], None, Ok(&[1, 6, 50]));
        check_input(&[Some(6), Some(50)], None, Ok(&[6, 50]));
        check_input(&[Some(6), ANY], Some(Rows), Ok(&[50, 6]));
        check_input(&[ANY, ANY], None, Err(NoLayout::Both));
        check_input(&[ANY, ANY], Some(Columns), Ok(&[6, 50]));
        check_input(&[Some(6), Some(6)], None, Err(NoLayout::Both));
        check_input(&[Some(6), Some(6)], Some(Columns), Ok(&[6, 50]));
        check_input(&[Some(1), ANY, Some(3)], Some(Rows), Err(NoLayout::Unfit));
        check_input(&[Some(1), ANY, Some(3)], None, Err(NoLayout::Unfit));
        check_input(&[Some(3), Some(1)], None, Err(NoLayout::Unfit));
        check_input(&[Some(2), ANY, Some(6)], None, Err(NoLayout::Unfit));
        check_input(&[ANY], None, Err(NoLayout::Unfit));
        check_input(&[], None, Err(NoLayout::Unfit));
    }

    #[test]
    fn the_dimension_with_as_many_rows_as_went_in_is_that_of_the_rows() {
        let check = |shape: &[usize], requested, expected| {
            assert_eq!(
                layout_of_output(shape, 50, requested),
                expected,
                "{shape:?}"
            );
        };
        check(&[50, 16], None, Ok((Layout::Rows, 16)));
        check(&[1, 16, 50], None, Ok((Layout::Columns, 16)));
        check(&[50, 50], None, Err(NoLayout::Both));
        check(&[50, 50], Some(Layout::Columns), Ok((Layout::Columns, 50)));
        check(&[1, 16], None, Err(NoLayout::Unfit));
        check(&[50, 16], Some(Layout::Columns), Err(NoLayout::Unfit));
        check(&[50, 0], None, Err(NoLayout::Unfit));
        check(&[2, 50, 16], None, Err(NoLayout::Unfit));
        check(&[50], None, Err(NoLayout::Unfit));
    }

    #[test]
    fn messages_list_what_fits() {
        assert_eq!(
            possible_shapes(ANY, Some(6)),
            "[?, 6] or [1, ?, 6] or [6, ?] or [1, 6, ?]"
        );
    }

    proptest! {
        #[test]
        fn packing_and_unpacking_change_nothing(n_rows in 0usize..9, length in 1usize..9) {
            let rows: Vec<f32> = (0..n_rows * length).map(|value| value as f32).collect();
            for layout in Layout::ALL {
                let packed = layout.pack(rows.clone(), length);
                prop_assert_eq!(&layout.unpack(packed.clone(), n_rows), &rows);
                if layout == Layout::Columns && n_rows > 1 {
                    prop_assert_eq!(packed[1], rows[length]);
                }
            }
        }
    }
}

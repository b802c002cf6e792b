//! nalgebra's matrices, column after column, and weights as matrices.
//!
//! nalgebra hands a product of more than five rows, columns and terms to matrixmultiply: the
//! processor's vector units, one thread. The left factor of a product must lie column after column,
//! so a transpose there is a copy: for smaller ones nalgebra 0.34 takes the length of a strided
//! column's memory for its number of rows, and writes beyond the end.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn};

pub(super) type Matrix = DMatrix<f64>;
/// A table row after row: only ever the right factor of a product.
pub(super) type Strided<'a> = DMatrixView<'a, f64, Dyn, Dyn>;

pub(super) fn col(m: &Matrix, j: usize) -> &[f64] {
    &m.as_slice()[j * m.nrows()..][..m.nrows()]
}

pub(super) fn col_mut(m: &mut Matrix, j: usize) -> &mut [f64] {
    let n = m.nrows();
    &mut m.as_mut_slice()[j * n..][..n]
}

/// A row-major table as a matrix.
pub(super) fn row_major(values: &[f64], rows: usize, columns: usize) -> Strided<'_> {
    Strided::from_slice_with_strides_generic(values, Dyn(rows), Dyn(columns), Dyn(columns), Dyn(1))
}

/// The transpose of a row-major table of `columns`, to be written to.
pub(super) fn row_major_transposed(values: &mut [f64], columns: usize) -> DMatrixViewMut<'_, f64> {
    let rows = values.len() / columns;
    DMatrixViewMut::from_slice(values, columns, rows)
}

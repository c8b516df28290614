//! Products of matrices inside slices, by `gemm`, on the calling thread.
#![allow(unsafe_code, reason = "matrix products by pointer and stride")]

/// A matrix inside a slice; `stride` is the distance between its rows and between its columns.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    pub(super) values: &'a [f32],
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) stride: (usize, usize),
}

impl Matrix<'_> {
    pub(super) fn transposed(self) -> Self {
        let (rows, columns) = self.stride;
        Self { rows: self.columns, columns: self.rows, stride: (columns, rows), ..self }
    }

    fn check(&self) {
        let last = (self.rows - 1) * self.stride.0 + (self.columns - 1) * self.stride.1;
        assert!(last < self.values.len(), "a matrix ends outside its slice");
    }
}

/// Writes the product of `a` and `b` to the matrix in `out` with rows `stride` apart.
pub(super) fn multiply(a: Matrix<'_>, b: Matrix<'_>, out: &mut [f32], stride: usize) {
    product(a, b, false, out, stride);
}

/// Adds the product of `a` and `b` to the matrix in `out` with rows `stride` apart.
pub(super) fn multiply_add(a: Matrix<'_>, b: Matrix<'_>, out: &mut [f32], stride: usize) {
    product(a, b, true, out, stride);
}

fn product(a: Matrix<'_>, b: Matrix<'_>, add: bool, out: &mut [f32], stride: usize) {
    let (m, n, k) = (a.rows, b.columns, a.columns);
    if m * n * k == 0 {
        return;
    }
    a.check();
    b.check();
    assert_eq!(k, b.rows);
    assert!((m - 1) * stride + n <= out.len() && n <= stride);
    let at = |stride: usize| stride as isize;
    // SAFETY: all three matrices lie inside their slices, checked above, and `out` is borrowed alone.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            out.as_mut_ptr(),
            1,
            at(stride),
            add,
            a.values.as_ptr(),
            at(a.stride.1),
            at(a.stride.0),
            b.values.as_ptr(),
            at(b.stride.1),
            at(b.stride.0),
            1.0,
            1.0,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

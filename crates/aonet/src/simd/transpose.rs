//! Squares of four by four values.
#![allow(unsafe_code, reason = "vector instructions")]

/// The columns of four rows.
// Left to the compiler, a loop over strided values becomes gathers or scatters. PERFORMANCE.md has the times.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn columns(rows: [&[f32; 4]; 4]) -> [[f32; 4]; 4] {
    use std::arch::x86_64::*;
    let mut columns = [[0.0; 4]; 4];
    // SAFETY: every x86-64 machine has these instructions; rows and columns are four values each.
    unsafe {
        let row = |i: usize| _mm_loadu_ps(rows[i].as_ptr());
        let (left, right) = (_mm_unpacklo_ps(row(0), row(1)), _mm_unpackhi_ps(row(0), row(1)));
        let (left_2, right_2) = (_mm_unpacklo_ps(row(2), row(3)), _mm_unpackhi_ps(row(2), row(3)));
        _mm_storeu_ps(columns[0].as_mut_ptr(), _mm_movelh_ps(left, left_2));
        _mm_storeu_ps(columns[1].as_mut_ptr(), _mm_movehl_ps(left_2, left));
        _mm_storeu_ps(columns[2].as_mut_ptr(), _mm_movelh_ps(right, right_2));
        _mm_storeu_ps(columns[3].as_mut_ptr(), _mm_movehl_ps(right_2, right));
    }
    columns
}

/// The columns of four rows.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn columns(rows: [&[f32; 4]; 4]) -> [[f32; 4]; 4] {
    let mut columns = [[0.0; 4]; 4];
    for (y, row) in rows.into_iter().enumerate() {
        for (x, value) in row.iter().enumerate() {
            columns[x][y] = *value;
        }
    }
    columns
}

/// Four values from an index on.
#[inline(always)]
pub fn four(values: &[f32], from: usize) -> &[f32; 4] {
    values[from..].first_chunk().expect("four values")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_rows_of_the_transpose() {
        let values: Vec<f32> = (0..18).map(|i| i as f32).collect();
        let rows = [0, 4, 8, 12].map(|from| four(&values, from + 1));
        let expected = [[1., 5., 9., 13.], [2., 6., 10., 14.], [3., 7., 11., 15.], [4., 8., 12., 16.]];
        assert_eq!(columns(rows), expected);
    }
}

//! Two numbers in (0, 1) for every pixel: a pattern that repeats every 5 pixels, as wide as the filter that removes it.
// A rank-1 lattice on the screen, and another one of the pairs of numbers. Sequences without a period, such as R2 along a
// Hilbert curve (XeGTAO), leave noise in a filter of 5x5 pixels: a window of theirs holds other numbers than the next one.

use crate::simd::lanes::F;
use crate::simd::{MAX_LANES, Simd};

/// Side of the pattern (px).
pub(crate) const SIDE: usize = 5;
/// Different numbers: all of them lie in every window of 5x5 pixels.
pub(crate) const COUNT: usize = SIDE * SIDE;
/// Steps of the first number from a pixel to the next one, to the right and down, in units of 1 / [`COUNT`].
pub(crate) const STEPS: [usize; 2] = [20, 11];
/// The second number's index is that of the first one times this.
// Five pixels of a row or of a column have numbers all over the range, with gaps of 9/25 at most: so pixels at the same distance from a
// post see it in many directions and by many taps.
pub(crate) const FACTOR: usize = 14;
/// The first number, in units of 1 / [`COUNT`]. With 1/2, 1/3 and so on, slices would lie at 30 degrees, where taps at whole distances fall
/// exactly between two pixels, and processors would choose different ones.
pub(crate) const OFFSET: f32 = 0.4;
/// Pixels after which rows of the pattern and whole vectors begin again.
pub(crate) const COLUMNS: usize = SIDE * MAX_LANES;

/// Rows are long enough for a vector to begin anywhere in them.
static NOISE: [[[f32; COLUMNS + MAX_LANES]; SIDE]; 2] = {
    let mut values = [[[0.0; COLUMNS + MAX_LANES]; SIDE]; 2];
    let mut y = 0;
    while y < SIDE {
        let mut x = 0;
        while x < COLUMNS + MAX_LANES {
            let index = (STEPS[0] * x + STEPS[1] * y) % COUNT;
            values[0][y][x] = number(index);
            values[1][y][x] = number(index * FACTOR % COUNT);
            x += 1;
        }
        y += 1;
    }
    values
};

const fn number(index: usize) -> f32 {
    (index as f32 + OFFSET) / COUNT as f32
}

/// The numbers of the pixels from (`x`, `y`) on.
#[inline(always)]
pub(crate) fn noise_at<S: Simd>(simd: S, x: usize, y: usize) -> [F<S>; 2] {
    let row = |which: usize| &NOISE[which][y % SIDE][x % COLUMNS..];
    [F::load(simd, row(0)), F::load(simd, row(1))]
}

/// The numbers of one pixel.
pub(crate) fn noise_of(x: usize, y: usize) -> [f32; 2] {
    [0, 1].map(|which| NOISE[which][y % SIDE][x % COLUMNS])
}

/// The first of them for [`COLUMNS`] pixels of a row.
pub(crate) fn noise_row(y: usize) -> &'static [f32] {
    &NOISE[0][y % SIDE][..COLUMNS]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_window_of_the_filter_holds_every_number_once() {
        let every: Vec<f32> = (0..COUNT).map(number).collect();
        for (x, y) in [(0, 0), (3, 1), (COLUMNS - 2, 4), (641, 359)] {
            for which in [0, 1] {
                let mut window: Vec<f32> =
                    (0..COUNT).map(|i| noise_of(x + i % SIDE, y + i / SIDE)[which]).collect();
                window.sort_by(f32::total_cmp);
                assert_eq!(window, every, "{which} at ({x}, {y})");
            }
        }
    }

    #[test]
    fn numbers_of_a_row_and_of_a_column_leave_no_large_gap() {
        for (start, along_rows, which) in (0..COUNT).flat_map(|i| {
            [true, false].into_iter().flat_map(move |rows| [0, 1].map(|which| (i, rows, which)))
        }) {
            let (x, y) = (start % SIDE, start / SIDE);
            let of = |i| if along_rows { noise_of(x + i, y) } else { noise_of(x, y + i) };
            let mut numbers: Vec<f32> = (0..SIDE).map(|i| of(i)[which]).collect();
            numbers.sort_by(f32::total_cmp);
            numbers.push(numbers[0] + 1.0);
            let gap = numbers.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f32::max);
            assert!(gap < 9.5 / COUNT as f32, "gap of {gap} at ({x}, {y}), along a row: {along_rows}");
        }
    }

    #[test]
    fn pairs_of_numbers_are_spread_over_the_square() {
        for cell in 0..9 {
            let inside = |v: f32, third: usize| (v * 3.0) as usize == third;
            let pairs = (0..COUNT).map(|i| noise_of(i % SIDE, i / SIDE));
            let count = pairs.filter(|[a, b]| inside(*a, cell / 3) && inside(*b, cell % 3)).count();
            assert!((2..=4).contains(&count), "{count} of 25 pairs in cell {cell}");
        }
    }
}

//! Numbers in [0, 1) for every pixel of a 64x64 tile, spread evenly over any neighbourhood.

use crate::simd::lanes::F;
use crate::simd::{MAX_LANES, Simd};

/// Side of the tile (px).
pub(crate) const TILE: usize = 64;

/// Two numbers a pixel; rows go on where they begin, so that all that start in the tile are whole.
// Index of the pixel along a Hilbert curve (Hilbert 1891) into the R2 sequence (Roberts 2018): what XeGTAO uses.
static NOISE: [[[f32; TILE + MAX_LANES]; TILE]; 2] = {
    let mut values = [[[0.0; TILE + MAX_LANES]; TILE]; 2];
    let mut i = 0;
    while i < TILE * TILE {
        let (x, y) = (i % TILE, i / TILE);
        [values[0][y][x], values[1][y][x]] = r2(hilbert_index(x, y) as f64);
        if x < MAX_LANES {
            [values[0][y][x + TILE], values[1][y][x + TILE]] = [values[0][y][x], values[1][y][x]];
        }
        i += 1;
    }
    values
};

/// The numbers of the pixels from (`x`, `y`) on.
#[inline(always)]
pub(crate) fn noise_at<S: Simd>(simd: S, x: usize, y: usize) -> [F<S>; 2] {
    let row = |which: usize| &NOISE[which][y % TILE][x % TILE..];
    [F::load(simd, row(0)), F::load(simd, row(1))]
}

/// The numbers of one pixel.
pub(crate) fn noise_of(x: usize, y: usize) -> [f32; 2] {
    [0, 1].map(|which| NOISE[which][y % TILE][x % TILE])
}

/// The first of them for a whole row of the tile.
pub(crate) fn noise_row(y: usize) -> &'static [f32] {
    &NOISE[0][y % TILE][..TILE]
}

/// Element `n` of the R2 sequence: multiples of 1 over the plastic number and of its square, from 0.5.
const fn r2(n: f64) -> [f32; 2] {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let (a, b) = (0.5 + n / PLASTIC, 0.5 + n / (PLASTIC * PLASTIC));
    [(a - a as u64 as f64) as f32, (b - b as u64 as f64) as f32]
}

/// Place of (x, y) along the Hilbert curve through the tile.
const fn hilbert_index(mut x: usize, mut y: usize) -> usize {
    let (mut index, mut side) = (0, TILE / 2);
    while side > 0 {
        let (right, down) = ((x & side > 0) as usize, (y & side > 0) as usize);
        index += side * side * ((3 * right) ^ down);
        if down == 0 {
            if right == 1 {
                (x, y) = (TILE - 1 - x, TILE - 1 - y);
            }
            (x, y) = (y, x);
        }
        side /= 2;
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_pixel_once_and_steps_to_a_neighbour() {
        let mut place = vec![None; TILE * TILE];
        for i in 0..TILE * TILE {
            let n = hilbert_index(i % TILE, i / TILE);
            assert!(place[n].replace((i % TILE, i / TILE)).is_none(), "{n} twice");
        }
        for pair in place.windows(2) {
            let (a, b) = (pair[0].unwrap(), pair[1].unwrap());
            assert_eq!(a.0.abs_diff(b.0) + a.1.abs_diff(b.1), 1, "{a:?} {b:?}");
        }
    }

    #[test]
    fn every_neighbourhood_has_all_of_the_range() {
        for (x, y) in [(0, 0), (16, 40), (52, 8)] {
            for values in &NOISE {
                let mut cells = [0; 4];
                for row in &values[y..y + 4] {
                    row[x..x + 4].iter().for_each(|v| cells[(v * 4.0) as usize] += 1);
                }
                assert!(cells.iter().all(|c| (2..=6).contains(c)), "{cells:?}");
            }
        }
    }
}

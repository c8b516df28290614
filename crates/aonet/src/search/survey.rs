//! Connected arcs from one pixel of every patch, for networks that compute at the resolution of patches.

use super::arcs::Arcs;
use super::shares::{PLANES, SHARES};
use super::{ArcsParams, PixelShares, Screen};
use crate::frame::BACKGROUND;
use crate::simd::lanes::F;
use crate::simd::{Isa, Kernel, MAX_LANES, Simd};
use crate::threads::Band;

/// Values of a cell: the shares of light, and whether the frame has a second layer.
pub const SURVEYED: usize = SHARES + 1;

/// The patches of a frame that is padded to whole ones, and how a row of them lies in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cells {
    /// Left and upper edge of the first patch (px).
    pub(crate) origin: [usize; 2],
    /// Side of a patch (px).
    pub(crate) patch: usize,
    /// Patches in a row.
    pub(crate) columns: usize,
    /// Copies of the first and last patch before and after each line.
    pub(crate) halo: usize,
}

/// Writes a band of cells: row by row, value by value. Allocates nothing.
pub(crate) fn survey_band(
    isa: Isa,
    (arcs, surfels): (ArcsParams, [&[f32]; 2]),
    screen: &Screen<'_>,
    (cells, band): (Cells, Band<'_>),
) {
    isa.run_on_chains(Rows { screen, arcs: &Arcs::new(screen, arcs, surfels), cells, band });
}

struct Rows<'a> {
    screen: &'a Screen<'a>,
    arcs: &'a Arcs<'a>,
    cells: Cells,
    band: Band<'a>,
}

impl Kernel for Rows<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { screen, arcs, cells: Cells { origin, patch, columns, halo }, band } = self;
        let [left, top] = origin.map(|edge| edge + patch / 2);
        let (width, height) = (screen.size().width(), screen.size().height());
        let line = columns + 2 * halo;
        let layers = f32::from(screen.gbuffer().second().is_some());
        for (i, row) in band.values.chunks_exact_mut(line * SURVEYED).enumerate() {
            let cell_row = band.first + i;
            let y = (cell_row * patch + top).min(height - 1);
            let depth = screen.row(screen.gbuffer().depth(), y);
            for from in (0..columns).step_by(S::LANES) {
                let pixels: [usize; MAX_LANES] =
                    std::array::from_fn(|lane| ((from + lane) * patch + left).min(width - 1));
                let seen = F::load(simd, &pixels.map(|x| depth[x])).lt(BACKGROUND);
                let planes: [F<S>; PLANES] =
                    arcs.shares(&screen.pixels_in(simd, pixels, y), (from, cell_row));
                let to = columns.min(from + S::LANES);
                let mut store = |c: usize, values: F<S>| {
                    values.store(&mut row[c * line + halo + from..c * line + halo + to]);
                };
                for c in 0..SHARES {
                    store(c, seen.select(planes[c + 1], 0.0));
                }
                store(SHARES, F::new(simd, layers));
            }
            for values in row.chunks_exact_mut(line) {
                let (first, last) = (values[halo], values[halo + columns - 1]);
                values[..halo].fill(first);
                values[halo + columns..].fill(last);
            }
        }
    }
}

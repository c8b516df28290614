//! The order in which the points of a spiral are traced: after any number of rays, the traced ones are spread evenly.
//!
//! Points that are close to each other are neighbours in the list, so every 2^k-th point is spread evenly. In bit-reversed order
//! (van der Corput 1935) the start of the list is spread evenly, too. Its aligned blocks are again every 2^k-th point, in the
//! order of the list, so neighbouring rays of a dispatch have similar directions.

/// Every `stride`-th point from `first` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Batch {
    /// Number of times that the whole spiral has been traced before.
    pub(super) round: u64,
    pub(super) first: u32,
    pub(super) stride: u32,
    /// Points, > 0.
    pub(super) rays: u32,
}

/// Number of traced points. After the last one the spiral starts again, turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Walk {
    /// Points of the spiral, > 0.
    spokes: u32,
    round: u64,
    /// Position in bit-reversed order; positions beyond the spiral are skipped.
    place: u32,
    /// Points traced, of all rounds.
    pub(super) samples: u32,
}

impl Walk {
    /// Nothing traced of a spiral of 1 to [`MAX_SPP`](crate::reference::MAX_SPP) points.
    pub(super) fn new(spokes: u32) -> Self {
        Self { spokes, round: 0, place: 0, samples: 0 }
    }

    /// log2 of the places.
    fn bits(&self) -> u32 {
        self.spokes.next_power_of_two().trailing_zeros()
    }

    /// Returns the next `samples` points in as few batches as possible, and advances.
    pub(super) fn advance(&mut self, samples: u32) -> impl Iterator<Item = Batch> + use<> {
        let mut walk = *self;
        let end = self.samples + samples;
        while self.samples < end {
            self.step(end - self.samples);
        }
        std::iter::from_fn(move || {
            while walk.samples < end {
                let batch = walk.step(end - walk.samples);
                if batch.rays > 0 {
                    return Some(batch);
                }
            }
            None
        })
    }

    /// The largest aligned block of at most `most` points.
    fn step(&mut self, most: u32) -> Batch {
        let bits = self.bits();
        let mut block = if self.place == 0 { bits } else { self.place.trailing_zeros() };
        let mut batch = self.block(block);
        while batch.rays > most {
            block -= 1;
            batch = self.block(block);
        }
        self.place += 1 << block;
        if self.place == 1 << bits {
            (self.place, self.round) = (0, self.round + 1);
        }
        self.samples += batch.rays;
        batch
    }

    /// The points of 2^`block` places.
    fn block(&self, block: u32) -> Batch {
        let bits = self.bits();
        // Shifting out all 32 bits, where there is one point, leaves none.
        let first = self.place.reverse_bits().checked_shr(u32::BITS - bits).unwrap_or(0);
        let stride = 1 << (bits - block);
        Batch { round: self.round, first, stride, rays: self.spokes.saturating_sub(first).div_ceil(stride) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn points(batches: impl Iterator<Item = Batch>) -> Vec<(u64, u32)> {
        batches.flat_map(|b| (0..b.rays).map(move |i| (b.round, b.first + i * b.stride))).collect()
    }

    #[test]
    fn every_point_is_traced_once_a_round_whatever_the_steps() {
        for spokes in [1, 2, 3, 37, 64, 100, 256] {
            for step in [1, 2, 5, 64, 1000] {
                let mut walk = Walk::new(spokes);
                let mut all = Vec::new();
                while walk.samples < 3 * spokes {
                    let next = step.min(3 * spokes - walk.samples);
                    let batch = points(walk.advance(next));
                    assert_eq!(batch.len(), next as usize);
                    all.extend(batch);
                }
                let expected: Vec<_> = (0..3).flat_map(|r| (0..spokes).map(move |i| (r, i))).collect();
                all.sort();
                assert_eq!(all, expected, "{spokes} points, {step} at a time");
            }
        }
    }

    #[test]
    fn whole_rounds_are_one_batch_and_the_order_does_not_depend_on_the_steps() {
        let mut walk = Walk::new(100);
        let whole: Vec<_> = walk.advance(200).collect();
        let round = |round| Batch { round, first: 0, stride: 1, rays: 100 };
        assert_eq!(whole, [round(0), round(1)]);
        let set = |steps: &[u32]| -> BTreeSet<_> {
            let mut walk = Walk::new(100);
            steps.iter().flat_map(|&n| points(walk.advance(n))).collect()
        };
        assert_eq!(set(&[3, 30, 7]), set(&[40]));
        assert_ne!(set(&[3, 30, 7]), set(&[41]));
    }

    #[test]
    fn a_beginning_is_spread_evenly() {
        for n in [4u32, 8, 16, 32, 64] {
            let eighths: BTreeSet<u32> =
                points(Walk::new(256).advance(n)).iter().map(|(_, i)| i / (256 / n)).collect();
            assert_eq!(eighths.len() as u32, n, "one in each part of {n}");
        }
    }
}

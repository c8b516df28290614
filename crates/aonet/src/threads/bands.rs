//! Work over rows: an image is cut into bands, and each thread takes the next band when it is free.

use super::pool::Pool;
use crate::error::Result;
use crate::simd::aligned::Aligned;
use std::sync::{Mutex, PoisonError};

/// Bands per thread: enough that a thread that was held up does not hold up the others for long.
// guess: more bands cost more in the convolutions, which resample the rows next to a band again.
const BANDS_PER_THREAD: usize = 4;

/// Threads, and memory of their own for each.
#[derive(Debug)]
pub(crate) struct Workers {
    pool: Pool,
    scratch: Vec<Mutex<Aligned>>,
    scratch_len: usize,
}

/// Consecutive rows of an image.
pub(crate) struct Band<'a> {
    /// Index of the first row.
    pub(crate) first: usize,
    /// All values of the rows.
    pub(crate) values: &'a mut [f32],
    /// Memory of the thread that works on the band. Holds anything.
    pub(crate) scratch: &'a mut [f32],
}

impl<'a> Band<'a> {
    /// All rows of an image, without scratch memory.
    pub(crate) fn whole(values: &'a mut [f32]) -> Self {
        Self { first: 0, values, scratch: &mut [] }
    }
}

impl Workers {
    /// `threads` threads with `scratch_len` values each.
    ///
    /// # Errors
    /// When `threads` is 0, a thread cannot be started or there is not enough memory.
    pub(crate) fn new(threads: usize, scratch_len: usize) -> Result<Self> {
        let pool = Pool::new(threads)?;
        let scratch =
            (0..threads).map(|_| Aligned::zeros(scratch_len).map(Mutex::new)).collect::<Result<_>>()?;
        Ok(Self { pool, scratch, scratch_len })
    }

    /// Number of threads.
    pub(crate) fn threads(&self) -> usize {
        self.pool.threads()
    }

    /// Bytes of scratch memory.
    pub(crate) fn scratch_bytes(&self) -> usize {
        self.scratch.len() * self.scratch_len * size_of::<f32>()
    }

    /// Calls `work` for every band of `image`, whose rows have `row_len` values.
    pub(crate) fn for_each_band(
        &mut self,
        image: &mut [f32],
        row_len: usize,
        work: impl Fn(Band<'_>) + Sync,
    ) {
        let rows = image.len().div_ceil(row_len);
        let rows = rows.div_ceil(self.threads() * BANDS_PER_THREAD);
        self.for_each_band_of(image, rows, row_len, work);
    }

    /// The same with `rows` rows in every band but the last.
    pub(crate) fn for_each_band_of(
        &mut self,
        image: &mut [f32],
        rows: usize,
        row_len: usize,
        work: impl Fn(Band<'_>) + Sync,
    ) {
        let bands = Mutex::new(image.chunks_mut(rows * row_len).enumerate());
        let next = || bands.lock().unwrap_or_else(PoisonError::into_inner).next();
        let scratch = &self.scratch;
        self.pool.run(&|thread| {
            let mut scratch = scratch[thread].lock().unwrap_or_else(PoisonError::into_inner);
            while let Some((i, values)) = next() {
                work(Band { first: i * rows, values, scratch: &mut scratch });
            }
        });
    }
}

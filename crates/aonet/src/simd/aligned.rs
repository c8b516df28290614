//! Zeroed values that start on a cache line.

use crate::error::{Error, Result};

/// Bytes in a cache line, and in the widest vector.
const LINE_BYTES: usize = 64;

/// A slice of f32 whose first value is at a multiple of 64 bytes.
#[derive(Debug)]
pub(crate) struct Aligned {
    storage: Vec<f32>,
    start: usize,
    len: usize,
}

impl Aligned {
    /// `len` zeros.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn zeros(len: usize) -> Result<Self> {
        let padded = len.saturating_add(LINE_BYTES / size_of::<f32>());
        Vec::<f32>::new()
            .try_reserve_exact(padded)
            .map_err(|e| Error::size("session memory", format!("{padded} values to be available"), e))?;
        // Unlike `resize`, this asks the system for zeros, which it hands out anyway.
        let storage = vec![0.0; padded];
        let start = storage.as_ptr().align_offset(LINE_BYTES);
        Ok(Self { storage, start, len })
    }
}

impl std::ops::Deref for Aligned {
    type Target = [f32];
    fn deref(&self) -> &[f32] {
        &self.storage[self.start..][..self.len]
    }
}

impl std::ops::DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.storage[self.start..][..self.len]
    }
}

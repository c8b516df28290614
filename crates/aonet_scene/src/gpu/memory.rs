//! Buffers on a device, checked against its limits.

use aonet::Result;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind;

/// A device and its queue.
#[derive(Debug, Clone)]
pub(super) struct Context {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
}

impl Context {
    /// A storage buffer.
    ///
    /// # Errors
    /// When it is larger than the device's largest storage binding.
    pub(super) fn storage(&self, label: &str, bytes: usize) -> Result<wgpu::Buffer> {
        bind::checked_buffer(&self.device, label, bytes as u64, wgpu::BufferUsages::STORAGE)
    }

    /// A storage buffer with contents: words of 32 bits, or a single zero if there are none.
    ///
    /// # Errors
    /// When it is larger than the device's largest storage binding.
    pub(super) fn filled(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer> {
        let buffer = self.storage(label, contents.len().max(16))?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    fn buffer(&self, label: &str, bytes: usize, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes as u64,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Places for the numbers of dispatches.
    pub(super) fn ring(&self) -> Ring {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        Ring { buffer: self.buffer("numbers of dispatches", PLACES * PLACE_BYTES, usage), next: 0 }
    }
}

/// Most dispatches between two submissions. guess: a driver's watchdog does not accept a thousand times a dispatch's rays.
pub(super) const PLACES: usize = 1024;

/// Bytes of a slot: the largest alignment that a device may require.
const PLACE_BYTES: usize = 256;

/// Parameters of dispatches. All writes to a buffer come before the next submission, so every dispatch of a submission
/// needs a place of its own; the places are reused in turn.
#[derive(Debug)]
pub(super) struct Ring {
    pub(super) buffer: wgpu::Buffer,
    next: usize,
}

impl Ring {
    /// Writes `words` to the next place; returns its offset.
    pub(super) fn put(&mut self, queue: &wgpu::Queue, words: &[u32]) -> u32 {
        let offset = self.next * PLACE_BYTES;
        self.next = (self.next + 1) % PLACES;
        let mut bytes = [0; PLACE_BYTES];
        let places = bytes.chunks_exact_mut(size_of::<u32>());
        places.zip(words).for_each(|(bytes, word)| bytes.copy_from_slice(&word.to_le_bytes()));
        queue.write_buffer(&self.buffer, offset as u64, &bytes);
        offset as u32
    }
}

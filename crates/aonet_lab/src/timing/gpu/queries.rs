//! Start and end of a frame's passes, by the device's clock.

use super::lost;
use aonet::gpu::{Device, Timestamps, wgpu};
use aonet_scene::Result;

/// Timestamps, and the buffers to read them.
pub(super) struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    back: wgpu::Buffer,
    count: u32,
}

impl Queries {
    /// Two timestamps for each pass; none if the device has no timestamps.
    pub(super) fn new(device: &Device, passes: usize) -> Option<Self> {
        if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = 2 * passes as u32;
        let set = device.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let buffer = |usage| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: u64::from(count) * 8,
                usage,
                mapped_at_creation: false,
            })
        };
        let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        let back = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
        Some(Self { set, resolved, back, count })
    }

    pub(super) fn timestamps(&self) -> Timestamps<'_> {
        Timestamps { queries: &self.set }
    }

    /// Submits the encoded passes and waits; returns start and end of every pass (ms), from an unknown origin.
    ///
    /// # Errors
    /// When the device is lost.
    pub(super) fn submit(&self, device: &Device, mut encoder: wgpu::CommandEncoder) -> Result<Vec<[f64; 2]>> {
        encoder.resolve_query_set(&self.set, 0..self.count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.back, 0, self.resolved.size());
        device.queue.submit([encoder.finish()]);
        self.back.map_async(wgpu::MapMode::Read, .., |_| ());
        device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        let bytes = self.back.get_mapped_range(..).map_err(lost)?;
        let ticks: Vec<_> = bytes.as_chunks().0.iter().map(|b| u64::from_le_bytes(*b)).collect();
        drop(bytes);
        self.back.unmap();
        let period_ms = f64::from(device.queue.get_timestamp_period()) * 1e-6;
        let first = ticks.first().copied().unwrap_or(0);
        let ms = |ticks: u64| ticks.wrapping_sub(first) as i64 as f64 * period_ms;
        Ok(ticks.chunks_exact(2).map(|t| [ms(t[0]), ms(t[1])]).collect())
    }
}

//! Where a pass writes its times.

use aonet::gpu::wgpu;

/// Where a pass writes when it begins and ends.
#[derive(Debug, Clone)]
pub struct PassClock(pub(super) wgpu::QuerySet);

impl PassClock {
    /// For the descriptor of a render pass.
    pub fn render(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.0,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Writes one of the two times by an empty pass, for passes that other code encodes.
    pub(super) fn write(&self, encoder: &mut wgpu::CommandEncoder, begin: Option<u32>, end: Option<u32>) {
        let writes = wgpu::ComputePassTimestampWrites {
            query_set: &self.0,
            beginning_of_pass_write_index: begin,
            end_of_pass_write_index: end,
        };
        drop(encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("stopwatch"),
            timestamp_writes: Some(writes),
        }));
    }

    /// Ends what `Stopwatch::begin` began.
    pub(super) fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        self.write(encoder, None, Some(1));
    }
}

//! The passes of a frame, one after the other.

use crate::error::Result;
use crate::gpu::image::Image;
use crate::gpu::options::{Frame, Options};
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::cover::cleared;
use crate::gpu::wgpu_30::pass::Pass;
use crate::gpu::wgpu_30::view::View;

/// What is encoded for frames of one size.
#[derive(Debug)]
pub(crate) struct Chain {
    /// Width and height [px].
    pub(crate) size: (usize, usize),
    /// Begins with zeros every frame.
    pub(crate) cleared: Option<wgpu::Buffer>,
    /// Passes that compute.
    pub(crate) passes: Vec<Pass>,
    /// The one that makes the AO texture.
    pub(crate) image: Image,
}

/// Where the passes of a frame write when they begin and end.
#[derive(Debug, Clone, Copy)]
pub struct Timestamps<'a> {
    /// Two queries for each of a session's `pass_labels`.
    pub queries: &'a wgpu::QuerySet,
}

impl Chain {
    /// Encodes a frame; with timestamps, every pass on its own.
    ///
    /// # Errors
    /// When view or camera have another size, or the frame's numbers are out of range.
    pub(crate) fn encode(
        &self,
        of: (&Context, &Options),
        encoder: &mut wgpu::CommandEncoder,
        (view, frame): (&View, &Frame),
        timestamps: Option<Timestamps<'_>>,
    ) -> Result<()> {
        view.begin(of, self.size, frame)?;
        if let Some(buffer) = &self.cleared {
            encoder.clear_buffer(buffer, 0, None);
        }
        match timestamps {
            None => self.encode_passes(encoder, view),
            Some(timestamps) => self.encode_each_pass(encoder, view, timestamps),
        }
        self.encode_image(encoder, view, timestamps);
        Ok(())
    }

    fn encode_passes(&self, encoder: &mut wgpu::CommandEncoder, view: &View) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("aonet"),
            timestamp_writes: None,
        });
        self.passes.iter().for_each(|p| p.encode(&mut pass, &view.group));
    }

    fn encode_each_pass(&self, encoder: &mut wgpu::CommandEncoder, view: &View, timestamps: Timestamps<'_>) {
        for (i, pass) in self.passes.iter().enumerate() {
            let mut one = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(&pass.label),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: timestamps.queries,
                    beginning_of_pass_write_index: Some(2 * i as u32),
                    end_of_pass_write_index: Some(2 * i as u32 + 1),
                }),
            });
            pass.encode(&mut one, &view.group);
        }
    }

    fn encode_image(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        timestamps: Option<Timestamps<'_>>,
    ) {
        let first = 2 * self.passes.len() as u32;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("aonet image"),
            color_attachments: &[cleared(&view.visibility, wgpu::Color::WHITE)],
            timestamp_writes: timestamps.map(|t| wgpu::RenderPassTimestampWrites {
                query_set: t.queries,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }),
            ..Default::default()
        });
        self.image.encode(&mut pass, &view.group);
    }

    /// Names of the passes in order.
    pub(crate) fn labels(&self) -> Vec<&str> {
        let labels = self.passes.iter().map(|p| p.label.as_str());
        labels.chain(["image"]).collect()
    }
}

//! The passes of a frame, one after the other.

use super::image::Image;
use super::pass::Pass;
use super::view::View;

/// Passes that compute, and the one that makes the AO texture.
#[derive(Debug)]
pub(super) struct Chain {
    pub(super) passes: Vec<Pass>,
    pub(super) image: Image,
}

/// Where the passes of a frame write when they begin and end.
#[derive(Debug, Clone, Copy)]
pub struct Timestamps<'a> {
    /// Two queries for each of a session's `pass_labels`.
    pub queries: &'a wgpu::QuerySet,
}

impl Chain {
    pub(super) fn encode(&self, encoder: &mut wgpu::CommandEncoder, view: &View) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("aonet"),
            timestamp_writes: None,
        });
        self.passes.iter().for_each(|p| p.encode(&mut pass, &view.group));
        drop(pass);
        self.encode_image(encoder, view, None);
    }

    /// Every pass on its own and timed.
    pub(super) fn encode_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        timestamps: Timestamps<'_>,
    ) {
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
        self.encode_image(encoder, view, Some(timestamps));
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
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view.visibility,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
            })],
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
    pub(super) fn labels(&self) -> Vec<&str> {
        let labels = self.passes.iter().map(|p| p.label.as_str());
        labels.chain(["image"]).collect()
    }
}

//! A scene on a device.

use super::memory::Context;
use crate::error::Result;
use crate::trace::{MAX_DEPTH, Tracer};
use aonet::gpu::wgpu;
use aonet::internals::gpu::scoped;

/// WGSL that shaders with rays need: bindings 1 and 2 of group 0.
pub(super) fn traverse() -> String {
    let constants = format!("const MAX_DEPTH = {MAX_DEPTH}u;\n");
    constants + include_str!("traverse.wgsl")
}

/// A scene's hierarchy and triangles on a device. Cheap to clone.
#[derive(Debug, Clone)]
pub struct SceneBuffers {
    pub(super) context: Context,
    pub(super) nodes: wgpu::Buffer,
    pub(super) triangles: wgpu::Buffer,
}

impl SceneBuffers {
    /// Uploads the hierarchy of `tracer`: 48 bytes a triangle, and 224 a node of up to eight children.
    ///
    /// # Errors
    /// When the scene is larger than the device's largest binding or its memory: the 128 MiB that WebGPU guarantees hold
    /// 2.8 million triangles. [`Device`](aonet::gpu::Device) asks for as much as the adapter has.
    pub fn new((device, queue): (&wgpu::Device, &wgpu::Queue), tracer: &Tracer) -> Result<Self> {
        let context = Context { device: device.clone(), queue: queue.clone() };
        let flat = tracer.flat()?;
        let [nodes, triangles] = scoped(device, "scene", || {
            Ok([
                context.filled("nodes of a scene", &flat.nodes)?,
                context.filled("triangles of a scene", &flat.triangles)?,
            ])
        })?;
        Ok(Self { context, nodes, triangles })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.nodes.size() + self.triangles.size()
    }
}

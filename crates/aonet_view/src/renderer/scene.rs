//! A scene in the device's memory. Vertex shaders fetch vertices by index, so that every triangle has its own
//! normal and colour, and no vertex is stored twice.

use super::device::{Gpu, bytes};
use super::textures::TextureArray;
use crate::Result;
use aonet::gpu::wgpu;
use aonet::internals::gpu::scoped;
use aonet_scene::Scene;
use aonet_scene::scene::{Bounds, DEFAULT_ALBEDO};

/// Vertices and triangles, world space.
#[derive(Debug)]
pub(super) struct SceneBuffers {
    /// Three floats a vertex.
    pub(super) position: wgpu::Buffer,
    /// Three floats a vertex.
    pub(super) normal: wgpu::Buffer,
    /// Three indices a triangle.
    pub(super) triangle: wgpu::Buffer,
    /// Three floats a triangle.
    pub(super) albedo: wgpu::Buffer,
    pub(super) textures: TextureArray,
    /// Vertices to draw.
    pub(super) corners: u32,
    pub(super) bounds: Bounds,
}

impl SceneBuffers {
    /// # Errors
    /// When the scene is broken, or larger than the device's largest shader binding.
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        // Indices out of range would not crash, but draw wrong triangles.
        let scene = scene.clone().checked()?;
        let grey = vec![DEFAULT_ALBEDO; if scene.albedo.is_empty() { scene.triangle.len() } else { 0 }];
        let vectors = |v: &[glam::Vec3]| bytes(v.iter().flat_map(|v| v.to_array()));
        let albedo = scene.albedo.iter().chain(&grey).copied().flatten();
        let indices = scene.triangle.as_flattened().iter().flat_map(|i| i.to_le_bytes());
        let arrays = [
            ("positions", vectors(&scene.position)),
            ("normals", vectors(&scene.normal)),
            ("triangles", indices.collect()),
            ("colours", bytes(albedo)),
        ];
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        for (what, bytes) in &arrays {
            if bytes.len() as u64 > most {
                let expected = format!("at most {most} bytes, which is the limit of the device");
                let found = format!("{} bytes", bytes.len());
                return Err(
                    aonet::Error::device(format!("{what} of scene {}", scene.name), expected, found).into()
                );
            }
        }
        let [position, normal, triangle, albedo] = scoped(&gpu.device, "scene", || {
            Ok(arrays.map(|(what, bytes)| {
                let buffer = gpu.buffer(what, bytes.len() as u64, wgpu::BufferUsages::STORAGE);
                gpu.queue.write_buffer(&buffer, 0, &bytes);
                buffer
            }))
        })?;
        let textures = TextureArray::new(gpu, &scene.textures)?;
        let corners = 3 * scene.triangle.len() as u32;
        Ok(Self { position, normal, triangle, albedo, textures, corners, bounds: scene.bounds() })
    }
}

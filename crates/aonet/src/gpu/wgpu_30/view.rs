//! The textures of a frame: what a session reads and what it writes.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::options::{DepthEncoding, Frame, NormalSpace, Options};
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::device::scoped;
use glam::Mat3A;

/// Views of textures of the session's size; all must be sampled once a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Textures<'a> {
    /// Normals in the session's encoding; needs the usage `TEXTURE_BINDING`.
    pub normal: &'a wgpu::TextureView,
    /// Depth in the session's encoding, the depth aspect only; needs the usage `TEXTURE_BINDING`.
    pub depth: &'a wgpu::TextureView,
    /// Visibility comes here, in the session's output format; needs the usage `RENDER_ATTACHMENT`.
    pub visibility: &'a wgpu::TextureView,
}

/// Textures that a session can read and write, and the camera's place in memory. One for every camera of a frame.
#[derive(Debug)]
pub struct View {
    pub(crate) size: (usize, usize),
    pub(crate) group: wgpu::BindGroup,
    pub(crate) frame: wgpu::Buffer,
    pub(crate) visibility: wgpu::TextureView,
}

/// The layout of what the shaders see of a frame.
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE | wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    // Depth textures, too, can be read as floats that are not filtered.
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("frame"),
        entries: &[entry(0, uniform), entry(1, texture), entry(2, texture)],
    })
}

impl View {
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        (size, output): ((usize, usize), wgpu::TextureFormat),
        textures: Textures<'_>,
    ) -> Result<Self> {
        let Textures { normal, depth, visibility } = textures;
        for (what, view) in [("normal", normal), ("depth", depth), ("visibility", visibility)] {
            let found = view.texture().size();
            if (found.width as usize, found.height as usize) != size {
                let found = format!("{}x{}", found.width, found.height);
                return Err(Error::size(format!("{what} texture"), format!("{}x{}", size.0, size.1), found));
            }
        }
        let format = visibility.texture().format();
        if format != output {
            return Err(Error::value("visibility texture", format!("{output:?}"), format!("{format:?}")));
        }
        if !visibility.texture().usage().contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
            let found = format!("{:?}", visibility.texture().usage());
            return Err(Error::value("visibility texture's usage", "RENDER_ATTACHMENT", found));
        }
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: FRAME_BYTES as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let entry = |binding: u32, resource| wgpu::BindGroupEntry { binding, resource };
        let group = scoped(device, "textures of a frame", || {
            Ok(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout,
                entries: &[
                    entry(0, frame.as_entire_binding()),
                    entry(1, wgpu::BindingResource::TextureView(normal)),
                    entry(2, wgpu::BindingResource::TextureView(depth)),
                ],
            }))
        })?;
        Ok(Self { size, group, frame, visibility: visibility.clone() })
    }
}

impl View {
    /// Writes a frame's numbers for the commands that are submitted next.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub(crate) fn begin(
        &self,
        (context, options): (&Context, &Options),
        (width, height): (usize, usize),
        frame: &Frame,
    ) -> Result<()> {
        if self.size != (width, height) {
            let found = format!("{}x{}", self.size.0, self.size.1);
            return Err(Error::size("view of a session", format!("{width}x{height}"), found));
        }
        let bytes = frame_bytes(options, frame, (width, height))?;
        context.queue.write_buffer(&self.frame, 0, &bytes);
        Ok(())
    }
}

/// # Errors
/// When a side is larger than the device's textures.
pub(crate) fn check_size(device: &wgpu::Device, (width, height): (usize, usize)) -> Result<()> {
    let most = device.limits().max_texture_dimension_2d as usize;
    match width.max(height) <= most {
        true => Ok(()),
        false => {
            let found = format!("{width}x{height}");
            Err(Error::size("session", format!("sides of at most {most}"), found))
        }
    }
}

/// Bytes of the struct `Frame` of `surface.wgsl`.
const FRAME_BYTES: usize = 96;

/// That struct.
///
/// # Errors
/// When the camera is of another size or out of range, or the planes are.
fn frame_bytes(
    options: &Options,
    frame: &Frame,
    (width, height): (usize, usize),
) -> Result<[u8; FRAME_BYTES]> {
    let (camera, radius) = (frame.camera, frame.params.radius());
    Size::new(width, height)?.expect("camera of a frame", camera.size())?;
    let view_from_normals = match options.normal_space {
        NormalSpace::View => Mat3A::IDENTITY,
        NormalSpace::World => camera.view_from_world().matrix3,
    };
    let [focal_x, focal_y] = camera.focal_px();
    let pixel_size = if camera.is_perspective() { [1.0 / focal_y, 0.0] } else { [0.0, 1.0 / focal_y] };
    let mut words = [0u32; FRAME_BYTES / 4];
    let mut put = |at: usize, values: &[f32]| {
        words[at..at + values.len()].iter_mut().zip(values).for_each(|(word, v)| *word = v.to_bits());
    };
    for (i, column) in view_from_normals.to_cols_array_2d().iter().enumerate() {
        put(4 * i, column);
    }
    put(14, &depth_line(options.depth, frame)?);
    put(16, &pixel_size);
    put(18, &[radius, camera.projected_px(radius, 1.0).log2()]);
    put(20, &camera.centre_px());
    put(22, &[focal_y / focal_x]);
    (words[12], words[13]) = (width as u32, height as u32);
    let mut bytes = [0; FRAME_BYTES];
    bytes.chunks_exact_mut(4).zip(words).for_each(|(bytes, word)| bytes.copy_from_slice(&word.to_le_bytes()));
    Ok(bytes)
}

/// Slope and offset that make a distance, or with perspective its inverse, of a stored depth.
fn depth_line(encoding: DepthEncoding, frame: &Frame) -> Result<[f32; 2]> {
    let perspective = frame.camera.is_perspective();
    let (near, far) = (f64::from(frame.camera.near()), f64::from(frame.far));
    let at = |v: f64| if perspective { 1.0 / v } else { v };
    let (at_0, at_1) = match encoding {
        DepthEncoding::Linear => return Ok([1.0, 0.0]),
        DepthEncoding::Reversed => (at(far), at(near)),
        DepthEncoding::Standard => (at(near), at(far)),
    };
    if !(far > near) || !at_0.is_finite() || !at_1.is_finite() {
        let expected = match perspective {
            true => "0 < near < far",
            false => "0 <= near < far, both finite",
        };
        return Err(Error::value("planes of a frame", expected, format!("near {near}, far {far}")));
    }
    Ok([(at_1 - at_0) as f32, at_0 as f32])
}

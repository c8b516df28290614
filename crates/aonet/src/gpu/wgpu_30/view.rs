//! The textures of a frame: what a session reads and what it writes.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::frame::window::{Margin, Window};
use crate::gpu::options::Frame;
use crate::gpu::program::Program;
use crate::gpu::uniforms::FRAME_BYTES;
use crate::gpu::wgpu_30::bind;
use crate::gpu::wgpu_30::device::scoped;

/// Views of textures of the session's size; all must be sampled once a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Textures<'a> {
    /// Normals in the session's encoding; needs the usage `TEXTURE_BINDING`.
    pub normal: &'a wgpu::TextureView,
    /// Depth in the session's encoding, the depth aspect only; needs the usage `TEXTURE_BINDING`.
    pub depth: &'a wgpu::TextureView,
    /// Visibility comes here, in the session's output format; needs the usage `RENDER_ATTACHMENT`. It may be smaller than the
    /// session: the rest is a guard band, as wide on the left as on the right and as high above as below.
    pub visibility: &'a wgpu::TextureView,
}

/// Textures that a session can read and write, and the camera's place in memory. One for every camera of a frame.
#[derive(Debug)]
pub struct View {
    pub(crate) size: (usize, usize),
    margin: Margin,
    pub(crate) group: wgpu::BindGroup,
    pub(crate) frame: wgpu::Buffer,
    pub(crate) visibility: wgpu::TextureView,
}

/// The layout of what the shaders see of a frame.
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let stages = wgpu::ShaderStages::COMPUTE | wgpu::ShaderStages::FRAGMENT;
    bind::layout(device, "frame", stages, &[bind::UNIFORM, bind::TEXTURE, bind::TEXTURE])
}

impl View {
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        (size, output): ((usize, usize), wgpu::TextureFormat),
        textures: Textures<'_>,
    ) -> Result<Self> {
        let Textures { normal, depth, visibility } = textures;
        for (what, view) in [("normal", normal), ("depth", depth)] {
            let found = view.texture().size();
            if (found.width as usize, found.height as usize) != size {
                let found = format!("{}x{}", found.width, found.height);
                return Err(Error::size(format!("{what} texture"), format!("{}x{}", size.0, size.1), found));
            }
        }
        let margin = margin(size, visibility.texture())?;
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
        let textures = [normal, depth].map(wgpu::BindingResource::TextureView);
        let resources = [frame.as_entire_binding()].into_iter().chain(textures);
        let group =
            scoped(device, "textures of a frame", || Ok(bind::group(device, "frame", layout, resources)))?;
        Ok(Self { size, margin, group, frame, visibility: visibility.clone() })
    }
}

impl View {
    /// Writes a frame's numbers for the commands that are submitted next.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub(crate) fn begin(&self, queue: &wgpu::Queue, program: &Program, frame: &Frame) -> Result<()> {
        let (width, height) = program.size;
        if self.size != program.size {
            let found = format!("{}x{}", self.size.0, self.size.1);
            return Err(Error::size("view of a session", format!("{width}x{height}"), found));
        }
        queue.write_buffer(&self.frame, 0, &program.frame_bytes(self.margin, frame)?);
        Ok(())
    }
}

/// The guard band of frames of `size` around a picture of the texture's size.
///
/// # Errors
/// When the texture is larger, or not in the middle of whole pixels.
fn margin((width, height): (usize, usize), picture: &wgpu::Texture) -> Result<Margin> {
    let found = Size::new(picture.width() as usize, picture.height() as usize)?;
    let rest = |side: usize, found: usize| side.checked_sub(found).filter(|rest| rest % 2 == 0);
    match (rest(width, found.width()), rest(height, found.height())) {
        (Some(x), Some(y)) => {
            Ok(Window::inside(Size::new(width, height)?, Margin { x: x / 2, y: y / 2 })?.margin())
        }
        _ => {
            let expected = format!("{width}x{height}, or less by an even number of pixels");
            Err(Error::size("visibility texture", expected, found))
        }
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

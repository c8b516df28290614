//! The textures of a frame: what a session reads and what it writes.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::frame::window::{Margin, Window};
use crate::gpu::options::{FrameNumbers, Layers};
use crate::gpu::program::Program;
use crate::gpu::uniforms::FRAME_BYTES;
use crate::gpu::wgpu_30::bind;
use crate::gpu::wgpu_30::errors::scoped;
use crate::gpu::wgpu_30::options::Outputs;

/// Views of textures of the session's size; all must be sampled once a pixel.
#[derive(Debug, Clone, Copy)]
pub struct FrameViews<'a> {
    /// Normals in the session's encoding; needs the usage `TEXTURE_BINDING`.
    pub normal: &'a wgpu::TextureView,
    /// Depth in the session's encoding, the depth aspect only; needs the usage `TEXTURE_BINDING`.
    pub depth: &'a wgpu::TextureView,
    /// The second layer of depth, likewise: for sessions with [`Layers::Two`]. Others do not read it.
    pub second: Option<&'a wgpu::TextureView>,
    /// Visibility comes here, in the session's output format; needs the usage `RENDER_ATTACHMENT`. It may be smaller than the
    /// session: the rest is a guard band, as wide on the left as on the right and as high above as below.
    pub visibility: &'a wgpu::TextureView,
}

/// Textures that a session reads and writes, and the memory of the frame's numbers. There is one for each camera of a
/// frame.
#[derive(Debug)]
pub struct BoundFrame {
    pub(crate) size: Size,
    margin: Margin,
    pub(crate) group: wgpu::BindGroup,
    pub(crate) frame: wgpu::Buffer,
    pub(crate) visibility: wgpu::TextureView,
    /// Of sessions with bent normals.
    pub(crate) bent: Option<wgpu::TextureView>,
}

/// The frames of a session.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frames {
    pub(crate) size: Size,
    pub(crate) layers: Layers,
    pub(crate) output: Outputs,
}

/// The layout of what the shaders see of a frame.
pub(crate) fn layout(device: &wgpu::Device, layers: Layers) -> wgpu::BindGroupLayout {
    let stages = wgpu::ShaderStages::COMPUTE | wgpu::ShaderStages::FRAGMENT;
    let types = [bind::UNIFORM, bind::TEXTURE, bind::TEXTURE, bind::TEXTURE];
    bind::layout(device, "frame", stages, &types[..2 + layers.count()])
}

impl BoundFrame {
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        Frames { size, layers, output }: Frames,
        (views, bent): (FrameViews<'_>, Option<&wgpu::TextureView>),
    ) -> Result<Self> {
        let FrameViews { normal, depth, second, visibility } = views;
        let mut inputs = vec![("normal", normal), ("depth", depth)];
        if layers == Layers::Two {
            let missing =
                || Error::value("second depth texture", "one, because the program has two layers", "none");
            inputs.push(("second depth", second.ok_or_else(missing)?));
        }
        for (what, view) in &inputs {
            size.expect(&format!("{what} texture"), size_of(view.texture())?)?;
        }
        let margin = margin(size, visibility.texture())?;
        check_target("visibility texture", visibility, output.visibility)?;
        match (output.bent, bent) {
            (None, None) => {}
            (Some(format), Some(view)) => {
                check_target("bent normals texture", view, format)?;
                size_of(visibility.texture())?.expect("bent normals texture", size_of(view.texture())?)?;
            }
            (expected, found) => {
                let word = |there: bool| if there { "one" } else { "none" };
                let expected = format!("{}, as the session was made", word(expected.is_some()));
                return Err(Error::value("bent normals texture", expected, word(found.is_some())));
            }
        }
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: FRAME_BYTES as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let textures = inputs.iter().map(|(_, view)| wgpu::BindingResource::TextureView(view));
        let resources = [frame.as_entire_binding()].into_iter().chain(textures);
        let group =
            scoped(device, "textures of a frame", || Ok(bind::group(device, "frame", layout, resources)))?;
        Ok(Self { size, margin, group, frame, visibility: visibility.clone(), bent: bent.cloned() })
    }
}

impl BoundFrame {
    /// Writes a frame's numbers for the commands that are submitted next.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub(crate) fn begin(&self, queue: &wgpu::Queue, program: &Program, frame: &FrameNumbers) -> Result<()> {
        program.size.expect("view of a session", self.size)?;
        queue.write_buffer(&self.frame, 0, &program.frame_bytes(self.margin, frame)?);
        Ok(())
    }
}

/// # Errors
/// When a texture to draw has another format than the session writes, or cannot be rendered to.
fn check_target(what: &str, view: &wgpu::TextureView, expected: wgpu::TextureFormat) -> Result<()> {
    let (format, usage) = (view.texture().format(), view.texture().usage());
    if format != expected {
        return Err(Error::value(what, format!("{expected:?}"), format!("{format:?}")));
    }
    match usage.contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
        true => Ok(()),
        false => Err(Error::value(format!("{what}'s usage"), "RENDER_ATTACHMENT", format!("{usage:?}"))),
    }
}

fn size_of(texture: &wgpu::Texture) -> Result<Size> {
    Size::new(texture.width() as usize, texture.height() as usize)
}

/// The guard band of frames of `size` around a picture of the texture's size.
///
/// # Errors
/// When the texture is larger, or not in the middle of whole pixels.
fn margin(size: Size, picture: &wgpu::Texture) -> Result<Margin> {
    let found = size_of(picture)?;
    let rest = |side: usize, found: usize| side.checked_sub(found).filter(|rest| rest % 2 == 0);
    match (rest(size.width(), found.width()), rest(size.height(), found.height())) {
        (Some(x), Some(y)) => Ok(Window::inside(size, Margin { x: x / 2, y: y / 2 })?.margin()),
        _ => {
            let expected = format!("{size}, or less by an even number of pixels");
            Err(Error::size("visibility texture", expected, found))
        }
    }
}

/// # Errors
/// When a side is larger than the device's textures.
pub(crate) fn check_size(device: &wgpu::Device, size: Size) -> Result<()> {
    let most = device.limits().max_texture_dimension_2d as usize;
    match size.width().max(size.height()) <= most {
        true => Ok(()),
        false => Err(Error::size("session", format!("sides of at most {most}"), size)),
    }
}

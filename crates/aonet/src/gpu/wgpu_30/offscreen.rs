//! A session on frames in main memory, for programs that do not render on the device.

use crate::error::{Error, Result};
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::bent_normals::BentNormals;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::frame::window::Window;
use crate::gpu::options::{DepthEncoding, FrameNumbers, Kernels, Layers, Precision};
use crate::gpu::wgpu_30::bind::extent;
use crate::gpu::wgpu_30::device::Device;
use crate::gpu::wgpu_30::errors::scoped;
use crate::gpu::wgpu_30::options::Options;
use crate::gpu::wgpu_30::session::Runner;
use crate::gpu::wgpu_30::view::{BoundFrame, FrameViews};
use crate::net::gpu::Session;
use crate::net::model::Model;
use crate::search::Classic;
use crate::search::bent::check;
use crate::search::gpu::ClassicSession;

/// A session, textures of its size and a way back. What takes the time is copying and waiting.
#[derive(Debug)]
pub struct Offscreen {
    device: Device,
    session: Runner,
    precision: Precision,
    window: Window,
    view: BoundFrame,
    normal: wgpu::Texture,
    depth: wgpu::Texture,
    /// Of sessions with two layers.
    second: Option<wgpu::Texture>,
    visibility: Target,
    /// Of sessions with bent normals.
    bent: Option<Target>,
}

/// A texture of floats that a session writes, and its way back.
#[derive(Debug)]
struct Target {
    texture: wgpu::Texture,
    back: wgpu::Buffer,
    /// Of a texel.
    channels: usize,
}

/// Frames in memory are floats.
const OPTIONS: Options = Options {
    precision: Precision::F32,
    kernels: Kernels::Plain,
    normals: crate::gpu::options::NormalEncoding::Plain,
    normal_space: crate::gpu::options::NormalSpace::View,
    depth: DepthEncoding::Linear,
    layers: Layers::One,
    output: wgpu::TextureFormat::R32Float,
};

/// Format of bent normals.
const BENT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

impl Offscreen {
    /// A session for pictures with a guard band or without, with its own textures. It multiplies matrices where the
    /// session computes in half floats and the device supports such products.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn new(
        device: &Device,
        model: &Model,
        window: impl Into<Window>,
        precision: Precision,
    ) -> Result<Self> {
        Self::in_layers(device, model, (window, Layers::One), precision)
    }

    /// The same for frames with one layer or two. Networks that read only the first layer give the same image for both.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn in_layers(
        device: &Device,
        model: &Model,
        (window, layers): (impl Into<Window>, Layers),
        precision: Precision,
    ) -> Result<Self> {
        let window = window.into();
        let kernels = device.matrices.map_or(Kernels::Plain, Kernels::Matrices);
        let options = Options { precision, kernels, layers, ..OPTIONS };
        let session = Session::new((&device.device, &device.queue), model, window.buffer_size(), options)?;
        let precision = session.precision();
        Self::of(device, session.into_runner(), (window, precision))
    }

    /// The same for [`Offscreen::run_with_bent_normals`].
    ///
    /// # Errors
    /// As [`Session::with_bent_normals`].
    pub fn with_bent_normals(
        device: &Device,
        model: &Model,
        (window, layers): (impl Into<Window>, Layers),
        precision: Precision,
    ) -> Result<Self> {
        let window = window.into();
        let kernels = device.matrices.map_or(Kernels::Plain, Kernels::Matrices);
        let options = Options { precision, kernels, layers, ..OPTIONS };
        let (on, size) = ((&device.device, &device.queue), window.buffer_size());
        let session = Session::with_bent_normals(on, model, size, options, BENT)?;
        let precision = session.precision();
        Self::of(device, session.into_runner(), (window, precision))
    }

    /// The same for a classic method and [`Offscreen::run_with_bent_normals`].
    ///
    /// # Errors
    /// As [`ClassicSession::with_bent_normals`].
    pub fn classic_with_bent_normals(
        device: &Device,
        method: &Classic,
        window: impl Into<Window>,
        layers: Layers,
    ) -> Result<Self> {
        let (window, options) = (window.into(), Options { layers, ..OPTIONS });
        let on = (&device.device, &device.queue);
        let session = ClassicSession::with_bent_normals(on, method, window.buffer_size(), options, BENT)?;
        Self::of(device, session.into_runner(), (window, Precision::F32))
    }

    /// The same for a classic method.
    ///
    /// # Errors
    /// As [`ClassicSession::new`].
    pub fn classic(device: &Device, method: &Classic, window: impl Into<Window>) -> Result<Self> {
        Self::classic_in_layers(device, method, window, Layers::One)
    }

    /// The same for frames with one layer or two. Methods that read only the first layer give the same image for both.
    ///
    /// # Errors
    /// As [`ClassicSession::new`].
    pub fn classic_in_layers(
        device: &Device,
        method: &Classic,
        window: impl Into<Window>,
        layers: Layers,
    ) -> Result<Self> {
        let (window, options) = (window.into(), Options { layers, ..OPTIONS });
        let on = (&device.device, &device.queue);
        let session = ClassicSession::new(on, method, window.buffer_size(), options)?;
        Self::of(device, session.into_runner(), (window, Precision::F32))
    }

    fn of(device: &Device, session: Runner, (window, precision): (Window, Precision)) -> Result<Self> {
        scoped(&device.device, "textures", || {
            let texture = |size: Size, format, usage| {
                device.device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("aonet offscreen"),
                    size: extent(size),
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage,
                    view_formats: &[],
                })
            };
            let input = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
            let normal = texture(window.buffer_size(), wgpu::TextureFormat::Rgba32Float, input);
            let depth = texture(window.buffer_size(), wgpu::TextureFormat::R32Float, input);
            let second = (session.layers() == Layers::Two)
                .then(|| texture(window.buffer_size(), wgpu::TextureFormat::R32Float, input));
            let target = |format, channels: usize| {
                let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
                let back = device.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("aonet offscreen"),
                    size: (row_bytes(window.size().width() * channels) * window.size().height()) as u64,
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                });
                Target { texture: texture(window.size(), format, usage), back, channels }
            };
            let visibility = target(OPTIONS.output, 1);
            let bent = session.has_bent_normals().then(|| target(BENT, 4));
            let [n, d, v] =
                [&normal, &depth, &visibility.texture].map(|t| t.create_view(&Default::default()));
            let b = bent.as_ref().map(|target| target.texture.create_view(&Default::default()));
            let s = second.as_ref().map(|t| t.create_view(&Default::default()));
            let views = FrameViews { normal: &n, depth: &d, second: s.as_ref(), visibility: &v };
            let view = session.bind(views, b.as_ref())?;
            Ok(Self {
                device: device.clone(),
                session,
                precision,
                window,
                view,
                normal,
                depth,
                second,
                visibility,
                bent,
            })
        })
    }

    /// Writes the visibility of a frame's picture: in [0, 1], 1 on the background. Waits for the device.
    ///
    /// # Errors
    /// When the frame has another size or margin than the session, or no second layer for a session with two, the image
    /// another size than its picture, or the device is lost.
    pub fn run(&mut self, gbuffer: &GBuffer, params: AoParams, image: &mut AoImage) -> Result<()> {
        if gbuffer.window() != self.window {
            return Err(Error::size("G-buffer of a session", self.window, gbuffer.window()));
        }
        self.window.size().expect("AO image of a session", image.size())?;
        if self.second.is_some() && gbuffer.second().is_none() {
            return Err(Error::value("layers of a frame", "2, as the session has", "1"));
        }
        scoped(&self.device.device, "frame", || {
            self.submit(gbuffer, params)?;
            self.visibility.download(&self.device, |i, texel| image.visibility_mut()[i] = texel[0])
        })
    }

    /// [`Offscreen::run`] that also writes the picture's bent normals.
    ///
    /// # Errors
    /// As [`Offscreen::run`]; also when the session was made without them, or `bent` has another size.
    pub fn run_with_bent_normals(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        bent: &mut BentNormals,
    ) -> Result<()> {
        check(self.bent.is_some(), self.window, bent)?;
        self.run(gbuffer, params, image)?;
        let Some(target) = &self.bent else { return Ok(()) };
        scoped(&self.device.device, "frame", || {
            target.download(&self.device, |i, texel| {
                bent.directions_mut()[i].copy_from_slice(&texel[..3]);
            })
        })
    }

    fn submit(&self, gbuffer: &GBuffer, params: AoParams) -> Result<()> {
        let frame = FrameNumbers { camera: *gbuffer.camera(), far: f32::INFINITY, params };
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.session.encode(&mut encoder, (&self.view, &frame), None)?;
        self.upload(gbuffer);
        for target in [&self.visibility].into_iter().chain(&self.bent) {
            let width = self.window.size().width() * target.channels;
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row_bytes(width) as u32),
                rows_per_image: None,
            };
            let to = wgpu::TexelCopyBufferInfo { buffer: &target.back, layout };
            encoder.copy_texture_to_buffer(target.texture.as_image_copy(), to, extent(self.window.size()));
        }
        self.device.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn upload(&self, gbuffer: &GBuffer) {
        let normals = gbuffer.normal().iter().flat_map(|n| [n[0], n[1], n[2], 0.0]);
        let bytes = |depth: &[f32]| depth.iter().flat_map(|d| d.to_le_bytes()).collect::<Vec<_>>();
        let textures = [
            (&self.normal, normals.flat_map(f32::to_le_bytes).collect()),
            (&self.depth, bytes(gbuffer.depth())),
        ];
        let second = self.second.as_ref().zip(gbuffer.second());
        let second = second.map(|(texture, second)| (texture, bytes(&second.depth)));
        for (texture, values) in textures.into_iter().chain(second) {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((values.len() / gbuffer.height()) as u32),
                rows_per_image: None,
            };
            let size = extent(gbuffer.size());
            self.device.queue.write_texture(texture.as_image_copy(), &values, layout, size);
        }
    }

    /// The numbers that it computes with.
    pub fn precision(&self) -> Precision {
        self.precision
    }
}

impl Target {
    /// Calls `write` with the index and the channels of every texel, once the device has drawn it.
    fn download(&self, device: &Device, mut write: impl FnMut(usize, &[f32])) -> Result<()> {
        let lost = |found: String| Error::device("image of a frame", "one that can be read back", found);
        self.back.map_async(wgpu::MapMode::Read, .., |_| ());
        device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(e.to_string()))?;
        let values = self.texture.width() as usize * self.channels;
        let copied = self.back.get_mapped_range(..).map_err(|e| lost(e.to_string())).map(|bytes| {
            let rows = bytes.chunks_exact(row_bytes(values));
            let texels = rows.flat_map(|row| row[..values * 4].chunks_exact(self.channels * 4));
            for (i, bytes) in texels.enumerate() {
                let mut texel = [0.0; 4];
                let floats = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
                texel.iter_mut().zip(floats).for_each(|(value, float)| *value = float);
                write(i, &texel[..self.channels]);
            }
        });
        self.back.unmap();
        copied
    }
}

/// Bytes of a row on its way back.
fn row_bytes(width: usize) -> usize {
    (width * size_of::<f32>()).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize)
}

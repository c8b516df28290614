//! A canvas as a render target.

use aonet::Size;
use aonet::gpu::{Device, wgpu};
use aonet_view::renderer::Present;
use aonet_view::{Error, Result};
use wgpu::CurrentSurfaceTexture as Next;

/// A canvas and its surface.
pub(crate) struct Canvas {
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    present: Present,
}

impl Canvas {
    /// # Errors
    /// When something else, such as WebGL, has drawn on the canvas.
    pub(crate) fn new(device: &Device, canvas: web_sys::HtmlCanvasElement, format: &str) -> Result<Self> {
        // Both formats work everywhere; browsers copy pictures in the format that they do not prefer.
        let format = match format {
            "rgba8unorm" => wgpu::TextureFormat::Rgba8Unorm,
            _ => wgpu::TextureFormat::Bgra8Unorm,
        };
        let configuration = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Srgb,
            width: canvas.width(),
            height: canvas.height(),
            present_mode: wgpu::PresentMode::Fifo,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Opaque,
            view_formats: vec![],
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        // In a browser any device can draw on a canvas.
        let surface = instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas))
            .map_err(|e| aonet::Error::device("canvas", "one that nothing else has drawn on", e))?;
        surface.configure(&device.device, &configuration);
        let present = Present::new((&device.device, &device.queue), format);
        Ok(Self { surface, configuration, present })
    }

    /// Changes the size to that of the canvas.
    pub(crate) fn resize(&mut self, device: &wgpu::Device, size: Size) {
        (self.configuration.width, self.configuration.height) = (size.width() as u32, size.height() as u32);
        self.surface.configure(device, &self.configuration);
    }

    /// Submits the commands and shows their picture on the canvas.
    ///
    /// # Errors
    /// When the canvas has no texture to draw on.
    pub(crate) fn show(
        &self,
        device: &Device,
        mut encoder: wgpu::CommandEncoder,
        picture: &wgpu::Texture,
    ) -> Result<()> {
        let texture = match self.surface.get_current_texture() {
            Next::Success(texture) | Next::Suboptimal(texture) => texture,
            other => {
                let found = format!("{other:?}");
                return Err(Error::Core(aonet::Error::device("canvas", "a texture to draw on", found)));
            }
        };
        let target = texture.texture.create_view(&Default::default());
        self.present.encode(&mut encoder, picture, &target);
        device.queue.submit([encoder.finish()]);
        device.queue.present(texture);
        Ok(())
    }
}

//! A window's surface and the device that draws on it.

use crate::{Error, Result};
use aonet::Size;
use aonet::frame::MAX_SIDE;
use aonet::gpu::{Device, wgpu};
use aonet::internals::gpu::wait;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use winit::window::Window;

/// The surface that frames are shown on.
#[derive(Debug)]
pub(super) struct Surface {
    pub(super) device: Device,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    lost: Arc<AtomicBool>,
    complaint: Arc<Mutex<Option<String>>>,
}

impl Surface {
    /// # Errors
    /// When no adapter can draw on the window.
    pub(super) fn new(window: &Arc<Window>) -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let refused = |what: &str, e: &dyn std::fmt::Display| {
            Error::Core(aonet::Error::device(what, "one that draws on the window", e))
        };
        let surface = instance.create_surface(Arc::clone(window)).map_err(|e| refused("surface", &e))?;
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..Default::default()
        };
        let adapter = wait(instance.request_adapter(&options)).map_err(|e| refused("adapter", &e))?;
        let device = Device::of(&adapter)?;
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| refused("surface", &"one that the adapter cannot draw on"))?;
        // The controls blend in sRGB values.
        config.format = config.format.remove_srgb_suffix();
        let formats = surface.get_capabilities(&adapter).formats;
        if !formats.contains(&config.format) {
            config.format = formats.first().copied().unwrap_or(config.format);
        }
        let (lost, complaint) = (Arc::new(AtomicBool::new(false)), Arc::default());
        listen(&device.device, (&lost, &complaint));
        let this = Self { device, surface, config, lost, complaint };
        this.configure();
        Ok(this)
    }

    fn configure(&self) {
        self.surface.configure(&self.device.device, &self.config);
    }

    /// Changes the size to the window's; a size of 0 means that nothing is drawn.
    pub(super) fn resize(&mut self, width: u32, height: u32) {
        if width > 0 && height > 0 {
            (self.config.width, self.config.height) = (width, height);
            self.configure();
        }
    }

    /// The texture of the next frame; none if the window is not visible or has just changed.
    ///
    /// # Errors
    /// When the surface is lost permanently.
    pub(super) fn acquire(&self) -> Result<Option<wgpu::SurfaceTexture>> {
        use wgpu::CurrentSurfaceTexture::{
            Lost, Occluded, Outdated, Suboptimal, Success, Timeout, Validation,
        };
        match self.surface.get_current_texture() {
            Success(texture) | Suboptimal(texture) => Ok(Some(texture)),
            Timeout | Occluded => Ok(None),
            Outdated => {
                self.configure();
                Ok(None)
            }
            Lost | Validation => {
                self.lost.store(true, Ordering::Release);
                Ok(None)
            }
        }
    }

    /// Whether device or surface are lost; all their resources must then be created again.
    pub(super) fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Acquire)
    }

    /// The device's error messages since the last call.
    pub(super) fn complaint(&self) -> Option<String> {
        self.complaint.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Format of the frames.
    pub(super) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// The size of the window.
    pub(super) fn size(&self) -> Size {
        let side = |px: u32| (px as usize).clamp(1, MAX_SIDE);
        Size::px(side(self.config.width), side(self.config.height))
    }
}

/// Listens for errors of the device that no call returns.
fn listen(device: &wgpu::Device, (lost, complaint): (&Arc<AtomicBool>, &Arc<Mutex<Option<String>>>)) {
    let lost = Arc::clone(lost);
    device.set_device_lost_callback(move |reason, message| {
        log::warn!("the graphics device is lost ({reason:?}): {message}");
        lost.store(true, Ordering::Release);
    });
    let complaint = Arc::clone(complaint);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        let mut complaint = complaint.lock().unwrap_or_else(PoisonError::into_inner);
        complaint.get_or_insert_with(|| error.to_string());
    }));
}

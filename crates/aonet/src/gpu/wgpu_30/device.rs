//! A device for programs that do not render: servers, commands, tests.

use crate::error::{Error, Result};
use crate::gpu::matrices::Matrices;
#[cfg(not(target_arch = "wasm32"))]
use crate::gpu::wgpu_30::matrix_trial;

/// A device, its queue and where they come from.
#[derive(Debug, Clone)]
pub struct Device {
    /// Name, driver and kind of the adapter.
    pub adapter: wgpu::AdapterInfo,
    /// With half floats, subgroups, timestamps and textures of 16 bits where the adapter has them.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The products of matrices that it has, if it has any.
    pub matrices: Option<Matrices>,
}

/// Features that are asked for where they exist: see [`Device::device`].
const WANTED: wgpu::Features = wgpu::Features::SHADER_F16
    .union(wgpu::Features::SUBGROUP)
    .union(wgpu::Features::TIMESTAMP_QUERY)
    .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM);

impl Device {
    /// The fastest adapter of this machine, with no window.
    ///
    /// # Errors
    /// When there is none, or it gives no device.
    pub async fn request() -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            })
            .await
            .map_err(|e| Error::device("adapter", "one that computes", e))?;
        Self::request_of(&adapter).await
    }

    async fn request_of(adapter: &wgpu::Adapter) -> Result<Self> {
        let limits = adapter.limits();
        let matrices = Matrices::of(adapter);
        let of_matrices = if matrices.is_some() { Matrices::FEATURES } else { wgpu::Features::empty() };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("aonet"),
            required_features: adapter.features() & WANTED | of_matrices,
            experimental_features: experimental(matrices),
            // What images of any size need; else what every adapter has.
            required_limits: wgpu::Limits {
                max_buffer_size: limits.max_buffer_size,
                max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
                max_texture_dimension_2d: limits.max_texture_dimension_2d,
                ..wgpu::Limits::default()
            },
            ..Default::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|e| Error::device("device", "WebGPU's default limits", e))?;
        Ok(Self { adapter: adapter.get_info(), device, queue, matrices })
    }

    /// The same, waiting for it. Products of matrices are tried out.
    ///
    /// # Errors
    /// As [`Device::request`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn wait_for() -> Result<Self> {
        wait(Self::request()).map(Self::tried)
    }

    /// The same of an adapter that the caller has chosen: one that draws on its window, say.
    ///
    /// # Errors
    /// When it gives no device.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn of(adapter: &wgpu::Adapter) -> Result<Self> {
        wait(Self::request_of(adapter)).map(Self::tried)
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn tried(self) -> Self {
        let right = |m: &Matrices| matrix_trial::succeeds(*m, &self.device, &self.queue);
        Self { matrices: self.matrices.filter(right), ..self }
    }
}

/// The end of a future that ends by itself, as wgpu's do but for browsers.
#[cfg(not(target_arch = "wasm32"))]
pub fn wait<T>(future: impl Future<Output = T>) -> T {
    use std::task::{Context, Poll, Waker};
    let mut future = std::pin::pin!(future);
    loop {
        if let Poll::Ready(done) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return done;
        }
        std::thread::yield_now();
    }
}

#[allow(unsafe_code, reason = "wgpu asks for a promise where a feature is experimental")]
fn experimental(matrices: Option<Matrices>) -> wgpu::ExperimentalFeatures {
    match matrices {
        // SAFETY: products of matrices are all that is asked for, and only shaders of this crate that tests hold
        // against plain loops compute them.
        Some(_) => unsafe { wgpu::ExperimentalFeatures::enabled() },
        None => wgpu::ExperimentalFeatures::disabled(),
    }
}

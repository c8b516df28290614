//! Backends that trace the reference: this machine's cores or a graphics processor.

use crate::Result;
use crate::gbuffer::Surface;
#[cfg(feature = "gpu")]
use crate::gpu::Offscreen;
use crate::reference::{Sampling, reference_ao};
use crate::trace::Tracer;
use aonet::{AoImage, AoParams};

/// Where rays are traced.
#[derive(Debug, Clone, Default)]
pub enum Backend {
    /// On the cores of the current thread pool.
    #[default]
    Cpu,
    /// On a device.
    #[cfg(feature = "gpu")]
    Gpu(Box<aonet::gpu::Device>),
}

/// A scene, prepared for the rays of references.
#[derive(Debug)]
pub enum Rays<'a> {
    /// In main memory.
    Cpu(&'a Tracer),
    /// On a device.
    #[cfg(feature = "gpu")]
    Gpu(Box<Offscreen<'a>>),
}

impl Backend {
    /// Name of the backend: `cpu`, or the name of the adapter.
    pub fn name(&self) -> &str {
        match self {
            Self::Cpu => "cpu",
            #[cfg(feature = "gpu")]
            Self::Gpu(device) => &device.adapter.name,
        }
    }

    /// Prepares the scene of `tracer` for this backend.
    ///
    /// # Errors
    /// When it is too large for a device.
    pub fn rays<'a>(&self, tracer: &'a Tracer) -> Result<Rays<'a>> {
        Ok(match self {
            Self::Cpu => Rays::Cpu(tracer),
            #[cfg(feature = "gpu")]
            Self::Gpu(device) => Rays::Gpu(Box::new(Offscreen::new(device, tracer)?)),
        })
    }
}

impl Rays<'_> {
    /// [`reference_ao`] on this backend: the same image up to rounding.
    ///
    /// # Errors
    /// As [`reference_ao`]; also when a device is lost or too small for the image.
    pub fn reference_ao(
        &mut self,
        surface: &Surface,
        params: AoParams,
        sampling: Sampling,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<AoImage> {
        match self {
            Self::Cpu(tracer) => reference_ao(tracer, surface, params, sampling, progress),
            #[cfg(feature = "gpu")]
            Self::Gpu(offscreen) => offscreen.reference_ao(surface, params, sampling, progress),
        }
    }
}

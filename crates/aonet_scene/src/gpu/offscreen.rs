//! References for surfaces in main memory, for programs that do not render on the device.

use super::reference::{Dispatch, Reference, ReferenceOptions};
use super::scene::SceneBuffers;
use crate::Result;
use crate::gbuffer::Surface;
use crate::reference::Sampling;
use crate::trace::Tracer;
use aonet::gpu::{Device, wgpu};
use aonet::internals::gpu::scoped;
use aonet::{AoImage, AoParams, Error, Size};

/// A scene on a device, for images in main memory.
#[derive(Debug)]
pub struct Offscreen<'a> {
    device: Device,
    tracer: &'a Tracer,
    /// Of the last image's size.
    reference: Reference,
}

impl<'a> Offscreen<'a> {
    /// Uploads the scene of `tracer` and compiles the shaders.
    ///
    /// # Errors
    /// When the scene is too large for the device, or the device is lost.
    pub fn new(device: &Device, tracer: &'a Tracer) -> Result<Self> {
        let scene = SceneBuffers::new((&device.device, &device.queue), tracer)?;
        let options =
            ReferenceOptions { sampling: Sampling { spp: 1, seed: 0 }, ..ReferenceOptions::default() };
        let reference = Reference::new(&scene, Size::px(1, 1), options)?;
        Ok(Self { device: device.clone(), tracer, reference })
    }

    /// [`reference_ao`](crate::reference::reference_ao) on the device: the same up to the rounding of directions and
    /// intersections. Waits for the device; `progress` is called from time to time with the number of rays traced since its
    /// last call.
    ///
    /// # Errors
    /// When `spp` is 0 or too large, `surface` is not of the scene or too large for the device, or the device is lost or has
    /// too little memory.
    pub fn reference_ao(
        &mut self,
        surface: &Surface,
        params: AoParams,
        sampling: Sampling,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<AoImage> {
        let surface = &*surface.without_margin();
        let size = surface.gbuffer.size();
        let (device, reference) = (&self.device, &mut self.reference);
        if reference.size() != size {
            reference.resize(size)?;
        }
        reference.set_sampling(sampling)?;
        reference.set_surface(self.tracer, surface, params)?;
        let counted = |dispatch: Dispatch| {
            let pixels = dispatch.first_pixel as usize..(dispatch.first_pixel + dispatch.pixels) as usize;
            let seen = pixels.filter(|&i| surface.gbuffer.is_foreground(i)).count() as u64;
            progress(seen * u64::from(dispatch.rays()));
        };
        let open = scoped(&device.device, "reference", || {
            submit(device, (reference, sampling.spp), &counted)?;
            download(device, reference.open())
        })?;
        let visibility = open.into_iter().map(|n| n as f32 / sampling.spp as f32).collect();
        Ok(AoImage::new(surface.gbuffer.size(), visibility)?)
    }
}

/// Traces all rays, a dispatch at a time; the next one waits on the device while it runs.
fn submit(
    Device { device, queue, .. }: &Device,
    (reference, spp): (&mut Reference, u32),
    counted: &dyn Fn(Dispatch),
) -> aonet::Result<()> {
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.clear_buffer(reference.open(), 0, None);
    queue.submit([encoder.finish()]);
    let mut running = None;
    reference.each_dispatch(spp, |reference, dispatch| {
        let mut encoder = device.create_command_encoder(&Default::default());
        reference.encode_rays(&mut encoder, dispatch);
        let submitted = queue.submit([encoder.finish()]);
        if let Some((submission_index, dispatch)) = running.replace((submitted, dispatch)) {
            let wait = wgpu::PollType::Wait { submission_index: Some(submission_index), timeout: None };
            device.poll(wait).map_err(lost)?;
            counted(dispatch);
        }
        Ok(())
    })?;
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
    if let Some((_, dispatch)) = running {
        counted(dispatch);
    }
    Ok(())
}

/// Open rays of each pixel.
fn download(Device { device, queue, .. }: &Device, open: &wgpu::Buffer) -> aonet::Result<Vec<u32>> {
    let back = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("open rays"),
        size: open.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(open, 0, &back, 0, None);
    queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
    let bytes = back.get_mapped_range(..).map_err(lost)?;
    Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

fn lost(found: impl ToString) -> Error {
    Error::device("reference", "a device that answers", found)
}

//! Invalid requests, and requirements of a device.

use super::device::{filled, target};
use super::textures::{FLOATS, Shown};
use super::{FLOAT, LEAST_PSNR, agreement, device, stage};
use aonet::Size;
use aonet::gpu::{Device, FrameNumbers, wgpu};
use aonet_scene::gbuffer::Surface;
use aonet_scene::gpu::{Offscreen, Reference, ReferenceOptions, SceneBuffers, SurfaceViews};
use aonet_scene::reference::{Sampling, reference_ao};
use std::task::{Context, Poll, Waker};

#[test]
fn wrong_sizes_formats_and_frames_are_errors() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage(Size::px(20, 12));
    let (params, camera) = (view.params().unwrap(), view.camera().unwrap());
    let scene = SceneBuffers::new((&device.device, &device.queue), &tracer).unwrap();
    let options = ReferenceOptions { output: FLOAT, ..ReferenceOptions::default() };
    let error = |found: Result<Reference, aonet_scene::Error>| found.unwrap_err().to_string();
    assert!(error(Reference::new(&scene, Size::px(32_768, 32_768), options)).contains("bytes"));
    let none = ReferenceOptions { sampling: Sampling { spp: 0, seed: 0 }, ..options };
    assert!(error(Reference::new(&scene, Size::px(5, 5), none)).contains("rays per pixel"));
    let no_target = ReferenceOptions { output: wgpu::TextureFormat::Rgb9e5Ufloat, ..options };
    assert!(error(Reference::new(&scene, Size::px(5, 5), no_target)).contains("device"));
    let mut reference = Reference::new(&scene, Size::px(20, 12), options).unwrap();
    assert!(reference.resize(Size::px(32_768, 32_768)).is_err() && reference.size() == Size::px(20, 12));
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let target = |size, format| target(&device, size, format);
    for (visibility, samples, what) in [
        (target(Size::px(12, 20), FLOAT), 1, "12x20"),
        (target(Size::px(20, 12), wgpu::TextureFormat::R8Unorm), 1, "R8Unorm"),
        (filled(&device, Size::px(20, 12), FLOAT, &[0; 960]), 1, "RENDER_ATTACHMENT"),
        (target(Size::px(20, 12), FLOAT), u32::MAX, "rays at once"),
    ] {
        let found = reference.encode(&mut encoder, samples, &visibility).unwrap_err().to_string();
        assert!(found.contains(what), "{found}");
    }
    let (normal, geo_normal) = (surface.gbuffer.normal(), &surface.geo_normal[..]);
    let shown = Shown { camera, depth: surface.gbuffer.depth(), normal, geo_normal };
    let [normal, geo_normal, depth] = &shown.textures(&device, FLOATS, |d| d);
    let textures = SurfaceViews { normal, geo_normal, depth };
    let small = filled(&device, Size::px(10, 12), FLOAT, &[0; 480]);
    let unread = target(Size::px(20, 12), FLOAT);
    for (textures, what) in [
        (SurfaceViews { normal: &small, ..textures }, "normal"),
        (SurfaceViews { depth: &small, ..textures }, "depth"),
        (SurfaceViews { depth: &unread, ..textures }, "device"),
    ] {
        assert!(reference.view(textures).unwrap_err().to_string().contains(what));
    }
    let of = reference.view(textures).unwrap();
    let frame = FrameNumbers { camera, far: f32::INFINITY, params };
    reference.start(&mut encoder, &of, &frame).unwrap();
    let other = camera.tile(0, 0, Size::px(12, camera.height())).unwrap();
    assert!(reference.start(&mut encoder, &of, &FrameNumbers { camera: other, ..frame }).is_err());
    assert!(reference.start(&mut encoder, &of, &FrameNumbers { far: -1.0, ..frame }).is_err());
    let triangles = tracer.scene().triangle.len() as u32;
    for (triangle, what) in [(vec![triangles; 240], "one of"), (vec![0; 239], "239")] {
        let elsewhere = Surface { triangle, ..surface.clone() };
        let found = reference.set_surface(&tracer, &elsewhere, params).unwrap_err().to_string();
        assert!(found.contains(what), "{found}");
    }
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage(Size::px(20, 12));
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 4, seed: 1 });
    let mut offscreen = Offscreen::new(&device, &tracer).unwrap();
    offscreen.reference_ao(&surface, params, sampling, &|_| ()).unwrap();
    device.device.destroy();
    let found = offscreen.reference_ao(&surface, params, sampling, &|_| ()).unwrap_err().to_string();
    assert!(found.contains("device") || found.contains("Device"), "{found}");
    assert!(Offscreen::new(&device, &tracer).is_err());
}

/// The result of a future that never waits.
fn ready<T>(future: impl Future<Output = T>) -> T {
    let mut future = std::pin::pin!(future);
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return value;
        }
    }
}

/// A device with only these limits.
fn limited(limits: wgpu::Limits) -> (wgpu::Device, wgpu::Queue) {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = ready(instance.request_adapter(&Default::default())).unwrap();
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    ready(adapter.request_device(&descriptor)).unwrap()
}

#[test]
fn the_limits_of_webgpu_are_enough_and_smaller_ones_are_named() {
    let Some(Device { adapter, .. }) = device() else { return };
    let (tracer, view, surface) = stage(Size::px(33, 18));
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 16, seed: 1 });
    let (device, queue) = limited(wgpu::Limits::defaults());
    let plain = Device { adapter, device, queue, matrices: None };
    let mut gpu = Offscreen::new(&plain, &tracer).unwrap();
    let gpu = gpu.reference_ao(&surface, params, sampling, &|_| ()).unwrap();
    let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
    assert!(agreement(&cpu, &gpu) >= LEAST_PSNR);
    let limits = wgpu::Limits { max_storage_buffer_binding_size: 1 << 16, ..wgpu::Limits::defaults() };
    let (device, queue) = limited(limits);
    let found = SceneBuffers::new((&device, &queue), &tracer).unwrap_err().to_string();
    assert!(found.contains("65536 bytes") && found.contains("of a scene"), "{found}");
}

//! The reference on a device. Without a device a test says that it was skipped; with `AONET_REQUIRE_GPU=1` it fails.

mod agreement;
#[path = "../../../aonet/tests/common/device.rs"]
mod device;
mod progressive;
mod refusals;
#[path = "../scenes/mod.rs"]
mod scenes;
mod textures;

use aonet::gpu::{Device, wgpu};
use aonet::metrics::psnr;
use aonet::{AoImage, Size};
use aonet_scene::gbuffer::{Surface, render};
use aonet_scene::gpu::{Offscreen, Reference, ReferenceOptions, SceneBuffers};
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::scene::procedural::Kind;
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use device::{device, read, target};

/// Least agreement with the CPU (dB).
const LEAST_PSNR: f64 = 45.0;

const FLOAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// The reference on a device and on the CPU.
fn both(device: &Device, (scene, view): (Scene, &View), sampling: Sampling) -> (Surface, AoImage, AoImage) {
    let tracer = Tracer::new(scene.checked().unwrap());
    let surface = render(&tracer, view).unwrap();
    let params = view.params().unwrap();
    let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
    let mut offscreen = Offscreen::new(device, &tracer).unwrap();
    let gpu = offscreen.reference_ao(&surface, params, sampling, &|_| ()).unwrap();
    (surface, cpu, gpu)
}

/// Over all pixels (dB); infinite where all are equal.
fn agreement(a: &AoImage, b: &AoImage) -> f64 {
    let squares = a.visibility().iter().zip(b.visibility()).map(|(a, b)| f64::from(a - b).powi(2));
    psnr(squares.sum::<f64>() / a.visibility().len() as f64)
}

/// A view of a procedural scene that shows something of it.
fn procedural(kind: Kind, size: Size) -> (Scene, View) {
    use aonet_scene::staging::{SceneSpec, SceneSplit, propose_view};
    let spec = SceneSpec::procedural(kind, 3, SceneSplit::Train);
    let (tracer, view) = propose_view(&spec, size, 1).unwrap();
    (tracer.scene().clone(), view)
}

/// A small, varied scene with its surface.
fn stage(size: Size) -> (Tracer, View, Surface) {
    let (scene, view) = procedural(Kind::ToyBlocks, size);
    let tracer = Tracer::new(scene);
    let surface = render(&tracer, &view).unwrap();
    (tracer, view, surface)
}

fn reference(device: &Device, tracer: &Tracer, size: Size, options: ReferenceOptions) -> Reference {
    let scene = SceneBuffers::new((&device.device, &device.queue), tracer).unwrap();
    Reference::new(&scene, size, options).unwrap()
}

/// The mean after `steps` of rays, each encoded on its own and all submitted together.
fn accumulated(device: &Device, reference: &mut Reference, steps: &[u32]) -> AoImage {
    let visibility = target(device, reference.size(), reference.options().output);
    let mut encoder = device.device.create_command_encoder(&Default::default());
    steps.iter().for_each(|&n| reference.encode(&mut encoder, n, &visibility).unwrap());
    read(device, encoder, &visibility)
}

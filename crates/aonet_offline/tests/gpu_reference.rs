//! The reference on a device: closed forms, agreement with the CPU, a few rays at a time.

#[path = "../../aonet/tests/common/device.rs"]
mod device;
mod scenes;

use aonet::metrics::psnr;
use aonet::net::gpu::{DepthEncoding, Device, Frame, wgpu};
use aonet::{AoImage, AoParams, Camera};
use aonet_offline::gbuffer::{Surface, render};
use aonet_offline::gpu::{Offscreen, Options, Reference, SceneBuffers, Textures};
use aonet_offline::reference::{Sampling, reference_ao};
use aonet_offline::scene::procedural::Kind;
use aonet_offline::trace::Tracer;
use aonet_offline::{Scene, View};
use device::{device, filled, read, target, texture};
use glam::Vec3;
use scenes::{cuboid, floor, quad, sphere, view};

/// Least agreement with the CPU [dB].
const LEAST_PSNR: f64 = 45.0;

const SAMPLING: Sampling = Sampling { spp: 1024, seed: 7 };

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

/// Over all pixels [dB]; infinite where all are equal.
fn agreement(a: &AoImage, b: &AoImage) -> f64 {
    let squares = a.visibility().iter().zip(b.visibility()).map(|(a, b)| f64::from(a - b).powi(2));
    psnr(squares.sum::<f64>() / a.visibility().len() as f64)
}

/// Five standard deviations of a mean of `SAMPLING.spp` independent rays of which a share of `p` is open.
fn five_sigma(p: f32) -> f32 {
    5.0 * (p * (1.0 - p) / SAMPLING.spp as f32).sqrt()
}

#[test]
fn closed_forms_hold() {
    let Some(device) = device() else { return };
    let mut wall = floor(1.0);
    wall.append(&quad(Vec3::new(-1e4, 0.0, -0.5), Vec3::X * 2e4, Vec3::Y));
    let mut ball = floor(10.0);
    ball.append(&sphere(Vec3::Y, 0.5, 64));
    let box_ = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0));
    let inside = Vec3::new(0.3, 1.0, 0.2);
    let at_wall = view(Vec3::new(0.0, 0.5, 0.3), Vec3::ZERO, 1e6);
    for (scene, view, expected) in [
        (floor(100.0), view(Vec3::new(0.3, 2.0, 0.4), Vec3::ZERO, 50.0), 1.0),
        (floor(100.0), view(Vec3::new(0.3, -2.0, 0.4), Vec3::ZERO, 50.0), 1.0),
        (box_.clone(), view(inside, Vec3::ZERO, 10.0), 0.0),
        (box_.clone(), view(inside, Vec3::new(1.0, 1.0, 0.0), 10.0), 0.0),
        (box_, view(inside, Vec3::ZERO, 0.99), 1.0),
        (wall, at_wall, 0.5 * (1.0 + 0.5 / 1.25f32.sqrt())),
        (ball, view(Vec3::new(0.9, 0.05, 0.0), Vec3::ZERO, 100.0), 0.75),
    ] {
        let (surface, cpu, gpu) = both(&device, (scene, &view), SAMPLING);
        for (i, v) in gpu.visibility().iter().enumerate() {
            assert!(surface.gbuffer.is_foreground(i), "pixel {i} sees nothing");
            assert!((v - expected).abs() <= five_sigma(expected), "{v} instead of {expected} at {i}");
        }
        assert!(agreement(&cpu, &gpu) > LEAST_PSNR);
    }
}

/// A view of a procedural scene that shows something of it.
fn procedural(kind: Kind, (width, height): (usize, usize)) -> (Scene, View) {
    use aonet_offline::dataset::{SceneSpec, SceneSplit, propose_view};
    let spec = SceneSpec::procedural(kind, 3, SceneSplit::Train);
    let (tracer, view) = propose_view(&spec, (width, height), 1).unwrap();
    (tracer.scene().clone(), view)
}

#[test]
fn every_procedural_scene_agrees_with_the_cpu() {
    let Some(device) = device() else { return };
    for (i, &kind) in Kind::ALL.iter().enumerate() {
        // No size is a multiple of anything.
        let (scene, view) = procedural(kind, (37 + 2 * i, 23 + 2 * i));
        let (surface, cpu, gpu) = both(&device, (scene, &view), Sampling { spp: 60, seed: 1 << 40 });
        let n = surface.triangle.len();
        let foreground = (0..n).filter(|&i| surface.gbuffer.is_foreground(i)).count();
        let different = cpu.visibility().iter().zip(gpu.visibility()).filter(|(a, b)| a != b).count();
        let psnr = agreement(&cpu, &gpu);
        println!("{kind:14} {psnr:6.1} dB, {different} of {foreground} pixels differ");
        assert!(psnr >= LEAST_PSNR && foreground > 100, "{kind}: {psnr} dB");
        assert!(cpu.visibility().iter().any(|v| *v < 0.9), "{kind}: nothing is occluded");
    }
}

const FLOAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// A small scene with its surface: something of everything.
fn stage(size: (usize, usize)) -> (Tracer, View, Surface) {
    let (scene, view) = procedural(Kind::ToyBlocks, size);
    let tracer = Tracer::new(scene);
    let surface = render(&tracer, &view).unwrap();
    (tracer, view, surface)
}

fn reference(device: &Device, tracer: &Tracer, size: (usize, usize), options: Options) -> Reference {
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

#[test]
fn rays_a_few_at_a_time_make_the_same_image_as_all_at_once() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage((41, 27));
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 60, seed: 5 });
    let options = Options { sampling, output: FLOAT, ..Options::default() };
    let mut reference = reference(&device, &tracer, (41, 27), options);
    assert!(accumulated(&device, &mut reference, &[0]).visibility().iter().all(|v| *v == 1.0), "no rays");
    reference.set_surface(&tracer, &surface, params).unwrap();
    let once = accumulated(&device, &mut reference, &[60]);
    let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
    assert!(agreement(&once, &cpu) >= LEAST_PSNR);
    reference.reset();
    let steps = [1, 1, 2, 3, 8, 0, 16, 29];
    let (first, rest) = steps.split_at(5);
    let early = accumulated(&device, &mut reference, first);
    assert_eq!(reference.samples(), 15);
    assert_ne!(early, once);
    assert_eq!(accumulated(&device, &mut reference, rest), once);
    // The next round has other rays; then so has the mean, which is nearer to the truth.
    let twice = accumulated(&device, &mut reference, &[60]);
    assert_eq!(reference.samples(), 120);
    let truth = Sampling { spp: 4096, seed: 9 };
    let truth = reference_ao(&tracer, &surface, params, truth, &|_| ()).unwrap();
    let [early, once, twice] = [early, once, twice].map(|image| agreement(&image, &truth));
    println!("15 rays {early:.1} dB, 60 {once:.1} dB, 120 {twice:.1} dB");
    assert!(early + 3.0 < once && once + 1.0 < twice, "{early} {once} {twice} dB");
}

#[test]
fn what_was_set_last_counts() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage((33, 18));
    let params = view.params().unwrap();
    let options = Options { output: FLOAT, ..Options::default() };
    let mut reference = reference(&device, &tracer, (20, 10), options);
    assert!(reference.set_surface(&tracer, &surface, params).is_err(), "another size");
    reference.resize((33, 18)).unwrap();
    reference.set_surface(&tracer, &surface, params).unwrap();
    for (radius, sampling) in [
        (params.radius, Sampling { spp: 16, seed: 1 }),
        (0.3 * params.radius, Sampling { spp: 16, seed: 1 << 63 }),
        (params.radius, Sampling { spp: 1, seed: 3 }),
        (params.radius, Sampling { spp: 129, seed: 3 }),
    ] {
        let params = AoParams::new(radius).unwrap();
        reference.set_surface(&tracer, &surface, params).unwrap();
        reference.set_sampling(sampling).unwrap();
        let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
        let gpu = accumulated(&device, &mut reference, &[sampling.spp]);
        let psnr = agreement(&cpu, &gpu);
        assert!(psnr >= LEAST_PSNR, "{sampling:?}: {psnr} dB");
    }
}

/// What a renderer knows of a frame.
struct Shown<'a> {
    camera: Camera,
    depth: &'a [f32],
    normal: &'a [[f32; 3]],
    geo_normal: &'a [[f32; 3]],
}

impl Shown<'_> {
    /// Normals, geometric normals and depth.
    fn textures(&self, device: &Device, stored: impl Fn(f32) -> f32) -> [wgpu::TextureView; 3] {
        let size = (self.camera.width, self.camera.height);
        let normals = |normals: &[[f32; 3]]| {
            let texels = normals.iter().flat_map(|n| [n[0], n[1], n[2], 0.0]).flat_map(f32::to_le_bytes);
            filled(device, size, wgpu::TextureFormat::Rgba32Float, &texels.collect::<Vec<_>>())
        };
        let depths = self.depth.iter().flat_map(|d| stored(*d).to_le_bytes());
        let depth = filled(device, size, FLOAT, &depths.collect::<Vec<_>>());
        [normals(self.normal), normals(self.geo_normal), depth]
    }
}

/// The reference that starts from textures.
fn from_textures(
    device: &Device,
    tracer: &Tracer,
    (textures, frame): (&[wgpu::TextureView; 3], &Frame),
    options: Options,
) -> AoImage {
    let size = (frame.camera.width, frame.camera.height);
    let mut reference = reference(device, tracer, size, options);
    let [normal, geo_normal, depth] = textures;
    let view = reference.view(Textures { normal, geo_normal, depth }).unwrap();
    let visibility = target(device, size, options.output);
    let mut encoder = device.device.create_command_encoder(&Default::default());
    reference.start(&mut encoder, &view, frame).unwrap();
    reference.encode(&mut encoder, options.sampling.spp, &visibility).unwrap();
    read(device, encoder, &visibility)
}

#[test]
fn rays_start_at_what_textures_show() {
    let Some(device) = device() else { return };
    let size = (45, 31);
    let (tracer, view, _) = stage(size);
    let height = 0.5 * (Vec3::from(view.eye) - Vec3::from(view.target)).length();
    for ortho_height in [None, Some(height)] {
        let view = View { ortho_height, ..view.clone() };
        let mut surface = render(&tracer, &view).unwrap();
        let (params, camera) = (view.params().unwrap(), view.camera().unwrap());
        let sampling = Sampling { spp: 60, seed: 5 };
        let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
        // As a renderer leaves them that does not know from which side a triangle is seen.
        let backs: Vec<usize> = (0..size.0 * size.1).filter(|i| i % 3 == 0).collect();
        let (depth, mut normal) = (surface.gbuffer.depth().to_vec(), surface.gbuffer.normal().to_vec());
        for i in backs {
            normal[i] = normal[i].map(|x| -2.0 * x);
            surface.geo_normal[i] = surface.geo_normal[i].map(|x| -0.5 * x);
        }
        let (near, far) = (f64::from(view.near), 1e5 * f64::from(view.near));
        let curve = |d: f64| if ortho_height.is_none() { 1.0 / d } else { d };
        let reversed = |d: f32| match d == f32::INFINITY {
            true => 0.0,
            false => ((curve(d.into()) - curve(far)) / (curve(near) - curve(far))) as f32,
        };
        let frame = Frame { camera, far: far as f32, params };
        for (encoding, linear) in [(DepthEncoding::Linear, true), (DepthEncoding::Reversed, false)] {
            let shown = Shown { camera, depth: &depth, normal: &normal, geo_normal: &surface.geo_normal };
            let textures = shown.textures(&device, |d| if linear { d } else { reversed(d) });
            let options = Options { sampling, depth: encoding, output: FLOAT };
            let gpu = from_textures(&device, &tracer, (&textures, &frame), options);
            let psnr = agreement(&cpu, &gpu);
            println!("{encoding:?}, orthographic {ortho_height:?}: {psnr:.1} dB");
            assert!(psnr >= LEAST_PSNR && gpu.visibility().iter().any(|v| *v < 0.5));
        }
    }
}

/// A depth buffer as a renderer leaves it: a floor seen from above, all of it at one distance.
#[test]
fn rays_start_at_a_depth_buffer() {
    let Some(device) = device() else { return };
    let size = (20, 12);
    let mut scene = floor(100.0);
    scene.append(&quad(Vec3::new(-100.0, 0.5, -100.0), Vec3::X * 200.0, Vec3::Z * 100.0));
    let tracer = Tracer::new(scene);
    let straight = View {
        up: [0.0, 0.0, -1.0],
        near: 0.25,
        ..view(Vec3::new(0.0, 0.4, 0.2), Vec3::new(0.0, 0.0, 0.2), 1.0)
    };
    let straight = View { width: size.0, height: size.1, fov_y_deg: 40.0, ..straight };
    let surface = render(&tracer, &straight).unwrap();
    let (params, sampling) = (straight.params().unwrap(), Sampling { spp: 60, seed: 5 });
    let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
    let depth =
        texture(&device, size, wgpu::TextureFormat::Depth32Float, usage).create_view(&Default::default());
    let mut encoder = device.device.create_command_encoder(&Default::default());
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            // near / distance.
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.25 / 0.4),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    }));
    device.queue.submit([encoder.finish()]);
    let camera = straight.camera().unwrap();
    let normal = surface.gbuffer.normal();
    let shown = Shown { camera, depth: surface.gbuffer.depth(), normal, geo_normal: &surface.geo_normal };
    let [normal, geo_normal, _] = shown.textures(&device, |d| d);
    let frame = Frame { camera, far: f32::INFINITY, params };
    let options = Options { sampling, output: FLOAT, ..Options::default() };
    let gpu = from_textures(&device, &tracer, (&[normal, geo_normal, depth], &frame), options);
    assert!(agreement(&cpu, &gpu) >= LEAST_PSNR && cpu.visibility().iter().any(|v| *v < 0.8));
}

#[test]
fn the_texture_may_have_any_format_of_one_channel() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage((33, 18));
    let sampling = Sampling { spp: 16, seed: 1 };
    let images = [(FLOAT, 0.0), (wgpu::TextureFormat::R16Float, 1e-3), (wgpu::TextureFormat::R8Unorm, 3e-3)];
    let images = images.map(|(output, tolerance)| {
        let options = Options { sampling, output, ..Options::default() };
        let mut reference = reference(&device, &tracer, (33, 18), options);
        reference.set_surface(&tracer, &surface, view.params().unwrap()).unwrap();
        (accumulated(&device, &mut reference, &[16]), tolerance)
    });
    for (image, tolerance) in &images {
        let close = |(a, b): (&f32, &f32)| (a - b).abs() <= *tolerance;
        assert!(images[0].0.visibility().iter().zip(image.visibility()).all(close), "{tolerance}");
    }
}

#[test]
fn wrong_sizes_formats_and_frames_are_errors() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage((20, 12));
    let (params, camera) = (view.params().unwrap(), view.camera().unwrap());
    let scene = SceneBuffers::new((&device.device, &device.queue), &tracer).unwrap();
    let options = Options { output: FLOAT, ..Options::default() };
    let error = |found: Result<Reference, aonet_offline::Error>| found.unwrap_err().to_string();
    assert!(error(Reference::new(&scene, (0, 5), options)).contains("0x5"));
    assert!(error(Reference::new(&scene, (32_768, 32_768), options)).contains("bytes"));
    let none = Options { sampling: Sampling { spp: 0, seed: 0 }, ..options };
    assert!(error(Reference::new(&scene, (5, 5), none)).contains("rays per pixel"));
    let no_target = Options { output: wgpu::TextureFormat::Rgb9e5Ufloat, ..options };
    assert!(error(Reference::new(&scene, (5, 5), no_target)).contains("device"));
    let mut reference = Reference::new(&scene, (20, 12), options).unwrap();
    assert!(reference.resize((12, 0)).is_err() && reference.size() == (20, 12));
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let target = |size, format| target(&device, size, format);
    for (visibility, samples, what) in [
        (target((12, 20), FLOAT), 1, "12x20"),
        (target((20, 12), wgpu::TextureFormat::R8Unorm), 1, "R8Unorm"),
        (filled(&device, (20, 12), FLOAT, &[0; 960]), 1, "RENDER_ATTACHMENT"),
        (target((20, 12), FLOAT), u32::MAX, "rays at once"),
    ] {
        let found = reference.encode(&mut encoder, samples, &visibility).unwrap_err().to_string();
        assert!(found.contains(what), "{found}");
    }
    let (normal, geo_normal) = (surface.gbuffer.normal(), &surface.geo_normal[..]);
    let shown = Shown { camera, depth: surface.gbuffer.depth(), normal, geo_normal };
    let [normal, geo_normal, depth] = &shown.textures(&device, |d| d);
    let textures = Textures { normal, geo_normal, depth };
    let small = filled(&device, (10, 12), FLOAT, &[0; 480]);
    let unread = target((20, 12), FLOAT);
    for (textures, what) in [
        (Textures { normal: &small, ..textures }, "normal"),
        (Textures { depth: &small, ..textures }, "depth"),
        (Textures { depth: &unread, ..textures }, "device"),
    ] {
        assert!(reference.view(textures).unwrap_err().to_string().contains(what));
    }
    let of = reference.view(textures).unwrap();
    let frame = Frame { camera, far: f32::INFINITY, params };
    reference.start(&mut encoder, &of, &frame).unwrap();
    let other = Camera { width: 12, ..camera };
    assert!(reference.start(&mut encoder, &of, &Frame { camera: other, ..frame }).is_err());
    assert!(reference.start(&mut encoder, &of, &Frame { far: -1.0, ..frame }).is_err());
    assert!(
        reference
            .start(&mut encoder, &of, &Frame { params: AoParams { radius: f32::NAN }, ..frame })
            .is_err()
    );
    let elsewhere = Surface { triangle: vec![u32::MAX - 1; 240], ..surface };
    assert!(reference.set_surface(&tracer, &elsewhere, params).is_err(), "triangles that are not there");
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage((20, 12));
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 4, seed: 1 });
    let mut offscreen = Offscreen::new(&device, &tracer).unwrap();
    offscreen.reference_ao(&surface, params, sampling, &|_| ()).unwrap();
    device.device.destroy();
    let found = offscreen.reference_ao(&surface, params, sampling, &|_| ()).unwrap_err().to_string();
    assert!(found.contains("device") || found.contains("Device"), "{found}");
    assert!(Offscreen::new(&device, &tracer).is_err());
}

#[test]
fn rays_are_counted_and_many_of_them_take_several_dispatches() {
    let Some(device) = device() else { return };
    let scene = floor(1.0);
    let tracer = Tracer::new(scene);
    let wide =
        View { fov_y_deg: 60.0, width: 90, height: 70, ..view(Vec3::new(0.0, 3.0, 0.1), Vec3::ZERO, 1.0) };
    let surface = render(&tracer, &wide).unwrap();
    let rays = std::sync::atomic::AtomicU64::new(0);
    let count = |n| {
        rays.fetch_add(n, std::sync::atomic::Ordering::Relaxed);
    };
    // 1.6 million rays, with those of the background that are not traced.
    let sampling = Sampling { spp: 256, seed: 1 };
    let mut offscreen = Offscreen::new(&device, &tracer).unwrap();
    let ao = offscreen.reference_ao(&surface, wide.params().unwrap(), sampling, &count).unwrap();
    let foreground = (0..90 * 70).filter(|&i| surface.gbuffer.is_foreground(i)).count();
    assert!(foreground < 90 * 70 && ao.visibility().iter().all(|v| *v == 1.0));
    assert_eq!(rays.into_inner(), 256 * foreground as u64);
}

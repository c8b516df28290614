//! Frames: methods, sizes, times, and invalid requests.

mod common;

use aonet::gpu::{Device, wgpu};
use aonet::net::{Model, cpu, shipped};
use aonet::{AoImage, AoParams, GBuffer, Size};
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::scene::procedural::Kind;
use aonet_scene::view::Surround;
use aonet_view::renderer::{Present, readback};
use aonet_view::{FrameParams, Method, Show};
use common::{demo, device, draw, frame, proposed, renderer, window};

/// Largest difference from the CPU's image for the paper's network, in half floats and an image of half floats.
/// Measured: 1.8e-3, with 16-bit floats throughout.
const PAPER_TOLERANCE: f32 = 4e-3;

/// Mean difference where a horizon search takes part, as in aonet's own tests: a tap between two pixels may fall on either. Measured: 1.5e-4.
const NETWORK_MEAN_TOLERANCE: f32 = 8e-4;

/// Mean difference of connected arcs. Measured: 2.5e-4, nearly all of it the rounding of an image of half floats.
const ARCS_MEAN_TOLERANCE: f32 = 4e-4;

fn differences(a: &AoImage, b: &AoImage) -> (f32, f32) {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let of: Vec<f32> = a.visibility().iter().zip(b.visibility()).map(|(a, b)| (a - b).abs()).collect();
    (of.iter().sum::<f32>() / of.len() as f32, of.iter().copied().fold(0.0, f32::max))
}

#[test]
fn networks_give_the_cpus_image_of_the_same_buffer() {
    let Some(device) = device() else { return };
    let (tracer, view) = proposed(Kind::FurnishedRoom, Size::px(130, 70));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(130, 70));
    let networks = [
        (Method::Fast, shipped::FAST),
        (Method::Balanced, shipped::BALANCED),
        (Method::High, shipped::HIGH),
        (Method::Paper, shipped::PAPER),
    ];
    for (method, bytes) in networks {
        let frame = FrameParams { methods: [method; 2], ..frame(&view) };
        draw(&device, &mut renderer, &frame);
        let gbuffer = readback::drawn(&renderer, &frame.camera).unwrap().gbuffer;
        let model = Model::from_bytes(bytes).unwrap();
        let mut expected = AoImage::open(Size::px(130, 70));
        cpu::Session::new(&model, Size::px(130, 70), 2)
            .unwrap()
            .run(&gbuffer, frame.params, &mut expected)
            .unwrap();
        let found = readback::visibility(&renderer, method).unwrap();
        let (mean, largest) = differences(&found, &expected);
        eprintln!("{method}: mean {mean:e}, largest {largest:e}");
        let least = expected.visibility().iter().copied().fold(1.0, f32::min);
        assert!(least < 0.7, "nothing to see: {least}");
        match method {
            Method::Paper => assert!(largest <= PAPER_TOLERANCE, "{method}: {largest:e}"),
            _ => assert!(mean <= NETWORK_MEAN_TOLERANCE, "{method}: {mean:e}"),
        }
    }
}

/// The columns of a picture of gray values in [0, 255].
fn columns(rgba: &[u8], width: usize, range: std::ops::Range<usize>) -> Vec<u8> {
    let rows = rgba.chunks_exact(4 * width);
    rows.flat_map(|row| row[4 * range.start..4 * range.end].iter().step_by(4)).copied().collect()
}

#[test]
fn the_slider_stands_between_the_methods() {
    let Some(device) = device() else { return };
    let size = Size::px(96, 54);
    let (tracer, view) = demo(size);
    let mut renderer = renderer(&device, tracer.scene(), size);
    let mut picture = |methods, split| {
        draw(&device, &mut renderer, &FrameParams { methods, split, show: Show::Visibility, ..frame(&view) });
        readback::picture(&renderer).unwrap()
    };
    let network = picture([Method::Balanced, Method::Off], 1.0);
    let both = picture([Method::Balanced, Method::Off], 0.5);
    let swapped = picture([Method::Off, Method::Balanced], 0.0);
    assert_eq!(network, swapped);
    assert_eq!(columns(&both, 96, 0..48), columns(&network, 96, 0..48));
    assert!(columns(&both, 96, 49..96).iter().all(|v| *v == 255));
    assert!(columns(&network, 96, 49..96).iter().any(|v| *v < 200));
}

#[test]
fn tiny_and_changing_sizes() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(Size::px(5, 3));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(5, 3));
    renderer.set_tracer(&tracer).unwrap();
    for (width, height) in [(5, 3), (1, 1), (2, 1), (1, 7), (33, 17), (96, 54)] {
        renderer.resize(Size::px(width, height)).unwrap();
        let view = aonet_scene::View { width, height, ..view.clone() };
        // The last pair is in use when the size changes.
        let alone = Method::ALL.map(|method| [method, Method::Off]);
        for methods in alone.into_iter().chain([[Method::Balanced, Method::Gtao]]) {
            draw(&device, &mut renderer, &FrameParams { methods, split: 0.5, ..frame(&view) });
        }
        assert_eq!(readback::picture(&renderer).unwrap().len(), 4 * width * height);
    }
    let again = readback::picture(&renderer).unwrap();
    let mut fresh = common::renderer(&device, tracer.scene(), Size::px(96, 54));
    let view = aonet_scene::View { width: 96, height: 54, ..view };
    draw(&device, &mut fresh, &FrameParams { methods: [Method::Balanced; 2], ..frame(&view) });
    draw(&device, &mut renderer, &FrameParams { methods: [Method::Balanced; 2], ..frame(&view) });
    assert_eq!(readback::picture(&renderer).unwrap(), readback::picture(&fresh).unwrap());
    assert_ne!(again, readback::picture(&fresh).unwrap());
}

#[test]
fn sizes_and_frames_that_cannot_be_are_refused_and_harm_nothing() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(Size::px(16, 9));
    let pair = (&device.device, &device.queue);
    // None where the device has textures of every size.
    let too_large = Size::new(device.device.limits().max_texture_dimension_2d as usize + 1, 9).ok();
    if let Some(size) = too_large {
        let message = aonet_view::Renderer::new(pair, tracer.scene(), size).unwrap_err().to_string();
        assert!(message.contains("width and height"), "{message}");
    }
    let mut renderer = renderer(&device, tracer.scene(), Size::px(16, 9));
    if let Some(size) = too_large {
        assert!(renderer.resize(size).unwrap_err().to_string().contains(&size.to_string()));
    }
    let good = frame(&view);
    let camera = good.camera.tile(0, 0, Size::px(17, 9)).unwrap();
    for (bad, named) in [
        (FrameParams { camera, ..good }, "17x9"),
        (FrameParams { split: f32::NAN, ..good }, "slider"),
        (FrameParams { split: 1.5, ..good }, "slider"),
        (FrameParams { far: 0.01, ..good }, "far"),
        (FrameParams { far: f32::NAN, ..good }, "far"),
        (FrameParams { separation: Some(-0.1), ..good }, "separation"),
        (FrameParams { separation: Some(f32::NAN), ..good }, "separation"),
        (FrameParams { separation: Some(11.0), ..good }, "separation"),
    ] {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let message = renderer.encode(&mut encoder, &bad).unwrap_err().to_string();
        assert!(message.contains(named), "{message}");
    }
    let mut broken = tracer.scene().clone();
    broken.triangle[7][1] = u32::MAX;
    assert!(renderer.set_scene(&broken).unwrap_err().to_string().contains("triangle 7"));
    let untraced = FrameParams { methods: [Method::Reference; 2], ..good };
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let message = renderer.encode(&mut encoder, &untraced).unwrap_err().to_string();
    assert!(message.contains("set_tracer"), "{message}");
    draw(&device, &mut renderer, &good);
    readback::picture(&renderer).unwrap();
    assert!(readback::visibility(&renderer, Method::Paper).is_err());
}

/// Mean difference from rays that start where the CPU sees the scene: at other places on edges, and half floats.
/// Measured: 6.7e-5.
const REFERENCE_MEAN_TOLERANCE: f32 = 2e-4;

#[test]
fn the_reference_converges_while_nothing_moves_and_starts_over_when_something_does() {
    let Some(device) = device() else { return };
    let (tracer, view) = proposed(Kind::FurnishedRoom, Size::px(64, 40));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(64, 40));
    renderer.set_tracer(&tracer).unwrap();
    let frame = FrameParams { methods: [Method::Reference; 2], samples: 64, ..frame(&view) };
    (0..4).for_each(|_| draw(&device, &mut renderer, &frame));
    assert_eq!(renderer.samples(), 256);
    let surface = aonet_scene::gbuffer::render(&tracer, &view).unwrap();
    let sampling = Sampling { spp: 256, seed: 0 };
    let expected = reference_ao(&tracer, &surface, frame.params, sampling, &|_| ()).unwrap();
    let found = readback::visibility(&renderer, Method::Reference).unwrap();
    let (mean, largest) = differences(&found, &expected);
    eprintln!("reference: mean {mean:e}, largest {largest:e}");
    assert!(mean <= REFERENCE_MEAN_TOLERANCE, "{mean:e}");
    let wider = AoParams::new(2.0 * view.radius).unwrap();
    draw(&device, &mut renderer, &FrameParams { params: wider, ..frame });
    assert_eq!(renderer.samples(), 64);
    let darker = readback::visibility(&renderer, Method::Reference).unwrap();
    let sum = |image: &AoImage| image.visibility().iter().sum::<f32>();
    assert!(sum(&darker) < 0.99 * sum(&found), "{} {}", sum(&darker), sum(&found));
    renderer.resize(Size::px(32, 20)).unwrap();
    let view = aonet_scene::View { width: 32, height: 20, ..view };
    draw(&device, &mut renderer, &FrameParams { methods: frame.methods, samples: 1, ..common::frame(&view) });
    assert_eq!(renderer.samples(), 1);
}

/// Methods see the guard band, and give the picture.
#[test]
fn methods_run_on_the_guard_band_as_on_a_cpu() {
    let Some(device) = device() else { return };
    let (tracer, view) = proposed(Kind::FurnishedRoom, Size::px(130, 70));
    let view = view.surrounded(Surround { margin: 0.2, separation: Some(0.1) });
    let mut renderer = renderer(&device, tracer.scene(), window(&view));
    let frame = FrameParams { methods: [Method::Balanced, Method::Gtao], split: 0.5, ..frame(&view) };
    draw(&device, &mut renderer, &frame);
    let gbuffer = readback::drawn(&renderer, &frame.camera).unwrap().gbuffer;
    assert_eq!((gbuffer.window(), renderer.size()), (window(&view), Size::px(130, 70)));
    let model = Model::from_bytes(shipped::BALANCED).unwrap();
    let cpu = |gbuffer: &GBuffer| {
        let mut image = AoImage::open(Size::px(130, 70));
        let mut session = cpu::Session::new(&model, gbuffer.window(), 2).unwrap();
        session.run(gbuffer, frame.params, &mut image).unwrap();
        image
    };
    let found = readback::visibility(&renderer, Method::Balanced).unwrap();
    let (mean, _) = differences(&found, &cpu(&gbuffer));
    let (without, _) = differences(&found, &cpu(&gbuffer.without_margin()));
    eprintln!("network with a guard band: mean {mean:e}, beside one without {without:e}");
    assert!(mean <= NETWORK_MEAN_TOLERANCE && without > 2.0 * NETWORK_MEAN_TOLERANCE, "{mean:e} {without:e}");
}

/// The picture of the reference, of the normals and of the colours is the same with and without a guard band, up to the
/// pixels on edges where the rasteriser of another size rounds otherwise.
#[test]
fn the_guard_band_is_not_in_the_picture() {
    let Some(device) = device() else { return };
    let size = Size::px(96, 54);
    let (tracer, plain) = demo(size);
    let wide = plain.clone().surrounded(Surround { margin: 0.25, separation: None });
    for (method, show) in
        [(Method::Reference, Show::Visibility), (Method::Off, Show::Normals), (Method::Off, Show::Shaded)]
    {
        let [a, b] = [&plain, &wide].map(|view| {
            let mut renderer = renderer(&device, tracer.scene(), window(view));
            renderer.set_tracer(&tracer).unwrap();
            let frame = FrameParams { methods: [method; 2], show, samples: 16, ..frame(view) };
            draw(&device, &mut renderer, &frame);
            assert_eq!(readback::albedo(&renderer).unwrap().dimensions(), (96, 54));
            readback::image(&renderer).unwrap()
        });
        let far =
            |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 3);
        let strays = a.pixels().zip(b.pixels()).filter(far).count();
        eprintln!("{show}: {strays} pixels differ");
        assert!(strays <= size.pixels() / 100, "{show}: {strays}");
    }
}

#[test]
fn the_second_layer_is_drawn_when_asked_for() {
    let Some(device) = device() else { return };
    let size = Size::px(64, 36);
    let (tracer, view) = demo(size);
    let mut renderer = renderer(&device, tracer.scene(), size);
    let plain = FrameParams { methods: [Method::Gtao; 2], ..frame(&view) };
    let mut second = |frame: FrameParams| {
        draw(&device, &mut renderer, &frame);
        let gbuffer = readback::drawn(&renderer, &frame.camera).unwrap().gbuffer;
        (gbuffer.second().map(|second| second.depth.to_vec()), readback::picture(&renderer).unwrap())
    };
    let (none, before) = second(plain);
    let (some, with) = second(FrameParams { separation: Some(0.1), ..plain });
    let (shown, picture) = second(FrameParams { show: Show::Second, ..plain });
    let (none_again, after) = second(plain);
    assert_eq!((none, none_again), (None, None));
    assert!(before == with && before == after, "the second layer changes the picture");
    let some = some.unwrap();
    assert_eq!(Some(&some), shown.as_ref());
    let black = picture.chunks_exact(4).map(|texel| texel[..3] == [0; 3]);
    assert_eq!(black.collect::<Vec<_>>(), some.iter().map(|d| d.is_infinite()).collect::<Vec<_>>());
    assert!(some.iter().any(|d| d.is_finite()) && some.iter().any(|d| d.is_infinite()));
}

/// Arcs read the layers that the last frame has, whatever the frames before had.
#[test]
fn arcs_read_the_second_layer_of_frames_that_have_one() {
    let Some(device) = device() else { return };
    let (tracer, view) = proposed(Kind::FurnishedRoom, Size::px(130, 70));
    let view = view.surrounded(Surround { margin: 0.2, separation: Some(0.1) });
    let small = aonet_scene::View { width: 96, height: 54, ..view.clone() };
    let mut renderer = renderer(&device, tracer.scene(), window(&view));
    let arcs = aonet::search::Classic::named("arcs").unwrap();
    let plain = |view| FrameParams { methods: [Method::Arcs; 2], separation: None, ..frame(view) };
    let deep = |view| FrameParams { separation: Some(0.1), ..plain(view) };
    let frames =
        [(&view, plain(&view)), (&view, deep(&view)), (&small, deep(&small)), (&small, plain(&small))];
    for (view, frame) in frames {
        renderer.resize(window(view)).unwrap();
        draw(&device, &mut renderer, &frame);
        let gbuffer = readback::drawn(&renderer, &frame.camera).unwrap().gbuffer;
        assert_eq!(gbuffer.second().is_some(), frame.separation.is_some());
        let found = readback::visibility(&renderer, Method::Arcs).unwrap();
        let (mean, largest) = differences(&found, &arcs.run(&gbuffer, frame.params).unwrap());
        eprintln!("arcs: mean {mean:e}, largest {largest:e}");
        assert!(mean <= ARCS_MEAN_TOLERANCE, "{mean:e}");
        if frame.separation.is_some() {
            let first = GBuffer::new(*gbuffer.camera(), gbuffer.depth().to_vec(), gbuffer.normal().to_vec());
            let first = first.unwrap().with_margin(gbuffer.window().margin()).unwrap();
            let (change, _) = differences(&found, &arcs.run(&first, frame.params).unwrap());
            eprintln!("the second layer changes {change:e}");
            assert!(change > 20.0 * ARCS_MEAN_TOLERANCE, "{change:e}");
        }
    }
}

#[test]
fn passes_are_timed_where_the_device_has_a_clock() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(Size::px(64, 36));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(64, 36));
    for _ in 0..3 {
        draw(&device, &mut renderer, &frame(&view));
        device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    }
    if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        assert!(renderer.times().is_empty());
        return;
    }
    let labels: Vec<_> = renderer.times().iter().map(|time| time.label.as_str()).collect();
    assert_eq!(labels, ["G-buffer", "network", "lighting"]);
    for _ in 0..3 {
        draw(&device, &mut renderer, &FrameParams { separation: Some(0.1), ..frame(&view) });
        device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    }
    let labels: Vec<_> = renderer.times().iter().map(|time| time.label.as_str()).collect();
    assert_eq!(labels, ["G-buffer", "second layer", "network", "lighting"]);
    assert!(renderer.times().iter().all(|time| time.ms > 0.0 && time.ms < 60e3), "{:?}", renderer.times());
}

#[test]
fn rays_and_passes_of_the_caller_are_timed_in_their_frame() {
    let Some(device) = device() else { return };
    if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        return;
    }
    let (tracer, view) = demo(Size::px(64, 36));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(64, 36));
    renderer.set_tracer(&tracer).unwrap();
    let target =
        target(&device, (wgpu::TextureFormat::Rgba8Unorm, [64, 36])).create_view(&Default::default());
    let present = Present::new((&device.device, &device.queue), wgpu::TextureFormat::Rgba8Unorm);
    let mut draw = |frame: FrameParams| {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let begun = renderer.begin(&mut encoder, &frame).is_ok();
        let clock = renderer.clock("presenting");
        assert_eq!(clock.is_some(), begun);
        if !begun {
            encoder = device.device.create_command_encoder(&Default::default());
        }
        present.encode_timed(&mut encoder, (renderer.picture(), &target), clock.as_ref());
        renderer.finish(&mut encoder);
        device.queue.submit([encoder.finish()]);
        device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        assert!(renderer.clock("too late").is_none());
        renderer.times().to_vec()
    };
    let traced = |samples| FrameParams {
        methods: [Method::Gtao, Method::Reference],
        split: 0.5,
        samples,
        ..frame(&view)
    };
    let (few, many) = (traced(1), traced(64));
    let broken = FrameParams { split: 2.0, ..few };
    draw(few);
    // Each frame reports the times of the one before; a refused frame changes nothing.
    let times = [few, broken, many, many].map(&mut draw);
    let labels: Vec<_> = times[0].iter().map(|time| time.label.as_str()).collect();
    assert_eq!(labels, ["G-buffer", "GTAO", "ray-traced reference", "lighting", "presenting"]);
    assert_eq!(times[1], times[0]);
    // Durations are not checked: a driver that computes on busy cores writes its timestamps late.
    assert!(times[3].iter().all(|time| time.ms > 0.0), "{times:?}");
    // The reference is complete: no rays are traced or timed.
    let none = FrameParams { samples: 0, ..few };
    draw(none);
    assert_eq!(draw(none).len(), 4);
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(Size::px(16, 9));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(16, 9));
    draw(&device, &mut renderer, &frame(&view));
    device.device.destroy();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    // Encoding may not notice the lost device; reading back does.
    let _ = renderer.encode(&mut encoder, &frame(&view));
    device.queue.submit([encoder.finish()]);
    let message = readback::picture(&renderer).unwrap_err().to_string();
    assert!(message.contains("device"), "{message}");
    assert!(renderer.resize(Size::px(8, 8)).is_err());
    assert!(
        aonet_view::Renderer::new((&device.device, &device.queue), tracer.scene(), Size::px(16, 9)).is_err()
    );
}

fn target(device: &Device, (format, [width, height]): (wgpu::TextureFormat, [u32; 2])) -> wgpu::Texture {
    device.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// A picture on a target of a format, stretched.
fn presented(
    device: &Device,
    renderer: &aonet_view::Renderer,
    of: (wgpu::TextureFormat, [u32; 2]),
) -> Vec<u8> {
    let (format, [width, height]) = of;
    let target = target(device, of);
    let back = device.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(256 * height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let present = Present::new((&device.device, &device.queue), format);
    present.encode(&mut encoder, renderer.picture(), &target.create_view(&Default::default()));
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(256), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
    encoder.copy_texture_to_buffer(target.as_image_copy(), to, target.size());
    device.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., Result::unwrap);
    device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = back.get_mapped_range(..).unwrap();
    bytes.chunks_exact(256).flat_map(|row| &row[..4 * width as usize]).copied().collect()
}

#[test]
fn a_target_shows_the_picture_whatever_it_encodes() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(Size::px(64, 36));
    let mut renderer = renderer(&device, tracer.scene(), Size::px(64, 36));
    draw(&device, &mut renderer, &FrameParams { methods: [Method::Off; 2], ..frame(&view) });
    let picture = readback::picture(&renderer).unwrap();
    let apart = |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    let plain = presented(&device, &renderer, (wgpu::TextureFormat::Rgba8Unorm, [64, 36]));
    let encoding = presented(&device, &renderer, (wgpu::TextureFormat::Rgba8UnormSrgb, [64, 36]));
    assert_eq!((plain.len(), apart(&plain, &picture)), (picture.len(), 0));
    assert!(apart(&encoding, &picture) <= 1, "{}", apart(&encoding, &picture));
    let half = presented(&device, &renderer, (wgpu::TextureFormat::Rgba8Unorm, [32, 18]));
    // In the middle of four texels all have equal weight.
    let mean = |x: usize, y: usize, c: usize| {
        let texel = |x: usize, y: usize| u32::from(picture[4 * (64 * y + x) + c]);
        texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1)
    };
    assert_eq!(half.len(), 32 * 18 * 4);
    for (i, value) in half.iter().enumerate() {
        let (x, y, c) = (i / 4 % 32, i / 128, i % 4);
        assert!((f64::from(*value) - f64::from(mean(x, y, c)) / 4.0).abs() <= 2.0, "({x}, {y})");
    }
}

#[test]
fn bent_normals_change_the_light_of_methods_that_have_them_and_no_visibility() {
    let Some(device) = device() else { return };
    let size = Size::px(130, 70);
    let (tracer, view) = proposed(Kind::FurnishedRoom, size);
    let mut renderer = renderer(&device, tracer.scene(), size);
    let mut drawn = |method, show, bent_normals| {
        let methods = [method; 2];
        draw(&device, &mut renderer, &FrameParams { methods, show, bent_normals, ..frame(&view) });
        readback::picture(&renderer).unwrap()
    };
    for method in [Method::Gtao, Method::AgtaoTuned, Method::Balanced, Method::Vbao] {
        let [plain, lit] = [false, true].map(|bent| drawn(method, Show::Shaded, bent));
        let changed = plain.iter().zip(&lit).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert_eq!(changed > 500, method.has_bent_normals(), "{method}: {changed} values");
        let [a, b] = [false, true].map(|bent| drawn(method, Show::Visibility, bent));
        assert_eq!(a, b, "{method}");
        // The switch goes back, too.
        assert_eq!(drawn(method, Show::Shaded, false), plain, "{method}");
        let [bent, normals] = [Show::Bent, Show::Normals].map(|show| drawn(method, show, false));
        assert_eq!(bent != normals, method.has_bent_normals(), "{method}");
    }
}

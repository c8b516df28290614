//! Images on wgpu 29 against the CPU's. Without a device a test says that it was skipped; with `AONET_REQUIRE_GPU=1` it fails.

use aonet::gpu::{DepthEncoding, Describe, FrameNumbers, Layers, Precision, ProgramOptions, TextureEncoding};
use aonet::net::{Model, cpu, gpu::Network, shipped};
use aonet::search::{Classic, gpu::Method};
use aonet::{AoImage, AoParams, Camera, GBuffer, Margin, Size};
use aonet_wgpu_29::{FrameViews, Session, wgpu};
use wgpu::TextureFormat::{R32Float, Rgba32Float};

#[path = "../../bevy/tests/common/boxes.rs"]
mod boxes;

const SIZE: Size = Size::px(96, 60);
const RADIUS: f32 = 1.0;
type Device = (wgpu::Device, wgpu::Queue);

fn now<T>(future: impl Future<Output = T>) -> T {
    let mut future = std::pin::pin!(future);
    loop {
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        if let std::task::Poll::Ready(done) = future.as_mut().poll(&mut context) {
            return done;
        }
    }
}

fn device() -> Option<Device> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = match now(instance.request_adapter(&Default::default())) {
        Ok(adapter) => adapter,
        Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            return None;
        }
    };
    let required_features = adapter.features() & wgpu::Features::SHADER_F16;
    let descriptor = wgpu::DeviceDescriptor { required_features, ..Default::default() };
    Some(now(adapter.request_device(&descriptor)).unwrap())
}

fn extent(size: Size) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.width() as u32, height: size.height() as u32, depth_or_array_layers: 1 }
}

fn texture(
    device: &Device,
    size: Size,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.0.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// A texture of floats.
fn filled(device: &Device, size: Size, format: wgpu::TextureFormat, values: &[f32]) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = texture(device, size, format, usage);
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some((bytes.len() / size.height()) as u32),
        rows_per_image: None,
    };
    device.1.write_texture(texture.as_image_copy(), &bytes, layout, extent(size));
    texture.create_view(&Default::default())
}

fn target(device: &Device, size: Size) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    texture(device, size, R32Float, usage).create_view(&Default::default())
}

/// One frame, twice: what is cleared every frame is.
fn run(device: &Device, session: &Session, gbuffer: &GBuffer) -> Vec<f32> {
    let size = gbuffer.size();
    let normals: Vec<f32> = gbuffer.normal().iter().flat_map(|n| [n[0], n[1], n[2], 0.0]).collect();
    let normal = filled(device, size, Rgba32Float, &normals);
    let depth = filled(device, size, R32Float, gbuffer.depth());
    let second = gbuffer.second().map(|second| filled(device, size, R32Float, &second.depth));
    let visibility = target(device, gbuffer.window().size());
    let views =
        FrameViews { normal: &normal, depth: &depth, second: second.as_ref(), visibility: &visibility };
    let bound = session.bind(views).unwrap();
    let params = AoParams::new(RADIUS).unwrap();
    let frame = FrameNumbers { camera: *gbuffer.camera(), far: f32::INFINITY, params };
    let mut encoder = device.0.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &bound, &frame).unwrap();
    let first = read(device, encoder, visibility.texture());
    let mut encoder = device.0.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &bound, &frame).unwrap();
    assert_eq!(read(device, encoder, visibility.texture()), first);
    first
}

fn read(device: &Device, mut encoder: wgpu::CommandEncoder, texture: &wgpu::Texture) -> Vec<f32> {
    let row_bytes = (4 * texture.width()).next_multiple_of(256);
    let buffer = device.0.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row_bytes * texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    device.1.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., Result::unwrap);
    device.0.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.get_mapped_range(..);
    let rows = bytes.chunks_exact(row_bytes as usize).map(|row| &row[..4 * texture.width() as usize]);
    rows.flat_map(|row| row.chunks_exact(4)).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn textures(layers: Layers) -> TextureEncoding {
    TextureEncoding { depth: DepthEncoding::Linear, layers, ..Default::default() }
}

fn model(name: &str) -> Model {
    let (_, bytes) = shipped::ALL.into_iter().find(|(known, _)| *known == name).expect("a network");
    Model::from_bytes(bytes).unwrap()
}

fn network(name: &str, precision: Precision, layers: Layers) -> Network {
    let options = ProgramOptions { precision, textures: textures(layers), ..Default::default() };
    Network::new(&model(name), options).unwrap()
}

fn on_cpu(name: &str, gbuffer: &GBuffer) -> Vec<f32> {
    let params = AoParams::new(RADIUS).unwrap();
    if let Ok(classic) = Classic::named(name) {
        return classic.run(gbuffer, params).unwrap().visibility().to_vec();
    }
    let mut image = AoImage::open(gbuffer.window().size());
    cpu::Session::new(&model(name), gbuffer.window(), 1).unwrap().run(gbuffer, params, &mut image).unwrap();
    image.visibility().to_vec()
}

fn camera() -> Camera {
    Camera::perspective(0.9, SIZE)
        .unwrap()
        .looking_at([1.6, 2.2, 3.4], [0.0, 0.5, -1.0], [0.0, 1.0, 0.0])
        .unwrap()
}

fn mean_difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len() as f32
}

#[test]
fn images_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let on = (&device.0, &device.1);
    let gbuffer = boxes::frame(camera());
    let half = device.0.features().contains(wgpu::Features::SHADER_F16);
    println!("half floats: {half}");
    let mut all =
        vec![("fast", Precision::F32), ("balanced", Precision::F32), ("agtao:tuned", Precision::F32)];
    all.extend(half.then_some(("balanced", Precision::F16)));
    for (name, precision) in all {
        let program = match Classic::named(name) {
            Ok(classic) => Method::new(&classic, textures(Layers::One)).unwrap().program(SIZE),
            Err(_) => network(name, precision, Layers::One).program(SIZE),
        };
        let session = Session::new(on, program.unwrap(), R32Float).unwrap();
        let (found, expected) = (run(&device, &session, &gbuffer), on_cpu(name, &gbuffer));
        let mean = mean_difference(&found, &expected);
        println!("{name}, {precision}: mean difference {mean:.6}");
        // Measured: 3e-6 and 3e-5.
        assert!(mean < if precision == Precision::F16 { 2e-4 } else { 3e-5 }, "{name}: {mean}");
        assert!(expected.iter().sum::<f32>() < 0.95 * expected.len() as f32, "nothing to see");
        // The comparison sees another method.
        assert!(mean_difference(&found, &on_cpu("gtao:tuned", &gbuffer)) > 5e-3);
    }
}

#[test]
fn guard_bands_and_second_layers_count() {
    let Some(device) = device() else { return };
    let margin = Margin { x: 12, y: 8 };
    let wide = boxes::frame(camera().with_margin(margin).unwrap()).with_margin(margin).unwrap();
    let behind: Vec<f32> = wide.depth().iter().map(|depth| depth + 0.3).collect();
    let normal = wide.normal().to_vec();
    let deep = wide
        .clone()
        .with_second(aonet::SecondLayer { depth: behind.into(), normal: Some(normal.into()) })
        .unwrap();
    let program = network("high", Precision::F32, Layers::Two).program(wide.size()).unwrap();
    let session = Session::new((&device.0, &device.1), program, R32Float).unwrap();
    let found = run(&device, &session, &deep);
    let mean = mean_difference(&found, &on_cpu("high", &deep));
    println!("high, two layers and a margin: mean difference {mean:.6}");
    assert!(mean < 5e-5, "{mean}");
    assert!(mean_difference(&found, &on_cpu("high", &wide)) > 1e-3, "the second layer changes nothing");
}

#[test]
fn mistakes_are_errors_that_name_them() {
    let Some(device) = device() else { return };
    let on = (&device.0, &device.1);
    let program = |layers| {
        Method::new(&Classic::named("gtao").unwrap(), textures(layers)).unwrap().program(SIZE).unwrap()
    };
    let session = Session::new(on, program(Layers::One), R32Float).unwrap();
    let normal = filled(&device, SIZE, Rgba32Float, &vec![0.0; 4 * SIZE.pixels()]);
    let depth = filled(&device, SIZE, R32Float, &vec![1.0; SIZE.pixels()]);
    let small = filled(&device, Size::px(8, 8), R32Float, &[1.0; 64]);
    let visibility = target(&device, SIZE);
    let odd = target(&device, Size::px(95, 60));
    let right = FrameViews { normal: &normal, depth: &depth, second: None, visibility: &visibility };
    let error = |session: &Session, views| session.bind(views).unwrap_err().to_string();
    for (views, expected) in [
        (FrameViews { depth: &small, ..right }, "depth texture: expected 96x60, found 8x8"),
        (
            FrameViews { visibility: &odd, ..right },
            "visibility texture: expected 96x60, or less by an even number",
        ),
        (
            FrameViews { visibility: &normal, ..right },
            "visibility texture: expected R32Float, found Rgba32Float",
        ),
    ] {
        let found = error(&session, views);
        assert!(found.contains(expected), "{found}");
    }
    let two = Session::new(on, program(Layers::Two), R32Float).unwrap();
    assert!(error(&two, right).contains("second depth texture: expected one, found none"));
    let bound = session.bind(right).unwrap();
    let frame = FrameNumbers {
        camera: Camera::perspective(0.9, Size::px(8, 8)).unwrap(),
        far: f32::INFINITY,
        params: AoParams::new(RADIUS).unwrap(),
    };
    let mut encoder = device.0.create_command_encoder(&Default::default());
    assert!(session.encode(&mut encoder, &bound, &frame).unwrap_err().to_string().contains("camera"));
    // A device without half floats, and a format that cannot be drawn to.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = now(instance.request_adapter(&Default::default())).unwrap();
    let plain = now(adapter.request_device(&Default::default())).unwrap();
    let half = network("fast", Precision::F16, Layers::One).program(SIZE).unwrap();
    assert!(Session::new((&plain.0, &plain.1), half, R32Float).unwrap_err().to_string().contains("session"));
    assert!(Session::new(on, program(Layers::One), wgpu::TextureFormat::Depth32Float).is_err());
}

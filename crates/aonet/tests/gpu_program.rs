//! A program that was written and read gives the image of the session that built it: bit for bit on software drivers, but for
//! rounding on others.

mod common;
#[path = "common/device.rs"]
mod device;

use aonet::Size;
use aonet::gpu::program::ProgramBytes;
use aonet::gpu::wgpu::TextureFormat::R32Float;
use aonet::gpu::{DepthEncoding, Describe, Device, FrameViews, Layers, Program, Session, TextureEncoding};
use aonet::net::{Features, KernelWeights, Model, shipped};
use aonet::search::Classic;
use aonet::search::gpu::Method;
use aonet::{AoImage, GBuffer};
use common::{assert_close, frame, model, params, small, spread};
use device::{Inputs, OPTIONS, device, filled, inputs, on_the_cpu, read, target};

const SIZE: Size = Size::px(70, 44);

/// One frame through a session.
fn run<M: Describe>(device: &Device, session: &Session<M>, gbuffer: &GBuffer) -> AoImage {
    let Inputs { normal, depth, frame, .. } = inputs(device, gbuffer, params());
    let visibility = target(device, session.size(), R32Float);
    let view = session
        .bind(FrameViews { normal: &normal, depth: &depth, second: None, visibility: &visibility })
        .unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &view, &frame).unwrap();
    read(device, encoder, &visibility)
}

/// Writes and reads the program of a session, and compares what the two give.
fn check<M: Describe>(device: &Device, session: &Session<M>, what: &str) {
    let bytes = session.program().to_bytes().unwrap();
    let program = Program::from_bytes(&bytes.json, &bytes.blob).unwrap();
    let of_file = Session::<Program>::new((&device.device, &device.queue), program, R32Float).unwrap();
    let gbuffer = frame(SIZE, 3);
    let expected = run(device, session, &gbuffer);
    assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {what}");
    let found = run(device, &of_file, &gbuffer);
    // Programs of files keep within their buffers by checks, so a GPU's compiler may round elsewhere. Measured on an H100: 1.8e-7.
    let rounding = if on_the_cpu(device) { 0.0 } else { 1e-6 };
    assert_close(&found, &expected, (rounding, what));
    // What is cleared every frame is: the second frame is the first.
    assert_close(&run(device, &of_file, &gbuffer), &found, (0.0, &format!("{what}, again")));
}

#[test]
fn files_of_networks_give_the_sessions_image() {
    let Some(device) = device() else { return };
    let on = (&device.device, &device.queue);
    for (model, what) in [
        (Model::from_bytes(shipped::BALANCED).unwrap(), "balanced"),
        (Model::from_bytes(shipped::HIGH).unwrap(), "high"),
        (model(small(Features::normal_depth_normalized(), 4, KernelWeights::Linear), 1), "normalised depth"),
    ] {
        check(&device, &aonet::net::gpu::Session::new(on, &model, SIZE, OPTIONS).unwrap(), what);
    }
}

#[test]
fn files_of_classic_methods_give_the_sessions_image() {
    let Some(device) = device() else { return };
    let on = (&device.device, &device.queue);
    for name in ["gtao", "ssao"] {
        let method = Classic::named(name).unwrap();
        let session = aonet::search::gpu::ClassicSession::new(on, &method, SIZE, OPTIONS).unwrap();
        check(&device, &session, name);
    }
}

#[test]
fn a_changed_file_is_noticed_and_a_broken_shader_is_an_error() {
    let Some(device) = device() else { return };
    let on = (&device.device, &device.queue);
    let method = Classic::named("hbao").unwrap();
    let session = aonet::search::gpu::ClassicSession::new(on, &method, SIZE, OPTIONS).unwrap();
    let bytes = session.program().to_bytes().unwrap();
    let text = String::from_utf8(bytes.json).unwrap();
    let with = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        let program = Program::from_bytes(changed.as_bytes(), &bytes.blob).unwrap();
        Session::<Program>::new(on, program, R32Float)
    };
    let gbuffer = frame(SIZE, 3);
    let changed = with("const RADIUS_SCALE: f32 = 1.0f", "const RADIUS_SCALE: f32 = 0.5f").unwrap();
    assert_ne!(run(&device, &changed, &gbuffer), run(&device, &session, &gbuffer));
    for (from, to) in
        [("fn visibility_at", "fn elsewhere"), ("fn main", "fn start"), ("\"read\":0", "\"write\":0")]
    {
        let found = with(from, to).unwrap_err().to_string();
        assert!(found.contains("device"), "{from}: {found}");
    }
    let mut fixed = with("\"hbao\"", "\"another name\"").unwrap();
    assert!(
        fixed.resize(Size::px(10, 10)).unwrap_err().to_string().contains("70x44"),
        "a program has one size"
    );
    assert!(fixed.sibling(SIZE).is_ok());
}

#[test]
fn programs_of_two_layers_read_the_second() {
    let Some(device) = device() else { return };
    let textures =
        TextureEncoding { depth: DepthEncoding::Linear, layers: Layers::Two, ..TextureEncoding::default() };
    let method = Method::new(&Classic::named("ssao").unwrap(), textures).unwrap();
    let ProgramBytes { json, blob } = method.program(SIZE).unwrap().to_bytes().unwrap();
    // The image becomes the distance between the layers.
    let json = String::from_utf8(json).unwrap();
    let background = "if (depth_at(pixel, 0u) >= BACKGROUND)";
    let distance = "if (depth_at(pixel, 1u) < BACKGROUND) { \
                    return vec4(depth_at(pixel, 1u) - depth_at(pixel, 0u)); }";
    assert_eq!(json.matches(background).count(), 1);
    let json = json.replace(background, &format!("{distance} {background}"));
    let program = Program::from_bytes(json.as_bytes(), &blob).unwrap();
    assert_eq!(program.textures().layers, Layers::Two);
    let session = Session::<Program>::new((&device.device, &device.queue), program, R32Float).unwrap();

    let gbuffer = frame(SIZE, 3);
    let expected: Vec<f32> = (0..SIZE.pixels()).map(|i| (1 + i % 64) as f32 / 64.0).collect();
    let first = vec![2.0f32; SIZE.pixels()];
    let texture = |size, values: &mut dyn Iterator<Item = f32>| {
        filled(&device, size, R32Float, &values.flat_map(f32::to_le_bytes).collect::<Vec<_>>())
    };
    let depth = texture(SIZE, &mut first.iter().copied());
    let second = texture(SIZE, &mut first.iter().zip(&expected).map(|(a, b)| a + b));
    let small = texture(Size::px(1, 1), &mut [1.0].into_iter());
    let Inputs { normal, frame, .. } = inputs(&device, &gbuffer, params());
    let visibility = target(&device, SIZE, R32Float);
    let views = FrameViews { normal: &normal, depth: &depth, second: Some(&second), visibility: &visibility };
    for second in [None, Some(&small)] {
        let error = session.bind(FrameViews { second, ..views }).unwrap_err().to_string();
        assert!(error.contains("second depth"), "{error}");
    }
    let bound = session.bind(views).unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &bound, &frame).unwrap();
    assert_eq!(read(&device, encoder, &visibility).visibility(), expected);
}

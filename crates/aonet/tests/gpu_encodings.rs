//! Every encoding of normals and depth that a renderer may have, against the oracle on the frame that it stands for.

mod common;
#[path = "common/device.rs"]
mod device;

use aonet::gpu::wgpu::TextureFormat as Format;
use aonet::gpu::{
    DepthEncoding, Device, FrameNumbers, FrameViews, NormalEncoding, NormalSpace, Options, Precision, wgpu,
};
use aonet::internals::naive;
use aonet::net::gpu::Session;
use aonet::net::{Features, KernelWeights, Model};
use aonet::{Camera, GBuffer, Projection, Size};
use common::{assert_close, frame, model, params, small};
use device::{device, filled, read, target, texture};
use glam::{Vec2, Vec3, Vec3A};

/// Largest difference from the oracle, which sees the decoded frame. Depth near the far plane loses digits.
const TOLERANCE: f32 = 1e-4;

const SIZE: Size = Size::px(37, 22);

fn network() -> Model {
    model(small(Features::normal_projected_radius(), 4, KernelWeights::Linear), 1)
}

/// A camera somewhere, looking somewhere.
fn camera(projection: Projection) -> Camera {
    let camera = Camera::new(projection, SIZE).unwrap().with_near(0.25).unwrap();
    camera.looking_at([3.0, 1.0, -2.0], [0.5, 0.0, 1.0], [0.1, 1.0, 0.2]).unwrap()
}

const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.1 };

/// Texels of a format from components, and the components that a shader gets back.
fn encode(format: Format, values: [f32; 4]) -> (Vec<u8>, [f32; 4]) {
    let unorm = |v: f32, most: u32| (v.clamp(0.0, 1.0) * most as f32).round() as u32;
    match format {
        Format::Rgba32Float => (values.iter().flat_map(|v| v.to_le_bytes()).collect(), values),
        Format::Rgba16Float | Format::Rg16Float => {
            let halves = values.map(half::f16::from_f32);
            let count = if format == Format::Rg16Float { 2 } else { 4 };
            let bytes = halves[..count].iter().flat_map(|h| h.to_le_bytes()).collect();
            (bytes, halves.map(half::f16::to_f32))
        }
        Format::Rgba8Unorm | Format::Rg8Unorm => {
            let steps = values.map(|v| unorm(v, 255));
            let count = if format == Format::Rg8Unorm { 2 } else { 4 };
            (steps[..count].iter().map(|s| *s as u8).collect(), steps.map(|s| s as f32 / 255.0))
        }
        Format::Rgb10a2Unorm => {
            let steps = values.map(|v| unorm(v, 1023));
            let word = steps[0] | steps[1] << 10 | steps[2] << 20;
            (word.to_le_bytes().to_vec(), steps.map(|s| s as f32 / 1023.0))
        }
        other => panic!("no test for {other:?}"),
    }
}

/// The octahedron unfolded into [-1, 1]².
fn octahedral(n: Vec3) -> Vec2 {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let folded = (Vec2::ONE - Vec2::new(n.y, n.x).abs()) * n.truncate().signum();
    if n.z >= 0.0 { n.truncate() } else { folded }
}

/// Components of the texel of a unit normal.
fn components(encoding: NormalEncoding, n: Vec3) -> [f32; 4] {
    match encoding {
        NormalEncoding::Plain => n.extend(0.0).to_array(),
        NormalEncoding::Unorm => (0.5 * n + 0.5).extend(0.0).to_array(),
        NormalEncoding::Octahedral => octahedral(n).extend(0.0).extend(0.0).to_array(),
        NormalEncoding::OctahedralUnorm => (0.5 * octahedral(n) + 0.5).extend(0.0).extend(0.0).to_array(),
    }
}

/// The inverse: a direction.
fn direction(encoding: NormalEncoding, [x, y, z, _]: [f32; 4]) -> Vec3 {
    let unfold = |x: f32, y: f32| {
        let z = 1.0 - x.abs() - y.abs();
        if z >= 0.0 {
            return Vec3::new(x, y, z);
        }
        Vec3::new((1.0 - y.abs()) * x.signum(), (1.0 - x.abs()) * y.signum(), z)
    };
    match encoding {
        NormalEncoding::Plain => Vec3::new(x, y, z),
        NormalEncoding::Unorm => 2.0 * Vec3::new(x, y, z) - 1.0,
        NormalEncoding::Octahedral => unfold(x, y),
        NormalEncoding::OctahedralUnorm => unfold(2.0 * x - 1.0, 2.0 * y - 1.0),
    }
}

/// Textures and the frame that they encode.
struct Encoded<'a> {
    normal: &'a wgpu::TextureView,
    depth: &'a wgpu::TextureView,
    decoded: &'a GBuffer<'a>,
    far: f32,
}

/// Runs the network on textures and compares with the oracle on the frame.
fn check(device: &Device, options: Options, encoded: Encoded<'_>) {
    let Encoded { normal, depth, decoded, far } = encoded;
    let model = network();
    let options = Options { precision: Precision::F32, output: Format::R32Float, ..options };
    let session = Session::new((&device.device, &device.queue), &model, SIZE, options).unwrap();
    let visibility = target(device, SIZE, Format::R32Float);
    let view = session.bind(FrameViews { normal, depth, second: None, visibility: &visibility }).unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let frame = FrameNumbers { camera: *decoded.camera(), far, params: params() };
    session.encode(&mut encoder, &view, &frame).unwrap();
    let expected = naive::run(&model, decoded, params()).unwrap();
    let found = read(device, encoder, &visibility);
    assert!(found.visibility().iter().any(|v| *v < 0.9), "something to see");
    assert_close(&found, &expected, (TOLERANCE, &format!("{options:?}")));
}

#[test]
fn normals() {
    use NormalEncoding::{Octahedral, OctahedralUnorm, Plain, Unorm};
    let Some(device) = device() else { return };
    let gbuffer = frame(SIZE, 3);
    let camera = camera(PERSPECTIVE);
    let depths: Vec<_> = gbuffer.depth().iter().flat_map(|d| d.to_le_bytes()).collect();
    let depth = filled(&device, SIZE, Format::R32Float, &depths);
    for (encoding, format) in [
        (Plain, Format::Rgba16Float),
        (Plain, Format::Rgba32Float),
        (Unorm, Format::Rgb10a2Unorm),
        (Unorm, Format::Rgba8Unorm),
        (Octahedral, Format::Rg16Float),
        (OctahedralUnorm, Format::Rg8Unorm),
    ] {
        for space in [NormalSpace::View, NormalSpace::World] {
            let view_from_normals = match space {
                NormalSpace::View => glam::Mat3A::IDENTITY,
                NormalSpace::World => camera.view_from_world().matrix3,
            };
            let (mut texels, mut decoded) = (Vec::new(), Vec::new());
            for n in gbuffer.normal() {
                // Zeros of the background, which no encoding has, become anything.
                let n = view_from_normals.transpose() * Vec3A::from(*n).try_normalize().unwrap_or(Vec3A::Z);
                let (bytes, stored) = encode(format, components(encoding, n.into()));
                texels.extend(bytes);
                let n = view_from_normals * Vec3A::from(direction(encoding, stored)).normalize();
                decoded.push(n.to_array());
            }
            let decoded = GBuffer::new(camera, gbuffer.depth().to_vec(), decoded).unwrap();
            let options = Options {
                normals: encoding,
                normal_space: space,
                depth: DepthEncoding::Linear,
                ..Options::default()
            };
            let normal = filled(&device, SIZE, format, &texels);
            let far = f32::INFINITY;
            check(&device, options, Encoded { normal: &normal, depth: &depth, decoded: &decoded, far });
        }
    }
}

#[test]
fn depths() {
    let Some(device) = device() else { return };
    let gbuffer = frame(SIZE, 4);
    let texels = gbuffer.normal().iter().flat_map(|n| [n[0], n[1], n[2], 0.0]);
    let normals: Vec<_> = texels.flat_map(f32::to_le_bytes).collect();
    let normal = filled(&device, SIZE, Format::Rgba32Float, &normals);
    for projection in [PERSPECTIVE, Projection::Orthographic { height: 2.0 }] {
        for depth in [DepthEncoding::Reversed, DepthEncoding::Standard, DepthEncoding::Linear] {
            for far in [9.0, f32::INFINITY] {
                let perspective = projection == PERSPECTIVE;
                if !perspective && far == f32::INFINITY && depth != DepthEncoding::Linear {
                    continue;
                }
                let near = f64::from(camera(projection).near());
                let curve = |d: f64| if perspective { 1.0 / d } else { d };
                let stored = |d: f32| {
                    let [near, far, at] = [near, f64::from(far), f64::from(d)].map(curve);
                    match (depth, d == f32::INFINITY) {
                        (DepthEncoding::Linear, _) => d,
                        (DepthEncoding::Reversed, true) => 0.0,
                        (DepthEncoding::Standard, true) => 1.0,
                        (DepthEncoding::Reversed, false) => ((at - far) / (near - far)) as f32,
                        (DepthEncoding::Standard, false) => ((at - near) / (far - near)) as f32,
                    }
                };
                let texels: Vec<_> = gbuffer.depth().iter().flat_map(|d| stored(*d).to_le_bytes()).collect();
                let view = filled(&device, SIZE, Format::R32Float, &texels);
                let normals = gbuffer.normal().to_vec();
                let decoded = GBuffer::new(camera(projection), gbuffer.depth().to_vec(), normals).unwrap();
                let options = Options { depth, ..Options::default() };
                check(&device, options, Encoded { normal: &normal, depth: &view, decoded: &decoded, far });
            }
        }
    }
}

/// A depth buffer as a renderer leaves it, all of it at one distance.
#[test]
fn a_depth_texture() {
    let Some(device) = device() else { return };
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
    let depth = texture(&device, SIZE, Format::Depth32Float, usage).create_view(&Default::default());
    let mut encoder = device.device.create_command_encoder(&Default::default());
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.125),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    }));
    device.queue.submit([encoder.finish()]);
    let gbuffer = frame(SIZE, 5);
    let up = |n: &[f32; 3]| if *n == [0.0; 3] { [0.0, 0.0, 1.0] } else { *n };
    let normals: Vec<_> = gbuffer.normal().iter().map(up).collect();
    let texels = normals.iter().flat_map(|n| [n[0], n[1], n[2], 0.0]);
    let normal =
        filled(&device, SIZE, Format::Rgba32Float, &texels.flat_map(f32::to_le_bytes).collect::<Vec<_>>());
    // near / distance, the near plane being at 0.25.
    let decoded = GBuffer::new(camera(PERSPECTIVE), vec![2.0; SIZE.pixels()], normals).unwrap();
    let far = f32::INFINITY;
    check(&device, Options::default(), Encoded { normal: &normal, depth: &depth, decoded: &decoded, far });
}

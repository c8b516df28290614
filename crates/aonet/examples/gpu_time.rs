//! Times every pass of the shipped networks on this machine's device and prints JSON: milliseconds, medians.
//!
//! `cargo run --release -p aonet --features gpu --example gpu_time [FRAMES [WIDTHxHEIGHT]...]`

use aonet::net::gpu::{
    DepthEncoding, Device, Frame, Options, Precision, Session, Textures, Timestamps, View, wgpu,
};
use aonet::net::{Model, shipped};
use aonet::{AoParams, Camera, Error, Projection, Result};
use serde_json::{Value, json};
use std::time::Instant;

const SIZES: [(usize, usize); 3] = [(1280, 720), (1920, 1080), (3840, 2160)];
/// Frames a measurement. guess: enough for a median.
const FRAMES: usize = 100;

fn main() -> Result<()> {
    let args: Vec<_> = std::env::args().skip(1).collect();
    let frames = args.first().and_then(|n| n.parse().ok()).unwrap_or(FRAMES).max(1);
    let given = args.iter().filter_map(|arg| {
        let (width, height) = arg.split_once('x')?;
        Some((width.parse().ok()?, height.parse().ok()?))
    });
    let mut sizes: Vec<_> = given.collect();
    if sizes.is_empty() {
        sizes.extend(SIZES);
    }
    let device = Device::wait_for()?;
    let mut rows = Vec::new();
    for (name, bytes) in [("paper", shipped::PAPER), ("any_radius", shipped::ANY_RADIUS)] {
        let model = Model::from_bytes(bytes)?;
        for precision in [Precision::F32, Precision::F16] {
            for size in &sizes {
                rows.push(measure(&device, (name, &model), (*size, precision), frames)?);
            }
        }
    }
    let adapter = format!("{} ({:?})", device.adapter.name, device.adapter.backend);
    println!("{:#}", json!({ "adapter": adapter, "driver": device.adapter.driver_info, "rows": rows }));
    Ok(())
}

fn measure(
    device: &Device,
    (name, model): (&str, &Model),
    (size, precision): ((usize, usize), Precision),
    frames: usize,
) -> Result<Value> {
    let options = Options { precision, depth: DepthEncoding::Linear, ..Options::default() };
    let session = Session::new((&device.device, &device.queue), model, size, options)?;
    let view = view(device, &session, size)?;
    let fov = Projection::Perspective { fov_y: 1.0 };
    let camera = Camera::look_at((glam::Vec3::ZERO, -glam::Vec3::Z, glam::Vec3::Y), fov, size, 0.1)?;
    let frame = Frame { camera, far: f32::INFINITY, params: AoParams::new(0.5)? };
    let submit = || {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        session.encode(&mut encoder, &view, &frame)?;
        device.queue.submit([encoder.finish()]);
        Ok::<_, Error>(())
    };
    submit()?;
    wait(device)?;
    let begin = Instant::now();
    for _ in 0..frames {
        submit()?;
    }
    wait(device)?;
    let whole_ms = begin.elapsed().as_secs_f64() * 1e3 / frames as f64;
    Ok(json!({
        "model": name,
        "asked": format!("{precision:?}"),
        "ran": format!("{:?}", session.precision()),
        "width": size.0,
        "height": size.1,
        "frames": frames,
        "frame_wall_ms": whole_ms,
        "gflop": 2e-9 * model.graph().macs_per_pixel() * (size.0 * size.1) as f64,
        "memory_bytes": session.memory_bytes(),
        "passes": passes(device, &session, (&view, &frame), frames)?,
    }))
}

/// Medians of every pass and of the time from the first one's begin to the last one's end.
fn passes(
    device: &Device,
    session: &Session,
    (view, frame): (&View, &Frame),
    frames: usize,
) -> Result<Value> {
    if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        return Ok(Value::Null);
    }
    let labels = session.pass_labels();
    let count = 2 * labels.len() as u32;
    let queries = device.device.create_query_set(&wgpu::QuerySetDescriptor {
        label: None,
        ty: wgpu::QueryType::Timestamp,
        count,
    });
    let buffer = |usage| {
        let size = u64::from(count) * 8;
        device.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        })
    };
    let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
    let back = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
    let period_ms = f64::from(device.queue.get_timestamp_period()) * 1e-6;
    let mut times = vec![Vec::new(); labels.len() + 1];
    for _ in 0..frames {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        session.encode_timed(&mut encoder, view, frame, Timestamps { queries: &queries })?;
        encoder.resolve_query_set(&queries, 0..count, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &back, 0, resolved.size());
        device.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| ());
        wait(device)?;
        let bytes = back.get_mapped_range(..).map_err(|e| Error::device("timestamps", "some", e))?;
        let ticks: Vec<_> =
            bytes.chunks_exact(8).map(|b| b.iter().rev().fold(0u64, |t, b| t << 8 | u64::from(*b))).collect();
        drop(bytes);
        back.unmap();
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * period_ms;
        times.iter_mut().zip(ticks.chunks_exact(2)).for_each(|(times, t)| times.push(ms(t[0], t[1])));
        times[labels.len()].push(ms(ticks[0], ticks[ticks.len() - 1]));
    }
    let medians = times.iter_mut().map(|times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    let rows = labels.into_iter().chain(["whole"]).zip(medians);
    Ok(rows.map(|(pass, ms)| json!({ "pass": pass, "ms": ms })).collect())
}

fn wait(device: &Device) -> Result<()> {
    let lost = |e| Error::device("frame", "an end", e);
    device.device.poll(wgpu::PollType::wait_indefinitely()).map(|_| ()).map_err(lost)
}

/// Textures with a floor that bends, so that rays are neither all blocked nor all free.
fn view(device: &Device, session: &Session, (width, height): (usize, usize)) -> Result<View> {
    let size = wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 };
    let texture = |format, usage| {
        let texture = device.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        (texture, view)
    };
    let input = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let normal = texture(wgpu::TextureFormat::Rgba16Float, input);
    let depth = texture(wgpu::TextureFormat::R32Float, input);
    let visibility = texture(wgpu::TextureFormat::R8Unorm, wgpu::TextureUsages::RENDER_ATTACHMENT);
    let wave = |i: usize| ((i % width) as f32 * 0.05).sin() * ((i / width) as f32 * 0.03).cos();
    let pixels = 0..width * height;
    let normals =
        pixels.clone().flat_map(|i| [0.5 * wave(i), 0.4 * wave(i + 7), 1.0, 0.0].map(half::f16::from_f32));
    let depths = pixels.map(|i| 3.0 + 0.3 * wave(i));
    for (texture, bytes) in [
        (&normal.0, normals.flat_map(half::f16::to_le_bytes).collect::<Vec<_>>()),
        (&depth.0, depths.flat_map(f32::to_le_bytes).collect()),
    ] {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((bytes.len() / height) as u32),
            rows_per_image: None,
        };
        device.queue.write_texture(texture.as_image_copy(), &bytes, layout, size);
    }
    session.view(Textures { normal: &normal.1, depth: &depth.1, visibility: &visibility.1 })
}

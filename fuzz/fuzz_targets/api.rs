//! The library on frames of any numbers: cameras, windows, layers, every classic method, networks.
#![no_main]

use aonet::net::{Model, cpu, shipped};
use aonet::search::{Classic, Options, Session};
use aonet::{AoImage, AoParams, Camera, GBuffer, Margin, Result, SecondLayer, Size};
use libfuzzer_sys::arbitrary::{self, Arbitrary};
use std::sync::LazyLock;

/// Pixels on a side, at most.
const SIDE: u8 = 40;

static CLASSIC: LazyLock<Vec<Classic>> = LazyLock::new(Classic::all);
static NETWORKS: LazyLock<Vec<Model>> = LazyLock::new(|| {
    let load = |(_, bytes): (&str, &[u8])| Model::from_bytes(bytes).expect("a shipped network");
    shipped::ALL.into_iter().map(load).collect()
});

#[derive(Debug, Arbitrary)]
struct Input {
    size: [u8; 2],
    margin: [u8; 2],
    lens: Lens,
    centre: Option<[f32; 2]>,
    radius: f32,
    method: u8,
    /// Behind the first layer by these shares of its depth.
    second: Option<[u8; 3]>,
    /// Numbers of pixels that are repeated over the frame: depth, and a normal.
    surfaces: Vec<(u16, [i8; 3])>,
    /// Pixels that are set to any number.
    damage: Vec<(u16, f32)>,
}

#[derive(Debug, Arbitrary)]
enum Lens {
    Perspective(f32),
    Orthographic(f32),
}

fn camera(input: &Input, size: Size) -> Result<Camera> {
    let camera = match input.lens {
        Lens::Perspective(fov_y) => Camera::perspective(fov_y, size)?,
        Lens::Orthographic(height) => Camera::orthographic(height, size)?,
    };
    match input.centre {
        Some(centre) => camera.with_centre_px(centre),
        None => Ok(camera),
    }
}

/// A direction that looks at the viewer, of unit length.
fn towards_viewer([x, y, z]: [i8; 3]) -> [f32; 3] {
    let [x, y, z] = [f32::from(x), f32::from(y), f32::from(z).abs() + 1.0];
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

fn run(input: &Input) -> Result<()> {
    let [width, height] = input.size.map(|side| usize::from(side % SIDE));
    let size = Size::new(width, height)?;
    let surface = |i: usize| input.surfaces.get(i % input.surfaces.len().max(1)).copied().unwrap_or((100, [0, 0, 1]));
    let depth_of = |(depth, _): (u16, [i8; 3])| if depth == 0 { f32::INFINITY } else { f32::from(depth) / 100.0 };
    let mut depth: Vec<f32> = (0..width * height).map(|i| depth_of(surface(i))).collect();
    let normal: Vec<_> = (0..width * height).map(|i| towards_viewer(surface(i).1)).collect();
    for (i, value) in &input.damage {
        depth[usize::from(*i) % (width * height)] = *value;
    }
    let behind = input.second.map(|shares| {
        let times = |i: usize| 1.0 + f32::from(shares[i % 3]) / 50.0;
        depth.iter().enumerate().map(|(i, d)| d * times(i)).collect::<Vec<_>>()
    });
    let mut gbuffer = GBuffer::new(camera(input, size)?, &depth, &normal)?;
    if let Some(depth) = behind {
        gbuffer = gbuffer.with_second(SecondLayer { depth: depth.into(), normal: None })?;
    }
    let [x, y] = input.margin.map(usize::from);
    gbuffer = gbuffer.with_margin(Margin { x, y })?;
    let params = AoParams::new(input.radius)?;
    let mut image = AoImage::open(gbuffer.window().size());
    let method = usize::from(input.method) % (CLASSIC.len() + NETWORKS.len());
    match NETWORKS.get(method.wrapping_sub(CLASSIC.len())) {
        None => Session::new(&CLASSIC[method], gbuffer.window(), Options::default())?.run(&gbuffer, params, &mut image)?,
        Some(network) => cpu::Session::new(network, gbuffer.window(), 1)?.run(&gbuffer, params, &mut image)?,
    }
    assert!(image.visibility().iter().all(|v| (0.0..=1.0).contains(v)), "visibility out of range");
    Ok(())
}

libfuzzer_sys::fuzz_target!(|input: Input| {
    let _ = run(&input);
});

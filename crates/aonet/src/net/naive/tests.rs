//! The oracle by hand, and the runtimes' search and features against it.

use super::*;
use crate::frame::camera::{Camera, Projection};
use crate::frame::gbuffer::{GBuffer, SecondLayer};
use crate::frame::size::Size;
use crate::search::{self, ArcsParams, Classic, Options, Share};

fn ramp(shape: (usize, usize, usize)) -> Planes {
    Planes::from_fn(shape, |c, y, x| (c * 100 + y * 10 + x) as f32)
}

#[test]
fn partition_then_merge_is_the_identity() {
    let image = ramp((3, 8, 12));
    let parts = patch_partition(&image, 4);
    assert_eq!((parts.channels, parts.height, parts.width), (48, 2, 3));
    assert_eq!(parts.at(16 + 4 + 2, 1, 2), image.at(1, 5, 10));
    assert_eq!(patch_merge(&parts, 4), image);
}

#[test]
fn upsampling_a_ramp_keeps_it_a_ramp() {
    let up = upsample2(&Planes::from_fn((1, 1, 4), |_, _, x| x as f32));
    assert_eq!(up.values[..8], [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0]);
    assert_eq!(avg_pool2(&up).values, [0.125, 1.0, 2.0, 2.875]);
}

#[test]
fn a_shifted_delta_filter_shifts_and_repeats_the_edge() {
    let mut weight = [0.0; 9];
    weight[5] = 1.0;
    let out =
        conv(&Planes::from_fn((1, 1, 3), |_, _, x| x as f32 + 1.0), (&weight, &[0.5], 3), Activation::Linear);
    assert_eq!(out.values, [2.5, 3.5, 3.5]);
    let out = conv(&ramp((1, 1, 1)), (&[0.0; 9], &[-1.0], 3), Activation::LeakyRelu);
    assert_eq!(out.values, [-0.01]);
}

#[test]
fn one_kernel_weight_picks_its_tap_of_its_pixel() {
    let guide = ramp((4, 8, 8));
    for (dy, dx, ky, kx, c) in [(0, 0, 0, 0, 0), (3, 2, 3, 1, 2), (1, 3, 2, 3, 1)] {
        let channel = ((dy * 4 + dx) * 16 + ky * 4 + kx) * 3 + c;
        let kernels = Planes::from_fn((768, 2, 2), |k, _, _| if k == channel { 3.0 } else { 0.0 });
        let out = kernel_predict(&kernels, &guide, 4, KernelWeights::Linear);
        let expected = guide.at(c, 4 + dy as isize + ky as isize - 1, dx as isize + kx as isize - 1);
        assert_eq!(out.at(0, 4 + dy as isize, dx as isize), expected);
        let touched = out.values.iter().filter(|v| **v != 0.0).count();
        assert!(touched <= 4, "one pixel a patch, not {touched}");
    }
}

#[test]
fn softmax_of_a_flat_wall_is_the_mean_normal() {
    let guide = Planes::from_fn((3, 4, 4), |c, _, _| [0.6, 0.0, 0.8][c]);
    let kernels = Planes::from_fn((48, 4, 4), |k, y, x| (k * 7 % 5) as f32 + y as f32 - x as f32);
    let out = kernel_predict(&kernels, &guide, 1, KernelWeights::Softmax);
    assert!(out.values.iter().all(|v| (v - 1.4 / 3.0).abs() < 1e-6));
}

/// Shelves of different depths before a slanted floor and a wall, the sky between them, and a second layer behind the shelves.
fn shelves(projection: Projection, layers: usize) -> GBuffer<'static> {
    let (width, height) = (96, 64);
    let camera = Camera::new(projection, Size::px(width, height)).unwrap();
    let ground = |i: usize| 6.0 - 0.02 * (i / width) as f32;
    let shelf = |i: usize| {
        let (x, y) = (i % width, i / width);
        (x % 24 < 7 || y % 20 < 4).then(|| 3.0 + 0.4 * ((x / 24 + y / 20) % 4) as f32 + 0.004 * x as f32)
    };
    let sky = |i: usize| i % width > 80 && i / width < 12;
    let pixels = || 0..width * height;
    let first = |i: usize| shelf(i).unwrap_or_else(|| if sky(i) { f32::INFINITY } else { ground(i) });
    let normal = |i: usize| {
        let normal: [f32; 3] = if shelf(i).is_some() { [-0.1, 0.0, 1.0] } else { [0.0, 0.4, 1.0] };
        let length = normal.iter().map(|c| c * c).sum::<f32>().sqrt();
        if first(i).is_finite() { normal.map(|c| c / length) } else { [0.0; 3] }
    };
    let frame = GBuffer::new(
        camera,
        pixels().map(first).collect::<Vec<_>>(),
        pixels().map(normal).collect::<Vec<_>>(),
    );
    if layers == 1 {
        return frame.unwrap();
    }
    // Behind every other shelf is one more.
    let second = |i: usize| if (i % width / 24).is_multiple_of(2) { ground(i) } else { 4.8 };
    let behind = |i: usize| if shelf(i).is_some() { second(i) } else { f32::INFINITY };
    let depth = pixels().map(behind).collect::<Vec<_>>();
    frame.unwrap().with_second(SecondLayer { depth: depth.into(), normal: None }).unwrap()
}

#[test]
fn connected_arcs_tell_the_shares_of_their_definition() {
    let params = AoParams::new(1.5).unwrap();
    for projection in [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 5.0 }] {
        for layers in [1, 2] {
            let frame = shelves(projection, layers);
            for arcs in [
                ArcsParams::default(),
                ArcsParams { slices: 2, steps: 12, ..ArcsParams::default() },
                ArcsParams { between: 1, ..ArcsParams::default() },
            ] {
                let expected = arcs::shares(&arcs, &frame, params);
                let mut session =
                    search::Session::new(&Classic::Arcs(arcs), frame.size(), Options::default()).unwrap();
                let found = session.shares(&frame, params).unwrap();
                let pixels = frame.depth().len();
                for (c, share) in Share::ALL[1..].iter().enumerate() {
                    let expected = &expected.values[c * pixels..][..pixels];
                    let off = found.plane(*share).iter().zip(expected).map(|(a, b)| (a - b).abs());
                    let mean = off.sum::<f32>() / pixels as f32;
                    let share_of_light = expected.iter().sum::<f32>() / pixels as f32;
                    eprintln!(
                        "{projection:?}, {layers} layers, {share:?}: mean {mean:e} of {share_of_light}"
                    );
                    // Measured: 2.2e-5.
                    assert!(mean < 2e-4, "{projection:?}, {layers} layers, {share:?}: {mean:e}");
                    assert!(share_of_light > 5e-3, "{share:?}: nothing to see");
                }
            }
        }
    }
}

//! Features in planes and in blocks against those of the frame.

use super::{buffers, index, noise};
use crate::net::config::Features;
use crate::net::cpu::context::Context;
use crate::net::cpu::features::PartitionFeatures;
use crate::net::features::write_features;
use crate::net::naive::Planes;
use crate::net::plan::Layout::{Blocked, Planar};
use crate::simd::aligned::Aligned;
use crate::simd::{Isa, Level};
use crate::threads::Workers;
use crate::{AoParams, Camera, GBuffer, Size};
use glam::Vec3;

#[test]
fn features_lie_in_planes_or_in_blocks() {
    let (width, height) = (37, 19);
    let size = Size::px(width, height);
    let depth: Vec<f32> = (0..width * height).map(|i| 2.0 + noise(i, 1)).collect();
    let normal = |i: usize| Vec3::new(noise(i, 2), noise(i, 3), 1.5).normalize().to_array();
    let normals: Vec<_> = (0..width * height).map(normal).collect();
    let gbuffer = GBuffer::new(Camera::perspective(1.0, size).unwrap(), depth, normals).unwrap();
    let (features, params) = (Features::normal_projected_radius(), AoParams::new(0.5).unwrap());
    let mut pixels = vec![0.0; 4 * size.pixels()];
    write_features(&features, &gbuffer, params, &[], &mut pixels);
    for (patch, layout) in [(1, Planar), (2, Planar), (2, Blocked), (4, Blocked), (8, Blocked)] {
        // One column of patches more than the frame needs.
        let cells = (height.div_ceil(patch), width.div_ceil(patch) + 1);
        let (buffers, arena_len) = buffers(&[(layout, (4 * patch * patch, cells.0, cells.1))]);
        let output = &buffers[0];
        let step = PartitionFeatures { size, patch, search: None, output: output.clone() };
        let halo = (output.channels, cells.0, cells.1 + 2);
        // Beyond the frame its last pixels repeat, beyond the patches the last ones.
        let expected = Planes::from_fn(halo, |c, y, x| {
            let (feature, dy, dx) = (c / (patch * patch), c / patch % patch, c % patch);
            let x = x.saturating_sub(1).min(cells.1 - 1) * patch + dx;
            pixels[(feature * height + (y * patch + dy).min(height - 1)) * width + x.min(width - 1)]
        });
        for level in Level::available() {
            let isa = Isa::new(level).unwrap();
            let mut arena = Aligned::zeros(arena_len).unwrap();
            arena.fill(f32::NAN);
            let mut workers = Workers::new(2, step.scratch_len()).unwrap();
            step.run(Context { isa, workers: &mut workers, arena: &mut arena }, &features, &gbuffer, params);
            let at = |c, y, x| arena[index(output, isa.lanes(), (c, y, x as isize - 1))];
            let found = Planes::from_fn(halo, at);
            assert_eq!(found.values, expected.values, "{level:?}, patches of {patch}, {layout:?}");
        }
    }
}

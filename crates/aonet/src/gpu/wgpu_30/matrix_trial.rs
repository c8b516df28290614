//! A trial of products of matrices. They are experimental: a device whose products are wrong has to do without.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::matrices::{Matrices, WAVES};
use crate::gpu::options::{Kernels, Layers, Precision};
use crate::gpu::program::{Arithmetic, Binding, Dispatch, Dispatches, Number};
use crate::gpu::shader::Shader;
use crate::gpu::wgpu_30::errors::scoped;
use crate::gpu::wgpu_30::host::Host;

/// Whether every subgroup of a workgroup multiplies as it should. Waits for the device.
pub(crate) fn succeeds(matrices: Matrices, device: &wgpu::Device, queue: &wgpu::Queue) -> bool {
    let host = Host::new((device, queue), Layers::One);
    let products = scoped(device, "trial", || products(&host, matrices));
    products
        .is_ok_and(|products| products.chunks_exact(matrices.side.pow(2)).all(|p| p == expected(matrices)))
}

/// The shader of the trial.
pub(crate) fn shader(matrices: Matrices) -> Shader {
    matrices.shader().part(include_str!("matrix_trial.wgsl"))
}

/// Small whole numbers, of which no two rows or columns are alike: their products and sums are exact.
fn factor(which: usize, row: usize, column: usize) -> f32 {
    ((row * 7 + column * 13 + 3 * row * column + 5 * which) % 17) as f32 - 8.0
}

fn expected(matrices: Matrices) -> Vec<f32> {
    let side = matrices.side;
    let at = |i: usize| (0..side).map(|k| factor(0, i / side, k) * factor(1, k, i % side)).sum();
    (0..side * side).map(at).collect()
}

fn products(host: &Host, matrices: Matrices) -> Result<Vec<f32>> {
    let (device, side) = (&host.device, matrices.side);
    // The second factor lies column by column.
    let factors: Vec<_> = (0..side * side)
        .map(|i| factor(0, i / side, i % side))
        .chain((0..side * side).map(|i| factor(1, i % side, i / side)))
        .collect();
    let bytes = WAVES * side * side * size_of::<f32>();
    let arithmetic = Arithmetic { precision: Precision::F16, kernels: Kernels::Matrices(matrices) };
    let mut list = Dispatches::default();
    let factors = list.reals("factors", &arithmetic.reals(&factors), arithmetic.precision.bytes());
    let products = list.storage("products", bytes);
    let dispatch = Dispatch {
        label: "trial",
        sees_frame: false,
        variants: vec![(shader(matrices), [1; 3].map(Number::from))],
    };
    list.push(dispatch, &[Binding::Read(factors), Binding::Write(products)]);
    let list = list.at(Size::px(1, 1), arithmetic.precision)?;
    let buffers = host.buffers(&list.buffers)?;
    let pass = host.pass(&list.passes[0], &list.shaders[0], &buffers, true);
    let products = &buffers[products];
    let back = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("trial"),
        size: products.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.encode_alone(&mut encoder.begin_compute_pass(&Default::default()));
    encoder.copy_buffer_to_buffer(products, 0, &back, 0, products.size());
    host.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., |_| ());
    let lost = |found: String| Error::device("products of matrices", "some that can be read back", found);
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(e.to_string()))?;
    let bytes = back.get_mapped_range(..).map_err(|e| lost(e.to_string()))?;
    Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_of_the_factors_are_told_apart() {
        for which in [0, 1] {
            let line = |i: usize| (0..16).map(|k| factor(which, i, k) as i32).collect::<Vec<_>>();
            let turned = |i: usize| (0..16).map(|k| factor(which, k, i) as i32).collect::<Vec<_>>();
            assert!((0..16).all(|i| (0..i).all(|k| line(i) != line(k) && turned(i) != turned(k))));
            assert!((0..16).any(|i| line(i) != turned(i)));
        }
    }
}

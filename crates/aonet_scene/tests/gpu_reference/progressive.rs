//! A few rays at a time.

use super::{FLOAT, LEAST_PSNR, accumulated, agreement, device, reference, stage};
use aonet::gpu::wgpu;
use aonet::{AoParams, Size};
use aonet_scene::gpu::ReferenceOptions;
use aonet_scene::reference::{Sampling, reference_ao};

#[test]
fn rays_a_few_at_a_time_make_the_same_image_as_all_at_once() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage(Size::px(41, 27));
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 60, seed: 5 });
    let options = ReferenceOptions { sampling, output: FLOAT, ..ReferenceOptions::default() };
    let mut reference = reference(&device, &tracer, Size::px(41, 27), options);
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
    let (tracer, view, surface) = stage(Size::px(33, 18));
    let params = view.params().unwrap();
    let options = ReferenceOptions { output: FLOAT, ..ReferenceOptions::default() };
    let mut reference = reference(&device, &tracer, Size::px(20, 10), options);
    assert!(reference.set_surface(&tracer, &surface, params).is_err(), "another size");
    reference.resize(Size::px(33, 18)).unwrap();
    reference.set_surface(&tracer, &surface, params).unwrap();
    for (radius, sampling) in [
        (params.radius(), Sampling { spp: 16, seed: 1 }),
        (0.3 * params.radius(), Sampling { spp: 16, seed: 1 << 63 }),
        (params.radius(), Sampling { spp: 1, seed: 3 }),
        (params.radius(), Sampling { spp: 129, seed: 3 }),
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

#[test]
fn the_texture_may_have_any_format_of_one_channel() {
    let Some(device) = device() else { return };
    let (tracer, view, surface) = stage(Size::px(33, 18));
    let sampling = Sampling { spp: 16, seed: 1 };
    let images = [(FLOAT, 0.0), (wgpu::TextureFormat::R16Float, 1e-3), (wgpu::TextureFormat::R8Unorm, 3e-3)];
    let images = images.map(|(output, tolerance)| {
        let options = ReferenceOptions { sampling, output, ..ReferenceOptions::default() };
        let mut reference = reference(&device, &tracer, Size::px(33, 18), options);
        reference.set_surface(&tracer, &surface, view.params().unwrap()).unwrap();
        (accumulated(&device, &mut reference, &[16]), tolerance)
    });
    for (image, tolerance) in &images {
        let close = |(a, b): (&f32, &f32)| (a - b).abs() <= *tolerance;
        assert!(images[0].0.visibility().iter().zip(image.visibility()).all(close), "{tolerance}");
    }
}

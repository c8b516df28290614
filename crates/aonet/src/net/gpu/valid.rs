//! Every shader, without a device.

use super::{features, head};
use crate::gpu::image::{self, covering};
use crate::gpu::matrices::Matrices;
use crate::gpu::options::{DepthEncoding, Kernels, Layers, NormalEncoding, Precision, TextureEncoding};
use crate::gpu::program::Arithmetic;
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::gpu::wgpu_30::matrix_trial;
use crate::net::config::{Features, KernelWeights};
use crate::net::gpu::conv::Kind;
use crate::net::gpu::head::kernel_predict_matrix as head_matrix;
use crate::net::gpu::head::kind::HeadKind;
use crate::net::graph::Activation;
use crate::net::plan::Resample;
use wgpu::naga;

pub(crate) const PRECISIONS: [Precision; 2] = [Precision::F32, Precision::F16];

pub(crate) const KERNELS: [Kernels; 2] = [Kernels::Plain, Kernels::Subgroups];

/// Panics when the shader is no WGSL or needs more memory a workgroup than WebGPU promises.
pub(crate) fn validate(source: &str, what: &str) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
    use naga::valid::Capabilities;
    let capabilities =
        Capabilities::SHADER_FLOAT16 | Capabilities::COOPERATIVE_MATRIX | Capabilities::SUBGROUP;
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
    validator.validate(&module).unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    let of_workgroup =
        module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
    let bytes: u32 = of_workgroup.map(|(_, v)| layouter[v.ty].size).sum();
    assert!(bytes <= wgpu::Limits::defaults().max_compute_workgroup_storage_size, "{what}: {bytes} bytes");
}

/// Whoever runs a program in the other precision replaces the heads of its shaders.
#[test]
fn only_the_head_of_a_shader_depends_on_its_precision() {
    for kernels in KERNELS {
        for rows in [1, 2, 4] {
            let sources = vec![Resample::Upsample2, Resample::None];
            let kind = Kind { sources, size: 3, activation: Activation::LeakyRelu, tile: 32 };
            let [single, half] = PRECISIONS.map(|precision| {
                let shader = kind.shader(Arithmetic { precision, kernels }, rows);
                let head = Shader::new(precision).source().to_owned();
                assert!(shader.source().starts_with(&head));
                shader.source()[head.len()..].to_owned()
            });
            assert_eq!(single, half, "{kernels:?}, {rows} rows");
        }
    }
}

#[test]
fn every_shader_is_valid() {
    use KernelWeights::{Linear, Off, Softmax};
    use Resample::{AvgPool, None, Upsample2};
    for matrices in MATRICES {
        validate(matrix_trial::shader(matrices).source(), "trial");
    }
    for by in
        PRECISIONS.into_iter().flat_map(|precision| KERNELS.map(|kernels| Arithmetic { precision, kernels }))
    {
        for rows in [1, 2, 4] {
            for size in [1, 3] {
                for sources in
                    [vec![None], vec![AvgPool(4), Upsample2], vec![Upsample2, None, AvgPool(2), None]]
                {
                    let kind = Kind { sources, size, activation: Activation::LeakyRelu, tile: 32 };
                    validate(kind.shader(by, rows).source(), &format!("{kind:?}"));
                    for matrices in MATRICES {
                        for tiles in [1, kind.tile / matrices.side] {
                            let shader = kind.matrix_shader(matrices, [rows, tiles]);
                            validate(shader.source(), &format!("{kind:?}"));
                        }
                    }
                }
            }
            for patch in [1, 2, 4, 8] {
                for kernel in [Off, Linear, Softmax] {
                    let shader = head::kind::shader(
                        by,
                        &HeadKind { patch, kernel, planes: 1, neighbours: vec![] },
                        rows,
                    );
                    validate(shader.source(), &format!("head {patch} {kernel:?}"));
                }
                for neighbours in [vec![], vec![1, 3]] {
                    let what = format!("head {patch}, weights of shares, neighbours at {neighbours:?}");
                    let kind = HeadKind { patch, kernel: Off, planes: 6, neighbours };
                    validate(head::kind::shader(by, &kind, rows).source(), &what);
                }
                for (matrices, kernel) in MATRICES.into_iter().zip([Linear, Softmax].into_iter().cycle()) {
                    let shader = head_matrix::shader(
                        matrices,
                        64,
                        &HeadKind { patch, kernel, planes: 1, neighbours: vec![] },
                    );
                    validate(shader.source(), &format!("head {patch} {matrices:?}"));
                }
            }
        }
    }
    for precision in PRECISIONS {
        for textures in encodings() {
            let surface = Surface { precision, textures };
            validate(features::depth_range::shader(surface).source(), "depth range");
            for patch in [1, 4] {
                for channels in Features::named().chain([Features::normal_radius_light()]) {
                    let shader = features::shader(surface, &channels, patch);
                    validate(shader.source(), &format!("{channels:?} {patch} {textures:?}"));
                }
                for (planes, blocked) in [(0, false), (1, false), (6, false), (0, true)] {
                    let image = image::shader(surface, (patch, planes), blocked);
                    validate(&covering(image.source()), "image");
                }
            }
        }
    }
}

pub(crate) const MATRICES: [Matrices; 7] = [
    of_device(8, 8),
    of_device(8, 32),
    of_device(16, 32),
    of_device(16, 64),
    spelt_out(8, 8),
    spelt_out(16, 32),
    spelt_out(16, 64),
];

/// Of llvmpipe and of devices of several makers.
const fn of_device(side: usize, lanes: usize) -> Matrices {
    Matrices { side, lanes, spelt_out: false }
}

/// The same for any device.
const fn spelt_out(side: usize, lanes: usize) -> Matrices {
    Matrices { side, lanes, spelt_out: true }
}

pub(crate) fn encodings() -> Vec<TextureEncoding> {
    use DepthEncoding::{Linear, Reversed, Standard};
    use NormalEncoding::{Octahedral, OctahedralUnorm, Plain, Unorm};
    let depth = |depth| TextureEncoding { depth, ..Default::default() };
    let normals = |normals| TextureEncoding { normals, ..Default::default() };
    let all = [Plain, Unorm, Octahedral, OctahedralUnorm].map(normals);
    let layers = [TextureEncoding { layers: Layers::Two, ..Default::default() }];
    [Linear, Reversed, Standard].map(depth).into_iter().chain(all).chain(layers).collect()
}

#[test]
#[should_panic(expected = "broken")]
fn a_broken_shader_is_noticed() {
    validate("fn main() -> u32 { return 1.5; }", "broken");
}

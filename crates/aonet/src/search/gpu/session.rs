//! Classic methods on a device, beside the networks: same textures, same verbs.

use super::{agtao, denoise, gtao, hbao, pixels, ssao, ssdo, vbao};
use crate::error::{Error, Result};
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::{Frame, Kernels, Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::wgpu_30::chain::{Chain, Timestamps};
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::device::check_limits;
use crate::gpu::wgpu_30::device::scoped;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};
use crate::gpu::wgpu_30::view::{self, Textures, View};
use crate::search::Classic;
use crate::search::gpu::hemisphere::{self, Sample};
use crate::search::gpu::pyramid::Pyramid;

/// A classic method and its memory on a device, for frames of one size. Computes in 32-bit floats. NNAO has no shaders.
#[derive(Debug)]
pub struct ClassicSession {
    context: Context,
    options: Options,
    compiler: Compiler,
    method: Classic,
    sized: Sized,
}

/// What depends on the size.
#[derive(Debug)]
struct Sized {
    memory_bytes: u64,
    chain: Chain,
}

impl ClassicSession {
    /// A session for frames of `size` (width, height) [px]. Precision and kernels of the options do not matter.
    ///
    /// # Errors
    /// When the method is NNAO or a parameter is out of its range, when a side is 0 or too large for the device, or the
    /// device lacks what WebGPU promises or does not have enough memory.
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        method: &Classic,
        size: (usize, usize),
        options: Options,
    ) -> Result<Self> {
        let method = method.checked()?;
        check_limits(&device.limits())?;
        let (precision, kernels) = (Precision::F32, Kernels::Plain);
        let context = Context { device: device.clone(), queue: queue.clone(), precision, kernels };
        let compiler = Compiler::new(device, view::layout(device));
        let sized = Sized::new((&context, &options), &compiler, &method, size)?;
        Ok(Self { context, options, compiler, method, sized })
    }

    /// Changes the size of the frames to `size` (width, height) [px]; views of another size are of no use then. After an
    /// error the session is as before.
    ///
    /// # Errors
    /// When a side is 0 or too large for the device, or there is not enough memory.
    pub fn resize(&mut self, size: (usize, usize)) -> Result<()> {
        self.sized = Sized::new((&self.context, &self.options), &self.compiler, &self.method, size)?;
        Ok(())
    }

    /// A view of a frame's textures; one for each camera that sees a frame.
    ///
    /// # Errors
    /// When a texture has another size, format or usage than the session needs.
    pub fn view(&self, textures: Textures<'_>) -> Result<View> {
        let of = (self.sized.chain.size, self.options.output);
        View::new(&self.context.device, &self.compiler.view_layout, of, textures)
    }

    /// Encodes the passes of a frame, as [`Session::encode`](super::Session::encode) does.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, view: &View, frame: &Frame) -> Result<()> {
        self.sized.chain.encode((&self.context, &self.options), encoder, (view, frame), None)
    }

    /// [`ClassicSession::encode`] with every pass on its own and timed.
    ///
    /// # Errors
    /// As [`ClassicSession::encode`].
    pub fn encode_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        frame: &Frame,
        timestamps: Timestamps<'_>,
    ) -> Result<()> {
        self.sized.chain.encode((&self.context, &self.options), encoder, (view, frame), Some(timestamps))
    }

    /// Names of the passes of a frame in order.
    pub fn pass_labels(&self) -> Vec<&str> {
        self.sized.chain.labels()
    }

    /// Width and height of its frames [px].
    pub fn size(&self) -> (usize, usize) {
        self.sized.chain.size
    }

    /// Bytes on the device that the passes hand over.
    pub fn memory_bytes(&self) -> u64 {
        self.sized.memory_bytes
    }
}

/// The shader of a method's search, before its filter.
///
/// # Errors
/// When it has none.
fn shader(of: (Precision, &Options), method: &Classic) -> Result<Shader> {
    Ok(match method {
        Classic::Ssao(params) => ssao::shader(of, params),
        Classic::Hbao(params) => hbao::shader(of, params),
        Classic::Ssdo(params) => ssdo::shader(of, params),
        Classic::Gtao(params) => gtao::shader(of, params),
        Classic::Vbao(params) => vbao::shader(of, params),
        Classic::Agtao(params) => agtao::shader(of, params),
        Classic::Nnao(_) => {
            let expected = "ssao, hbao, ssdo, gtao, vbao or agtao";
            return Err(Error::value("method on a graphics device", expected, method.name()));
        }
    })
}

impl Sized {
    fn new(
        (context, options): (&Context, &Options),
        compiler: &Compiler,
        method: &Classic,
        size: (usize, usize),
    ) -> Result<Self> {
        crate::Size::new(size.0, size.1)?;
        view::check_size(&context.device, size)?;
        scoped(&context.device, "session", || {
            let pixels = || context.storage("visibility", size.0 * size.1 * size_of::<f32>());
            let buffers = [pixels()?, pixels()?];
            let (mut passes, pyramid_bytes) =
                search_passes((context, options), compiler, (method, &buffers[0]), size)?;
            let filter = method.denoise();
            for i in 0..filter.passes as usize {
                let shader = denoise::shader((context.precision, options), filter);
                let way = [&buffers[i % 2], &buffers[(i + 1) % 2]];
                passes.push(denoise::pass((compiler, shader), way, size));
            }
            let last = Raw::Pixels(&buffers[filter.passes as usize % 2]);
            let image = Image::new((context, options), compiler, last, (1, size, None), false)?;
            let memory_bytes = pyramid_bytes + buffers.iter().map(wgpu::Buffer::size).sum::<u64>();
            Ok(Self { memory_bytes, chain: Chain { size, cleared: None, passes, image } })
        })
    }
}

/// The dispatches that fill `found`, and the bytes of what else they write.
fn search_passes(
    (context, options): (&Context, &Options),
    compiler: &Compiler,
    (method, found): (&Classic, &wgpu::Buffer),
    size: (usize, usize),
) -> Result<(Vec<Pass>, u64)> {
    let of = (context.precision, options);
    let recipe = Recipe { label: method.name(), shader: shader(of, method)?, sees_frame: true };
    let found = Binding::Write(found);
    let search = |bindings: &[Binding<'_>]| pixels::pass(compiler, &recipe, bindings, size);
    let around = |samples: Vec<Sample>| {
        let samples = hemisphere::buffer(context, &samples)?;
        Ok((vec![search(&[found, Binding::Read(&samples)])], 0))
    };
    match method {
        Classic::Ssao(params) => around(ssao::samples(params)),
        Classic::Ssdo(params) => around(ssdo::samples(params)),
        Classic::Gtao(params) => {
            let pyramid = Pyramid::new(context, size)?;
            let [levels, coarse] = pyramid.bindings();
            let passes = pyramid.pass(compiler, (of, params), size).into_iter();
            Ok((passes.chain([search(&[found, levels, coarse])]).collect(), pyramid.bytes()))
        }
        Classic::Hbao(_) | Classic::Vbao(_) | Classic::Agtao(_) | Classic::Nnao(_) => {
            Ok((vec![search(&[found])], 0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::gpu::valid::{PRECISIONS, encodings, validate};
    use crate::search::gpu::pyramid;
    use crate::search::{GtaoParams, HORIZONS, SsaoParams, VbaoParams};

    /// Every branch that a parameter chooses.
    fn methods() -> impl Iterator<Item = Classic> {
        let all = Classic::all().into_iter().filter(|m| !matches!(m, Classic::Nnao(_)));
        all.chain([
            Classic::Gtao(GtaoParams { depth_levels: 1, ..GtaoParams::default() }),
            Classic::Vbao(VbaoParams { cosine: 1, ..VbaoParams::default() }),
            Classic::Ssao(SsaoParams { hemisphere: 0, ..SsaoParams::default() }),
        ])
    }

    #[test]
    fn every_shader_is_valid() {
        for precision in PRECISIONS {
            for options in encodings() {
                let of = (precision, &options);
                for method in methods() {
                    validate(shader(of, &method).unwrap().source(), &format!("{method:?}"));
                }
                validate(pyramid::shader(of, &GtaoParams::default()).source(), "pyramid");
                validate(denoise::shader(of, HORIZONS.denoise()).source(), "denoise");
            }
        }
    }
}

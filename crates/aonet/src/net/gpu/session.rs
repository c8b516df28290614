//! A model ready to run at one size.

use crate::error::{Error, Result};
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::{Frame, Kernels, Options, Precision};
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::chain::{Chain, Timestamps};
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::device::scoped;
use crate::gpu::wgpu_30::view::{Textures, View, check_size};
use crate::net::config::Channel;
use crate::net::gpu::features::{self, Extras};
use crate::net::gpu::head::Head;
use crate::net::gpu::memory::Memory;
use crate::net::gpu::network::{Network, Weighed};
use crate::net::model::Model;
use crate::net::plan::Plan;
use crate::search::gpu::agtao::{self, Horizons};
use std::sync::Arc;

/// A network and its memory on a device, for frames of one size.
#[derive(Debug)]
pub struct Session {
    network: Arc<Network>,
    sized: Sized,
}

/// What depends on the size.
#[derive(Debug)]
struct Sized {
    plan: Plan,
    memory: Memory,
    extras: Extras,
    raw: wgpu::Buffer,
    chain: Chain,
}

impl Session {
    /// A session for frames of `size` (width, height) [px].
    ///
    /// # Errors
    /// When a side is 0 or too large for the device, or the device lacks what WebGPU promises or does not have enough
    /// memory.
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        model: &Model,
        size: (usize, usize),
        options: Options,
    ) -> Result<Self> {
        let network = scoped(device, "network", || Network::new((device, queue), model, options))?;
        Self::of(Arc::new(network), size)
    }

    /// Another session with the same weights and shaders, for frames of another size.
    ///
    /// # Errors
    /// As [`Session::resize`].
    pub fn sibling(&self, size: (usize, usize)) -> Result<Self> {
        Self::of(Arc::clone(&self.network), size)
    }

    fn of(network: Arc<Network>, size: (usize, usize)) -> Result<Self> {
        let sized = Sized::new(&network, size)?;
        Ok(Self { network, sized })
    }

    /// Changes the size of the frames to `size` (width, height) [px]; views of another size are of no use then. After an
    /// error the session is as before.
    ///
    /// # Errors
    /// When a side is 0 or too large for the device, or there is not enough memory.
    pub fn resize(&mut self, size: (usize, usize)) -> Result<()> {
        self.sized = Sized::new(&self.network, size)?;
        Ok(())
    }

    /// A view of a frame's textures; one for each camera that sees a frame.
    ///
    /// # Errors
    /// When a texture has another size, format or usage than the session needs.
    pub fn view(&self, textures: Textures<'_>) -> Result<View> {
        let network = &self.network;
        let of = (self.sized.plan.size, network.options.output);
        View::new(&network.context.device, &network.compiler.view_layout, of, textures)
    }

    /// Encodes the passes of a frame: they read the normal and depth of `view` and write its visibility, in [0, 1],
    /// 1 on the background. Waits for nothing, reads nothing back and allocates no memory on the device.
    ///
    /// The frame's numbers are written when the encoder's commands are submitted next: a view that is encoded twice in
    /// one submission sees the second camera twice. Views of one session share its memory and run one after the other.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, view: &View, frame: &Frame) -> Result<()> {
        let Network { context, options, .. } = &*self.network;
        self.sized.chain.encode((context, options), encoder, (view, frame), None)
    }

    /// [`Session::encode`] with every pass on its own and timed.
    ///
    /// # Errors
    /// As [`Session::encode`].
    pub fn encode_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        frame: &Frame,
        timestamps: Timestamps<'_>,
    ) -> Result<()> {
        let Network { context, options, .. } = &*self.network;
        self.sized.chain.encode((context, options), encoder, (view, frame), Some(timestamps))
    }

    /// Names of the passes of a frame in order.
    pub fn pass_labels(&self) -> Vec<&str> {
        self.sized.chain.labels()
    }

    /// What runs.
    pub fn plan(&self) -> &Plan {
        &self.sized.plan
    }

    /// The numbers that it computes with: see [`Options::precision`].
    pub fn precision(&self) -> Precision {
        self.network.context.precision
    }

    /// The instructions that it computes with: see [`Options::kernels`].
    pub fn kernels(&self) -> Kernels {
        self.network.context.kernels
    }

    /// Bytes of activations on the device; weights not included.
    pub fn memory_bytes(&self) -> u64 {
        let Sized { memory, extras, raw, .. } = &self.sized;
        let horizons = extras.horizons.as_ref().map_or(0, |h| h.found.size() + h.filtered.size());
        memory.bytes() + raw.size() + horizons
    }
}

impl Sized {
    fn new(network: &Network, (width, height): (usize, usize)) -> Result<Self> {
        let plan = Plan::new(&network.graph, width, height)?;
        check_size(&network.context.device, (width, height))?;
        scoped(&network.context.device, "session", || Self::of_plan(network, plan))
    }

    fn of_plan(network: &Network, plan: Plan) -> Result<Self> {
        let Network { context, options, compiler, .. } = network;
        let memory = Memory::new(context, &plan.buffers)?;
        let extras = extras(context, network, plan.size)?;
        let raw = context.storage("visibility", Head::raw_len(&plan) * size_of::<f32>())?;
        let surface = surface(context.precision, options);
        let mut passes: Vec<_> =
            features::depth_range_pass(surface, compiler, plan.size, &extras).into_iter().collect();
        let horizons = extras.horizons.as_ref();
        passes.extend(agtao::passes((context.precision, options), compiler, plan.size, horizons));
        let image = |of: Raw<'_>, patch: usize, corrects: bool| {
            let cells = (plan.padded.0 / patch, plan.padded.1 / patch);
            Image::new(
                (context, options),
                compiler,
                of,
                (patch, cells, horizons.map(|h| &h.filtered)),
                corrects,
            )
        };
        let mut last = None;
        for step in &network.steps {
            match step {
                Weighed::Features { output, patch } => {
                    let of = (context, options, network.features);
                    passes.push(features::pass(of, compiler, (&plan, &memory, &extras), (*output, *patch))?);
                }
                Weighed::Conv(conv) => passes.push(conv.pass(context, compiler, (&plan, &memory))?),
                Weighed::Head { head, corrects, patch } => {
                    passes.push(head.pass(context, compiler, (&plan, &memory), &raw)?);
                    last = Some(image(Raw::Pixels(&raw), *patch, *corrects)?);
                }
                Weighed::Image { input } => {
                    last = Some(image(Raw::FirstChannel(memory.of(*input)), 1, false)?)
                }
            }
        }
        let image = last.ok_or_else(|| Error::config("graph", "an image at the end", "none"))?;
        let chain = Chain { size: plan.size, cleared: extras.depth_range.clone(), passes, image };
        Ok(Self { plan, memory, extras, raw, chain })
    }
}

/// What the features need besides the textures.
fn extras(context: &Context, network: &Network, (width, height): (usize, usize)) -> Result<Extras> {
    let sees = |channel: Channel| network.features.channels().contains(&channel);
    let range = || context.storage("depth range", 2 * size_of::<u32>());
    let pixels = || context.storage("horizon visibility", width * height * size_of::<f32>());
    let horizons = || Ok(Horizons { found: pixels()?, filtered: pixels()? });
    Ok(Extras {
        depth_range: sees(Channel::DepthNormalized).then(range).transpose()?,
        horizons: sees(Channel::HorizonOcclusion).then(horizons).transpose()?,
    })
}

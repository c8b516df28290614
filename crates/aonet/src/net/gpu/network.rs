//! A model as programs: weights are packed once, for frames of every size.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::{Layers, ProgramOptions};
use crate::gpu::program::{self, Arithmetic, Binding, Describe, Dispatches, Draw, Program};
use crate::gpu::surface::Surface;
use crate::net::config::{Channel, Features, SearchConfig};
use crate::net::gpu::context::Context;
use crate::net::gpu::conv::Conv;
use crate::net::gpu::features::{self, Target};
use crate::net::gpu::head::Head;
use crate::net::gpu::memory::Memory;
use crate::net::graph::Graph;
use crate::net::model::Model;
use crate::net::plan::{BufferId, Plan, Step};
use crate::search::gpu::{agtao, arcs, denoise, pixels, surfels};

/// Sources of a convolution at most: with weights, bias and output they are within the eight storage buffers that
/// every device has.
const MAX_SOURCES: usize = 4;

/// A model that describes its programs.
#[derive(Debug)]
pub struct Network {
    pub(crate) arithmetic: Arithmetic,
    surface: Surface,
    features: Features,
    graph: Graph,
    steps: Vec<PackedStep>,
}

/// A step of a plan with its packed weights.
#[derive(Debug)]
enum PackedStep {
    /// Normals of the second layer.
    Surfels {
        output: BufferId,
    },
    Search {
        search: SearchConfig,
        surfels: Option<BufferId>,
        output: BufferId,
    },
    Filter {
        search: SearchConfig,
        input: BufferId,
        output: BufferId,
    },
    Features {
        search: Option<BufferId>,
        output: BufferId,
        patch: usize,
    },
    Conv(Conv),
    Head {
        head: Head,
        patch: usize,
        base: Option<(BufferId, usize)>,
    },
    Image {
        input: BufferId,
    },
}

impl Network {
    /// Packs the weights of a model. Half floats come to 32-bit ones where the features of the network do not fit in them.
    ///
    /// # Errors
    /// When a convolution has more inputs than shaders can read.
    pub fn new(model: &Model, options: ProgramOptions) -> Result<Self> {
        let ProgramOptions { precision, kernels, textures } = options;
        let features = model.config().features.clone();
        let precision = precision.of(&features);
        let arithmetic = Arithmetic { precision, kernels: kernels.of(precision) };
        // Its steps are those of every size.
        let plan = Plan::new(model.graph(), Size::px(1, 1))?;
        let steps = plan.steps.iter().map(|step| PackedStep::new(step, &plan, model, arithmetic));
        Ok(Self {
            steps: steps.collect::<Result<_>>()?,
            surface: Surface { precision, textures },
            arithmetic,
            features,
            graph: model.graph().clone(),
        })
    }

    /// Adds the dispatches of a plan to the list; returns the draw that ends them.
    fn push(&self, plan: &Plan, list: &mut Dispatches) -> Result<Draw> {
        let memory = Memory::new(self.arithmetic, &plan.buffers, list);
        let Self { arithmetic, surface, .. } = *self;
        let depth_range = (self.features.sees(Channel::DepthNormalized))
            .then(|| features::depth_range::push(surface, plan.size, list));
        let context = Context { arithmetic, surface, plan, memory: &memory };
        let mut last = None;
        for step in &self.steps {
            last = self.push_step(step, &context, depth_range, list).or(last);
        }
        let last = last.ok_or_else(|| Error::config("graph", "an image at the end", "none"))?;
        Ok(last.draw(surface, list))
    }

    /// Adds the dispatches of a step to the list; returns the image that the step ends with, if it does.
    fn push_step(
        &self,
        step: &PackedStep,
        context: &Context<'_>,
        depth_range: Option<program::BufferId>,
        list: &mut Dispatches,
    ) -> Option<Image> {
        let Context { surface, plan, memory, .. } = *context;
        let place = |id: &BufferId| memory.of(*id);
        match step {
            PackedStep::Surfels { output } => {
                if surface.textures.layers == Layers::Two {
                    surfels::push_into(place(output), surface, plan.size, list);
                }
            }
            PackedStep::Search { search, surfels, output } => {
                let shader = match search {
                    SearchConfig::Agtao(params) => agtao::shader(surface, params),
                    SearchConfig::Arcs(params) => arcs::shader(surface, params, search.planes()),
                };
                let seen = surfels.filter(|_| surface.textures.layers == Layers::Two);
                let mut bindings = vec![Binding::Write(place(output))];
                bindings.extend(seen.map(|surfels| Binding::Read(place(&surfels))));
                pixels::push(search.method().name(), shader, &bindings, plan.size, list);
            }
            PackedStep::Filter { search, input, output } => {
                let shader = denoise::shader(surface, search.filter(), search.planes());
                denoise::push(shader, [place(input), place(output)], plan.size, list);
            }
            PackedStep::Features { search, output, patch } => {
                let search = search.as_ref().map(place);
                let target = Target { output: *output, patch: *patch, depth_range, search };
                features::push(&self.features, target, context, list);
            }
            PackedStep::Conv(conv) => conv.push(context, list),
            PackedStep::Head { head, patch, base } => {
                let raw = list.storage("visibility", head.raw_len(plan) * size_of::<f32>());
                head.push(context, raw, list);
                let cells = plan.cells(*patch);
                return Some(Image {
                    raw: Raw::Pixels(raw),
                    patch: *patch,
                    cells,
                    base: base.as_ref().map(|(found, planes)| (place(found), *planes)),
                });
            }
            PackedStep::Image { input } => {
                let raw = Raw::FirstChannel(place(input));
                return Some(Image { raw, patch: 1, cells: plan.padded, base: None });
            }
        }
        None
    }
}

impl Describe for Network {
    fn program(&self, size: Size) -> Result<Program> {
        let mut list = Dispatches::default();
        let image = self.push(&Plan::new(&self.graph, size)?, &mut list)?;
        let (textures, arithmetic) = (self.surface.textures, self.arithmetic);
        Ok(Program { size, textures, arithmetic, dispatches: list, image, trusted: true })
    }
}

impl PackedStep {
    fn new(step: &Step, plan: &Plan, model: &Model, arithmetic: Arithmetic) -> Result<Self> {
        let weights = model.weights();
        Ok(match step {
            // Shaders read the normals of the first layer from its texture.
            Step::Surfels { outputs: [_, second] } => Self::Surfels { output: *second },
            Step::Search { search, surfels, output } => {
                Self::Search { search: *search, surfels: surfels.map(|[_, second]| second), output: *output }
            }
            Step::Filter { search, input, output } => {
                Self::Filter { search: *search, input: *input, output: *output }
            }
            Step::Features { search, output, patch } => {
                Self::Features { search: *search, output: *output, patch: *patch }
            }
            Step::Conv(conv) => {
                if conv.sources.len() > MAX_SOURCES {
                    let expected = format!("at most {MAX_SOURCES} inputs side by side");
                    return Err(Error::config(&conv.name, expected, conv.sources.len()));
                }
                Self::Conv(Conv::new(arithmetic, plan, weights, conv))
            }
            Step::Head(step) => {
                let head = Head::new(arithmetic, plan, weights, step);
                Self::Head { head, patch: step.patch, base: step.base.map(|found| (found, step.planes)) }
            }
            Step::Image { input } => Self::Image { input: *input },
        })
    }
}

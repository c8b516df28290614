//! A model as programs: weights are packed once, for frames of every size.

use crate::error::{Error, Result};
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::ProgramOptions;
use crate::gpu::program::{Arithmetic, Binding, Describe, Dispatches, Draw, Program};
use crate::gpu::surface::Surface;
use crate::net::config::{Channel, Features, SearchConfig};
use crate::net::gpu::conv::Conv;
use crate::net::gpu::features::{self, Extras};
use crate::net::gpu::head::Head;
use crate::net::gpu::memory::Memory;
use crate::net::graph::Graph;
use crate::net::model::Model;
use crate::net::plan::{BufferId, Plan, Step};
use crate::search::gpu::{agtao, denoise, pixels};

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
    steps: Vec<Weighed>,
}

/// A step of a plan with its weights.
#[derive(Debug)]
enum Weighed {
    Search { search: SearchConfig, output: BufferId },
    Filter { search: SearchConfig, input: BufferId, output: BufferId },
    Features { search: Option<BufferId>, output: BufferId, patch: usize },
    Conv(Conv),
    Head { head: Head, patch: usize, base: Option<BufferId> },
    Image { input: BufferId },
}

/// What the dispatches of one size have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sized<'a> {
    pub(crate) arithmetic: Arithmetic,
    pub(crate) surface: Surface,
    pub(crate) plan: &'a Plan,
    pub(crate) memory: &'a Memory,
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
        let plan = Plan::new(model.graph(), 1, 1)?;
        let steps = plan.steps.iter().map(|step| Weighed::new(step, &plan, model, arithmetic));
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
        let Self { arithmetic, surface, ref features, .. } = *self;
        let depth_range = features
            .sees(Channel::DepthNormalized)
            .then(|| features::depth_range::push(surface, plan.size, list));
        let sized = Sized { arithmetic, surface, plan, memory: &memory };
        let image = |raw: Raw, patch: usize, base| Image {
            raw,
            patch,
            cells: (plan.padded.0 / patch, plan.padded.1 / patch),
            base,
        };
        let mut last = None;
        for step in &self.steps {
            match step {
                Weighed::Search { search, output } => match search {
                    SearchConfig::Agtao(params) => {
                        let shader = agtao::shader(surface, params);
                        let output = Binding::Write(memory.of(*output));
                        pixels::push(("agtao", shader), &[output], plan.size, list);
                    }
                },
                Weighed::Filter { search, input, output } => {
                    let shader = denoise::shader(surface, search.filter());
                    denoise::push(shader, [*input, *output].map(|id| memory.of(id)), plan.size, list);
                }
                Weighed::Features { search, output, patch } => {
                    let extras = Extras { depth_range, search: search.map(|id| memory.of(id)) };
                    features::push(features, (&sized, extras), (*output, *patch), list);
                }
                Weighed::Conv(conv) => conv.push(&sized, list),
                Weighed::Head { head, patch, base } => {
                    let raw = list.storage("visibility", Head::raw_len(plan) * size_of::<f32>());
                    head.push(&sized, raw, list);
                    last = Some(image(Raw::Pixels(raw), *patch, base.map(|id| memory.of(id))));
                }
                Weighed::Image { input } => {
                    last = Some(image(Raw::FirstChannel(memory.of(*input)), 1, None));
                }
            }
        }
        let last = last.ok_or_else(|| Error::config("graph", "an image at the end", "none"))?;
        Ok(last.draw(surface, list))
    }
}

impl Describe for Network {
    fn program(&self, size: (usize, usize)) -> Result<Program> {
        let mut list = Dispatches::default();
        let image = self.push(&Plan::new(&self.graph, size.0, size.1)?, &mut list)?;
        let (textures, arithmetic) = (self.surface.textures, self.arithmetic);
        Ok(Program { size, textures, arithmetic, dispatches: list, image, trusted: true })
    }
}

impl Weighed {
    fn new(step: &Step, plan: &Plan, model: &Model, arithmetic: Arithmetic) -> Result<Self> {
        let weights = model.weights();
        Ok(match step {
            Step::Search { search, output } => Self::Search { search: *search, output: *output },
            Step::Filter { search, input, output } => {
                Self::Filter { search: *search, input: *input, output: *output }
            }
            Step::Features { search, output, patch } => {
                Self::Features { search: *search, output: *output, patch: *patch }
            }
            Step::Conv { name, sources, output, size, groups, activation } => {
                if sources.len() > MAX_SOURCES {
                    let expected = format!("at most {MAX_SOURCES} inputs side by side");
                    return Err(Error::config(name, expected, sources.len()));
                }
                let of = (name.as_str(), &sources[..], *output, [*size, *groups], *activation);
                Self::Conv(Conv::new(arithmetic, plan, weights, of))
            }
            Step::Head { name, input, guide, patch, kernel, base } => {
                let head = Head::new(arithmetic, plan, weights, (name, [*input, *guide], *patch, *kernel));
                Self::Head { head, patch: *patch, base: *base }
            }
            Step::Image { input } => Self::Image { input: *input },
        })
    }
}

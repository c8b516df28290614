//! A model as programs: weights are packed once, for frames of every size.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::{BentEncoding, ProgramOptions};
use crate::gpu::program::{self, Arithmetic, Binding, Describe, Dispatches, Draw, Program, Template};
use crate::gpu::surface::Surface;
use crate::net::config::{Channel, Features, SearchConfig};
use crate::net::gpu::context::Context;
use crate::net::gpu::conv::Conv;
use crate::net::gpu::features::{self, Target};
use crate::net::gpu::grids::{Grids, smallest_bent_plan, smallest_plan};
use crate::net::gpu::head::Head;
use crate::net::gpu::memory::Memory;
use crate::net::gpu::survey;
use crate::net::model::Model;
use crate::net::plan::{BufferId, HeadStep, Plan, Step};
use crate::search::gpu::{agtao, arcs, bent, denoise, pixels, surfels};

/// Sources of a convolution at most: with weights, bias and output they are within the eight storage buffers that
/// every device has.
const MAX_SOURCES: usize = 4;

/// A model that describes its programs.
#[derive(Debug)]
pub struct Network {
    pub(crate) arithmetic: Arithmetic,
    surface: Surface,
    features: Features,
    /// The smallest one: its steps are those of every size.
    plan: Plan,
    /// What the search found, its bend included, and how bent normals are drawn, where they are asked for.
    bent: Option<(BufferId, BentEncoding)>,
    /// In the order of the plan's steps.
    convs: Vec<Conv>,
    head: Option<Head>,
}

impl Network {
    /// Packs the weights of a model. Half floats come to 32-bit ones where the features of the network do not fit in them.
    ///
    /// # Errors
    /// When a convolution has more inputs than shaders can read.
    pub fn new(model: &Model, options: ProgramOptions) -> Result<Self> {
        Self::of(model, options, (smallest_plan(model.graph())?, None))
    }

    /// A model that draws bent normals as well.
    ///
    /// # Errors
    /// As [`Network::new`], and when the network has no search.
    pub fn with_bent_normals(model: &Model, options: ProgramOptions, encoding: BentEncoding) -> Result<Self> {
        let (plan, bent) = smallest_bent_plan(model.graph())?;
        Self::of(model, options, (plan, Some((bent, encoding))))
    }

    fn of(
        model: &Model,
        options: ProgramOptions,
        (plan, bent): (Plan, Option<(BufferId, BentEncoding)>),
    ) -> Result<Self> {
        let ProgramOptions { precision, kernels, textures } = options;
        let features = model.config().features.clone();
        let precision = precision.of(&features);
        let arithmetic = Arithmetic { precision, kernels: kernels.of(precision) };
        let (mut convs, mut head) = (Vec::new(), None);
        for step in &plan.steps {
            match step {
                Step::Conv(conv) if conv.sources.len() > MAX_SOURCES => {
                    let expected = format!("at most {MAX_SOURCES} inputs side by side");
                    return Err(Error::config(&conv.name, expected, conv.sources.len()));
                }
                Step::Conv(conv) => convs.push(Conv::new(arithmetic, &plan, model.weights(), conv)),
                Step::Head(step) => head = Some(Head::new(arithmetic, &plan, model.weights(), step)),
                Step::Surfels { .. }
                | Step::Search { .. }
                | Step::Filter { .. }
                | Step::Smooth { .. }
                | Step::Features { .. }
                | Step::Survey { .. }
                | Step::Image { .. } => {}
            }
        }
        Ok(Self { convs, head, surface: Surface { precision, textures }, arithmetic, features, plan, bent })
    }

    /// The programs of every size.
    ///
    /// # Errors
    /// When the network has no image at its end.
    pub fn template(&self) -> Result<Template> {
        let mut dispatches = Dispatches::default();
        let (image, bent) = self.push(&mut dispatches)?;
        let (textures, arithmetic) = (self.surface.textures, self.arithmetic);
        Ok(Template { textures, arithmetic, dispatches, image, bent, trusted: true })
    }

    /// Adds the dispatches to the list; returns the draws that end them.
    fn push(&self, list: &mut Dispatches) -> Result<(Draw, Option<Draw>)> {
        let Self { arithmetic, surface, ref plan, .. } = *self;
        let grids = Grids::new(plan);
        let memory = Memory::new(&plan.buffers, &grids, list);
        let depth_range = (self.features.sees(Channel::DepthNormalized))
            .then(|| features::depth_range::push(surface, list));
        let context = Context { arithmetic, surface, plan, grids: &grids, memory: &memory };
        let mut convs = self.convs.iter();
        let place = |id: &BufferId| memory.of(*id);
        let mut image = None;
        for step in &plan.steps {
            match step {
                Step::Surfels { outputs } => {
                    surfels::push_into(&outputs.each_ref().map(place), surface, list);
                }
                Step::Search { search, surfels, output } => {
                    let packed = surfels.as_ref().map(|buffers| buffers.each_ref().map(place));
                    let planes = plan.buffers[*output].channels;
                    push_search((search, planes), surface, (packed, place(output)), list);
                }
                Step::Filter { search, pass, input, output } => {
                    let by = (search.filter(), *pass);
                    let shader = denoise::shader(surface, by, plan.buffers[*output].channels);
                    denoise::push(shader, [place(input), place(output)], list);
                }
                Step::Smooth { search, pass, .. } => {
                    let corrected: Image = image.take().expect("smoothing follows the head");
                    image = Some(corrected.smoothed((search.filter(), *pass), surface, list));
                }
                Step::Features { search, output, patch } => {
                    let search = search.as_ref().map(place);
                    let target = Target { output: *output, patch: *patch, depth_range, search };
                    features::push(&self.features, target, &context, list);
                }
                Step::Survey { arcs, surfels, output, patch } => {
                    let packed = surfels.each_ref().map(place);
                    survey::push(arcs, (packed, *output), *patch, (&context, list));
                }
                Step::Conv(_) => convs.next().expect("packed for every size").push(&context, list),
                Step::Head(HeadStep { patch, planes, base, .. }) => {
                    let head = self.head.as_ref().expect("packed for every size");
                    let raw = list.storage("visibility", head.raw_len(&grids) * size_of::<f32>().into());
                    head.push(&context, raw, list);
                    let base = base.as_ref().map(|found| (place(found), *planes));
                    image = Some(Image {
                        raw: Raw::Pixels(raw),
                        patch: *patch,
                        cells: grids.patches(*patch),
                        base,
                    });
                }
                Step::Image { input } => {
                    let raw = Raw::FirstChannel(place(input));
                    image = Some(Image { raw, patch: 1, cells: grids.padded.clone(), base: None });
                }
            }
        }
        let image = image.ok_or_else(|| Error::config("graph", "an image at the end", "none"))?;
        let image = image.draw(surface, list);
        let bent = self.bent.map(|(found, encoding)| {
            bent::draw((place(&found), plan.buffers[found].channels), encoding, surface, list)
        });
        Ok((image, bent))
    }
}

/// Adds the dispatch of a search that reports so many values for a pixel; it reads packed normals, if it follows planes, and
/// writes the output.
fn push_search(
    (search, planes): (&SearchConfig, usize),
    surface: Surface,
    (packed, output): (Option<[program::BufferId; 2]>, program::BufferId),
    list: &mut Dispatches,
) {
    let shader = match search {
        SearchConfig::Agtao(params) => agtao::shader(surface, params, planes),
        SearchConfig::Arcs(params) => arcs::shader(surface, params, planes),
    };
    let mut bindings = vec![Binding::Write(output)];
    bindings.extend(packed.iter().flat_map(|packed| surfels::read(packed, surface)));
    pixels::push(search.method().name(), shader, &bindings, list);
}

impl Describe for Network {
    fn program(&self, size: Size) -> Result<Program> {
        self.template()?.at(size)
    }
}

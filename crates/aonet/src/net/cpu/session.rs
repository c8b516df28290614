//! A model ready to run at one size.

use super::context::Context;
use super::conv::Conv;
use super::features::PartitionFeatures;
use super::head::Head;
use super::image::Image;
use super::precision::{Arithmetic, Precision};
use super::recipe::Recipe;
use super::search::{Filter, Search, Smooth, Surfels, Survey};
use super::winograd::{self, Winograd};
use crate::error::{Error, Result};
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::bent_normals::BentNormals;
use crate::frame::gbuffer::GBuffer;
use crate::frame::window::Window;
use crate::net::config::Features;
use crate::net::model::Model;
use crate::net::plan::{BufferId, Plan, Step};
use crate::search::{Screen, bent};
use crate::simd::aligned::Aligned;
use crate::simd::{Isa, Level};
use crate::threads::Workers;

/// How a session computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Threads, the caller's included.
    pub threads: usize,
    /// Vector instructions.
    pub level: Level,
    /// Numbers that are multiplied.
    pub precision: Precision,
}

impl Default for Options {
    /// One thread, the best instructions of this machine, f32.
    fn default() -> Self {
        Self { threads: 1, level: Level::best(), precision: Precision::F32 }
    }
}

/// A network, its memory and its threads, for frames of one size.
///
/// What lies between convolutions is f32; a result does not depend on the number of threads.
#[derive(Debug)]
pub struct Session {
    window: Window,
    /// Visibility of picture and guard band, where there is one.
    guarded: Option<AoImage>,
    plan: Plan,
    /// Visibility and bend of the search, where they are asked for.
    bent: Option<BufferId>,
    features: Features,
    precision: Precision,
    isa: Isa,
    workers: Workers,
    arena: Aligned,
    steps: Vec<Prepared>,
}

/// A step of the plan with its weights.
#[derive(Debug)]
enum Prepared {
    Surfels(Surfels),
    Search(Search),
    Filter(Filter),
    Smooth(Smooth),
    Features(PartitionFeatures),
    Survey(Survey),
    Conv(Conv),
    Winograd(Winograd),
    Head(Box<Head>),
    Image(Image),
}

impl Session {
    /// A session for pictures of a size, or for a window of one and its guard band, in f32 and with the best
    /// instructions of this machine. The caller of [`Session::run`] is one of the `threads`.
    ///
    /// # Errors
    /// When `threads` is 0, a thread cannot be started, or there is not enough memory.
    pub fn new(model: &Model, window: impl Into<Window>, threads: usize) -> Result<Self> {
        Self::with_options(model, window, Options { threads, ..Options::default() })
    }

    /// [`Session::new`] with a choice of numbers and instructions.
    ///
    /// # Errors
    /// As [`Session::new`], when the machine does not have the instructions, and when the model does not know the ranges that
    /// integers need.
    pub fn with_options(model: &Model, window: impl Into<Window>, options: Options) -> Result<Self> {
        let window = window.into();
        Self::of((Plan::new(model.graph(), window.buffer_size())?, None), model, window, options)
    }

    /// [`Session::with_options`] for [`Session::run_with_bent_normals`]. The bent normals are those of the network's search.
    ///
    /// # Errors
    /// As [`Session::with_options`], and when the network has no search.
    pub fn with_bent_normals(model: &Model, window: impl Into<Window>, options: Options) -> Result<Self> {
        let window = window.into();
        let (plan, bent) = Plan::with_bent_normals(model.graph(), window.buffer_size())?;
        Self::of((plan, Some(bent)), model, window, options)
    }

    fn of(
        (plan, bent): (Plan, Option<BufferId>),
        model: &Model,
        window: Window,
        options: Options,
    ) -> Result<Self> {
        let Options { threads, level, precision } = options;
        let arithmetic = Arithmetic::new(level, precision)?;
        let isa = arithmetic.isa();
        let recipe = Recipe { plan: &plan, weights: model.weights(), arithmetic, ranges: model.ranges() };
        let steps: Vec<_> =
            plan.steps.iter().map(|step| Prepared::new(step, &recipe)).collect::<Result<_>>()?;
        let scratch_len = steps.iter().map(Prepared::scratch_len).max().unwrap_or(0);
        let workers = Workers::new(threads, scratch_len)?;
        let arena = Aligned::zeros(plan.arena_len)?;
        let features = model.config().features.clone();
        let guarded = window.has_margin().then(|| AoImage::open(plan.size));
        Ok(Self { window, guarded, features, plan, bent, precision, isa, workers, arena, steps })
    }

    /// Writes the visibility of a frame's picture: in [0, 1], 1 on the background. Allocates nothing.
    ///
    /// # Errors
    /// When the frame has another size or margin than the session, or the image another size than its picture.
    pub fn run(&mut self, gbuffer: &GBuffer, params: AoParams, image: &mut AoImage) -> Result<()> {
        self.run_observed(gbuffer, params, image, &mut |_| ())
    }

    /// [`Session::run`] that also writes the picture's bent normals. Allocates nothing.
    ///
    /// # Errors
    /// As [`Session::run`]; also when the session is not one of [`Session::with_bent_normals`], or `bent` has another size.
    pub fn run_with_bent_normals(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        bent: &mut BentNormals,
    ) -> Result<()> {
        bent::check(self.bent.is_some(), self.window, bent)?;
        self.run(gbuffer, params, image)?;
        let planes = self.bent.map(|id| self.plan.buffers[id].range()).unwrap_or_default();
        bent::write(&mut self.workers, gbuffer, &self.arena[planes], bent);
        Ok(())
    }

    /// [`Session::run`] that calls `after_step` with the index of every step of the plan when the step is done: for
    /// whoever has a clock. Allocates nothing itself.
    ///
    /// # Errors
    /// As [`Session::run`]; no step has run then.
    pub fn run_observed(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        after_step: &mut dyn FnMut(usize),
    ) -> Result<()> {
        self.run_steps(gbuffer, params, image, &mut |i, _, _| after_step(i))
    }

    /// The same for whoever wants to see the arena after a step, too.
    pub(super) fn run_steps(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        after_step: &mut dyn FnMut(usize, &Plan, &[f32]),
    ) -> Result<()> {
        if gbuffer.window() != self.window {
            return Err(Error::size("G-buffer of a session", self.window, gbuffer.window()));
        }
        self.window.size().expect("AO image of a session", image.size())?;
        let mut guarded = self.guarded.take();
        let buffer = guarded.as_mut().unwrap_or(&mut *image);
        let screen = &Screen::new(gbuffer, params);
        for (i, step) in self.steps.iter().enumerate() {
            let context = Context { isa: self.isa, workers: &mut self.workers, arena: &mut self.arena };
            match step {
                Prepared::Surfels(step) => step.run(context, screen),
                Prepared::Search(step) => step.run(context, screen),
                Prepared::Filter(step) => step.run(context, screen),
                Prepared::Smooth(step) => step.run(context, screen, buffer),
                Prepared::Features(step) => step.run(context, &self.features, gbuffer, params),
                Prepared::Survey(step) => step.run(context, screen),
                Prepared::Conv(conv) => conv.run(context),
                Prepared::Winograd(conv) => conv.run(context),
                Prepared::Head(head) => head.run(context, gbuffer, buffer),
                Prepared::Image(step) => step.run(context, gbuffer, buffer),
            }
            after_step(i, &self.plan, &self.arena);
        }
        if let Some(guarded) = &guarded {
            self.window.crop(guarded.visibility(), image.visibility_mut());
        }
        self.guarded = guarded;
        Ok(())
    }

    /// Values in a vector: the size of a block of channels.
    pub(super) fn lanes(&self) -> usize {
        self.isa.lanes()
    }

    /// In which numbers it multiplies.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// What runs.
    #[doc(hidden)]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Bytes of activations and scratch memory; parameters and thread stacks not included.
    pub fn memory_bytes(&self) -> usize {
        self.arena.len() * size_of::<f32>() + self.workers.scratch_bytes()
    }
}

impl Prepared {
    fn new(step: &Step, recipe: &Recipe<'_>) -> Result<Self> {
        let plan = recipe.plan;
        let buffer = |id: BufferId| plan.buffers[id].clone();
        Ok(match step {
            Step::Surfels { outputs } => Self::Surfels(Surfels { outputs: outputs.map(buffer) }),
            Step::Search { search, surfels, output } => Self::Search(Search {
                search: *search,
                surfels: surfels.map(|surfels| surfels.map(buffer)),
                output: buffer(*output),
            }),
            Step::Filter { search, pass, input, output } => Self::Filter(Filter {
                search: *search,
                pass: *pass,
                input: buffer(*input),
                output: buffer(*output),
            }),
            Step::Smooth { search, pass, base, read } => Self::Smooth(Smooth {
                search: *search,
                pass: *pass,
                base: base.map(buffer),
                read: buffer(*read),
            }),
            Step::Features { search, output, patch } => Self::Features(PartitionFeatures {
                size: plan.size,
                patch: *patch,
                search: search.map(buffer),
                output: buffer(*output),
            }),
            Step::Survey { arcs, surfels, output, patch } => Self::Survey(Survey {
                arcs: *arcs,
                surfels: surfels.map(buffer),
                output: buffer(*output),
                patch: *patch,
            }),
            Step::Conv(step) => match winograd::pays(plan, step) && recipe.arithmetic.packed() <= 2 {
                true => Self::Winograd(Winograd::new(recipe, step)?),
                false => Self::Conv(Conv::new(recipe, step)?),
            },
            Step::Head(step) => Self::Head(Box::new(Head::new(recipe, step)?)),
            Step::Image { input } => Self::Image(Image { input: buffer(*input) }),
        })
    }

    fn scratch_len(&self) -> usize {
        match self {
            Self::Surfels(_) | Self::Search(_) | Self::Filter(_) | Self::Smooth(_) | Self::Survey(_) => 0,
            Self::Features(step) => step.scratch_len(),
            Self::Conv(conv) => conv.scratch_len(),
            Self::Winograd(conv) => conv.scratch_len(),
            Self::Head(head) => head.scratch_len(),
            Self::Image(_) => 0,
        }
    }
}

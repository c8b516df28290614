//! Programs of every size: numbers are formulas of the frames' width and height.

use super::numbers::{Contents, words};
use super::{Arithmetic, Binding, Buffer, Dispatches, Draw, Number, Pass, Program, ShaderId, Usage};
use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::options::{Precision, TextureEncoding};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Workgroups that keep a device busy: with fewer, a dispatch is cut finer. guess: two for each multiprocessor of a large device.
pub const ENOUGH_WORKGROUPS: u64 = 256;

/// What a GPU does for frames of any size. [`Template::at`] makes the [`Program`] of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Template {
    pub(crate) textures: TextureEncoding,
    pub(crate) arithmetic: Arithmetic,
    pub(crate) dispatches: Dispatches,
    pub(crate) image: Draw,
    /// Draws bent normals, where a session asks for them.
    pub(crate) bent: Option<Draw>,
    /// See [`Program`].
    pub(crate) trusted: bool,
}

/// A buffer whose size may depend on that of the frames.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TemplateBuffer {
    pub(crate) label: String,
    pub(crate) bytes: Number,
    pub(crate) usage: Usage,
    pub(crate) contents: Option<Initial>,
    pub(crate) cleared: bool,
}

/// What a buffer holds from the start.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Initial {
    /// Numbers of 32 bits, whatever the precision.
    Words(Contents),
    /// Numbers in the precision of the activations.
    Reals(Contents),
    /// Whole numbers of 32 bits that depend on the size.
    Numbers(Vec<Number>),
}

/// A dispatch of one of several shaders.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TemplatePass {
    pub(crate) label: String,
    pub(crate) sees_frame: bool,
    pub(crate) bindings: Vec<Binding>,
    /// The first with enough workgroups runs, else the last.
    pub(crate) variants: Vec<Variant>,
}

/// A shader and its workgroups in x, y and z.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Variant {
    pub(crate) shader: ShaderId,
    pub(crate) workgroups: [Number; 3],
}

impl Template {
    /// What the frame's textures must hold.
    pub fn textures(&self) -> TextureEncoding {
        self.textures
    }

    /// The numbers that it computes with.
    pub fn precision(&self) -> Precision {
        self.arithmetic.precision
    }

    /// Its shaders in WGSL. A program of one size has those that the size needs.
    pub fn shaders(&self) -> &[Arc<str>] {
        &self.dispatches.shaders
    }

    /// Number of dispatches and of the draws that end them.
    pub fn pass_count(&self) -> usize {
        self.dispatches.passes.len() + 1 + usize::from(self.bent.is_some())
    }

    /// The program for frames of `size`.
    ///
    /// # Errors
    /// When the buffers of a frame do not fit in memory, or a dispatch has more workgroups than 32 bits can count.
    pub fn at(&self, size: Size) -> Result<Program> {
        let Self { textures, arithmetic, trusted, .. } = *self;
        let mut parts = self.dispatches.at(size, arithmetic.precision)?;
        let mut placed = |draw: &Draw| {
            let shader = parts.shader(&self.dispatches.shaders[draw.shader]);
            Draw { shader, bindings: draw.bindings.clone() }
        };
        let (image, bent) = (placed(&self.image), self.bent.as_ref().map(placed));
        Ok(Program { size, textures, arithmetic, parts, image, bent, trusted })
    }
}

/// Buffers, shaders and dispatches of one size.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Parts {
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) shaders: Vec<Arc<str>>,
    pub(crate) passes: Vec<Pass>,
}

impl Parts {
    fn shader(&mut self, source: &Arc<str>) -> ShaderId {
        let found = self.shaders.iter().position(|shader| Arc::ptr_eq(shader, source));
        found.unwrap_or_else(|| {
            self.shaders.push(Arc::clone(source));
            self.shaders.len() - 1
        })
    }
}

impl Dispatches {
    /// What they are for frames of a size.
    ///
    /// # Errors
    /// As [`Template::at`].
    pub(crate) fn at(&self, size: Size, precision: Precision) -> Result<Parts> {
        let value = |number: &Number| {
            let found = number.at(size, precision).filter(|found| *found <= i64::MAX as u64);
            found.ok_or_else(|| Error::size("program", "an image that fits in memory", size))
        };
        let word = |number: &Number| {
            let found = u32::try_from(value(number)?);
            found.map_err(|_| Error::size("program", "numbers that fit in 32 bits", size))
        };
        let mut parts = Parts::default();
        for TemplateBuffer { label, bytes, usage, contents, cleared } in &self.buffers {
            let contents = match contents {
                None => None,
                Some(Initial::Words(bytes) | Initial::Reals(bytes)) => Some(Arc::clone(bytes)),
                Some(Initial::Numbers(numbers)) => {
                    Some(words(&numbers.iter().map(word).collect::<Result<Vec<_>>>()?))
                }
            };
            let (label, bytes) = (label.clone(), value(bytes)?);
            parts.buffers.push(Buffer { label, bytes, usage: *usage, contents, cleared: *cleared });
        }
        for pass in &self.passes {
            let mut chosen = None;
            for Variant { shader, workgroups: [x, y, z] } in &pass.variants {
                let workgroups = [word(x)?, word(y)?, word(z)?];
                chosen = Some((*shader, workgroups));
                let count = workgroups.iter().fold(1u64, |all, n| all.saturating_mul(u64::from(*n)));
                if count >= ENOUGH_WORKGROUPS {
                    break;
                }
            }
            let (shader, workgroups) = chosen.expect("a pass has a shader");
            let shader = parts.shader(&self.shaders[shader]);
            let TemplatePass { label, sees_frame, bindings, .. } = pass.clone();
            parts.passes.push(Pass { label, shader, sees_frame, bindings, workgroups });
        }
        Ok(parts)
    }
}

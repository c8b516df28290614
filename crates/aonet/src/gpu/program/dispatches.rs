//! A list of dispatches that grows, for frames of any size.

use super::numbers::Contents;
use super::template::{Initial, TemplateBuffer, TemplatePass, Variant};
use super::{Binding, BufferId, Number, ShaderId, Usage};
use crate::gpu::shader::Shader;
use std::sync::Arc;

/// Buffers, shaders and dispatches so far. Passes with the same source share a shader.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Dispatches {
    pub(crate) buffers: Vec<TemplateBuffer>,
    pub(crate) shaders: Vec<Arc<str>>,
    pub(crate) passes: Vec<TemplatePass>,
}

/// A dispatch without its buffers.
#[derive(Debug)]
pub(crate) struct Dispatch<'a> {
    pub(crate) label: &'a str,
    /// Whether the shader reads the textures of a frame.
    pub(crate) sees_frame: bool,
    /// Shaders and their workgroups in x, y and z: the first with enough workgroups runs, else the last.
    pub(crate) variants: Vec<(Shader, [Number; 3])>,
}

impl Dispatches {
    /// Adds a buffer that shaders write.
    pub(crate) fn storage(&mut self, label: &str, bytes: impl Into<Number>) -> BufferId {
        self.add(label, bytes.into(), Usage::Storage, None)
    }

    /// Adds a buffer that shaders write and that holds zeros at the beginning of every frame.
    pub(crate) fn cleared(&mut self, label: &str, bytes: usize) -> BufferId {
        let id = self.storage(label, bytes);
        self.buffers[id].cleared = true;
        id
    }

    /// Adds a buffer that shaders read, of 32-bit numbers.
    pub(crate) fn filled(&mut self, label: &str, contents: &Contents) -> BufferId {
        self.add(label, contents.len().into(), Usage::Storage, Some(Initial::Words(Arc::clone(contents))))
    }

    /// Adds a buffer that shaders read, of numbers in the precision of the activations, which have so many bytes.
    pub(crate) fn reals(&mut self, label: &str, contents: &Contents, bytes: usize) -> BufferId {
        let length = Number::from(contents.len() / bytes) * Number::REAL_BYTES;
        self.add(label, length, Usage::Storage, Some(Initial::Reals(Arc::clone(contents))))
    }

    /// Adds whole numbers that all invocations see.
    pub(crate) fn uniform(&mut self, label: &str, values: impl IntoIterator<Item = Number>) -> BufferId {
        let values: Vec<_> = values.into_iter().collect();
        self.add(label, (4 * values.len()).into(), Usage::Uniform, Some(Initial::Numbers(values)))
    }

    fn add(&mut self, label: &str, bytes: Number, usage: Usage, contents: Option<Initial>) -> BufferId {
        self.buffers.push(TemplateBuffer { label: label.to_owned(), bytes, usage, contents, cleared: false });
        self.buffers.len() - 1
    }

    /// Adds a shader unless it is there.
    pub(crate) fn shader(&mut self, source: &str) -> ShaderId {
        let found = self.shaders.iter().position(|shader| **shader == *source);
        found.unwrap_or_else(|| {
            self.shaders.push(source.into());
            self.shaders.len() - 1
        })
    }

    /// Adds a dispatch at the end.
    pub(crate) fn push(&mut self, dispatch: Dispatch<'_>, bindings: &[Binding]) {
        let Dispatch { label, sees_frame, variants } = dispatch;
        let variants = variants.into_iter().map(|(shader, workgroups)| {
            let shader = self.shader(shader.source());
            Variant { shader, workgroups }
        });
        let variants = variants.collect();
        let bindings = bindings.to_vec();
        self.passes.push(TemplatePass { label: label.to_owned(), sees_frame, bindings, variants });
    }
}

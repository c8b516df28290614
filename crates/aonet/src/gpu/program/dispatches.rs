//! A list of dispatches that grows.

use super::numbers::{Contents, words};
use super::{Binding, Buffer, BufferId, Pass, ShaderId, Usage};
use crate::gpu::shader::Shader;
use std::sync::Arc;

/// Buffers, shaders and dispatches so far. Passes with the same source share a shader.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Dispatches {
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) shaders: Vec<Arc<str>>,
    pub(crate) passes: Vec<Pass>,
}

/// A dispatch without its buffers.
#[derive(Debug)]
pub(crate) struct Dispatch<'a> {
    pub(crate) label: &'a str,
    pub(crate) shader: Shader,
    /// Whether the shader reads the textures of a frame.
    pub(crate) sees_frame: bool,
    pub(crate) workgroups: [usize; 3],
}

impl Dispatches {
    /// Adds a buffer that shaders write.
    pub(crate) fn storage(&mut self, label: &str, bytes: usize) -> BufferId {
        self.add(label, bytes, Usage::Storage, None)
    }

    /// Adds a buffer that shaders write and that holds zeros at the beginning of every frame.
    pub(crate) fn cleared(&mut self, label: &str, bytes: usize) -> BufferId {
        let id = self.storage(label, bytes);
        self.buffers[id].cleared = true;
        id
    }

    /// Adds a buffer that shaders read.
    pub(crate) fn filled(&mut self, label: &str, contents: &Contents) -> BufferId {
        self.add(label, contents.len(), Usage::Storage, Some(Arc::clone(contents)))
    }

    /// Adds whole numbers that all invocations see.
    pub(crate) fn uniform(&mut self, label: &str, values: &[usize]) -> BufferId {
        let contents = words(values);
        self.add(label, contents.len(), Usage::Uniform, Some(contents))
    }

    fn add(&mut self, label: &str, bytes: usize, usage: Usage, contents: Option<Contents>) -> BufferId {
        let (label, bytes) = (label.to_owned(), bytes as u64);
        self.buffers.push(Buffer { label, bytes, usage, contents, cleared: false });
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
    pub(crate) fn push(&mut self, dispatch: &Dispatch<'_>, bindings: &[Binding]) {
        let shader = self.shader(dispatch.shader.source());
        self.passes.push(Pass {
            label: dispatch.label.to_owned(),
            shader,
            sees_frame: dispatch.sees_frame,
            bindings: bindings.to_vec(),
            workgroups: dispatch.workgroups.map(|n| n as u32),
        });
    }
}

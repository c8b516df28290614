//! What a GPU does for a frame, as a plain value: buffers, shaders, dispatches and the image at the end.
//!
//! A [`Program`] belongs to one method and one size, and names no graphics interface. With the feature `gpu`, a `Session` runs
//! it on wgpu. A [`Template`] holds the programs of every size; [`Template::to_bytes`] stores it for other hosts.

mod dispatches;
mod file;
mod number;
mod numbers;
mod template;
mod template_file;

pub(crate) use dispatches::{Dispatch, Dispatches};
pub use file::ProgramBytes;
pub(crate) use number::Grid;
pub use number::{Formula, Number};
pub(crate) use numbers::{Arithmetic, Contents, floats};
pub(crate) use template::Parts;
pub use template::{ENOUGH_WORKGROUPS, Template};

use crate::error::Result;
use crate::frame::size::Size;
use crate::frame::window::Margin;
use crate::gpu::options::{FrameNumbers, TextureEncoding};
use crate::gpu::uniforms;
pub use crate::gpu::uniforms::{FRAME_BYTES, FRAME_FIELDS, FrameField};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Index into [`Program::buffers`].
pub type BufferId = usize;

/// Index into [`Program::shaders`].
pub type ShaderId = usize;

/// How shaders see a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Usage {
    /// A few numbers that all invocations read.
    Uniform,
    /// An array.
    Storage,
}

/// A buffer of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Buffer {
    /// Name for debuggers.
    pub label: String,
    /// Size, a multiple of 4.
    pub bytes: u64,
    /// How shaders see it.
    pub usage: Usage,
    /// What it holds from the start, all of it; without contents the start does not matter.
    pub contents: Option<Arc<[u8]>>,
    /// Whether it is filled with zeros at the beginning of every frame.
    pub cleared: bool,
}

/// A whole buffer as a shader sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Binding {
    /// `var<uniform>`
    Uniform(BufferId),
    /// `var<storage, read>`
    Read(BufferId),
    /// `var<storage, read_write>`
    Write(BufferId),
}

impl Binding {
    /// The buffer that is bound.
    pub fn buffer(self) -> BufferId {
        match self {
            Self::Uniform(buffer) | Self::Read(buffer) | Self::Write(buffer) => buffer,
        }
    }
}

/// One dispatch of a shader's entry point `main`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pass {
    /// Name for debuggers and tables.
    pub label: String,
    /// What it runs.
    pub shader: ShaderId,
    /// Whether the shader sees the frame: then bind group 0 holds the frame's numbers (binding 0), its normals (1), its
    /// depth (2) and, with two layers, the depth of the second layer (3). The pass's own buffers are in group 1 then, otherwise
    /// in group 0.
    pub sees_frame: bool,
    /// The pass's own buffers by binding.
    pub bindings: Vec<Binding>,
    /// Workgroups in x, y and z.
    pub workgroups: [u32; 3],
}

/// The last pass: it draws the AO texture. The shader's entry points are `cover`, the vertex stage of one triangle of three
/// vertices, and `main`, the fragment stage. It always sees the frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    /// What it runs.
    pub shader: ShaderId,
    /// Its own buffers by binding, in bind group 1.
    pub bindings: Vec<Binding>,
}

/// All that a GPU does for frames of one size. Passes run in order; each sees what the ones before it wrote.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    pub(crate) size: Size,
    pub(crate) textures: TextureEncoding,
    pub(crate) arithmetic: Arithmetic,
    pub(crate) parts: Parts,
    pub(crate) image: Draw,
    /// Draws bent normals, where a session asks for them.
    pub(crate) bent: Option<Draw>,
    /// Whether this crate has built it: what comes from a file is not run without checks.
    pub(crate) trusted: bool,
}

impl Program {
    /// Size of the frames.
    pub fn size(&self) -> Size {
        self.size
    }

    /// What the frame's textures must hold.
    pub fn textures(&self) -> TextureEncoding {
        self.textures
    }

    /// Buffers that the passes use, besides those of the frame.
    pub fn buffers(&self) -> &[Buffer] {
        &self.parts.buffers
    }

    /// Shaders in WGSL.
    pub fn shaders(&self) -> &[Arc<str>] {
        &self.parts.shaders
    }

    /// Dispatches in order.
    pub fn passes(&self) -> &[Pass] {
        &self.parts.passes
    }

    /// The draw that follows them.
    pub fn image(&self) -> &Draw {
        &self.image
    }

    /// The draw of bent normals, which follows that of the image, in programs that were made with it.
    pub fn bent_normals(&self) -> Option<&Draw> {
        self.bent.as_ref()
    }

    /// The numbers of a frame: the uniform buffer at binding 0 of passes that see the frame. `margin` is the guard band
    /// inside the program's size; the AO texture has the rest.
    ///
    /// # Errors
    /// When the camera has another size than the program, or the frame's numbers are out of range.
    pub fn frame_bytes(&self, margin: Margin, frame: &FrameNumbers) -> Result<[u8; FRAME_BYTES]> {
        uniforms::frame_bytes(self.textures, self.size, margin, frame)
    }

    /// Names of the passes in order, the images included.
    pub fn pass_labels(&self) -> Vec<&str> {
        let bent = self.bent.as_ref().map(|_| "bent normals");
        self.passes().iter().map(|pass| pass.label.as_str()).chain(["image"]).chain(bent).collect()
    }

    /// Bytes of the buffers that passes hand results over in; weights not included.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers().iter().filter(|buffer| buffer.contents.is_none()).map(|buffer| buffer.bytes).sum()
    }
}

/// A method that has a program for every size.
pub trait Describe {
    /// The program for frames of `size`.
    ///
    /// # Errors
    /// When the buffers of a frame do not fit in memory.
    fn program(&self, size: Size) -> Result<Program>;
}

//! A program as two files: JSON for what it does, and one block of bytes for what its buffers start with.
//!
//! The JSON is one object: `format` (1), `size` (width, height), `requires` (WebGPU's names of features), `textures` (what the
//! frame's textures hold), `frame` (the uniform buffer of the frame's numbers; `struct Frame` in the shaders says what each of
//! them means), `blob_bytes`, `buffers`, `shaders` (WGSL), `passes` and `image`. A buffer's `contents` are a part of the
//! block; parts follow one another in the order of the buffers. Numbers in the block are little-endian.

use super::{Arithmetic, Binding, Buffer, Draw, Parts, Pass, Program, Usage};
use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::options::{Kernels, Precision, TextureEncoding};
use crate::gpu::uniforms::{FRAME_BYTES, FRAME_FIELDS};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// The format that this version reads and writes.
pub(super) const FORMAT: u32 = 1;

/// WebGPU's default limits, within which programs stay.
const MAX_STORAGE_BUFFERS: usize = 8;
const MAX_UNIFORM_BUFFERS: usize = 12;
const MAX_UNIFORM_BYTES: u64 = 1 << 16;
const MAX_WORKGROUPS: u32 = u16::MAX as u32;

/// A program as the contents of two files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramBytes {
    /// What it does: JSON in UTF-8.
    pub json: Vec<u8>,
    /// What its buffers start with.
    pub blob: Vec<u8>,
}

/// The JSON.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: u32,
    size: [usize; 2],
    requires: Vec<Feature>,
    textures: TextureEncoding,
    frame: FrameLayout,
    blob_bytes: usize,
    buffers: Vec<BufferEntry>,
    shaders: Vec<String>,
    passes: Vec<Pass>,
    image: Draw,
}

/// A feature of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Feature {
    #[serde(rename = "shader-f16")]
    ShaderF16,
}

impl Feature {
    /// Those that shaders of a precision need.
    pub(super) fn of(precision: Precision) -> Vec<Self> {
        match precision {
            Precision::F32 => vec![],
            Precision::F16 => vec![Self::ShaderF16],
        }
    }
}

/// The uniform buffer of a frame's numbers.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameLayout {
    bytes: usize,
    fields: Vec<FieldEntry>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldEntry {
    name: String,
    #[serde(rename = "type")]
    ty: String,
    offset: usize,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BufferEntry {
    label: String,
    bytes: u64,
    usage: Usage,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contents: Option<Part>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    cleared: bool,
}

/// A part of the block.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Part {
    pub(super) offset: usize,
    pub(super) bytes: usize,
}

impl Program {
    /// The program as the contents of two files.
    ///
    /// # Errors
    /// When it needs subgroups or products of matrices: other hosts have them in other forms; and when it draws bent normals.
    pub fn to_bytes(&self) -> Result<ProgramBytes> {
        if self.bent.is_some() {
            return Err(Error::config("images of a program file", "visibility", "bent normals as well"));
        }
        if self.arithmetic.kernels != Kernels::Plain {
            return Err(Error::config("kernels of a program file", "plain", self.arithmetic.kernels));
        }
        let mut blob = Vec::new();
        let buffers = self.buffers().iter().map(|buffer| entry(buffer, &mut blob)).collect();
        let document = Document {
            format: FORMAT,
            size: [self.size.width(), self.size.height()],
            requires: Feature::of(self.arithmetic.precision),
            textures: self.textures,
            frame: FrameLayout::ours(),
            blob_bytes: blob.len(),
            buffers,
            shaders: self.shaders().iter().map(|source| source.to_string()).collect(),
            passes: self.passes().to_vec(),
            image: self.image.clone(),
        };
        let json = serde_json::to_vec(&document).map_err(|e| Error::format("program", "JSON", e))?;
        Ok(ProgramBytes { json, blob })
    }

    /// The program that two files hold. Its shaders run with every check that a device has.
    ///
    /// # Errors
    /// When the files are not a program of this version, or do not belong together.
    pub fn from_bytes(json: &[u8], blob: &[u8]) -> Result<Self> {
        let document: Document =
            serde_json::from_slice(json).map_err(|e| Error::format("program", "the JSON of a program", e))?;
        document.check(blob)?;
        let size = document.size()?;
        let buffers = document.buffers.into_iter().map(|entry| entry.buffer(blob)).collect();
        let precision = match document.requires.contains(&Feature::ShaderF16) {
            true => Precision::F16,
            false => Precision::F32,
        };
        let shaders = document.shaders.into_iter().map(Into::into).collect();
        Ok(Self {
            size,
            textures: document.textures,
            arithmetic: Arithmetic { precision, kernels: Kernels::Plain },
            parts: Parts { buffers, shaders, passes: document.passes },
            image: document.image,
            bent: None,
            trusted: false,
        })
    }
}

/// A buffer's entry; its contents go to the end of the block.
fn entry(buffer: &Buffer, blob: &mut Vec<u8>) -> BufferEntry {
    let contents = buffer.contents.as_ref().map(|contents| {
        let part = Part { offset: blob.len(), bytes: contents.len() };
        blob.extend_from_slice(contents);
        part
    });
    let Buffer { label, bytes, usage, cleared, .. } = buffer.clone();
    BufferEntry { label, bytes, usage, contents, cleared }
}

impl BufferEntry {
    /// The buffer with its part of the block, which was checked.
    fn buffer(self, blob: &[u8]) -> Buffer {
        let Self { label, bytes, usage, cleared, contents } = self;
        let contents = contents.map(|part| blob[part.offset..][..part.bytes].into());
        Buffer { label, bytes, usage, contents, cleared }
    }
}

impl FrameLayout {
    pub(super) fn ours() -> Self {
        let field = |field: &crate::gpu::uniforms::FrameField| FieldEntry {
            name: field.name.to_owned(),
            ty: field.ty.to_owned(),
            offset: field.offset,
        };
        Self { bytes: FRAME_BYTES, fields: FRAME_FIELDS.iter().map(field).collect() }
    }
}

/// An error about a part of the file.
pub(super) fn wrong<T>(what: impl ToString, expected: impl ToString, found: impl ToString) -> Result<T> {
    Err(Error::format(format!("program: {}", what.to_string()), expected, found))
}

impl Document {
    fn size(&self) -> Result<Size> {
        let [width, height] = self.size;
        Size::named("frames of a program", width, height)
    }

    fn check(&self, blob: &[u8]) -> Result<()> {
        if self.format != FORMAT {
            return wrong("format", FORMAT, self.format);
        }
        self.size()?;
        if self.frame != FrameLayout::ours() {
            return wrong("frame", "the numbers of a frame that this version writes", "others");
        }
        if self.blob_bytes != blob.len() {
            return wrong("block", format!("{} bytes", self.blob_bytes), format!("{} bytes", blob.len()));
        }
        self.check_buffers()?;
        for pass in &self.passes {
            self.check_bindings(&pass.label, pass.shader, &pass.bindings)?;
            if pass.workgroups.iter().any(|n| !(1..=MAX_WORKGROUPS).contains(n)) {
                let expected = format!("1 to {MAX_WORKGROUPS}");
                return wrong(
                    format!("workgroups of {}", pass.label),
                    expected,
                    format!("{:?}", pass.workgroups),
                );
            }
        }
        if self.image.bindings.iter().any(|binding| matches!(binding, Binding::Write(_))) {
            return wrong("image", "buffers that it reads", "one that it writes");
        }
        self.check_bindings("image", self.image.shader, &self.image.bindings)
    }

    fn check_buffers(&self) -> Result<()> {
        let mut end = 0;
        for BufferEntry { label, bytes, usage, contents, cleared } in &self.buffers {
            let what = format!("buffer {label}");
            if *bytes == 0 || bytes % 4 != 0 {
                return wrong(what, "a multiple of 4 bytes", bytes);
            }
            if *usage == Usage::Uniform && *bytes > MAX_UNIFORM_BYTES {
                return wrong(what, format!("at most {MAX_UNIFORM_BYTES} bytes"), bytes);
            }
            let Some(Part { offset, bytes: part }) = contents else { continue };
            if *cleared {
                return wrong(what, "contents or zeros", "both");
            }
            // Parts neither overlap nor leave gaps: what is read is as long as the block.
            if *offset != end || *part as u64 != *bytes || *part > self.blob_bytes - end {
                let expected = format!("{bytes} bytes of contents from {end} on, within the block");
                return wrong(what, expected, format!("{part} bytes from {offset} on"));
            }
            end += part;
        }
        match end == self.blob_bytes {
            true => Ok(()),
            false => wrong("block", format!("{end} bytes, as its parts have"), self.blob_bytes),
        }
    }

    fn check_bindings(&self, label: &str, shader: usize, bindings: &[Binding]) -> Result<()> {
        if shader >= self.shaders.len() {
            return wrong(format!("shader of {label}"), format!("below {}", self.shaders.len()), shader);
        }
        let what = || format!("bindings of {label}");
        let (mut written, mut uniforms) = (HashSet::new(), 0);
        for binding in bindings {
            let Some(buffer) = self.buffers.get(binding.buffer()) else {
                return wrong(what(), format!("buffers below {}", self.buffers.len()), binding.buffer());
            };
            let usage = match binding {
                Binding::Uniform(_) => Usage::Uniform,
                Binding::Read(_) | Binding::Write(_) => Usage::Storage,
            };
            if usage != buffer.usage {
                return wrong(
                    what(),
                    format!("{} as {usage:?}", buffer.label),
                    format!("{:?}", buffer.usage),
                );
            }
            uniforms += usize::from(usage == Usage::Uniform);
            if let Binding::Write(id) = binding
                && (buffer.contents.is_some() || !written.insert(*id))
            {
                return wrong(what(), "results, each written once", &buffer.label);
            }
        }
        if bindings.iter().any(|b| matches!(b, Binding::Read(id) if written.contains(id))) {
            return wrong(what(), "each buffer read or written", "one that is both");
        }
        match uniforms <= MAX_UNIFORM_BUFFERS && bindings.len() - uniforms <= MAX_STORAGE_BUFFERS {
            true => Ok(()),
            false => {
                let expected =
                    format!("at most {MAX_STORAGE_BUFFERS} arrays and {MAX_UNIFORM_BUFFERS} uniforms");
                wrong(what(), expected, bindings.len())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Describe;
    use crate::search::Classic;
    use crate::search::gpu::Method;
    use serde_json::{Value, json};

    fn written() -> ProgramBytes {
        let method = Method::new(&Classic::named("gtao").unwrap(), TextureEncoding::default()).unwrap();
        method.program(Size::px(20, 10)).unwrap().to_bytes().unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let bytes = written();
        let read = Program::from_bytes(&bytes.json, &bytes.blob).unwrap();
        assert!(!read.trusted, "nobody knows who wrote it");
        assert_eq!(read.to_bytes().unwrap(), bytes);
    }

    #[test]
    fn broken_files_are_errors_that_say_what_is_wrong() {
        let ProgramBytes { json, blob } = written();
        let changed = |pointer: &str, value: Value| {
            let mut document: Value = serde_json::from_slice(&json).unwrap();
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            match document.pointer_mut(parent).unwrap() {
                Value::Object(fields) => drop(fields.insert(key.to_owned(), value)),
                Value::Array(items) => items[key.parse::<usize>().unwrap()] = value,
                other => panic!("{pointer}: {other}"),
            }
            serde_json::to_vec(&document).unwrap()
        };
        for (pointer, value, expected) in [
            ("/format", json!(2), "format"),
            ("/size/0", json!(0), "0x10"),
            ("/size/1", json!(1u64 << 40), "1099511627776"),
            ("/requires", json!(["everything"]), "everything"),
            ("/frame/fields/3/offset", json!(4), "frame"),
            ("/blob_bytes", json!(8), "block"),
            ("/buffers/0/bytes", json!(0), "multiple of 4"),
            ("/buffers/0/bytes", json!(801), "multiple of 4"),
            ("/buffers/2/bytes", json!(64), "contents"),
            ("/buffers/2/contents/offset", json!(4), "contents"),
            ("/buffers/2/contents/bytes", json!(u64::MAX), "contents"),
            ("/buffers/2/cleared", json!(true), "both"),
            ("/passes/0/shader", json!(99), "shader of pyramid"),
            ("/passes/0/bindings/1", json!({"write": 99}), "bindings of pyramid"),
            ("/passes/0/bindings/1", json!({"write": 2}), "Uniform"),
            ("/passes/0/bindings/0", json!({"read": 3}), "both"),
            ("/passes/0/bindings/0", json!({"write": 3}), "once"),
            ("/passes/1/bindings", json!(vec![json!({"read": 0}); 9]), "at most 8"),
            ("/passes/0/workgroups/2", json!(0), "workgroups of pyramid"),
            ("/passes/0/workgroups/2", json!(65536), "workgroups of pyramid"),
            ("/image/bindings/1", json!({"write": 0}), "image"),
            ("/image/shader", json!(4), "shader of image"),
        ] {
            let error = Program::from_bytes(&changed(pointer, value), &blob).unwrap_err().to_string();
            assert!(error.contains(expected), "{pointer}: {error}");
        }
        assert!(Program::from_bytes(&json, &blob[1..]).unwrap_err().to_string().contains("block"));
        assert!(Program::from_bytes(b"{}", &[]).is_err() && Program::from_bytes(&[0xff], &[]).is_err());
    }

    #[test]
    fn instructions_that_hosts_spell_in_other_ways_are_not_written() {
        let method = Method::new(&Classic::named("gtao").unwrap(), TextureEncoding::default()).unwrap();
        let mut program = method.program(Size::px(20, 10)).unwrap();
        program.arithmetic.kernels = Kernels::Subgroups;
        assert!(program.to_bytes().unwrap_err().to_string().contains("subgroups"));
    }

    proptest::proptest! {
        #[test]
        fn any_changed_byte_is_read_or_refused(at in 0usize..1 << 20, byte: u8) {
            let ProgramBytes { mut json, blob } = written();
            let at = at % json.len();
            json[at] = byte;
            drop(Program::from_bytes(&json, &blob));
            drop(Program::from_bytes(&json[..at], &blob));
        }
    }
}

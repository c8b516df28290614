//! A template as two files: JSON for what a GPU does, and one block of bytes for weights. `docs/program_format.md` describes both.

use super::file::{Feature, FrameLayout, Part, ProgramBytes, wrong};
use super::template::{Initial, TemplateBuffer, TemplatePass};
use super::{Arithmetic, Dispatches, Draw, ENOUGH_WORKGROUPS, Number, Program, Template, Usage};
use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::options::{DepthEncoding, Kernels, NormalEncoding, Precision, TextureEncoding};
use crate::gpu::shader::Shader;
use crate::gpu::surface::{depth_lines, normal_lines};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The format that this version reads and writes. Format 1 is that of programs of one size.
const FORMAT: u32 = 2;

/// The JSON.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: u32,
    requires: Vec<Feature>,
    precision: Precision,
    textures: TextureEncoding,
    choices: Choices,
    frame: FrameLayout,
    enough_workgroups: u64,
    blob: BlobEntry,
    buffers: Vec<BufferEntry>,
    shaders: Vec<String>,
    passes: Vec<TemplatePass>,
    image: Draw,
}

/// Lines of the shaders that stand for an option: those of another choice may take their place.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Choices {
    normals: BTreeMap<NormalEncoding, String>,
    depth: BTreeMap<DepthEncoding, String>,
    precision: BTreeMap<Precision, String>,
}

/// The block of bytes.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BlobEntry {
    bytes: usize,
    /// Name and digest of the file: whoever writes the file adds them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sha256: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BufferEntry {
    label: String,
    bytes: Number,
    usage: Usage,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contents: Option<ContentsEntry>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    cleared: bool,
}

/// What a buffer holds from the start.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ContentsEntry {
    /// A part of the block: numbers of 32 bits.
    Words(Part),
    /// A part of the block: numbers in the precision of the activations.
    Reals(Part),
    /// Whole numbers of 32 bits.
    Numbers(Vec<Number>),
}

impl Choices {
    /// Those of a precision; what was computed for half floats can run in 32-bit ones.
    fn of(precision: Precision) -> Self {
        let precisions = match precision {
            Precision::F32 => &[Precision::F32][..],
            Precision::F16 => &[Precision::F32, Precision::F16],
        };
        let lines = |of: &Precision| Shader::new(*of).source().trim_end().to_owned();
        Self {
            normals: NormalEncoding::ALL.map(|of| (of, normal_lines(of))).into(),
            depth: DepthEncoding::ALL.map(|of| (of, depth_lines(of))).into(),
            precision: precisions.iter().map(|of| (*of, lines(of))).collect(),
        }
    }
}

impl Template {
    /// The template as the contents of two files, as `docs/program_format.md` describes them.
    ///
    /// # Errors
    /// When it needs subgroups or products of matrices: other hosts have them in other forms; and when it draws bent normals.
    pub fn to_bytes(&self) -> Result<ProgramBytes> {
        if self.bent.is_some() {
            return Err(Error::config("images of a program file", "visibility", "bent normals as well"));
        }
        let Arithmetic { precision, kernels } = self.arithmetic;
        if kernels != Kernels::Plain {
            return Err(Error::config("kernels of a program file", "plain", kernels));
        }
        let mut blob = Vec::new();
        let buffers = self.dispatches.buffers.iter().map(|buffer| entry(buffer, &mut blob)).collect();
        let document = Document {
            format: FORMAT,
            requires: Feature::of(precision),
            precision,
            textures: self.textures,
            choices: Choices::of(precision),
            frame: FrameLayout::ours(),
            enough_workgroups: ENOUGH_WORKGROUPS,
            blob: BlobEntry { bytes: blob.len(), file: None, sha256: None },
            buffers,
            shaders: self.shaders().iter().map(|source| source.to_string()).collect(),
            passes: self.dispatches.passes.clone(),
            image: self.image.clone(),
        };
        let json = serde_json::to_vec(&document).map_err(|e| Error::format("program", "JSON", e))?;
        Ok(ProgramBytes { json, blob })
    }

    /// The template that two files hold. Its shaders run with every check that a device has. A digest of the block is not compared:
    /// whoever reads the files does that.
    ///
    /// # Errors
    /// When the files are not a program of this version, or do not belong together.
    pub fn from_bytes(json: &[u8], blob: &[u8]) -> Result<Self> {
        let document: Document =
            serde_json::from_slice(json).map_err(|e| Error::format("program", "the JSON of a program", e))?;
        document.check(blob)?;
        let Document { precision, textures, buffers, shaders, passes, image, .. } = document;
        let buffers = buffers.into_iter().map(|entry| entry.buffer(blob)).collect();
        let shaders = shaders.into_iter().map(Into::into).collect();
        let dispatches = Dispatches { buffers, shaders, passes };
        let arithmetic = Arithmetic { precision, kernels: Kernels::Plain };
        let template = Self { textures, arithmetic, dispatches, image, bent: None, trusted: false };
        // What programs of one size are checked for does not depend on the size, but for limits of the device.
        let bytes = template.at(Size::px(1, 1))?.to_bytes()?;
        Program::from_bytes(&bytes.json, &bytes.blob)?;
        Ok(template)
    }
}

/// Bytes of so many numbers in the precision of the activations.
fn reals(count: usize) -> Number {
    Number::from(count) * Number::REAL_BYTES
}

/// A buffer's entry; weights go to the end of the block.
fn entry(buffer: &TemplateBuffer, blob: &mut Vec<u8>) -> BufferEntry {
    let mut part = |bytes: &[u8]| {
        let part = Part { offset: blob.len(), bytes: bytes.len() };
        blob.extend_from_slice(bytes);
        part
    };
    let contents = buffer.contents.as_ref().map(|contents| match contents {
        Initial::Words(bytes) => ContentsEntry::Words(part(bytes)),
        Initial::Reals(bytes) => ContentsEntry::Reals(part(bytes)),
        Initial::Numbers(numbers) => ContentsEntry::Numbers(numbers.clone()),
    });
    let TemplateBuffer { label, bytes, usage, cleared, .. } = buffer.clone();
    BufferEntry { label, bytes, usage, contents, cleared }
}

impl BufferEntry {
    /// The buffer with its part of the block, which was checked.
    fn buffer(self, blob: &[u8]) -> TemplateBuffer {
        let Self { label, bytes, usage, cleared, contents } = self;
        let of = |part: Part| blob[part.offset..][..part.bytes].into();
        let contents = contents.map(|contents| match contents {
            ContentsEntry::Words(part) => Initial::Words(of(part)),
            ContentsEntry::Reals(part) => Initial::Reals(of(part)),
            ContentsEntry::Numbers(numbers) => Initial::Numbers(numbers),
        });
        TemplateBuffer { label, bytes, usage, contents, cleared }
    }
}

impl Document {
    fn check(&self, blob: &[u8]) -> Result<()> {
        if self.format != FORMAT {
            return wrong("format", FORMAT, self.format);
        }
        if self.frame != FrameLayout::ours() {
            return wrong("frame", "the numbers of a frame that this version writes", "others");
        }
        if self.requires != Feature::of(self.precision) || self.choices != Choices::of(self.precision) {
            return wrong("requires and choices", format!("those of {}", self.precision), "others");
        }
        if self.enough_workgroups != ENOUGH_WORKGROUPS {
            return wrong("enough_workgroups", ENOUGH_WORKGROUPS, self.enough_workgroups);
        }
        if self.blob.bytes != blob.len() {
            return wrong("block", format!("{} bytes", self.blob.bytes), format!("{} bytes", blob.len()));
        }
        for TemplatePass { label, variants, .. } in &self.passes {
            let shaders = variants.iter().map(|variant| variant.shader);
            if variants.is_empty() || shaders.clone().any(|shader| shader >= self.shaders.len()) {
                let expected = format!("one or more, below {}", self.shaders.len());
                return wrong(
                    format!("shader of {label}"),
                    expected,
                    format!("{:?}", shaders.collect::<Vec<_>>()),
                );
            }
        }
        if self.image.shader >= self.shaders.len() {
            return wrong("shader of image", format!("below {}", self.shaders.len()), self.image.shader);
        }
        self.check_block(blob)
    }

    /// Parts neither overlap nor leave gaps: what is read is as long as the block.
    fn check_block(&self, blob: &[u8]) -> Result<()> {
        let mut end = 0;
        for BufferEntry { label, bytes, contents, .. } in &self.buffers {
            let what = || format!("buffer {label}");
            let (part, expected) = match contents {
                Some(ContentsEntry::Words(part)) => (part, part.bytes.into()),
                Some(ContentsEntry::Reals(part)) => (part, reals(part.bytes / self.precision.bytes())),
                Some(ContentsEntry::Numbers(_)) | None => continue,
            };
            if *bytes != expected {
                return wrong(
                    what(),
                    format!("{expected:?} bytes, as its contents have"),
                    format!("{bytes:?}"),
                );
            }
            if part.offset != end || part.bytes > blob.len() - end {
                let expected = format!("contents from {end} on, within the block");
                return wrong(what(), expected, format!("{} bytes from {} on", part.bytes, part.offset));
            }
            end += part.bytes;
        }
        match end == blob.len() {
            true => Ok(()),
            false => wrong("block", format!("{end} bytes, as its parts have"), blob.len()),
        }
    }
}

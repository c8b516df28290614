//! Accessors: typed arrays in the buffers, dense or sparse, at any stride and component type.

use super::buffers::Buffers;
use super::json::{Accessor, Document, MetallicRoughness, Primitive, Sparse, at};
use aonet::{Error, Result};
use std::cell::Cell;

/// Most array elements per byte of a file. Instances of a mesh multiply the elements in the bytes.
// guess: a tree of 100 kB placed a thousand times by nodes of 60 bytes asks for 800 a byte.
const ELEMENTS_PER_BYTE: usize = 1024;
/// Array elements that any file may have: 40 million unshared triangles.
const MAX_ELEMENTS: usize = 1 << 27;

/// Reads the arrays of one document, up to a total that the file's size justifies.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    file_bytes: usize,
    budget: Cell<usize>,
}

/// Location of an array's elements.
struct Rows<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Rows<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..][..size])
    }
}

impl<'a> Accessors<'a> {
    /// `json_and_bin` is the length of the file itself (bytes).
    pub(super) fn new(document: &'a Document, buffers: Buffers<'a>, json_and_bin: usize) -> Self {
        let file_bytes = json_and_bin.saturating_add(buffers.external_bytes());
        let budget = Cell::new(file_bytes.saturating_mul(ELEMENTS_PER_BYTE).min(MAX_ELEMENTS));
        Self { document, buffers, file_bytes, budget }
    }

    /// Vectors of `N` floats; integers become floats, normalised where the accessor says so.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>> {
        let accessor = at(&self.document.accessors, index, "accessor")?;
        let what = || format!("glTF accessor {index}");
        let decode = float(accessor.component_type, accessor.normalized)
            .ok_or_else(|| Error::format(what(), "a component type of numbers", accessor.component_type))?;
        self.read(index, decode)
    }

    /// Vectors of `N` unsigned integers, as vertex and joint indices are.
    pub(super) fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>> {
        let accessor = at(&self.document.accessors, index, "accessor")?;
        let what = || format!("glTF accessor {index}");
        let decode = integer(accessor.component_type)
            .ok_or_else(|| Error::format(what(), "an unsigned component type", accessor.component_type))?;
        self.read(index, decode)
    }

    /// Length of an accessor, without reading it.
    pub(super) fn count(&self, index: usize) -> Result<usize> {
        Ok(at(&self.document.accessors, index, "accessor")?.count)
    }

    /// Numbers in an element of an accessor, where its type is known.
    pub(super) fn components(&self, index: usize) -> Option<usize> {
        self.document.accessors.get(index).and_then(|a| components(&a.shape))
    }

    /// The material of a primitive, if it has one. A missing material counts as none.
    pub(super) fn material(&self, primitive: &Primitive) -> Option<&'a MetallicRoughness> {
        let material = primitive.material.and_then(|i| self.document.materials.get(i));
        material.map(|m| &m.pbr_metallic_roughness)
    }

    /// Bytes of the file itself and of its external buffers.
    pub(super) fn file_bytes(&self) -> usize {
        self.file_bytes
    }

    /// Whether an accessor has bytes of its own.
    pub(super) fn is_stored(&self, index: usize) -> bool {
        self.document.accessors.get(index).is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some())
    }

    fn read<T: Copy + Default, const N: usize>(
        &self,
        index: usize,
        decode: fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>> {
        let accessor = at(&self.document.accessors, index, "accessor")?;
        let what = || format!("glTF accessor {index}");
        if components(&accessor.shape) != Some(N) {
            return Err(Error::format(
                what(),
                format!("a type of {N} components"),
                format!("{:?}", accessor.shape),
            ));
        }
        let size = bytes_of(accessor.component_type);
        let element = |row: &[u8]| std::array::from_fn(|k| decode(&row[k * size..][..size]));
        self.charge(accessor.count, &what())?;
        let mut values: Vec<[T; N]> = match accessor.buffer_view {
            Some(view) => {
                let (offset, count) = (accessor.byte_offset, accessor.count);
                self.rows(view, (offset, count, N * size), &what())?.iter().map(element).collect()
            }
            None if accessor.count <= self.file_bytes => vec![[T::default(); N]; accessor.count],
            None => {
                let expected = format!("a count within the {} bytes of the file", self.file_bytes);
                return Err(Error::format(what(), expected, accessor.count));
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.overwrite(&mut values, (accessor, sparse), element, &what())?;
        }
        Ok(values)
    }

    fn overwrite<T: Copy, const N: usize>(
        &self,
        values: &mut [[T; N]],
        (accessor, sparse): (&Accessor, &Sparse),
        element: impl Fn(&[u8]) -> [T; N],
        what: &str,
    ) -> Result<()> {
        let what = format!("{what} sparse");
        let to_index = integer(sparse.indices.component_type)
            .ok_or_else(|| Error::format(&what, "unsigned indices", sparse.indices.component_type))?;
        self.charge(sparse.count, &what)?;
        let (targets, sources) = (&sparse.indices, &sparse.values);
        let index_size = bytes_of(targets.component_type);
        let size = N * bytes_of(accessor.component_type);
        let targets =
            self.rows(targets.buffer_view, (targets.byte_offset, sparse.count, index_size), &what)?;
        let sources = self.rows(sources.buffer_view, (sources.byte_offset, sparse.count, size), &what)?;
        let count = values.len();
        for (target, source) in targets.iter().zip(sources.iter()) {
            let target = to_index(target) as usize;
            *values
                .get_mut(target)
                .ok_or_else(|| Error::format(&what, format!("indices below {count}"), target))? =
                element(source);
        }
        Ok(())
    }

    /// `count` elements of `size` bytes from `offset` of a buffer view, after a check that they lie inside.
    fn rows(
        &self,
        view: usize,
        (offset, count, size): (usize, usize, usize),
        what: &str,
    ) -> Result<Rows<'_>> {
        let bytes = self.view(view, what)?;
        let stride = self.document.buffer_views[view].byte_stride.unwrap_or(size);
        if stride < size {
            return Err(Error::format(
                format!("glTF buffer view {view}"),
                format!("a stride >= {size}"),
                stride,
            ));
        }
        let span = match count {
            0 => Some(0),
            _ => stride.checked_mul(count - 1).and_then(|last| last.checked_add(size)),
        };
        let end = span.and_then(|span| span.checked_add(offset));
        let bytes = end.and_then(|end| bytes.get(offset.min(end)..end)).ok_or_else(|| {
            let expected = format!("elements within the {} bytes of buffer view {view}", bytes.len());
            Error::format(
                what,
                expected,
                format!("{count} of {size} bytes, {stride} apart, from byte {offset}"),
            )
        })?;
        Ok(Rows { bytes, stride, size, count })
    }

    /// The bytes of a buffer view, which `what` asks for.
    pub(super) fn view(&self, view: usize, what: &str) -> Result<&[u8]> {
        let view_json = at(&self.document.buffer_views, view, "buffer view")?;
        let buffer = view_json.buffer;
        let bytes = self.buffers.get(buffer).ok_or_else(|| {
            Error::format(what, format!("bytes in buffer {buffer}"), "no uri and no BIN chunk")
        })?;
        let end = view_json.byte_offset.checked_add(view_json.byte_length);
        end.and_then(|end| bytes.get(view_json.byte_offset..end)).ok_or_else(|| {
            let expected = format!("a range within the {} bytes of buffer {buffer}", bytes.len());
            let found = format!("{} bytes from {}", view_json.byte_length, view_json.byte_offset);
            Error::format(format!("glTF buffer view {view}"), expected, found)
        })
    }

    /// Counts an array of `count` elements against the file's limit.
    pub(super) fn charge(&self, count: usize, what: &str) -> Result<()> {
        let cost = count.saturating_add(1);
        let left = self.budget.get().checked_sub(cost).ok_or_else(|| {
            let expected = "no more elements (instances included) than the size of the file justifies";
            Error::format(what, expected, format!("{count} more, {} left", self.budget.get()))
        })?;
        self.budget.set(left);
        Ok(())
    }
}

fn components(shape: &str) -> Option<usize> {
    match shape {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        "MAT4" => Some(16),
        _ => None,
    }
}

const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

fn bytes_of(component_type: u32) -> usize {
    match component_type {
        I8 | U8 => 1,
        I16 | U16 => 2,
        _ => 4,
    }
}

/// One component as a float. Normalised integers: glTF 2.0 specification §3.11.
fn float(component_type: u32, normalized: bool) -> Option<fn(&[u8]) -> f32> {
    Some(match (component_type, normalized) {
        (I8, false) => |b| f32::from(b[0] as i8),
        (U8, false) => |b| f32::from(b[0]),
        (I16, false) => |b| f32::from(i16::from_le_bytes([b[0], b[1]])),
        (U16, false) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])),
        (I8, true) => |b| (f32::from(b[0] as i8) / 127.0).max(-1.0),
        (U8, true) => |b| f32::from(b[0]) / 255.0,
        (I16, true) => |b| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0),
        (U16, true) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0,
        (F32, _) => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        _ => return None,
    })
}

fn integer(component_type: u32) -> Option<fn(&[u8]) -> u32> {
    Some(match component_type {
        U8 => |b| u32::from(b[0]),
        U16 => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
        U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        _ => return None,
    })
}

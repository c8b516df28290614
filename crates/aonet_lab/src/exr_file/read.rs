use super::format_error;
use aonet::Result;
use aonet::{Margin, Size, Window};
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::{ChunksReader, Reader};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, SampleType, Text};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::collections::HashSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Most pixel bytes that one byte of a file can stand for: DEFLATE, the densest of the codecs, packs at
/// most 1032 into one.
const MAX_EXPANSION: u128 = 1100;

/// The flag of files with deep data, in byte 5.
const DEEP: u8 = 0x08;

/// Bytes of planes that any file may use, because a small region of a large image is padded with background.
/// guess: enough for a frame of 1920x1080.
const PADDING_BYTES: u128 = 64 << 20;

/// A channel of a file.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    /// As stored; in files of several parts, behind the part's name.
    pub(crate) name: String,
    part: usize,
    index: usize,
    sample_type: SampleType,
}

impl Channel {
    /// Whether it is stored in half floats.
    pub(crate) fn is_half(&self) -> bool {
        self.sample_type == SampleType::F16
    }
}

/// An EXR file whose headers are read and checked, and whose pixels are not read yet.
pub(crate) struct ExrFile<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
    channels: Vec<Channel>,
    window: Window,
    justified_bytes: u128,
}

/// The first bytes of every OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

impl<'a> ExrFile<'a> {
    /// Reads the headers.
    ///
    /// # Errors
    /// When the bytes are no OpenEXR file, or claim more pixels than their length can hold.
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self> {
        if !bytes.starts_with(&MAGIC) {
            let found = if bytes.is_empty() { "an empty file" } else { "a file that begins otherwise" };
            return Err(format_error("an OpenEXR file, which begins with 76 2f 31 01", found));
        }
        if bytes.get(5).is_some_and(|flags| flags & DEEP != 0) {
            return Err(format_error("flat images", "deep data"));
        }
        let reader = guarded(|| exr::block::read(Cursor::new(bytes), false))
            .map_err(|found| format_error("headers of flat images without subsampled channels", found))?;
        let headers = reader.headers();
        let justified_bytes = bytes.len() as u128 * MAX_EXPANSION;
        let claimed: u128 = headers.iter().map(claimed_bytes).sum();
        if claimed > justified_bytes {
            let expected = format!("at most {justified_bytes} bytes of pixels in a file of {}", bytes.len());
            return Err(format_error(expected, format!("headers that claim {claimed}")));
        }
        let Vec2(width, height) = headers[0].shared_attributes.display_window.size;
        let size = Size::new(width, height)?;
        let window = Window::new(size, margin(headers, size))?;
        let several = headers.len() > 1;
        let channels = headers.iter().enumerate().flat_map(|(part, header)| channels(part, header, several));
        Ok(Self { channels: channels.collect(), window, reader, justified_bytes })
    }

    /// Size of the display window (px).
    pub(crate) fn size(&self) -> Size {
        self.window.size()
    }

    /// The display window, and as margin what every data window has around it: as much on the left as on the right, and above as
    /// below.
    pub(crate) fn window(&self) -> Window {
        self.window
    }

    /// All channels of all parts.
    pub(crate) fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn attribute(&self, name: &str) -> Option<&AttributeValue> {
        let name = Text::new_or_none(name)?;
        self.reader.headers().iter().find_map(|header| header.own_attributes.other.get(&name))
    }

    /// A custom attribute that holds text.
    pub(crate) fn text(&self, name: &str) -> Option<String> {
        match self.attribute(name)? {
            AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        }
    }

    /// A custom attribute that holds a float.
    pub(crate) fn number(&self, name: &str) -> Option<f32> {
        match self.attribute(name)? {
            AttributeValue::F32(number) => Some(*number),
            _ => None,
        }
    }

    /// HxW planes of the display window, for each of `wanted`: a channel, and its value at pixels that
    /// the file does not store.
    ///
    /// # Errors
    /// When a chunk is missing or damaged, or a channel is of integers.
    pub(crate) fn planes(self, wanted: &[(Channel, f32)]) -> Result<Vec<Vec<f32>>> {
        let picture = self.window.size().into();
        self.planes_of(picture, wanted)
    }

    /// The same of the display window and a margin around it.
    ///
    /// # Errors
    /// As [`ExrFile::planes`].
    pub(crate) fn planes_of(self, window: Window, wanted: &[(Channel, f32)]) -> Result<Vec<Vec<f32>>> {
        self.check_wanted(window.buffer_size(), wanted)?;
        let (meta, chunks) = chunks(self.reader, wanted)?;
        let pixels = window.buffer_size().pixels();
        let mut planes: Vec<_> = wanted.iter().map(|(_, outside)| vec![*outside; pixels]).collect();
        let mut placed = Vec::new();
        let mut chunks = chunks.into_iter();
        // A few at a time: pages of memory cost as much as decoding.
        let at_once = 2 * rayon::current_num_threads();
        while chunks.len() > 0 {
            let few: Vec<_> = chunks.by_ref().take(at_once).collect();
            let blocks = few.into_par_iter().map(|chunk| decode(chunk, &meta));
            let blocks = blocks.collect::<Result<Vec<_>>>()?;
            planes.par_iter_mut().zip(wanted).for_each(|(plane, (channel, _))| {
                for block in blocks.iter().filter(|block| block.index.layer == channel.part) {
                    place(block, channel, &meta.headers[channel.part], (plane, window));
                }
            });
            placed.extend(blocks.iter().map(|block| block.index));
        }
        check_complete(&placed, &meta, wanted)?;
        Ok(planes)
    }

    fn check_wanted(&self, size: Size, wanted: &[(Channel, f32)]) -> Result<()> {
        for (channel, _) in wanted {
            if channel.sample_type == SampleType::U32 {
                return Err(format_error(format!("half or float in {}", channel.name), "integers"));
            }
        }
        let plane_bytes = size.pixels() as u128 * size_of::<f32>() as u128;
        // Half floats take twice the memory after reading.
        if plane_bytes * wanted.len() as u128 > 2 * self.justified_bytes + PADDING_BYTES {
            let found = format!("{size}, of which little is stored");
            return Err(format_error("a display window that the file can fill", found));
        }
        Ok(())
    }
}

/// Runs the `exr` crate; a panic of it becomes an error.
fn guarded<T>(run: impl FnOnce() -> exr::error::Result<T>) -> std::result::Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => result.map_err(|e| e.to_string()),
        Err(_) => Err("damage that the decoder stumbled over".into()),
    }
}

/// All chunks that hold `wanted` channels at full resolution.
fn chunks(reader: Reader<Cursor<&[u8]>>, wanted: &[(Channel, f32)]) -> Result<(MetaData, Vec<Chunk>)> {
    let is_wanted = |chunk: &Chunk| {
        let full_size = match &chunk.compressed_block {
            CompressedBlock::Tile(tile) => tile.coordinates.is_largest_resolution_level(),
            _ => true,
        };
        full_size && wanted.iter().any(|(channel, _)| channel.part == chunk.layer_index)
    };
    let read = guarded(|| {
        let chunks = reader.all_chunks(false)?;
        let meta = chunks.meta_data().clone();
        let kept = chunks.filter(|chunk| chunk.as_ref().map_or(true, is_wanted));
        Ok((meta, kept.collect::<exr::error::Result<_>>()?))
    });
    read.map_err(|found| format_error("whole chunks of pixels", found))
}

/// Decodes a rectangle of an image.
///
/// # Errors
/// When it is damaged, or has not as many bytes as its pixels.
fn decode(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock> {
    let block = guarded(|| UncompressedBlock::decompress_chunk(chunk, meta, false))
        .map_err(|found| format_error("whole chunks of pixels", found))?;
    let bytes = block.index.pixel_size.area() * meta.headers[block.index.layer].channels.bytes_per_pixel;
    if block.data.len() != bytes {
        return Err(format_error(format!("a chunk of {bytes} bytes"), block.data.len()));
    }
    Ok(block)
}

/// Copies a channel of a block to where it lies in the display window and its margin, cropped to them.
fn place(
    block: &UncompressedBlock,
    channel: &Channel,
    header: &Header,
    (plane, window): (&mut [f32], Window),
) {
    let plane_width = window.buffer_size().width();
    let Vec2(width, _) = block.index.pixel_size;
    let (x, y) = offset(header, block.index.pixel_position);
    let (x, y) = (x + window.margin().x as i64, y + window.margin().y as i64);
    let from = x.clamp(0, plane_width as i64);
    let to = (x + width as i64).clamp(0, plane_width as i64);
    if from >= to {
        return;
    }
    // The channels of a line follow each other.
    let before = &header.channels.list[..channel.index];
    let start = width * before.iter().map(|c| c.sample_type.bytes_per_sample()).sum::<usize>();
    let sample = channel.sample_type.bytes_per_sample();
    let [first, end] = [from, to].map(|column| start + (column - x) as usize * sample);
    let lines = block.data.chunks_exact(width * header.channels.bytes_per_pixel);
    let rows = 0..(plane.len() / plane_width) as i64;
    for (y, line) in (y..).zip(lines).filter(|(y, _)| rows.contains(y)) {
        let row = &mut plane[y as usize * plane_width..][..plane_width];
        convert(&line[first..end], channel, &mut row[from as usize..to as usize]);
    }
}

/// Converts native-endian samples of a half or float channel.
fn convert(line: &[u8], channel: &Channel, out: &mut [f32]) {
    if channel.is_half() {
        let halves: Vec<half::f16> =
            line.as_chunks().0.iter().map(|b| half::f16::from_ne_bytes(*b)).collect();
        halves.convert_to_f32_slice(out);
    } else {
        out.iter_mut().zip(line.as_chunks().0).for_each(|(out, b)| *out = f32::from_ne_bytes(*b));
    }
}

/// Position in the display window of a pixel of the data window.
fn offset(header: &Header, Vec2(x, y): Vec2<usize>) -> (i64, i64) {
    let data = header.own_attributes.layer_position;
    let display = header.shared_attributes.display_window.position;
    let along = |data: i32, display: i32, at: usize| i64::from(data) - i64::from(display) + at as i64;
    (along(data.0, display.0, x), along(data.1, display.1, y))
}

/// What all data windows have in common around the display window, the same on opposite sides (px).
fn margin(headers: &[Header], size: Size) -> Margin {
    let of = |header: &Header| {
        let (x, y) = offset(header, Vec2(0, 0));
        let right = x + header.layer_size.0 as i64 - size.width() as i64;
        let below = y + header.layer_size.1 as i64 - size.height() as i64;
        [(-x).min(right).max(0) as usize, (-y).min(below).max(0) as usize]
    };
    let common = headers.iter().map(of).reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])]);
    let [x, y] = common.unwrap_or_default();
    Margin { x, y }
}

/// Bytes that a header says its pixels, or one of its tiles, take at full resolution.
fn claimed_bytes(header: &Header) -> u128 {
    let area = |Vec2(width, height): Vec2<usize>| width as u128 * height as u128;
    let tile = match header.blocks {
        BlockDescription::ScanLines => 0,
        BlockDescription::Tiles(tiles) => area(tiles.tile_size),
    };
    area(header.layer_size).max(tile) * header.channels.bytes_per_pixel as u128
}

/// # Errors
/// When the blocks do not cover each wanted part exactly once.
fn check_complete(blocks: &[BlockIndex], meta: &MetaData, wanted: &[(Channel, f32)]) -> Result<()> {
    let mut seen = HashSet::new();
    let mut stored = vec![0; meta.headers.len()];
    for BlockIndex { layer, pixel_position: Vec2(x, y), pixel_size, .. } in blocks {
        if seen.insert((layer, x, y)) {
            stored[*layer] += pixel_size.area();
        }
    }
    for (channel, _) in wanted {
        let expected = meta.headers[channel.part].layer_size.area();
        if stored[channel.part] != expected {
            return Err(format_error(format!("{expected} pixels of {}", channel.name), stored[channel.part]));
        }
    }
    Ok(())
}

fn channels(part: usize, header: &Header, several: bool) -> Vec<Channel> {
    let prefix = match &header.own_attributes.layer_name {
        Some(name) if several => format!("{name}."),
        _ => String::new(),
    };
    let list = header.channels.list.iter().enumerate();
    list.map(|(index, channel)| {
        let name = channel.name.to_string();
        let name = if name.starts_with(&prefix) { name } else { format!("{prefix}{name}") };
        Channel { name, part, index, sample_type: channel.sample_type }
    })
    .collect()
}

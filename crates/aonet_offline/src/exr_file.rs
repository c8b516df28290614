//! OpenEXR as named planes of `f32`: what frames and AO images share.
//!
//! The `exr` crate parses the headers and decompresses the chunks. Everything that a hostile file could
//! use to make it panic or allocate is checked here, between the two.

use aonet::camera::check_size;
use aonet::{Error, Result};
use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::reader::{ChunksReader, Reader};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, IntegerBounds, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::WritableImage;
use rayon::prelude::*;
use std::io::Cursor;

/// Most pixel bytes that one byte of a file can stand for: DEFLATE, the densest of the codecs, packs at
/// most 1032 into one; and the header of a small file is part of its length.
const MAX_EXPANSION: u128 = 1100;

/// Largest display window, in areas of the data window. guess: a rendered region is no smaller.
const MAX_PADDING: usize = 64;

/// A plane to be written.
pub(crate) struct Plane {
    pub(crate) name: &'static str,
    pub(crate) samples: FlatSamples,
}

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

/// An EXR file whose headers are read and found sane, and whose pixels are not read yet.
pub(crate) struct ExrFile<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
    channels: Vec<Channel>,
    size: (usize, usize),
}

fn format_error(expected: impl ToString, found: impl ToString) -> Error {
    Error::format("OpenEXR", expected, found)
}

impl<'a> ExrFile<'a> {
    /// Reads the headers.
    ///
    /// # Errors
    /// When the bytes are no OpenEXR file, or claim more pixels than their length can hold.
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self> {
        let reader =
            exr::block::read(Cursor::new(bytes), false).map_err(|e| format_error("a readable file", e))?;
        let headers = reader.headers();
        let claimed: u128 = headers.iter().map(claimed_bytes).sum();
        let justified = bytes.len() as u128 * MAX_EXPANSION;
        if claimed > justified {
            let found = format!("headers that claim {claimed} bytes of pixels");
            return Err(format_error(
                format!("at most {justified} bytes of pixels in {} bytes", bytes.len()),
                found,
            ));
        }
        let Vec2(width, height) = headers[0].shared_attributes.display_window.size;
        check_size("OpenEXR display window", width, height)?;
        let channels =
            headers.iter().enumerate().flat_map(|(part, header)| channels(part, header, headers.len() > 1));
        Ok(Self { channels: channels.collect(), size: (width, height), reader })
    }

    /// Width and height [px] of the display window.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
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
    /// When a chunk is missing or damaged, or a channel is subsampled or of integers.
    pub(crate) fn planes(self, wanted: &[(Channel, f32)]) -> Result<Vec<Vec<f32>>> {
        for (channel, _) in wanted {
            let header = &self.reader.headers()[channel.part];
            check_part(header, self.size)?;
            if channel.sample_type == SampleType::U32 {
                return Err(format_error(format!("half or float in {}", channel.name), "integers"));
            }
        }
        let area = self.size.0 * self.size.1;
        let mut planes: Vec<Vec<f32>> = wanted.iter().map(|(_, outside)| vec![*outside; area]).collect();
        self.decode(wanted, &mut planes)?;
        Ok(planes)
    }

    fn decode(self, wanted: &[(Channel, f32)], planes: &mut [Vec<f32>]) -> Result<()> {
        let damaged = |e: exr::error::Error| format_error("whole chunks of pixels", e);
        let (width, height) = self.size;
        let chunks = self.reader.all_chunks(false).map_err(damaged)?;
        let meta = chunks.meta_data().clone();
        let chunks = chunks.collect::<exr::error::Result<Vec<Chunk>>>().map_err(damaged)?;
        let is_wanted = |chunk: &Chunk| wanted.iter().any(|(channel, _)| channel.part == chunk.layer_index);
        let chunks: Vec<Chunk> = chunks.into_iter().filter(is_wanted).collect();
        let blocks: Vec<(UncompressedBlock, Vec<Vec<f32>>)> = chunks
            .into_par_iter()
            .map(|chunk| {
                let mut block = UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(damaged)?;
                let lines = samples(&block, &meta.headers[block.index.layer], wanted)?;
                block.data = Vec::new();
                Ok((block, lines))
            })
            .collect::<Result<_>>()?;
        let mut stored = vec![0usize; meta.headers.len()];
        let mut seen = std::collections::HashSet::new();
        for (block, samples) in blocks.into_iter().filter(|(block, _)| block.index.level == Vec2(0, 0)) {
            let index = block.index;
            if seen.insert((index.layer, index.pixel_position.0, index.pixel_position.1)) {
                stored[index.layer] += index.pixel_size.area();
            }
            let header = &meta.headers[index.layer];
            let in_part = wanted.iter().zip(planes.iter_mut()).filter(|((c, _), _)| c.part == index.layer);
            for ((_, plane), samples) in in_part.zip(samples) {
                place(
                    plane,
                    (width, height),
                    offset(header, index.pixel_position),
                    (&samples, index.pixel_size.0),
                );
            }
        }
        for (channel, _) in wanted {
            let expected = meta.headers[channel.part].layer_size.area();
            if stored[channel.part] != expected {
                return Err(format_error(
                    format!("{expected} pixels of {}", channel.name),
                    stored[channel.part],
                ));
            }
        }
        Ok(())
    }
}

/// Copies a block of rows of `width` samples to where its corner lies in the display window, cropped to it.
fn place(
    plane: &mut [f32],
    (plane_width, plane_height): (usize, usize),
    (x, y): (i64, i64),
    block: (&[f32], usize),
) {
    let (samples, width) = block;
    let from = x.clamp(0, plane_width as i64);
    let to = (x + width as i64).clamp(0, plane_width as i64);
    if from >= to {
        return;
    }
    for (row, line) in samples.chunks_exact(width).enumerate() {
        let y = y + row as i64;
        if (0..plane_height as i64).contains(&y) {
            let start = y as usize * plane_width;
            let line = &line[(from - x) as usize..(to - x) as usize];
            plane[start + from as usize..start + to as usize].copy_from_slice(line);
        }
    }
}

/// Position of a pixel of the data window in the display window.
fn offset(header: &Header, Vec2(x, y): Vec2<usize>) -> (i64, i64) {
    let data = header.own_attributes.layer_position;
    let display = header.shared_attributes.display_window.position;
    let along = |data: i32, display: i32, at: usize| i64::from(data) - i64::from(display) + at as i64;
    (along(data.0, display.0, x), along(data.1, display.1, y))
}

/// The samples of the wanted channels of this block's part, each row after row.
fn samples(block: &UncompressedBlock, header: &Header, wanted: &[(Channel, f32)]) -> Result<Vec<Vec<f32>>> {
    let Vec2(width, height) = block.index.pixel_size;
    let line_bytes = width * header.channels.bytes_per_pixel;
    if block.data.len() != line_bytes * height {
        return Err(format_error(format!("a chunk of {} bytes", line_bytes * height), block.data.len()));
    }
    let mut all = Vec::new();
    for (channel, _) in wanted.iter().filter(|(channel, _)| channel.part == block.index.layer) {
        let before = &header.channels.list[..channel.index];
        let start = width * before.iter().map(|c| c.sample_type.bytes_per_sample()).sum::<usize>();
        let length = width * channel.sample_type.bytes_per_sample();
        let mut plane = Vec::with_capacity(width * height);
        for line in block.data.chunks_exact(line_bytes) {
            let line = &line[start..start + length];
            match channel.sample_type {
                SampleType::F16 => {
                    plane.extend(line.as_chunks().0.iter().map(|b| half::f16::from_ne_bytes(*b).to_f32()))
                }
                SampleType::F32 => plane.extend(line.as_chunks().0.iter().map(|b| f32::from_ne_bytes(*b))),
                SampleType::U32 => {
                    plane.extend(line.as_chunks().0.iter().map(|b| u32::from_ne_bytes(*b) as f32))
                }
            }
        }
        all.push(plane);
    }
    Ok(all)
}

/// Bytes that a header says its pixels take. All levels of a mip or rip map are at most 4 images.
fn claimed_bytes(header: &Header) -> u128 {
    let area = |Vec2(width, height): Vec2<usize>| width as u128 * height as u128;
    let block = match header.blocks {
        exr::meta::BlockDescription::ScanLines => 0,
        exr::meta::BlockDescription::Tiles(tiles) => area(tiles.tile_size),
    };
    area(header.layer_size).max(block) * header.channels.bytes_per_pixel as u128
}

fn check_part(header: &Header, (width, height): (usize, usize)) -> Result<()> {
    if let Some(channel) = header.channels.list.iter().find(|c| c.sampling != Vec2(1, 1)) {
        return Err(format_error(
            "no subsampled channels",
            format!("{} at {:?}", channel.name, channel.sampling),
        ));
    }
    let stored = header.layer_size.area();
    if width * height > MAX_PADDING.saturating_mul(stored) {
        let expected = format!("a data window of at least 1/{MAX_PADDING} of the display window");
        return Err(format_error(expected, format!("{stored} of {} pixels", width * height)));
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

/// An OpenEXR file of `planes` that are all `width * height` long, with at most one text and one number
/// as custom attributes. Equal input gives equal bytes.
///
/// # Errors
/// When the encoder refuses.
pub(crate) fn encode(
    (width, height): (usize, usize),
    planes: Vec<Plane>,
    text: Option<(&str, String)>,
    number: Option<(&str, f32)>,
) -> Result<Vec<u8>> {
    let list = planes.into_iter().map(|plane| AnyChannel::new(plane.name, plane.samples)).collect();
    let mut attributes = LayerAttributes { software_name: Some(Text::from("aonet")), ..Default::default() };
    let text = text
        .and_then(|(name, text)| Some((Text::from(name), AttributeValue::Text(Text::new_or_none(text)?))));
    attributes.other.extend(text);
    let encoding = Encoding { compression: COMPRESSION, ..Encoding::SMALL_LOSSLESS };
    let layer = Layer::new((width, height), attributes, encoding, AnyChannels::sort(list));
    let mut image = Image::from_layer(layer);
    // The crate keeps custom attributes in maps of random order: one in the layer's and one in the
    // image's map are always written in the same order.
    image
        .attributes
        .other
        .extend(number.map(|(name, number)| (Text::from(name), AttributeValue::F32(number))));
    image.attributes.display_window = IntegerBounds::from_dimensions((width, height));
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| format_error("an image that can be encoded", e))?;
    Ok(bytes.into_inner())
}

/// Blocks of 16 lines by DEFLATE.
const COMPRESSION: exr::compression::Compression = exr::compression::Compression::ZIP16;

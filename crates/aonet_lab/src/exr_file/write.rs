use super::format_error;
use aonet::{Result, Size, Window};
use exr::compression::Compression;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::WritableImage;
use std::io::Cursor;

/// A plane to write.
pub(crate) struct Plane {
    pub(crate) name: &'static str,
    pub(crate) samples: FlatSamples,
}

/// An OpenEXR file of images alone, of one size, such as AO or shares of light. It is not compressed: ZIP saves 8 % of such
/// 32-bit values, and takes more time than the network.
///
/// # Errors
/// When the encoder refuses.
pub(crate) fn encode_images(size: Size, planes: Vec<Plane>) -> Result<Vec<u8>> {
    encode(size.into(), planes, LayerAttributes::default(), None, Compression::Uncompressed)
}

/// An OpenEXR file of a frame: `planes` that are all of the window's buffer, with one text and at most one number as custom
/// attributes. ZIP is the smallest of the lossless codecs on frames, and nearly the fastest to decode. Equal input gives equal bytes.
///
/// # Errors
/// When the text is not of Latin-1, or the encoder refuses.
pub(crate) fn encode_frame(
    window: Window,
    planes: Vec<Plane>,
    (name, text): (&str, String),
    number: Option<(&str, f32)>,
) -> Result<Vec<u8>> {
    let latin = Text::new_or_none(&text).ok_or_else(|| format_error("an attribute in Latin-1", text))?;
    let mut attributes = LayerAttributes::default();
    attributes.other.insert(Text::from(name), AttributeValue::Text(latin));
    encode(window, planes, attributes, number, Compression::ZIP16)
}

fn encode(
    window: Window,
    planes: Vec<Plane>,
    attributes: LayerAttributes,
    number: Option<(&str, f32)>,
    compression: Compression,
) -> Result<Vec<u8>> {
    let list = planes.into_iter().map(|plane| AnyChannel::new(plane.name, plane.samples)).collect();
    let encoding = Encoding { compression, ..Encoding::SMALL_LOSSLESS };
    let (size, margin, buffer) = (window.size(), window.margin(), window.buffer_size());
    let attributes = LayerAttributes {
        software_name: Some(Text::from("aonet")),
        layer_position: Vec2(-(margin.x as i32), -(margin.y as i32)),
        ..attributes
    };
    let layer = Layer::new((buffer.width(), buffer.height()), attributes, encoding, AnyChannels::sort(list));
    let mut image = Image::from_layer(layer);
    image.attributes.display_window = IntegerBounds::new((0, 0), (size.width(), size.height()));
    // The crate keeps custom attributes in maps of random order; with one in the layer's map and one in
    // the image's, the order is always the same.
    image
        .attributes
        .other
        .extend(number.map(|(name, number)| (Text::from(name), AttributeValue::F32(number))));
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|e| format_error("an image that can be encoded", e))?;
    Ok(bytes.into_inner())
}

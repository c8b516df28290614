//! Decodes image files into square textures with all mip levels.

use aonet_scene::scene::DEFAULT_ALBEDO;
use aonet_scene::scene::textures::{Image, most_decoded_bytes};
use image::imageops::{self, FilterType};
use image::{ImageReader, Limits, RgbaImage};
use std::io::Cursor;
use std::sync::Arc;

/// Memory that an image may take when it is decoded: 8192 x 8192 texels of 8 bits.
// guess: more than any visible texture needs.
const MOST_DECODED_BYTES: u64 = 1 << 28;

/// Texels of the mip levels, largest first: red, green, blue and alpha, sRGB.
pub(super) type Levels = Vec<RgbaImage>;

/// Width and height of an image (px), from the start of its file.
///
/// # Errors
/// Why it cannot be shown.
pub(super) fn size(image: &Image) -> Result<(u32, u32), String> {
    let (width, height) = reader(image)?.into_dimensions().map_err(|e| e.to_string())?;
    match u64::from(width) * u64::from(height) * 4 <= MOST_DECODED_BYTES {
        true => Ok((width, height)),
        false => Err(format!("{width}x{height} texels, which are more than {MOST_DECODED_BYTES} bytes")),
    }
}

/// An image as a square of `side` x `side` texels, a power of two, and all smaller levels.
///
/// # Errors
/// Why it cannot be shown.
pub(super) fn levels(image: &Image, side: u32) -> Result<Levels, String> {
    size(image)?;
    let decoded = reader(image)?.decode().map_err(|e| e.to_string())?.into_rgba8();
    let light = Light::new();
    Ok(light.smaller(light.squared(decoded, side)))
}

/// Replaces an image that cannot be shown: the default colour.
pub(super) fn plain(side: u32) -> Levels {
    let [r, g, b] = DEFAULT_ALBEDO.map(encoded);
    Light::new().smaller(RgbaImage::from_pixel(side, side, image::Rgba([r, g, b, 255])))
}

fn reader(image: &Image) -> Result<ImageReader<Cursor<Arc<[u8]>>>, String> {
    let bytes = image.read()?;
    let mut limits = Limits::default();
    // Scaled with 16 bits per channel.
    limits.max_alloc = Some(most_decoded_bytes(bytes.len()).min(2 * MOST_DECODED_BYTES));
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|e| e.to_string())?;
    reader.limits(limits);
    match reader.format() {
        Some(format) if format.reading_enabled() => Ok(reader),
        Some(format) => Err(format!("{}, where PNG and JPEG are known", format.to_mime_type())),
        None => Err("neither PNG nor JPEG".into()),
    }
}

/// Tables between linear light and 8-bit sRGB values: a scene has tens of millions of texels.
struct Light {
    of: Vec<f32>,
    encoded: Vec<u8>,
}

/// Entries of the table of light: the darkest sRGB values are two and a half entries apart.
const STEPS: usize = 1 << 13;

impl Light {
    fn new() -> Self {
        let of = (0..=255).map(|value| decoded(value as f32 / 255.0)).collect();
        Self { of, encoded: (0..=STEPS).map(|step| encoded(step as f32 / STEPS as f32)).collect() }
    }

    /// Means of so many texels along x and y (1 or 2), in linear light. The last of an odd number of rows or columns is left out.
    fn shrunk(&self, image: &RgbaImage, [along_x, along_y]: [u32; 2]) -> RgbaImage {
        RgbaImage::from_fn(image.width() / along_x, image.height() / along_y, |x, y| {
            let texel =
                |dx: u32, dy: u32| image.get_pixel(along_x * x + dx % along_x, along_y * y + dy % along_y).0;
            let texels = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
            let sum = |c: usize| texels.iter().map(|t| self.of[usize::from(t[c])]).sum::<f32>();
            let mean = |c| self.encoded[(sum(c) * (STEPS as f32 / 4.0)).round() as usize];
            image::Rgba([mean(0), mean(1), mean(2), 255])
        })
    }

    /// Stretches the image to a square; texture coordinates do not depend on the size. Halving works in linear light, and the
    /// remaining factor below two is scaled in sRGB values, as other programs do. Each side is halved by itself: `resize` takes
    /// memory for the width of the old image times the height of the new one.
    fn squared(&self, mut image: RgbaImage, side: u32) -> RgbaImage {
        loop {
            let along = [image.width(), image.height()].map(|length| if length >= 2 * side { 2 } else { 1 });
            if along == [1, 1] {
                break;
            }
            image = self.shrunk(&image, along);
        }
        match image.dimensions() == (side, side) {
            true => image,
            false => imageops::resize(&image, side, side, FilterType::Triangle),
        }
    }

    /// The image and all its halves, down to one texel.
    fn smaller(&self, largest: RgbaImage) -> Levels {
        let mut levels = vec![largest];
        while let Some(last) = levels.last()
            && last.width() > 1
        {
            levels.push(self.shrunk(last, [2, 2]));
        }
        levels
    }
}

/// IEC 61966-2-1.
fn decoded(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// IEC 61966-2-1, of 8 bits.
fn encoded(linear: f32) -> u8 {
    let value = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * value).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet_scene::scene::textures::ImageFile;
    use image::{ImageFormat, Rgba};

    fn file(image: &RgbaImage, format: ImageFormat) -> Image {
        let mut bytes = Cursor::new(Vec::new());
        image::DynamicImage::from(image.clone()).into_rgb8().write_to(&mut bytes, format).unwrap();
        Image { name: "test".into(), file: Ok(ImageFile::Embedded(bytes.into_inner().into())) }
    }

    #[test]
    fn halves_are_means_of_light() {
        let board =
            RgbaImage::from_fn(4, 4, |x, y| Rgba(if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] }));
        let found = levels(&file(&board, ImageFormat::Png), 4).unwrap();
        assert_eq!(found.iter().map(RgbaImage::width).collect::<Vec<_>>(), [4, 2, 1]);
        assert_eq!(found[0], board);
        // Half the light of white, IEC 61966-2-1: 1.055 * 0.5^(1 / 2.4) - 0.055 = 0.7354, times 255.
        let is_grey = |image: &RgbaImage| image.pixels().all(|p| p.0 == [188, 188, 188, 255]);
        assert!(is_grey(&found[1]) && is_grey(&found[2]), "{found:?}");
        let halved = levels(&file(&board, ImageFormat::Png), 2).unwrap();
        assert!(halved[0].dimensions() == (2, 2) && is_grey(&halved[0]), "{halved:?}");
    }

    #[test]
    fn plain_colours_stay_as_they_are() {
        for value in 0..=255 {
            let plain = RgbaImage::from_pixel(4, 4, Rgba([value, 255 - value, value, 255]));
            let found = levels(&file(&plain, ImageFormat::Png), 2).unwrap();
            assert!(found.iter().all(|level| level.pixels().all(|p| p == plain.get_pixel(0, 0))), "{value}");
        }
    }

    #[test]
    fn an_image_of_any_shape_becomes_a_square() {
        let wide =
            RgbaImage::from_fn(6, 2, |x, _| Rgba(if x < 3 { [200, 0, 0, 255] } else { [0, 0, 200, 255] }));
        let found = levels(&file(&wide, ImageFormat::Png), 8).unwrap();
        assert_eq!(found[0].dimensions(), (8, 8));
        assert_eq!(
            [found[0].get_pixel(1, 5).0, found[0].get_pixel(6, 2).0],
            [[200, 0, 0, 255], [0, 0, 200, 255]]
        );
        let jpeg =
            levels(&file(&RgbaImage::from_pixel(16, 16, Rgba([90, 160, 40, 255])), ImageFormat::Jpeg), 16)
                .unwrap();
        let near = |a: &[u8; 4], b: [u8; 4]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 3);
        assert!(jpeg[0].pixels().all(|p| near(&p.0, [90, 160, 40, 255])), "{:?}", jpeg[0].get_pixel(0, 0));
    }

    #[test]
    fn a_long_image_takes_no_more_memory_than_a_square_one() {
        // Its width times the side of the square would be 17 GB.
        let long = RgbaImage::from_fn(1 << 20, 1, |x, _| Rgba([if x < 1 << 19 { 0 } else { 255 }; 4]));
        for (image, [dark, light]) in
            [(imageops::rotate90(&long), [(9, 0), (9, 1023)]), (long, [(0, 9), (1023, 9)])]
        {
            let found = levels(&file(&image, ImageFormat::Png), 1024).unwrap();
            assert_eq!([dark, light].map(|(x, y)| found[0].get_pixel(x, y)[0]), [0, 255]);
        }
    }

    #[test]
    fn what_cannot_be_shown_says_why() {
        let whole = file(&RgbaImage::from_pixel(64, 64, Rgba([1, 2, 3, 255])), ImageFormat::Png);
        let bytes = whole.read().unwrap();
        let of = |bytes: &[u8]| Image { name: "test".into(), file: Ok(ImageFile::Embedded(bytes.into())) };
        for length in 0..bytes.len() - 12 {
            assert!(levels(&of(&bytes[..length]), 4).is_err(), "{length}");
        }
        // Sides of 2^31 - 1, with the checksum that belongs to them.
        let mut huge = bytes.to_vec();
        huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(levels(&of(&huge), 4).is_err());
        // 8192 x 8192 texels would fit, but not in a file of this length.
        huge[16..24].copy_from_slice(&[0, 0, 0x20, 0, 0, 0, 0x20, 0]);
        huge[29..33].copy_from_slice(&[0xfd, 0xc8, 0x5d, 0x0e]);
        let why = levels(&of(&huge), 4).unwrap_err();
        assert!(why.contains("Memory limit"), "{why}");
        let webp = b"RIFF\x24\0\0\0WEBPVP8 ";
        for (image, named) in [
            (of(webp), "webp"),
            (of(b"\xabKTX 20\xbb\r\n\x1a\n"), "neither"),
            (Image { name: "x".into(), file: Err("no such file".into()) }, "no such file"),
        ] {
            let why = levels(&image, 4).unwrap_err();
            assert!(why.contains(named), "{why}");
        }
    }
}

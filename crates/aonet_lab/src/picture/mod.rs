//! Pictures of frames: 8-bit, row 0 at the top.

mod text;

use aonet::metrics::ERROR_SCALE;
use aonet::search::{Share, Shares};
use aonet::{AoImage, BentNormals, GBuffer, Size};
use aonet_scene::{Error, Result, atomic_file};
use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};
use std::io::Cursor;
use std::path::Path;

/// Width of a [`sheet`] (px), and the largest height of one of its panels.
const SHEET_WIDTH: u32 = 1280;
const PANEL_HEIGHT: u32 = 960;

/// Space between the panels of a sheet, and around their captions (px).
const GAP: u32 = 4;
const CAPTION: u32 = text::LINE + 2 * GAP;

/// Colour behind a sheet, of its captions, and of pixels without geometry.
pub(crate) const PAPER: [u8; 3] = [24; 3];
const INK: [u8; 3] = [235; 3];
const BACKGROUND: [u8; 3] = [40; 3];

/// Colours from far to near: nine samples of matplotlib's viridis.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Colours of errors: too dark, correct, too bright.
const DIVERGING: [[u8; 3]; 5] = [[5, 48, 97], [67, 147, 195], [247, 247, 247], [214, 96, 77], [103, 0, 31]];

/// The caption of a panel of a [`sheet`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Caption {
    /// One short line; the end of a longer one is cut off.
    pub text: String,
    /// Whether the colours of [`error`] are explained at the right.
    pub error_legend: bool,
}

impl Caption {
    /// A caption of text alone.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), error_legend: false }
    }
}

fn picture(width: usize, height: usize, colour: impl Fn(usize) -> [u8; 3]) -> RgbImage {
    RgbImage::from_fn(width as u32, height as u32, |x, y| Rgb(colour(y as usize * width + x as usize)))
}

fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// The colour at `t` in [0, 1] between the first and the last of `stops`.
fn gradient(stops: &[[u8; 3]], t: f32) -> [u8; 3] {
    let place = t.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    let i = (place as usize).min(stops.len() - 2);
    let mix = |c: usize| {
        f32::from(stops[i][c]) + (place - i as f32) * (f32::from(stops[i + 1][c]) - f32::from(stops[i][c]))
    };
    [0, 1, 2].map(|c| mix(c).round() as u8)
}

/// Visibility as grey, linear: 0 black, 1 white.
pub fn ao(image: &AoImage) -> RgbImage {
    picture(image.width(), image.height(), |i| [byte(image.visibility()[i]); 3])
}

/// View-space normals of the picture as n * 0.5 + 0.5; the background is black.
pub fn normals(gbuffer: &GBuffer) -> RgbImage {
    layers(&gbuffer.without_margin())
}

/// Bent normals as n * 0.5 + 0.5; the background is black.
pub fn bent_normals(bent: &BentNormals) -> RgbImage {
    let size = bent.size();
    picture(size.width(), size.height(), |i| match bent.directions()[i] {
        [0.0, 0.0, 0.0] => [0; 3],
        direction => direction.map(|c| byte(0.5 * c + 0.5)),
    })
}

/// The normals of every layer of a frame, side by side, coloured as by [`normals`]. The guard band is shown, too, and darker.
pub fn layers(gbuffer: &GBuffer) -> RgbImage {
    let (window, width, height) = (gbuffer.window(), gbuffer.width(), gbuffer.height());
    let margin = window.margin();
    let behind = gbuffer.second().and_then(|second| second.normal.as_deref());
    let layers: Vec<&[[f32; 3]]> = [Some(gbuffer.normal()), behind].into_iter().flatten().collect();
    picture(width * layers.len(), height, |i| {
        let (x, y) = (i % (width * layers.len()), i / (width * layers.len()));
        let normal = layers[x / width][y * width + x % width];
        let inside =
            (margin.x..width - margin.x).contains(&(x % width)) && (margin.y..height - margin.y).contains(&y);
        let brightness = if inside { 1.0 } else { 0.5 };
        match normal == [0.0; 3] {
            true => [0; 3],
            false => normal.map(|c| byte(brightness * (0.5 * c + 0.5))),
        }
    })
}

/// A panel that a [`sheet`] leaves empty.
pub fn blank(size: Size) -> RgbImage {
    RgbImage::from_pixel(size.width() as u32, size.height() as u32, Rgb(PAPER))
}

/// Shares of light as a mixture of their colours: see [`Share::colour`].
pub fn shares(shares: &Shares) -> RgbImage {
    let size = shares.size();
    picture(size.width(), size.height(), |i| {
        let mixed = |c: usize| {
            let of = |share: Share| shares.plane(share)[i] * f32::from(share.colour()[c]);
            Share::ALL.map(of).iter().sum::<f32>().round() as u8
        };
        [0, 1, 2].map(mixed)
    })
}

/// Depth, logarithmic from the nearest hundredth of the foreground (yellow) to the farthest (violet); the
/// background is dark grey.
pub fn depth(gbuffer: &GBuffer) -> RgbImage {
    let gbuffer = gbuffer.without_margin();
    let mut logs: Vec<f32> = gbuffer.depth().iter().filter(|d| d.is_finite()).map(|d| d.ln()).collect();
    logs.sort_unstable_by(f32::total_cmp);
    let at = |share: usize| logs.get((logs.len() * share / 100).min(logs.len().wrapping_sub(1)));
    let (near, far) = (at(1).copied().unwrap_or(0.0), at(99).copied().unwrap_or(0.0));
    let range = (far - near).max(f32::MIN_POSITIVE);
    picture(gbuffer.width(), gbuffer.height(), |i| match gbuffer.is_foreground(i) {
        true => gradient(&VIRIDIS, (far - gbuffer.depth()[i].ln()) / range),
        false => BACKGROUND,
    })
}

/// `image` minus `reference`: white where they agree, blue where `image` is too dark, red where it is too
/// bright, full colour from [`ERROR_SCALE`] on.
///
/// # Errors
/// When the sizes differ.
pub fn error(reference: &AoImage, image: &AoImage) -> Result<RgbImage> {
    let size = |a: &AoImage| format!("{}x{}", a.width(), a.height());
    if size(reference) != size(image) {
        return Err(aonet::Error::size("image to compare", size(reference), size(image)).into());
    }
    Ok(picture(image.width(), image.height(), |i| {
        let difference = image.visibility()[i] - reference.visibility()[i];
        gradient(&DIVERGING, 0.5 + 0.5 * difference / ERROR_SCALE)
    }))
}

/// Panels in rows of `columns`, each above its caption, about 1280 px wide. Larger pictures are shrunk,
/// smaller ones enlarged.
///
/// # Errors
/// When there are no panels or no columns.
pub fn sheet(panels: &[(RgbImage, Caption)], columns: usize) -> Result<RgbImage> {
    sheet_of_width(panels, columns, SHEET_WIDTH)
}

/// A [`sheet`] about `width` wide (px).
///
/// # Errors
/// When there are no panels or no columns, or a panel would have no pixel.
pub fn sheet_of_width(panels: &[(RgbImage, Caption)], columns: usize, width: u32) -> Result<RgbImage> {
    let columns = columns.min(panels.len()) as u32;
    if columns == 0 {
        return Err(Error::request("picture sheet", "at least one panel and one column", "none"));
    }
    let rows = (panels.len() as u32).div_ceil(columns);
    let cell = width.saturating_sub(GAP * (columns - 1)) / columns;
    if cell == 0 {
        return Err(Error::request(
            "picture sheet",
            format!("at least a pixel for each of {columns} columns"),
            width,
        ));
    }
    let panels: Vec<(RgbImage, &Caption)> =
        panels.iter().map(|(p, caption)| (fitted(p, cell), caption)).collect();
    let height = panels.iter().map(|(p, _)| p.height()).max().unwrap_or(1) + CAPTION;
    let mut sheet = RgbImage::from_pixel(columns * (cell + GAP) - GAP, rows * height, Rgb(PAPER));
    for (k, (panel, caption)) in (0..).zip(&panels) {
        let (left, top) = (k % columns * (cell + GAP), k / columns * height);
        imageops::replace(&mut sheet, panel, i64::from(left), i64::from(top));
        let line = draw_caption(caption, cell);
        imageops::replace(&mut sheet, &line, i64::from(left), i64::from(top + height - CAPTION));
    }
    Ok(sheet)
}

/// The picture scaled to `width`, or to a smaller width if it would be too high.
fn fitted(picture: &RgbImage, width: u32) -> RgbImage {
    let (w, h) = (picture.width() as f32, picture.height() as f32);
    let scale = (width as f32 / w).min(PANEL_HEIGHT as f32 / h);
    let side = |length: f32| ((scale * length).round() as u32).max(1);
    let filter = if scale < 1.0 { FilterType::Triangle } else { FilterType::Nearest };
    imageops::resize(picture, side(w), side(h), filter)
}

fn draw_caption(caption: &Caption, width: u32) -> RgbImage {
    let mut line = RgbImage::from_pixel(width, CAPTION, Rgb(PAPER));
    text::draw(&mut line, (GAP, GAP), &caption.text, INK);
    if caption.error_legend {
        let legend = legend(width.saturating_sub(text::width(&caption.text) + 2 * GAP));
        let left = i64::from(width) - i64::from(legend.width());
        imageops::replace(&mut line, &legend, left, 0);
    }
    line
}

/// The colours of [`error`] from too dark to too bright, between their values: narrower where a caption leaves less room (px).
fn legend(room: u32) -> RgbImage {
    let (low, high) = (format!("-{ERROR_SCALE}"), format!("+{ERROR_SCALE}"));
    let bar_left = text::width(&low) + 2 * GAP;
    let bar_right = text::width(&high) + 2 * GAP;
    let bar = room.saturating_sub(bar_left + bar_right).clamp(48, 96);
    let width = bar_left + bar + bar_right;
    let mut legend = RgbImage::from_pixel(width, CAPTION, Rgb(PAPER));
    text::draw(&mut legend, (GAP, GAP), &low, INK);
    for (x, y) in (0..bar).flat_map(|x| (GAP..CAPTION - GAP).map(move |y| (x, y))) {
        legend.put_pixel(bar_left + x, y, Rgb(gradient(&DIVERGING, x as f32 / (bar - 1) as f32)));
    }
    text::draw(&mut legend, (bar_left + bar + GAP, GAP), &high, INK);
    legend
}

/// Writes a picture as PNG under a temporary name, then renames it.
///
/// # Errors
/// When it cannot be written.
pub fn save_png(picture: &RgbImage, path: &Path) -> Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|e| Error::file(path, "a picture that PNG can hold", e))?;
    atomic_file::write(path, bytes.get_ref())
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Margin, Projection, SecondLayer, Size};

    fn gbuffer() -> GBuffer<'static> {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(projection, Size::px(3, 1)).unwrap().with_near(0.1).unwrap();
        GBuffer::new(camera, vec![1.0, 100.0, f32::INFINITY], vec![[0.0, 0.0, 1.0]; 3]).unwrap()
    }

    #[test]
    fn known_values_have_known_colours() {
        let image = AoImage::new(Size::px(3, 1), vec![0.0, 0.5, 1.0]).unwrap();
        let colours = |p: RgbImage| p.pixels().map(|p| p.0).collect::<Vec<_>>();
        assert_eq!(colours(ao(&image)), [[0; 3], [128; 3], [255; 3]]);
        assert_eq!(colours(normals(&gbuffer())), [[128, 128, 255], [128, 128, 255], [0; 3]]);
        assert_eq!(colours(depth(&gbuffer())), [VIRIDIS[8], VIRIDIS[0], BACKGROUND]);
        let reference = AoImage::new(Size::px(3, 1), vec![0.5; 3]).unwrap();
        assert_eq!(colours(error(&reference, &image).unwrap()), [DIVERGING[0], DIVERGING[2], DIVERGING[4]]);
        assert!(error(&reference, &AoImage::open(Size::px(1, 3))).is_err());
    }

    #[test]
    fn layers_are_side_by_side_and_guard_bands_darker() {
        let back = SecondLayer {
            depth: vec![2.0, 200.0, f32::INFINITY].into(),
            normal: Some(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0; 3]].into()),
        };
        let deep = gbuffer().with_margin(Margin { x: 1, y: 0 }).unwrap().with_second(back).unwrap();
        let found: Vec<_> = layers(&deep).pixels().map(|p| p.0).collect();
        let [up, dark, right] = [[128, 128, 255], [64, 64, 128], [255, 128, 128]];
        assert_eq!(found, [dark, up, [0; 3], dark, right, [0; 3]]);
        assert_eq!(layers(&gbuffer()), normals(&gbuffer()));
    }

    #[test]
    fn sheets_of_any_shape_are_about_as_wide_as_they_should_be() {
        for (width, height) in [(1, 1), (7, 3), (4001, 17), (17, 4001), (640, 360)] {
            let panel = (RgbImage::new(width, height), Caption { text: "x".repeat(200), error_legend: true });
            let sheet = sheet(&[panel.clone(), panel.clone(), panel], 2).unwrap();
            assert_eq!(sheet.width(), SHEET_WIDTH);
            assert!(sheet.height() <= 2 * (PANEL_HEIGHT + CAPTION));
        }
        assert!(sheet(&[], 2).is_err());
    }

    #[test]
    fn a_legend_leaves_room_for_its_caption() {
        // Pictures of a gallery of four columns.
        let width = (SHEET_WIDTH - 3 * GAP) / 4;
        let line = |error_legend| draw_caption(&Caption { text: "24.0 dB .909".into(), error_legend }, width);
        let text = text::width("24.0 dB .909") + GAP;
        let start = |line: RgbImage| imageops::crop_imm(&line, 0, 0, text, CAPTION).to_image();
        assert_eq!(start(line(true)), start(line(false)));
        assert_ne!(line(true), line(false));
    }

    #[test]
    fn a_saved_picture_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let saved = normals(&gbuffer());
        save_png(&saved, &path).unwrap();
        assert_eq!(image::open(&path).unwrap().to_rgb8(), saved);
        assert!(save_png(&saved, dir.path()).is_err());
    }
}

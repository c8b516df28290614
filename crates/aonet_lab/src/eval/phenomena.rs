//! Where a method errs: at depth edges, around thin things, at the frame's border, on open surfaces.

use super::grain::Grain;
use aonet::{AoImage, AoParams, GBuffer};
use serde::Serialize;

/// A part of a frame with a typical error of methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phenomenon {
    /// Foreground within 4 px of a depth edge: halos.
    DepthEdge,
    /// Foreground within 16 px of something at most 8 px thin, and not on it: the surface behind is hidden.
    AroundThin,
    /// Foreground within 5 % of the frame's width or height from its border: occluders are outside the frame.
    Border,
    /// Foreground with a visibility of at least 0.97 away from depth edges: noise and false darkness.
    Open,
}

impl Phenomenon {
    /// All variants.
    pub const ALL: [Self; 4] = [Self::DepthEdge, Self::AroundThin, Self::Border, Self::Open];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::DepthEdge => "depth edges",
            Self::AroundThin => "around thin things",
            Self::Border => "frame border",
            Self::Open => "open surfaces",
        }
    }
}

/// How large the AO radius is on the screen: the median over the foreground as a share of the frame's height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiusClass {
    /// Below 6 %.
    Small,
    /// 6 to 18 %.
    Medium,
    /// Above 18 %.
    Large,
}

impl RadiusClass {
    /// All variants.
    pub const ALL: [Self; 3] = [Self::Small, Self::Medium, Self::Large];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Small => "radius < 6 %",
            Self::Medium => "radius 6-18 %",
            Self::Large => "radius > 18 %",
        }
    }

    /// The class of a frame; none without foreground.
    pub fn of(gbuffer: &GBuffer, params: AoParams) -> Option<Self> {
        Some(match projected_radius(gbuffer, params)? {
            s if s < 0.06 => Self::Small,
            s if s <= 0.18 => Self::Medium,
            _ => Self::Large,
        })
    }
}

/// The AO radius at the median depth, as a share of the image's height; none without foreground.
pub fn projected_radius(gbuffer: &GBuffer, params: AoParams) -> Option<f32> {
    let mut depths: Vec<f32> = gbuffer.depth().iter().copied().filter(|d| d.is_finite()).collect();
    if depths.is_empty() {
        return None;
    }
    let middle = depths.len() / 2;
    let median = *depths.select_nth_unstable_by(middle, f32::total_cmp).1;
    Some(gbuffer.camera().projected_px(params.radius(), median) / gbuffer.height() as f32)
}

/// Reach of each phenomenon (px), and largest width of thin things. guess: the visible size of halos at 640 to 1280 px.
const EDGE_REACH: usize = 4;
const THIN: usize = 8;
const THIN_REACH: usize = 16;
/// Distance from the pixel's plane that makes an edge (share of the AO radius). guess
const EDGE_STEP: f32 = 0.1;
/// Share of a side that counts as border.
const BORDER: f32 = 0.05;
/// Visibility from which on a pixel counts as open.
const OPEN: f32 = 0.97;

/// The pixels of every phenomenon of a frame: HxW each, in the order of [`Phenomenon::ALL`].
pub fn masks(gbuffer: &GBuffer, params: AoParams, reference: &AoImage) -> [Vec<bool>; 4] {
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let grid = Grid::new(gbuffer, params);
    let pixels = |of: &dyn Fn(usize, usize) -> bool| -> Vec<bool> {
        (0..width * height).map(|i| of(i % width, i / width)).collect()
    };
    let edge = dilated(&pixels(&|x, y| grid.is_edge(x, y)), width, EDGE_REACH);
    let thin = pixels(&|x, y| grid.is_thin(x, y));
    let around = dilated(&thin, width, THIN_REACH);
    let (bx, by) = (BORDER * width as f32, BORDER * height as f32);
    let near = |at: usize, size: usize, reach: f32| (at.min(size - 1 - at) as f32) < reach;
    let inside = |x: usize, y: usize| gbuffer.is_foreground(y * width + x);
    [
        pixels(&|x, y| inside(x, y) && edge[y * width + x]),
        pixels(&|x, y| inside(x, y) && around[y * width + x] && !thin[y * width + x]),
        pixels(&|x, y| inside(x, y) && (near(x, width, bx) || near(y, height, by))),
        pixels(&|x, y| {
            let i = y * width + x;
            inside(x, y) && !edge[i] && reference.visibility()[i] >= OPEN
        }),
    ]
}

/// The surfaces of a frame, pixel by pixel.
pub(super) struct Grid<'a> {
    gbuffer: &'a GBuffer<'a>,
    /// (world units)
    step: f32,
}

impl<'a> Grid<'a> {
    pub(super) fn new(gbuffer: &'a GBuffer<'a>, params: AoParams) -> Self {
        Self { gbuffer, step: EDGE_STEP * params.radius() }
    }

    /// Whether the pixel to the right or below is off this pixel's plane, or this pixel off the other's plane.
    pub(super) fn is_edge(&self, x: usize, y: usize) -> bool {
        let right = x + 1 < self.gbuffer.width() && self.is_step((x, y), (x + 1, y));
        right || (y + 1 < self.gbuffer.height() && self.is_step((x, y), (x, y + 1)))
    }

    fn is_step(&self, a: (usize, usize), b: (usize, usize)) -> bool {
        let index = |(x, y): (usize, usize)| y * self.gbuffer.width() + x;
        let depth = [a, b].map(|at| self.gbuffer.depth()[index(at)]);
        if !(depth[0].is_finite() && depth[1].is_finite()) {
            return depth[0].is_finite() != depth[1].is_finite();
        }
        let camera = self.gbuffer.camera();
        let away = camera.position_view(b.0, b.1, depth[1]) - camera.position_view(a.0, a.1, depth[0]);
        [a, b].into_iter().all(|at| away.dot(self.gbuffer.normal()[index(at)].into()).abs() > self.step)
    }

    /// Whether the pixel's surface ends within [`THIN`] pixels on both sides, in front of something farther.
    fn is_thin(&self, x: usize, y: usize) -> bool {
        let (width, height) = (self.gbuffer.width(), self.gbuffer.height());
        let depth = |x: usize, y: usize| self.gbuffer.depth()[y * width + x];
        let here = depth(x, y);
        let farther = |d: f32| d > here + 2.0 * self.step;
        let pair = |at: usize, size: usize, along: &dyn Fn(usize) -> f32| {
            let before = (1..=THIN).find(|k| at >= *k && farther(along(at - k)));
            let after = (1..=THIN).find(|k| at + k < size && farther(along(at + k)));
            before.zip(after).is_some_and(|(a, b)| a + b <= THIN + 1)
        };
        here.is_finite() && (pair(x, width, &|x| depth(x, y)) || pair(y, height, &|y| depth(x, y)))
    }
}

/// Every pixel within a square of `reach` pixels around a set one.
pub(super) fn dilated(mask: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let height = mask.len() / width;
    let spread = |of: &dyn Fn(usize) -> bool, at: usize, size: usize| {
        (at.saturating_sub(reach)..(at + reach + 1).min(size)).any(of)
    };
    let rows: Vec<bool> =
        (0..mask.len()).map(|i| spread(&|x| mask[i / width * width + x], i % width, width)).collect();
    (0..mask.len()).map(|i| spread(&|y| rows[y * width + i % width], i / width, height)).collect()
}

/// Error of a method over the pixels of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PixelError {
    /// Number of pixels.
    pub pixels: u64,
    /// Sum of the squared differences in visibility.
    pub squares: f64,
    /// Sum of the differences: above zero, the method is too bright.
    pub sum: f64,
}

impl PixelError {
    /// Adds the pixels of a mask.
    pub(crate) fn add(&mut self, reference: &AoImage, image: &AoImage, mask: &[bool]) {
        let pairs = image.visibility().iter().zip(reference.visibility());
        for ((found, expected), _) in pairs.zip(mask).filter(|(_, counts)| **counts) {
            let error = f64::from(found - expected);
            self.pixels += 1;
            self.squares += error * error;
            self.sum += error;
        }
    }

    /// Root of the mean squared error; none without pixels.
    pub fn rmse(&self) -> Option<f64> {
        (self.pixels > 0).then(|| (self.squares / self.pixels as f64).sqrt())
    }

    /// Mean error; none without pixels.
    pub fn bias(&self) -> Option<f64> {
        (self.pixels > 0).then(|| self.sum / self.pixels as f64)
    }
}

/// Errors of a method by phenomenon and by radius, over all frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Breakdown {
    /// In the order of [`Phenomenon::ALL`].
    pub phenomena: [PixelError; 4],
    /// Over the foreground, in the order of [`RadiusClass::ALL`].
    pub radii: [PixelError; 3],
    /// Variation over a few pixels on smooth surfaces.
    pub grain: Grain,
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Size};

    const SIZE: Size = Size::px(100, 60);

    /// A wall at depth 10 with a pole of `width` columns in front of it, from column 50 on.
    fn pole(width: usize) -> GBuffer<'static> {
        let camera = Camera::orthographic(6.0, SIZE);
        let depth = |i: usize| if (50..50 + width).contains(&(i % SIZE.width())) { 5.0 } else { 10.0 };
        let depths = (0..SIZE.pixels()).map(depth).collect::<Vec<_>>();
        GBuffer::new(camera.unwrap(), depths, vec![[0.0, 0.0, 1.0]; SIZE.pixels()]).unwrap()
    }

    fn row(mask: &[bool], y: usize) -> Vec<usize> {
        (0..SIZE.width()).filter(|x| mask[y * SIZE.width() + x]).collect()
    }

    #[test]
    fn every_phenomenon_has_its_pixels() {
        let open = AoImage::open(SIZE);
        let [edge, thin, border, flat] = masks(&pole(4), AoParams::new(1.0).unwrap(), &open);
        // The steps are right of columns 49 and 53.
        assert_eq!(row(&edge, 30), (45..=57).collect::<Vec<_>>());
        assert_eq!(row(&thin, 30), (34..50).chain(54..70).collect::<Vec<_>>());
        assert_eq!(row(&border, 30), (0..5).chain(95..100).collect::<Vec<_>>());
        assert_eq!(row(&border, 2).len(), 100);
        assert_eq!(row(&flat, 30), (0..45).chain(58..100).collect::<Vec<_>>());
        let [_, thick, ..] = masks(&pole(20), AoParams::new(1.0).unwrap(), &open);
        assert!(row(&thick, 30).is_empty());
        let [smooth, ..] = masks(&pole(4), AoParams::new(100.0).unwrap(), &open);
        assert!(row(&smooth, 30).is_empty(), "a step far below the radius is none");
        let dark = AoImage::new(SIZE, vec![0.5; SIZE.pixels()]).unwrap();
        assert!(row(&masks(&pole(4), AoParams::new(1.0).unwrap(), &dark)[3], 30).is_empty());
    }

    #[test]
    fn errors_add_up_over_frames() {
        let reference = AoImage::new(Size::px(2, 1), vec![0.5, 0.5]).unwrap();
        let image = AoImage::new(Size::px(2, 1), vec![0.8, 0.1]).unwrap();
        let mut error = PixelError::default();
        error.add(&reference, &image, &[true, false]);
        assert!((error.rmse().unwrap() - 0.3).abs() < 1e-6 && (error.bias().unwrap() - 0.3).abs() < 1e-6);
        error.add(&reference, &image, &[false, true]);
        assert!((error.rmse().unwrap() - 0.125f64.sqrt()).abs() < 1e-6, "{error:?}");
        assert!((error.bias().unwrap() + 0.05).abs() < 1e-6);
        assert_eq!(PixelError::default().rmse(), None);
    }

    #[test]
    fn radii_have_classes() {
        // 10 px a unit; 60 rows.
        for (radius, class) in
            [(0.3, RadiusClass::Small), (0.6, RadiusClass::Medium), (1.2, RadiusClass::Large)]
        {
            assert_eq!(RadiusClass::of(&pole(4), AoParams::new(radius).unwrap()), Some(class));
        }
    }
}

//! Grain: how much a method's image varies over a few pixels where the surface is smooth, beside the reference.

use super::phenomena::{Grid, dilated};
use aonet::{AoImage, AoParams, GBuffer};
use serde::Serialize;

/// Pixels on each side of the window whose mean is taken off. guess: noise after a filter of 5x5 px has about this size.
const REACH: usize = 4;
/// The same of the window whose mean it is taken off: what is left of the reference's own noise, which differs from pixel to pixel.
const CORE: usize = 1;
/// Cosine between the normals of neighbours below which a surface is not smooth. guess
const SMOOTH: f32 = 0.98;

/// The foreground pixels of a frame from whose window no depth edge and no bend is seen: HxW.
pub(super) fn smooth(gbuffer: &GBuffer, params: AoParams) -> Vec<bool> {
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let grid = Grid::new(gbuffer, params);
    let bends = |a: usize, b: usize| dot(gbuffer.normal()[a], gbuffer.normal()[b]) < SMOOTH;
    let rough = |i: usize| {
        let (x, y) = (i % width, i / width);
        let bent = (x + 1 < width && bends(i, i + 1)) || (y + 1 < height && bends(i, i + width));
        !gbuffer.is_foreground(i) || bent || grid.is_edge(x, y)
    };
    // A step lies between a pixel and the next one: one pixel more.
    let near = dilated(&(0..width * height).map(rough).collect::<Vec<_>>(), width, REACH + 1);
    let inside = |at: usize, size: usize| at >= REACH && at + REACH < size;
    (0..width * height).map(|i| !near[i] && inside(i % width, width) && inside(i / width, height)).collect()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Squares of the mean of 3x3 pixels minus that of 9x9 pixels in two images, over smooth surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Grain {
    /// Number of pixels.
    pub pixels: u64,
    /// Sum over the method's image.
    pub found: f64,
    /// Sum over the reference, which has the noise of its rays.
    pub reference: f64,
}

impl Grain {
    /// Adds the pixels of a mask, none of which is nearer to the border than the window reaches.
    pub(super) fn add(&mut self, reference: &AoImage, image: &AoImage, mask: &[bool]) {
        let width = reference.width();
        let [found, expected] = [image, reference].map(|of| Sums::new(of.visibility(), width));
        for i in (0..mask.len()).filter(|i| mask[*i]) {
            self.pixels += 1;
            self.found += found.detail(i).powi(2);
            self.reference += expected.detail(i).powi(2);
        }
    }

    /// The deviation of the method's image over that of the reference; none without smooth surfaces.
    pub fn ratio(&self) -> Option<f64> {
        (self.reference > 0.0).then(|| (self.found / self.reference).sqrt())
    }
}

/// Sums over all rectangles from the upper left corner on.
struct Sums {
    width: usize,
    /// A row and a column more than the image.
    sums: Vec<f64>,
}

impl Sums {
    fn new(values: &[f32], width: usize) -> Self {
        let stride = width + 1;
        let mut sums = vec![0.0; stride * (values.len() / width + 1)];
        for (y, row) in values.chunks_exact(width).enumerate() {
            let mut sum = 0.0;
            for (x, v) in row.iter().enumerate() {
                sum += f64::from(*v);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + sum;
            }
        }
        Self { width, sums }
    }

    /// The mean of the pixels nearest to a pixel minus the mean of the window around it.
    fn detail(&self, i: usize) -> f64 {
        self.mean(i, CORE) - self.mean(i, REACH)
    }

    /// The mean of the pixels within `reach` of a pixel in both directions.
    fn mean(&self, i: usize, reach: usize) -> f64 {
        let (x, y, side, stride) = (i % self.width, i / self.width, 2 * reach + 1, self.width + 1);
        let corner = |dx: usize, dy: usize| self.sums[(y - reach + dy) * stride + x - reach + dx];
        let sum = corner(side, side) - corner(0, side) - corner(side, 0) + corner(0, 0);
        sum / (side * side) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Size};

    const SIZE: Size = Size::px(40, 30);

    /// A wall with a step in depth after column 19.
    fn wall(step: f32) -> GBuffer<'static> {
        let camera = Camera::orthographic(3.0, SIZE).unwrap();
        let depth =
            (0..SIZE.pixels()).map(|i| if i % 40 < 20 { 5.0 } else { 5.0 + step }).collect::<Vec<_>>();
        GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; SIZE.pixels()]).unwrap()
    }

    #[test]
    fn smooth_surfaces_lie_away_from_steps_and_from_the_border() {
        let params = AoParams::new(1.0).unwrap();
        let row = |step: f32| -> Vec<usize> {
            let mask = smooth(&wall(step), params);
            (0..40).filter(|x| mask[15 * 40 + x]).collect()
        };
        assert_eq!(row(0.0), (4..36).collect::<Vec<_>>());
        // The step is an edge of column 19.
        assert_eq!(row(1.0), (4..14).chain(25..36).collect::<Vec<_>>());
        assert!((0..40).all(|x| !smooth(&wall(0.0), params)[3 * 40 + x]));
    }

    #[test]
    fn grain_counts_what_varies_and_not_what_slopes() {
        let mask = smooth(&wall(0.0), AoParams::new(1.0).unwrap());
        let image = |value: &dyn Fn(usize, usize) -> f32| {
            AoImage::new(SIZE, (0..SIZE.pixels()).map(|i| value(i % 40, i / 40)).collect::<Vec<_>>()).unwrap()
        };
        let chess = |x: usize, y: usize| if (x / 3 + y / 3).is_multiple_of(2) { 0.02 } else { -0.02 };
        let slope = |x: usize| 0.01 * x as f32 + 0.2;
        let mut grain = Grain::default();
        grain.add(
            &image(&|x, y| slope(x) + chess(x, y)),
            &image(&|x, y| slope(x) + 2.0 * chess(x, y)),
            &mask,
        );
        assert_eq!(grain.pixels, 32 * 22);
        assert!((grain.ratio().unwrap() - 2.0).abs() < 1e-4, "{grain:?}");
        let mut none = Grain::default();
        none.add(&image(&|x, y| slope(x) + chess(x, y)), &image(&|x, _| slope(x)), &mask);
        assert!(none.ratio().unwrap() < 1e-3, "{none:?}");
        assert_eq!(Grain::default().ratio(), None);
    }
}

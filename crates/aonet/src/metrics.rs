//! How alike two AO images are: SSIM, mean squared error and PSNR, over the whole frame and over the
//! foreground only (sky inflates both).
//!
//! SSIM: Wang et al. 2004, Eq. 13, L = 1, K1 = 0.01, K2 = 0.03, biased variances, averaged over the
//! windows that lie inside the image. Foreground SSIM averages the windows *centred* on a foreground
//! pixel (they may take in background at its edge); foreground error averages foreground pixels.

use crate::AoImage;
use crate::error::{Error, Result};
use crate::simd::{Isa, Kernel, Level, Simd};
use serde::Serialize;

/// Difference of visibility that a picture of errors shows in full colour.
pub const ERROR_SCALE: f32 = 0.25;

const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Smallest width and height (px) that can be compared: one Gaussian window.
pub const MIN_SIDE: usize = 11;

/// The weights that SSIM takes its local means with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Window {
    /// 11x11 Gaussian, sigma 1.5 px: what is meant by "SSIM".
    Gaussian11,
    /// 8x8 mean; its centre is the pixel after the middle, so it spans -4..=+3.
    Flat8,
}

impl Window {
    /// One side of the separable window; sums to 1.
    fn taps(self) -> Vec<f64> {
        match self {
            Self::Gaussian11 => {
                let raw: Vec<f64> = (-5..=5).map(|i| (-f64::from(i * i) / (2.0 * 1.5 * 1.5)).exp()).collect();
                let sum: f64 = raw.iter().sum();
                raw.iter().map(|w| w / sum).collect()
            }
            Self::Flat8 => vec![1.0 / 8.0; 8],
        }
    }
}

/// Similarity of two images over a set of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scores {
    /// Mean SSIM of the Gaussian 11x11 window, in [-1, 1]; 1 = identical.
    pub ssim: f64,
    /// Mean SSIM of the flat 8x8 window.
    pub ssim_8x8: f64,
    /// Mean squared error.
    pub mse: f64,
    /// [`psnr`] of `mse` (dB); infinite (null in JSON) for identical pixels.
    pub psnr: f64,
    /// Pixels that the error was averaged over.
    pub pixels: usize,
}

/// Similarity over the full frame and over its foreground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// Every pixel.
    pub full: Scores,
    /// Foreground only; absent without a mask, or where no window is centred on foreground.
    pub foreground: Option<Scores>,
}

/// Compares `image` with `reference`; `foreground` is HxW, row-major.
///
/// # Errors
/// When the sizes differ or a side is shorter than [`MIN_SIDE`].
pub fn compare(reference: &AoImage, image: &AoImage, foreground: Option<&[bool]>) -> Result<Comparison> {
    let gaussian = ssim_means(reference, image, Window::Gaussian11, foreground)?;
    let flat = ssim_means(reference, image, Window::Flat8, foreground)?;
    let error = squared_error(reference, image, foreground);
    let scores = |ssim: f64, ssim_8x8: f64, (sum, pixels): (f64, usize)| {
        let mse = sum / pixels as f64;
        Scores { ssim, ssim_8x8, mse, psnr: psnr(mse), pixels }
    };
    let inside = gaussian.foreground.zip(flat.foreground);
    Ok(Comparison {
        full: scores(gaussian.full, flat.full, error[0]),
        foreground: inside.map(|(g, f)| scores(g, f, error[1])),
    })
}

/// Mean SSIM of two images over their full frame, in [-1, 1].
///
/// # Errors
/// When the sizes differ or a side is shorter than [`MIN_SIDE`].
pub fn ssim(a: &AoImage, b: &AoImage, window: Window) -> Result<f64> {
    Ok(ssim_means(a, b, window, None)?.full)
}

/// Peak signal-to-noise ratio (dB) of a mean squared error, for a peak of 1; infinite for 0.
pub fn psnr(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

struct Means {
    full: f64,
    foreground: Option<f64>,
}

/// Sum and count of something over all pixels, and over the foreground.
type Sums = [(f64, usize); 2];

fn add(mut total: Sums, row: Sums) -> Sums {
    for (t, r) in total.iter_mut().zip(row) {
        *t = (t.0 + r.0, t.1 + r.1);
    }
    total
}

fn squared_error(a: &AoImage, b: &AoImage, foreground: Option<&[bool]>) -> Sums {
    let width = a.width();
    let rows = (0..a.height()).map(|y| {
        let mut sums = Sums::default();
        for i in y * width..(y + 1) * width {
            let d = f64::from(a.visibility()[i]) - f64::from(b.visibility()[i]);
            let inside = foreground.is_some_and(|f| f[i]);
            sums = add(sums, [(d * d, 1), if inside { (d * d, 1) } else { (0.0, 0) }]);
        }
        sums
    });
    rows.fold(Sums::default(), add)
}

fn ssim_means(a: &AoImage, b: &AoImage, window: Window, foreground: Option<&[bool]>) -> Result<Means> {
    check(a, b, foreground)?;
    let instructions = Isa::new(Level::best())?;
    let taps = window.taps();
    let (width, centre) = (a.width(), taps.len() / 2);
    let mut columns = std::array::from_fn(|_| vec![0.0; width + BLOCK]);
    let mut row = vec![0.0; width + 1 - taps.len()];
    let mut total = Sums::default();
    for y in 0..a.height() + 1 - taps.len() {
        let pixels = [a, b].map(|image| &image.visibility()[y * width..][..taps.len() * width]);
        instructions.run(SsimRow { pixels, taps: &taps, columns: &mut columns, row: &mut row });
        let mut sums = Sums::default();
        for (x, s) in row.iter().enumerate() {
            let inside = foreground.is_some_and(|f| f[(y + centre) * width + x + centre]);
            sums = add(sums, [(*s, 1), if inside { (*s, 1) } else { (0.0, 0) }]);
        }
        total = add(total, sums);
    }
    let mean = |(sum, count): (f64, usize)| sum / count as f64;
    Ok(Means { full: mean(total[0]), foreground: (total[1].1 > 0).then(|| mean(total[1])) })
}

/// SSIM of every window of a row of windows, from left to right.
///
/// Plain loops over f64: a [`Kernel`] so that the compiler may use the vectors of this machine. Sums keep their order, so
/// that every machine gives the same bits.
struct SsimRow<'a> {
    /// The rows that the windows cover, of both images.
    pixels: [&'a [f32]; 2],
    taps: &'a [f64],
    /// Memory for the means of a, b, a^2, b^2 and ab down every column, padded by a block.
    columns: &'a mut [Vec<f64>; 5],
    /// The result.
    row: &'a mut [f64],
}

/// Windows that are computed together.
const BLOCK: usize = 16;

impl Kernel for SsimRow<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, _: S) {
        self.sum_columns();
        for (block, out) in self.row.chunks_mut(BLOCK).enumerate() {
            let means = self.columns.each_ref().map(|column| {
                let mut mean = [0.0; BLOCK];
                for (k, tap) in self.taps.iter().enumerate() {
                    let sums: &[f64; BLOCK] = column[block * BLOCK + k..].first_chunk().expect("padding");
                    mean.iter_mut().zip(sums).for_each(|(mean, sum)| *mean += tap * sum);
                }
                mean
            });
            let ssim: [f64; BLOCK] =
                std::array::from_fn(|i| ssim_of_means(means.each_ref().map(|mean| mean[i])));
            out.copy_from_slice(&ssim[..out.len()]);
        }
    }
}

impl SsimRow<'_> {
    /// Means down the columns.
    #[inline(always)]
    fn sum_columns(&mut self) {
        let width = self.pixels[0].len() / self.taps.len();
        let [a, b, aa, bb, ab] = self.columns.each_mut().map(|column| &mut column[..width]);
        for sums in [&mut *a, &mut *b, &mut *aa, &mut *bb, &mut *ab] {
            sums.fill(0.0);
        }
        for (j, tap) in self.taps.iter().enumerate() {
            let [p, q] = self.pixels.map(|pixels| &pixels[j * width..][..width]);
            for x in 0..width {
                let (p, q) = (f64::from(p[x]), f64::from(q[x]));
                a[x] += tap * p;
                b[x] += tap * q;
                aa[x] += tap * (p * p);
                bb[x] += tap * (q * q);
                ab[x] += tap * (p * q);
            }
        }
    }
}

/// Wang et al. 2004, Eq. 13, from the means of a, b, a^2, b^2 and ab.
#[inline(always)]
fn ssim_of_means([a, b, aa, bb, ab]: [f64; 5]) -> f64 {
    let (var_a, var_b, cov) = (aa - a * a, bb - b * b, ab - a * b);
    (2.0 * a * b + C1) * (2.0 * cov + C2) / ((a * a + b * b + C1) * (var_a + var_b + C2))
}

fn check(a: &AoImage, b: &AoImage, foreground: Option<&[bool]>) -> Result<()> {
    let size = |image: &AoImage| format!("{}x{}", image.width(), image.height());
    if (a.width(), a.height()) != (b.width(), b.height()) {
        return Err(Error::size("image to compare", format!("{} as the reference", size(a)), size(b)));
    }
    if a.width().min(a.height()) < MIN_SIDE {
        return Err(Error::size("images to compare", format!("at least {MIN_SIDE}x{MIN_SIDE}"), size(a)));
    }
    match foreground {
        Some(f) if f.len() != a.visibility().len() => {
            Err(Error::size("foreground mask", a.visibility().len(), f.len()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn image(width: usize, height: usize, value: impl Fn(usize, usize) -> f64) -> AoImage {
        let pixels = (0..width * height).map(|i| value(i % width, i / width) as f32).collect();
        AoImage::new(crate::Size::px(width, height), pixels).unwrap()
    }

    /// The images and the mask of `tests/scripts/metrics.py`.
    fn stored() -> (AoImage, AoImage, Vec<bool>) {
        let a = |x: usize, y: usize| ((x * x + 3 * y * y + 5 * x * y) % 64 + 2 * x + y) as f64 / 255.0;
        let noise = |x: usize, y: usize| (((37 * x + 91 * y) % 17) as f64 - 8.0) / 80.0;
        let b = |x, y| (0.9 * a(x, y) + 0.08 + noise(x, y)).clamp(0.0, 1.0);
        let inside = |i: usize| (i % 56).abs_diff(20).pow(2) + (i / 56).abs_diff(15).pow(2) < 200;
        (image(56, 40, a), image(56, 40, b), (0..56 * 40).map(inside).collect())
    }

    // f32 pixels against f64 ones: the values agree to 1e-7.
    const TOLERANCE: f64 = 1e-6;

    #[test]
    fn scores_agree_with_scikit_image() {
        let (a, b, mask) = stored();
        let c = compare(&a, &b, Some(&mask)).unwrap();
        let inside = c.foreground.unwrap();
        for (found, expected) in [
            (c.full.ssim, 0.7104742),
            (inside.ssim, 0.7005455),
            (c.full.ssim_8x8, 0.7252812),
            (inside.ssim_8x8, 0.7143950),
            (c.full.mse, 0.005479307),
            (inside.mse, 0.006195534),
            (c.full.psnr, -10.0 * 0.005479307f64.log10()),
        ] {
            assert!((found - expected).abs() < TOLERANCE, "{found} instead of {expected}");
        }
        assert_eq!((c.full.pixels, inside.pixels), (56 * 40, mask.iter().filter(|m| **m).count()));
    }

    #[test]
    fn one_changed_pixel_is_noticed() {
        let (a, b, mask) = stored();
        let mut changed = b.clone();
        changed.visibility_mut()[15 * 56 + 20] += 0.3;
        let (before, after) =
            (compare(&a, &b, Some(&mask)).unwrap(), compare(&a, &changed, Some(&mask)).unwrap());
        assert!((before.full.ssim - after.full.ssim).abs() > 100.0 * TOLERANCE);
        assert!((before.foreground.unwrap().ssim - after.foreground.unwrap().ssim).abs() > 100.0 * TOLERANCE);
        assert!((before.full.mse - after.full.mse).abs() > 10.0 * TOLERANCE);
    }

    #[test]
    fn psnr_has_known_values() {
        let (zero, grey) = (image(16, 16, |_, _| 0.0), image(16, 16, |_, _| 0.1));
        assert!((compare(&zero, &grey, None).unwrap().full.psnr - 20.0).abs() < 1e-5);
        assert_eq!(compare(&grey, &grey, None).unwrap().full.psnr, f64::INFINITY);
    }

    #[test]
    fn errors_outside_the_foreground_do_not_count_inside() {
        let left = |x: usize, _: usize| if x < 16 { 0.5 } else { 0.0 };
        let (a, b) = (image(48, 16, |_, _| 0.5), image(48, 16, left));
        let mask: Vec<bool> = (0..48 * 16).map(|i| i % 48 < 8).collect();
        let c = compare(&a, &b, Some(&mask)).unwrap();
        assert!(c.full.ssim < 0.6 && c.full.mse > 0.1, "{c:?}");
        let inside = c.foreground.unwrap();
        assert!(inside.mse == 0.0 && inside.ssim > 0.999, "{inside:?}");
        assert_eq!(compare(&a, &b, Some(&[false; 48 * 16])).unwrap().foreground, None);
    }

    #[test]
    fn images_that_cannot_be_compared_are_refused() {
        let flat = |w, h| image(w, h, |_, _| 0.5);
        let message = |a: AoImage, b: AoImage| compare(&a, &b, None).unwrap_err().to_string();
        assert!(message(flat(16, 16), flat(16, 17)).contains("16x17"));
        assert!(message(flat(10, 64), flat(10, 64)).contains("11x11"));
        assert!(compare(&flat(11, 11), &flat(11, 11), Some(&[true; 3])).is_err());
        assert_eq!(ssim(&flat(11, 11), &flat(11, 11), Window::Gaussian11).unwrap(), 1.0);
    }

    fn any_image() -> impl Strategy<Value = AoImage> {
        proptest::collection::vec(0.0f32..=1.0, 13 * 12)
            .prop_map(|v| AoImage::new(crate::Size::px(13, 12), v).unwrap())
    }

    proptest! {
        #[test]
        fn identity_symmetry_and_range(a in any_image(), b in any_image()) {
            let (ab, ba, aa) = (compare(&a, &b, None)?, compare(&b, &a, None)?, compare(&a, &a, None)?);
            prop_assert!((aa.full.ssim - 1.0).abs() < 1e-9 && (aa.full.ssim_8x8 - 1.0).abs() < 1e-9);
            prop_assert!((ab.full.ssim - ba.full.ssim).abs() < 1e-12 && ab.full.mse == ba.full.mse);
            prop_assert!(ab.full.ssim.abs() <= 1.0 && ab.full.ssim_8x8.abs() <= 1.0 && ab.full.mse <= 1.0);
        }

        #[test]
        fn more_noise_is_worse(a in any_image(), noise in any_image(), strength in 0.05f32..0.4) {
            let noisy = |k: f32| {
                let mix = |(p, n): (&f32, &f32)| 0.25 + 0.5 * p + k * (n - 0.5);
                AoImage::new(crate::Size::px(13, 12), a.visibility().iter().zip(noise.visibility()).map(mix).collect()).unwrap()
            };
            let score = |k| compare(&noisy(0.0), &noisy(k), None).unwrap().full;
            let (less, more) = (score(0.5 * strength), score(strength));
            prop_assert!(more.ssim < less.ssim && more.psnr < less.psnr, "{less:?} {more:?}");
        }
    }
}

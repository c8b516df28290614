//! SSIM and MS-SSIM of square images, on the framework's tape. Wang et al. 2004; Wang, Simoncelli and Bovik 2003.

use super::net::Kernels;
use burn::tensor::module::avg_pool2d;
use burn::tensor::ops::AvgPoolOptions;
use burn::tensor::{Device, Tensor, TensorData};

/// Side and spread of the Gaussian window. Wang et al. 2004, §III.C.
const GAUSSIAN_SIDE: usize = 11;
const SIGMA: f64 = 1.5;
/// Side of the flat window. Deep Shading's loss layer.
const FLAT_SIDE: usize = 8;

/// C1 and C2 for images in [0, 1]: Wang et al. 2004, and Deep Shading's loss layer.
pub(super) const GAUSSIAN_CONSTANTS: (f64, f64) = (0.01 * 0.01, 0.03 * 0.03);
const FLAT_CONSTANTS: (f64, f64) = (1e-4, 1e-3);

/// Exponents of the scales, finest first. Wang et al. 2003, §3.2.
const SCALES: [f64; 5] = [0.0448, 0.2856, 0.3001, 0.2363, 0.1333];

pub(super) use super::config::LEAST_MS_SSIM_SIDE;

const _: () = assert!(LEAST_MS_SSIM_SIDE == GAUSSIAN_SIDE << (SCALES.len() - 1));

/// What a scale's mean is raised to: a negative one has no power. guess: the slope of its power stays below 1000.
const LEAST_MEAN: f64 = 1e-4;

/// A sliding window for images of one size on one device.
pub(super) struct Window {
    mean: Mean,
    constants: (f64, f64),
}

/// Weighted means over the places of a window, along both axes.
enum Mean {
    /// The weights along an axis as a banded matrix 1 x 1 x (side - taps + 1) x side: a matrix product differentiates
    /// everywhere and is fast on the CPU.
    Product(Box<Tensor<4>>),
    /// The weights along an axis. On GPUs frameworks multiply matrices in numbers of ten bits, and in flat places variances, which
    /// are differences of means, would be nothing but rounding.
    Sums(Vec<f32>),
}

/// Numerators and denominators of SSIM's two factors for every window, each Bx1xHxW.
struct Factors {
    luminance: (Tensor<4>, Tensor<4>),
    structure: (Tensor<4>, Tensor<4>),
}

impl Window {
    /// 11x11 with a spread of 1.5, for images of `side` px.
    pub(super) fn gaussian11(side: usize, on: (&Device, Kernels)) -> Self {
        let centre = (GAUSSIAN_SIDE / 2) as f64;
        let tap = |i: usize| (-(i as f64 - centre).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
        let taps: Vec<f64> = (0..GAUSSIAN_SIDE).map(tap).collect();
        Self { mean: Mean::new(&taps, side, on), constants: GAUSSIAN_CONSTANTS }
    }

    /// 8x8 with equal weights, for images of `side` px.
    pub(super) fn flat8(side: usize, on: (&Device, Kernels)) -> Self {
        Self { mean: Mean::new(&[1.0; FLAT_SIDE], side, on), constants: FLAT_CONSTANTS }
    }

    /// Mean over all windows that lie inside the images Bx1xHxW.
    pub(super) fn ssim(&self, x: Tensor<4>, y: Tensor<4>) -> Tensor<1> {
        self.factors(x, y).ssim().mean()
    }

    fn factors(&self, x: Tensor<4>, y: Tensor<4>) -> Factors {
        let mean = |image| self.mean.of(image);
        let (mx, my) = (mean(x.clone()), mean(y.clone()));
        let vx = mean(x.clone() * x.clone()) - mx.clone() * mx.clone();
        let vy = mean(y.clone() * y.clone()) - my.clone() * my.clone();
        let cov = mean(x * y) - mx.clone() * my.clone();
        let (c1, c2) = self.constants;
        Factors {
            luminance: (mx.clone() * my.clone() * 2.0 + c1, mx.clone() * mx + my.clone() * my + c1),
            structure: (cov * 2.0 + c2, vx + vy + c2),
        }
    }
}

impl Mean {
    /// Weights are divided by their sum.
    fn new(taps: &[f64], side: usize, (device, by): (&Device, Kernels)) -> Self {
        let total: f64 = taps.iter().sum();
        let taps: Vec<_> = taps.iter().map(|tap| (tap / total) as f32).collect();
        match by {
            Kernels::Own => Self::Product(Box::new(band(&taps, side, device))),
            Kernels::Framework => Self::Sums(taps),
        }
    }

    /// Of images Bx1xHxW, for windows that lie inside them.
    fn of(&self, image: Tensor<4>) -> Tensor<4> {
        match self {
            Self::Product(rows) => {
                let columns = rows.clone().swap_dims(2, 3);
                (**rows).clone().matmul(image).matmul(columns)
            }
            Self::Sums(taps) => [2, 3].into_iter().fold(image, |image, axis| {
                let length = image.dims()[axis] + 1 - taps.len();
                let weighted = |(i, tap): (usize, &f32)| image.clone().narrow(axis, i, length) * *tap;
                let sum = taps.iter().enumerate().map(weighted).reduce(|a, b| a + b);
                sum.expect("a window has taps")
            }),
        }
    }
}

impl Factors {
    fn ssim(self) -> Tensor<4> {
        self.luminance.0 * self.structure.0 / (self.luminance.1 * self.structure.1)
    }

    /// The mean without the luminance: contrast and structure.
    fn contrast_structure(self) -> Tensor<4> {
        self.structure.0 / self.structure.1
    }
}

/// Gaussian windows for five scales.
pub(super) struct MsSsim {
    scales: Vec<Window>,
}

impl MsSsim {
    /// For images of `side` px, at least [`LEAST_MS_SSIM_SIDE`].
    pub(super) fn new(side: usize, on: (&Device, Kernels)) -> Self {
        Self { scales: (0..SCALES.len()).map(|k| Window::gaussian11(side >> k, on)).collect() }
    }

    /// Mean over the batch Bx1xHxW of the product over the scales; luminance counts at the coarsest one only.
    /// Products are of means over each image, as in the authors' program and DeepAO's.
    pub(super) fn of(&self, x: Tensor<4>, y: Tensor<4>) -> Tensor<1> {
        let half = |image: Tensor<4>| avg_pool2d(image, AvgPoolOptions::new([2, 2]));
        let (mut x, mut y) = (x, y);
        let mut product = Tensor::ones([x.dims()[0], 1, 1, 1], &x.device());
        for (k, (window, weight)) in self.scales.iter().zip(SCALES).enumerate() {
            if k > 0 {
                (x, y) = (half(x), half(y));
            }
            let factors = window.factors(x.clone(), y.clone());
            let coarsest = k + 1 == SCALES.len();
            let map = if coarsest { factors.ssim() } else { factors.contrast_structure() };
            let mean = map.mean_dim(3).mean_dim(2);
            product = product * mean.clamp_min(LEAST_MEAN).powf_scalar(weight);
        }
        product.mean()
    }
}

fn band(taps: &[f32], side: usize, device: &Device) -> Tensor<4> {
    let out = side - taps.len() + 1;
    let mut band = vec![0f32; out * side];
    for row in 0..out {
        taps.iter().enumerate().for_each(|(i, tap)| band[row * side + row + i] = *tap);
    }
    Tensor::from_data(TensorData::new(band, [1, 1, out, side]), device)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means of SSIM and of its contrast and structure, by plain loops over two-dimensional windows.
    fn plain(x: &[f64], y: &[f64], window: &[f64], (c1, c2): (f64, f64)) -> (f64, f64) {
        let (side, taps) = (x.len().isqrt(), window.len().isqrt());
        let out = side - taps + 1;
        let (mut ssim, mut structure) = (0.0, 0.0);
        for i in 0..out * out {
            let mean = |f: &dyn Fn(usize) -> f64| -> f64 {
                let at = |t: usize| (i / out + t / taps) * side + i % out + t % taps;
                window.iter().enumerate().map(|(t, w)| w * f(at(t))).sum()
            };
            let (mx, my) = (mean(&|p| x[p]), mean(&|p| y[p]));
            let (vx, vy) = (mean(&|p| (x[p] - mx).powi(2)), mean(&|p| (y[p] - my).powi(2)));
            let cs = (2.0 * mean(&|p| (x[p] - mx) * (y[p] - my)) + c2) / (vx + vy + c2);
            structure += cs;
            ssim += cs * (2.0 * mx * my + c1) / (mx * mx + my * my + c1);
        }
        (ssim / (out * out) as f64, structure / (out * out) as f64)
    }

    fn plain_gaussian() -> Vec<f64> {
        let tap = |t: i32| -> f64 { (-f64::from((t / 11 - 5).pow(2) + (t % 11 - 5).pow(2)) / 4.5).exp() };
        let total: f64 = (0..121).map(tap).sum();
        (0..121).map(|t| tap(t) / total).collect()
    }

    fn plain_ms_ssim(x: &[f64], y: &[f64]) -> f64 {
        let halved = |image: &[f64]| -> Vec<f64> {
            let (side, half) = (image.len().isqrt(), image.len().isqrt() / 2);
            let corner = |i: usize| 2 * (i / half) * side + 2 * (i % half);
            let block = |p: usize| image[p] + image[p + 1] + image[p + side] + image[p + side + 1];
            (0..half * half).map(|i| block(corner(i)) / 4.0).collect()
        };
        let (mut x, mut y, mut product) = (x.to_vec(), y.to_vec(), 1.0);
        for (k, exponent) in [0.0448, 0.2856, 0.3001, 0.2363, 0.1333].into_iter().enumerate() {
            if k > 0 {
                (x, y) = (halved(&x), halved(&y));
            }
            let (ssim, structure) = plain(&x, &y, &plain_gaussian(), (1e-4, 9e-4));
            product *= f64::powf(if k == 4 { ssim } else { structure }, exponent);
        }
        product
    }

    /// Two images that are equal up to `noise`, with values that f32 represents exactly.
    fn pair(side: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 44) as f64 / (1u64 << 20) as f64
        };
        let x: Vec<f64> =
            (0..side * side).map(|i| 0.5 * random() + 0.3 * (i / side / 9 % 2) as f64).collect();
        let y = x.iter().map(|x| f64::from((0.8 * x + 0.1 + noise * random()) as f32)).collect();
        (x, y)
    }

    fn tensor(values: &[f64], device: &Device) -> Tensor<4> {
        let side = values.len().isqrt();
        let values: Vec<f32> = values.iter().map(|v| *v as f32).collect();
        Tensor::from_data(TensorData::new(values, [1, 1, side, side]), device)
    }

    /// Largest difference to the loops in f64: variances are differences of f32 numbers. Measured 2e-6.
    const AGREEMENT: f64 = 1e-5;

    #[test]
    fn both_windows_agree_with_plain_loops() {
        let device = Device::flex();
        let (x, y) = pair(40, 0.3);
        let flat = [1.0 / 64.0; 64];
        for by in [Kernels::Own, Kernels::Framework] {
            let cases = [
                (Window::gaussian11(40, (&device, by)), plain(&x, &y, &plain_gaussian(), (1e-4, 9e-4))),
                (Window::flat8(40, (&device, by)), plain(&x, &y, &flat, (1e-4, 1e-3))),
            ];
            for (window, (expected, _)) in cases {
                let found: f32 = window.ssim(tensor(&x, &device), tensor(&y, &device)).into_scalar();
                assert!(
                    (f64::from(found) - expected).abs() < AGREEMENT,
                    "{by:?}: {found}, expected {expected}"
                );
                assert!((0.3..0.9).contains(&expected), "{expected}: neither alike nor strange");
            }
        }
    }

    /// 190 halves to 95, 47, 23 and 11: odd sides lose their last row.
    #[test]
    fn ms_ssim_agrees_with_plain_loops_and_so_does_its_slope() {
        let device = Device::flex().autodiff();
        for side in [LEAST_MS_SSIM_SIDE, 190] {
            let (x, y) = pair(side, 0.6);
            let image = tensor(&x, &device).require_grad();
            let loss = MsSsim::new(side, (&device, Kernels::Own)).of(image.clone(), tensor(&y, &device));
            let slope: Vec<f32> = image.grad(&loss.backward()).unwrap().into_data().try_into_vec().unwrap();
            let (found, expected) = (f64::from(loss.into_scalar::<f32>()), plain_ms_ssim(&x, &y));
            assert!((found - expected).abs() < AGREEMENT, "{side}: {found}, expected {expected}");
            assert!((0.3..0.95).contains(&expected), "{expected}: neither alike nor strange");

            let step = 1e-4;
            let moved = |by: f64| -> Vec<f64> {
                x.iter().zip(&slope).map(|(x, s)| x + by * f64::from(s.signum())).collect()
            };
            let numeric = (plain_ms_ssim(&moved(step), &y) - plain_ms_ssim(&moved(-step), &y)) / (2.0 * step);
            let analytic: f64 = slope.iter().map(|s| f64::from(s.abs())).sum();
            assert!((numeric / analytic - 1.0).abs() < 1e-3, "{side}: {analytic}, numeric {numeric}");
        }
    }

    #[test]
    fn a_batch_is_the_mean_of_its_images() {
        let device = Device::flex();
        let side = LEAST_MS_SSIM_SIDE;
        let ((x, y), (u, v)) = (pair(side, 0.2), pair(side, 0.9));
        let ms_ssim = MsSsim::new(side, (&device, Kernels::Own));
        let of = |x: &[f64], y: &[f64]| -> f32 {
            ms_ssim.of(tensor(x, &device), tensor(y, &device)).into_scalar()
        };
        let cat = |a: &[f64], b: &[f64]| Tensor::cat(vec![tensor(a, &device), tensor(b, &device)], 0);
        let both: f32 = ms_ssim.of(cat(&x, &u), cat(&y, &v)).into_scalar();
        let (first, second) = (of(&x, &y), of(&u, &v));
        assert!(first - second > 0.05, "{first} and {second} are too alike");
        assert!((both - 0.5 * (first + second)).abs() < 1e-6, "{both}, of {first} and {second}");
    }

    #[test]
    fn opposite_images_have_a_finite_slope() {
        let device = Device::flex().autodiff();
        let side = LEAST_MS_SSIM_SIDE;
        let (x, _) = pair(side, 0.0);
        let opposite: Vec<f64> = x.iter().map(|x| 1.0 - x).collect();
        let image = tensor(&x, &device).require_grad();
        let loss = MsSsim::new(side, (&device, Kernels::Own)).of(image.clone(), tensor(&opposite, &device));
        let slope: Vec<f32> = image.grad(&loss.backward()).unwrap().into_data().try_into_vec().unwrap();
        assert!(slope.iter().all(|s| s.is_finite()));
        assert!((0.0..0.3).contains(&loss.into_scalar::<f32>()));
    }
}

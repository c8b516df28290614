//! The training loss. AO-Net §3.4, Eq. 3–5.

use super::config::LossConfig;
use super::vgg::Vgg;
use burn::tensor::{Device, Tensor, TensorData};

/// Side and spread of SSIM's Gaussian window, and its constants for images in [0, 1]. Wang et al. 2004, §III.C.
const WINDOW: usize = 11;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// The loss and its terms for images of one size on one device.
pub(crate) struct Loss {
    config: LossConfig,
    blur: Tensor<4>,
    vgg: Option<Vgg>,
}

/// The terms of the loss before weighting, each a scalar; a term with weight 0 is not computed.
pub(crate) struct Terms {
    pub(crate) total: Tensor<1>,
    pub(crate) dssim: Option<Tensor<1>>,
    pub(crate) perceptual: Option<Tensor<1>>,
    pub(crate) l1: Option<Tensor<1>>,
}

impl Loss {
    /// `side` is that of the square images [px]. Without `vgg` the perceptual term is off.
    pub(crate) fn new(config: &LossConfig, side: usize, vgg: Option<Vgg>, device: &Device) -> Self {
        Self { config: config.clone(), blur: gaussian_rows(side, device), vgg }
    }

    /// Loss of `visibility` against `target`, both Bx1xHxW.
    pub(crate) fn of(&self, visibility: Tensor<4>, target: Tensor<4>) -> Terms {
        let on = |weight: f64| weight > 0.0;
        let dssim = on(self.config.dssim)
            .then(|| (ssim(visibility.clone(), target.clone(), &self.blur) * -1.0 + 1.0) * 0.5);
        let vgg = self.vgg.as_ref().filter(|_| on(self.config.perceptual));
        let perceptual = vgg.map(|vgg| vgg.distance(visibility.clone(), target.clone()));
        let l1 = on(self.config.l1).then(|| (visibility - target).abs().mean());
        let weighted =
            [(&dssim, self.config.dssim), (&perceptual, self.config.perceptual), (&l1, self.config.l1)];
        let total = weighted.into_iter().filter_map(|(term, weight)| Some(term.clone()? * weight));
        let total = total.reduce(|a, b| a + b).expect("a checked configuration has a term");
        Terms { total, dssim, perceptual, l1 }
    }
}

/// Mean SSIM over all windows that lie inside the image.
fn ssim(x: Tensor<4>, y: Tensor<4>, rows: &Tensor<4>) -> Tensor<1> {
    let columns = rows.clone().swap_dims(2, 3);
    let blur = |image: Tensor<4>| rows.clone().matmul(image).matmul(columns.clone());
    let (mx, my) = (blur(x.clone()), blur(y.clone()));
    let vx = blur(x.clone() * x.clone()) - mx.clone() * mx.clone();
    let vy = blur(y.clone() * y.clone()) - my.clone() * my.clone();
    let cov = blur(x * y) - mx.clone() * my.clone();
    let luminance = mx.clone() * my.clone() * 2.0 + C1;
    let structure = cov * 2.0 + C2;
    let norm = (mx.clone() * mx + my.clone() * my + C1) * (vx + vy + C2);
    (luminance * structure / norm).mean()
}

/// The window as a banded matrix (side - 10) x side: a matrix product differentiates everywhere and is fast.
fn gaussian_rows(side: usize, device: &Device) -> Tensor<4> {
    let centre = (WINDOW / 2) as f64;
    let tap = |i: usize| (-(i as f64 - centre).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    let total: f64 = (0..WINDOW).map(tap).sum();
    let out = side - WINDOW + 1;
    let mut band = vec![0f32; out * side];
    for row in 0..out {
        (0..WINDOW).for_each(|i| band[row * side + row + i] = (tap(i) / total) as f32);
    }
    Tensor::from_data(TensorData::new(band, [1, 1, out, side]), device)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(side: usize, value: impl Fn(usize, usize) -> f32) -> Tensor<4> {
        let values: Vec<f32> = (0..side * side).map(|i| value(i / side, i % side)).collect();
        Tensor::from_data(TensorData::new(values, [1, 1, side, side]), &Device::flex())
    }

    fn terms(x: Tensor<4>, y: Tensor<4>) -> Terms {
        let config = LossConfig { dssim: 0.94, perceptual: 0.06, vgg_layers: vec![], l1: 0.5 };
        Loss::new(&config, x.dims()[2], None, &Device::flex()).of(x, y)
    }

    #[test]
    fn equal_images_cost_nothing() {
        let x = image(32, |y, x| ((y * 3 + x) % 7) as f32 / 7.0);
        assert!(terms(x.clone(), x).total.into_scalar::<f32>().abs() < 1e-5);
    }

    #[test]
    fn flat_images_have_the_closed_form() {
        let (a, b) = (0.25f64, 0.75f64);
        let t = terms(image(32, |_, _| a as f32), image(32, |_, _| b as f32));
        let ssim = (2.0 * a * b + C1) / (a * a + b * b + C1);
        let dssim = f64::from(t.dssim.unwrap().into_scalar::<f32>());
        // Variances are differences of f32 numbers near 1, off by up to 1e-7; C2 is 9e-4.
        assert!((dssim - 0.5 * (1.0 - ssim)).abs() < 2e-4, "{dssim}");
        assert!((t.l1.unwrap().into_scalar::<f32>() - 0.5).abs() < 1e-6);
        assert!(t.perceptual.is_none());
    }
}

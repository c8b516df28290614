//! The training loss. AO-Net §3.4, Eq. 3–5.

use super::config::{LossConfig, SsimWindow};
use super::net::Kernels;
use super::ssim::{MsSsim, Window};
use super::vgg::Vgg;
use burn::tensor::{Device, Tensor};

/// The loss and its terms for images of one size on one device.
pub(crate) struct Loss {
    config: LossConfig,
    window: Window,
    ms_ssim: Option<MsSsim>,
    vgg: Option<Vgg>,
}

/// The loss, and terms of it before weighting, each a scalar; a term with weight 0 is not computed.
pub(crate) struct Terms {
    pub(crate) total: Tensor<1>,
    pub(crate) dssim: Option<Tensor<1>>,
    pub(crate) perceptual: Option<Tensor<1>>,
    pub(crate) l1: Option<Tensor<1>>,
    pub(crate) psnr: Option<Tensor<1>>,
}

/// Mean squared error of 40 dB, beyond which the PSNR term fades out.
const FADE_MSE: f64 = 1e-4;

impl Loss {
    /// `side` is the side of the square images (px). Without `vgg` the perceptual term is off.
    pub(crate) fn new(config: &LossConfig, side: usize, vgg: Option<Vgg>, on: (&Device, Kernels)) -> Self {
        let window = match config.ssim_window {
            SsimWindow::Gaussian11 => Window::gaussian11(side, on),
            SsimWindow::Flat8 => Window::flat8(side, on),
        };
        let ms_ssim = (config.ms_ssim > 0.0).then(|| MsSsim::new(side, on));
        Self { config: config.clone(), window, ms_ssim, vgg }
    }

    /// Loss of `visibility` against `target`, both Bx1xHxW.
    pub(crate) fn of(&self, visibility: Tensor<4>, target: Tensor<4>) -> Terms {
        let (config, pair) = (&self.config, || (visibility.clone(), target.clone()));
        let on = |weight: f64| (weight > 0.0).then(pair);
        let dssim = on(config.dssim).map(|(x, y)| (self.window.ssim(x, y) * -1.0 + 1.0) * 0.5);
        let ms_ssim = self.ms_ssim.as_ref().zip(on(config.ms_ssim));
        let ms_ssim = ms_ssim.map(|(ms_ssim, (x, y))| ms_ssim.of(x, y) * -1.0 + 1.0);
        let perceptual = self.vgg.as_ref().zip(on(config.perceptual));
        let perceptual = perceptual.map(|(vgg, (x, y))| vgg.distance(x, y));
        let l1 = on(config.l1).map(|(x, y)| (x - y).abs().mean());
        let psnr = on(config.psnr).map(|(x, y)| {
            let error = x - y;
            let pixels = error.dims()[2] * error.dims()[3];
            let crops = error.dims()[0];
            let mse = (error.clone() * error).reshape([crops, pixels]).mean_dim(1);
            ((mse / FADE_MSE + 1.0).log() / std::f64::consts::LN_10).mean()
        });
        let weighted = [
            (&dssim, config.dssim),
            (&ms_ssim, config.ms_ssim),
            (&perceptual, config.perceptual),
            (&l1, config.l1),
            (&psnr, config.psnr),
        ];
        let total = weighted.into_iter().filter_map(|(term, weight)| Some(term.clone()? * weight));
        let total = total.reduce(|a, b| a + b).expect("a checked configuration has a term");
        Terms { total, dssim, perceptual, l1, psnr }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ssim::{GAUSSIAN_CONSTANTS, LEAST_MS_SSIM_SIDE};
    use super::*;
    use burn::tensor::TensorData;

    const SIDE: usize = LEAST_MS_SSIM_SIDE;

    fn image(value: impl Fn(usize, usize) -> f32) -> Tensor<4> {
        let values: Vec<f32> = (0..SIDE * SIDE).map(|i| value(i / SIDE, i % SIDE)).collect();
        Tensor::from_data(TensorData::new(values, [1, 1, SIDE, SIDE]), &Device::flex())
    }

    fn terms(config: &LossConfig, x: Tensor<4>, y: Tensor<4>) -> Terms {
        Loss::new(config, SIDE, None, (&Device::flex(), Kernels::Own)).of(x, y)
    }

    fn every_term(ssim_window: SsimWindow) -> LossConfig {
        let vgg_layers = vec![];
        LossConfig {
            dssim: 0.94,
            perceptual: 0.06,
            vgg_layers,
            l1: 0.5,
            ms_ssim: 0.84,
            psnr: 0.1,
            ssim_window,
        }
    }

    #[test]
    fn equal_images_cost_nothing() {
        for window in [SsimWindow::Gaussian11, SsimWindow::Flat8] {
            let x = image(|y, x| ((y * 3 + x) % 7) as f32 / 7.0);
            let total = terms(&every_term(window), x.clone(), x).total;
            assert!(total.into_scalar::<f32>().abs() < 1e-5);
        }
    }

    /// Variances are zero: SSIM is its luminance, and MS-SSIM the power of it at the coarsest scale. But variances are
    /// differences of f32 numbers near 1, off by up to 1e-7; C2 is 9e-4.
    #[test]
    fn flat_images_have_the_closed_form() {
        let (a, b, c1) = (0.25f64, 0.75f64, GAUSSIAN_CONSTANTS.0);
        let (x, y) = (image(|_, _| a as f32), image(|_, _| b as f32));
        let luminance = (2.0 * a * b + c1) / (a * a + b * b + c1);
        for window in [SsimWindow::Gaussian11, SsimWindow::Flat8] {
            let t = terms(&every_term(window), x.clone(), y.clone());
            let dssim = f64::from(t.dssim.unwrap().into_scalar::<f32>());
            assert!((dssim - 0.5 * (1.0 - luminance)).abs() < 2e-4, "{dssim}");
            assert!((t.l1.unwrap().into_scalar::<f32>() - 0.5).abs() < 1e-6);
            let psnr = f64::from(t.psnr.unwrap().into_scalar::<f32>());
            assert!((psnr - 2501f64.log10()).abs() < 1e-5, "{psnr}");
            assert!(t.perceptual.is_none());
        }
        let deep_ao = LossConfig { ms_ssim: 0.84, l1: 0.24, ..LossConfig::default() };
        let total = f64::from(terms(&deep_ao, x, y).total.into_scalar::<f32>());
        let expected = 0.84 * (1.0 - luminance.powf(0.1333)) + 0.24 * 0.5;
        assert!((total - expected).abs() < 2e-4, "{total}, expected {expected}");
    }
}

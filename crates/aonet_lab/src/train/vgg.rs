//! VGG-19 features for the perceptual loss. AO-Net Eq. 4; Simonyan and Zisserman 2014, configuration E.

use super::flex_ops;
use super::net::Kernels;
use aonet_scene::error::{Error, Result};
use burn::tensor::activation::relu;
use burn::tensor::module::{conv2d, max_pool2d};
use burn::tensor::ops::{ConvOptions, MaxPoolOptions};
use burn::tensor::{Device, Tensor, TensorData};
use half::f16;
use safetensors::{Dtype, SafeTensors};
use std::path::Path;

/// Activation name, torchvision index of its convolution, output channels, whether 2x2 max pooling comes before.
const LAYERS: [(&str, usize, usize, bool); 8] = [
    ("relu1_1", 0, 64, false),
    ("relu1_2", 2, 64, false),
    ("relu2_1", 5, 128, true),
    ("relu2_2", 7, 128, false),
    ("relu3_1", 10, 256, true),
    ("relu3_2", 12, 256, false),
    ("relu3_3", 14, 256, false),
    ("relu3_4", 16, 256, false),
];

/// ImageNet statistics of the three colour channels, as torchvision has them.
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const STD: [f32; 3] = [0.229, 0.224, 0.225];

/// The first convolutions of VGG-19, as deep as the deepest compared layer; frozen.
///
/// Measured on one core, there and back: a crop of 128 px takes 0.07 s up to relu1_2 and 0.18 s up to relu2_2, with the
/// framework's convolutions 0.08 s and 0.18 s; the paper's network with the other terms takes 0.018 s.
pub(crate) struct Vgg {
    layers: Vec<Layer>,
    mean: Tensor<4>,
    std: Tensor<4>,
    by: Kernels,
}

struct Layer {
    weight: Tensor<4>,
    bias: Tensor<1>,
    pool_before: bool,
    compared: bool,
}

impl Vgg {
    /// Reads `features.N.{weight,bias}` (torchvision's names, OIHW, f16 or f32) from a safetensors file.
    ///
    /// # Errors
    /// When the file is no such file, or `compared` names an unknown layer.
    pub(crate) fn load(path: &Path, compared: &[String], (device, by): (&Device, Kernels)) -> Result<Self> {
        // Constants beside images that are on the tape.
        let device = &device.clone().inner();
        if let Some(unknown) = compared.iter().find(|name| !LAYERS.iter().any(|l| l.0 == name.as_str())) {
            let known: Vec<_> = LAYERS.iter().map(|l| l.0).collect();
            return Err(Error::request("loss vgg_layers", known.join(", "), unknown));
        }
        let deepest = LAYERS.iter().rposition(|l| compared.iter().any(|c| c == l.0));
        let deepest =
            deepest.ok_or_else(|| Error::request("loss vgg_layers", "at least one layer", "none"))?;
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let file =
            SafeTensors::deserialize(&bytes).map_err(|e| Error::file(path, "a safetensors file", e))?;
        let mut layers = Vec::new();
        let mut channels = 3;
        for (name, index, out, pool_before) in LAYERS.into_iter().take(deepest + 1) {
            let weight = values(&file, (path, &format!("features.{index}.weight")), &[out, channels, 3, 3])?;
            let bias = values(&file, (path, &format!("features.{index}.bias")), &[out])?;
            layers.push(Layer {
                weight: Tensor::from_data(TensorData::new(weight, [out, channels, 3, 3]), device),
                bias: Tensor::from_data(TensorData::new(bias, [out]), device),
                pool_before,
                compared: compared.iter().any(|c| c == name),
            });
            channels = out;
        }
        let constant = |v: [f32; 3]| Tensor::from_data(TensorData::new(v.to_vec(), [1, 3, 1, 1]), device);
        Ok(Self { layers, mean: constant(MEAN), std: constant(STD), by })
    }

    /// Sum over the compared layers of the root mean square difference of activations; images are Bx1xHxW in [0, 1].
    pub(crate) fn distance(&self, x: Tensor<4>, y: Tensor<4>) -> Tensor<1> {
        let grey = |image: Tensor<4>| self.features(image.repeat_dim(1, 3));
        // The target needs no gradient, so it is not on the tape.
        let distances = grey(x).into_iter().zip(grey(y.inner())).map(|(x, y)| {
            let difference = x - y;
            ((difference.clone() * difference).mean() + 1e-12).sqrt()
        });
        distances.reduce(|a, b| a + b).expect("at least one layer is compared")
    }

    /// Activations of the compared layers for RGB images Bx3xHxW in [0, 1].
    fn features(&self, image: Tensor<4>) -> Vec<Tensor<4>> {
        let mut x = (image - self.mean.clone()) / self.std.clone();
        let mut compared = Vec::new();
        for layer in &self.layers {
            if layer.pool_before {
                x = max_pool2d(x, MaxPoolOptions::new([2, 2]));
            }
            x = relu(self.conv(x, layer));
            if layer.compared {
                compared.push(x.clone());
            }
        }
        compared
    }

    /// Beyond its border the image is zero, as VGG-19 was trained.
    fn conv(&self, x: Tensor<4>, layer: &Layer) -> Tensor<4> {
        let (weight, bias) = (layer.weight.clone(), layer.bias.clone());
        match self.by {
            Kernels::Framework => conv2d(x, weight, Some(bias), ConvOptions::new([1, 1], [1, 1], [1, 1], 1)),
            Kernels::Own => {
                // Repeated edges lie outside a ring of zeros, which is cut off again.
                let [_, _, h, w] = x.dims();
                let ringed = flex_ops::conv(x.pad((1, 1, 1, 1), 0.0), (weight, bias), 1.0);
                ringed.narrow(2, 1, h).narrow(3, 1, w)
            }
        }
    }
}

fn values(file: &SafeTensors<'_>, (path, name): (&Path, &str), shape: &[usize]) -> Result<Vec<f32>> {
    let view = file.tensor(name).map_err(|e| Error::file(path, format!("tensor {name}"), e))?;
    if view.shape() != shape {
        return Err(Error::file(path, format!("{name} of shape {shape:?}"), format!("{:?}", view.shape())));
    }
    match view.dtype() {
        Dtype::F16 => {
            Ok(view.data().chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect())
        }
        Dtype::F32 => {
            Ok(view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
        }
        other => Err(Error::file(path, format!("{name} as f16 or f32"), format!("{other:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::TensorView;
    use std::path::PathBuf;

    /// Mean and standard deviation of the original network's activations on uniform noise of 3x64x64, and the power
    /// of two by which the stored weights scale them down.
    const NOISE: [(&str, f64, f64, i32); 4] = [
        ("relu1_2", 123.514, 158.708, 6),
        ("relu2_2", 181.103, 350.337, 6),
        ("relu3_1", 203.393, 359.967, 6),
        ("relu3_4", 722.516, 1122.477, 8),
    ];

    fn noise(seed: u64) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        }
    }

    #[test]
    fn noise_excites_the_layers_as_in_the_original_network() {
        let Some(data) = std::env::var_os("AONET_DATA") else {
            eprintln!("skipped: AONET_DATA is not set");
            return;
        };
        let path = Path::new(&data).join("vgg19/vgg19_features_unit_f16.safetensors");
        let device = Device::flex();
        let vgg = Vgg::load(&path, &NOISE.map(|n| n.0.to_owned()), (&device, Kernels::Own)).unwrap();
        let noise: Vec<f32> = std::iter::repeat_with(noise(1)).take(3 * 64 * 64).collect();
        let image = Tensor::from_data(TensorData::new(noise, [1, 3, 64, 64]), &device);
        for ((name, mean, std, scale), found) in NOISE.into_iter().zip(vgg.features(image)) {
            let values: Vec<f32> = found.into_data().try_into_vec().unwrap();
            let n = values.len() as f64;
            let found_mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
            let found_std =
                (values.iter().map(|v| (f64::from(*v) - found_mean).powi(2)).sum::<f64>() / n).sqrt();
            let near =
                |found: f64, expected: f64| (found * f64::from(scale).exp2() / expected - 1.0).abs() < 0.05;
            assert!(near(found_mean, mean) && near(found_std, std), "{name}: {found_mean} {found_std}");
        }
    }

    /// A file of random weights as far as relu2_1, small enough that activations stay near 1.
    fn random_weights(dir: &Path) -> PathBuf {
        let mut random = noise(3);
        let mut entries = Vec::new();
        for (index, shape) in [(0, [64, 3, 3, 3]), (2, [64, 64, 3, 3]), (5, [128, 64, 3, 3])] {
            let scale = 2.0 * (shape[1] as f32).sqrt().recip();
            let mut floats = |n: usize| -> Vec<u8> {
                (0..n).flat_map(|_| (scale * (random() - 0.5)).to_le_bytes()).collect()
            };
            let weight = floats(shape.iter().product());
            entries.push((format!("features.{index}.weight"), shape.to_vec(), weight));
            entries.push((format!("features.{index}.bias"), vec![shape[0]], floats(shape[0])));
        }
        let view = |(name, shape, bytes)| {
            let bytes: &Vec<u8> = bytes;
            (name, TensorView::new(Dtype::F32, shape, bytes).unwrap())
        };
        let views: Vec<_> = entries.iter().map(|(n, s, b)| view((n.clone(), s.clone(), b))).collect();
        let path = dir.join("vgg.safetensors");
        std::fs::write(&path, safetensors::serialize(views, None).unwrap()).unwrap();
        path
    }

    /// Distance of two images of noise and its slope along the first.
    fn distance_and_slope(path: &Path, by: Kernels) -> (f32, Vec<f32>) {
        let device = Device::flex().autodiff();
        let layers = ["relu1_1", "relu1_2", "relu2_1"].map(String::from);
        let vgg = Vgg::load(path, &layers, (&device, by)).unwrap();
        let image = |seed| {
            let values: Vec<f32> = std::iter::repeat_with(noise(seed)).take(2 * 16 * 24).collect();
            Tensor::<4>::from_data(TensorData::new(values, [2, 1, 16, 24]), &device).require_grad()
        };
        let (x, y) = (image(1), image(2));
        let distance = vgg.distance(x.clone(), y.clone());
        let tape = distance.backward();
        assert!(y.grad(&tape).is_none(), "the target has no slope");
        (distance.into_scalar(), x.grad(&tape).unwrap().into_data().try_into_vec().unwrap())
    }

    #[test]
    fn own_kernels_have_the_distance_and_slope_of_the_framework() {
        let dir = tempfile::tempdir().unwrap();
        let path = random_weights(dir.path());
        let (expected, expected_slope) = distance_and_slope(&path, Kernels::Framework);
        let (found, slope) = distance_and_slope(&path, Kernels::Own);
        assert!(expected > 0.1 && (found - expected).abs() < 1e-5 * expected, "{found}, not {expected}");
        let largest = expected_slope.iter().fold(0f32, |m, v| m.max(v.abs()));
        for (found, expected) in slope.iter().zip(&expected_slope) {
            assert!((found - expected).abs() < 1e-4 * largest, "{found}, not {expected}, of {largest}");
        }
    }
}

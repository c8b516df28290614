//! Frames, models and comparisons for the tests of the runtimes.
#![allow(dead_code, reason = "each test program uses some of it")]

use aonet::internals::features::{search_planes, survey_planes};
use aonet::internals::graph::{Graph, SURVEYED};
use aonet::internals::naive::{self, Inputs, Planes};
use aonet::internals::weights::Weights;
use aonet::net::{
    Arch, Channel, Features, KernelWeights, Model, ModelConfig, Output, SearchConfig, TrainingFacts,
};
use aonet::search::ArcsParams;
use aonet::{AoImage, AoParams, Camera, GBuffer, Projection, SecondLayer, Size};

/// Numbers in [0, 1) from a seed: xorshift64*.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// A frame of random depths and normals; one pixel in five is background.
pub(crate) fn frame(size: Size, seed: u64) -> GBuffer<'static> {
    let mut random = Random::new(seed);
    let pixels = size.pixels();
    let mut depth = Vec::with_capacity(pixels);
    let mut normal = Vec::with_capacity(pixels);
    for _ in 0..pixels {
        let far = random.unit() < 0.2;
        depth.push(if far { f32::INFINITY } else { 0.5 + 4.0 * random.unit() });
        let n = [random.unit() - 0.5, random.unit() - 0.5, 1.0 + random.unit()];
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        normal.push(n.map(|c| c / length));
    }
    GBuffer::new(camera(size), depth, normal).unwrap()
}

/// A curved surface that occludes itself, with a hole.
pub(crate) fn waves(size: Size) -> GBuffer<'static> {
    waves_through(Projection::Perspective { fov_y: 1.0 }, size)
}

/// The same through another lens.
pub(crate) fn waves_through(projection: Projection, size: Size) -> GBuffer<'static> {
    waves_seen_by(Camera::new(projection, size).unwrap())
}

/// The same seen by any camera at the origin.
pub(crate) fn waves_seen_by(camera: Camera) -> GBuffer<'static> {
    let (width, height) = (camera.width(), camera.height());
    let depth_at = |x: usize, y: usize| 3.0 + 0.4 * (x as f32 * 0.2).sin() * (y as f32 * 0.15).cos();
    let (mut depth, mut normal) = (Vec::new(), Vec::new());
    for i in 0..width * height {
        let (x, y) = (i % width, i / width);
        let at = |x: usize, y: usize| camera.position_view(x, y, depth_at(x, y));
        let across = (at(x + 1, y) - at(x, y)).cross(at(x, y) - at(x, y + 1));
        normal.push(across.normalize().to_array());
        let hole = (x as f32 - 30.0).hypot(y as f32 - 30.0) < 8.0;
        depth.push(if hole { f32::INFINITY } else { depth_at(x, y) });
    }
    GBuffer::new(camera, depth, normal).unwrap()
}

/// The same frame behind bars, with what they hide as the second layer. Between them there is another surface behind it,
/// which has gaps.
pub(crate) fn behind_bars(gbuffer: &GBuffer) -> GBuffer<'static> {
    let (width, mut depth, mut normal) =
        (gbuffer.width(), gbuffer.depth().to_vec(), gbuffer.normal().to_vec());
    let mut second = vec![f32::INFINITY; depth.len()];
    for i in 0..depth.len() {
        if !depth[i].is_finite() {
            continue;
        }
        match i % width % 12 {
            0..4 => {
                second[i] = depth[i];
                (depth[i], normal[i]) = (depth[i] - 0.25, [0.0, 0.0, 1.0]);
            }
            4..8 => second[i] = depth[i] + 0.1 + 0.02 * (i / width % 7) as f32,
            _ => {}
        }
    }
    with_depth_behind(&GBuffer::new(*gbuffer.camera(), depth, normal).unwrap(), second)
}

/// The same frame with a second layer of random depths; one pixel in five has none.
pub(crate) fn with_noise_behind(gbuffer: GBuffer<'static>, seed: u64) -> GBuffer<'static> {
    let mut random = Random::new(seed);
    let second = gbuffer.depth().iter().map(|first| {
        let (far, behind) = (random.unit() < 0.2, random.unit());
        if far { f32::INFINITY } else { first + behind }
    });
    with_depth_behind(&gbuffer, second.collect())
}

fn with_depth_behind(gbuffer: &GBuffer<'static>, depth: Vec<f32>) -> GBuffer<'static> {
    gbuffer.clone().with_second(SecondLayer { depth: depth.into(), normal: None }).unwrap()
}

/// A camera at the origin that sees a tenth of a radian: every normal that leans forward faces it.
pub(crate) fn camera(size: Size) -> Camera {
    let fov_y = 0.1 * size.height() as f32 / size.width().max(size.height()) as f32;
    Camera::perspective(fov_y, size).unwrap()
}

/// A model with random weights and biases, whose outputs lie around the middle of [0, 1].
pub(crate) fn model(config: ModelConfig, seed: u64) -> Model {
    let graph = Graph::new(&config).unwrap();
    let mut tensors = Weights::init(&graph, seed).tensors().clone();
    let mut random = Random::new(seed);
    // Sixteen kernel weights of 0.1 times normals that face the viewer, over three, make 0.5.
    let (head_scale, head_bias) = match (config.output, config.kernel) {
        (Output::Visibility, KernelWeights::Off) => (2.0, 0.5),
        (Output::Visibility, KernelWeights::Linear) => (0.5, 0.1),
        // Most of the test frames are open.
        (Output::Correction | Output::Shares, KernelWeights::Off) => (2.0, -0.4),
        (Output::Correction | Output::Shares, KernelWeights::Linear) => (0.5, -0.08),
        (_, KernelWeights::Softmax) => (10.0, 0.0),
    };
    for (name, tensor) in &mut tensors {
        match name.as_str() {
            // The last convolution of Deep Shading.
            "up0.bias" => tensor.values.fill(0.5),
            name if config.arch == Arch::DeepShading && name.ends_with("weight") => {
                tensor.values.iter_mut().for_each(|v| *v *= 10.0);
            }
            "head.weight" => tensor.values.iter_mut().for_each(|v| *v *= head_scale),
            "head.bias" => tensor.values.iter_mut().for_each(|v| *v = head_bias + 0.02 * random.unit()),
            name if name.ends_with("bias") => {
                tensor.values.iter_mut().for_each(|v| *v = 0.2 * random.unit() - 0.1);
            }
            _ => {}
        }
    }
    let weights = Weights::new(&graph, tensors).unwrap();
    Model::new(config, weights, TrainingFacts::default()).unwrap()
}

/// A small network: quick for the oracle.
pub(crate) fn small(features: Features, patch: usize, kernel: KernelWeights) -> ModelConfig {
    let (encoder, decoder) = (vec![5, 17], vec![18]);
    ModelConfig { patch, kernel, encoder, decoder, ..seeing(features) }
}

/// A small network that weighs shares of light.
pub(crate) fn weighing_shares(patch: usize) -> ModelConfig {
    let search = Some(SearchConfig::Arcs(ArcsParams::default()));
    let features = Features::normal_radius_light();
    ModelConfig { search, output: Output::Shares, ..small(features, patch, KernelWeights::Off) }
}

/// A small network that corrects a search and sees a survey.
pub(crate) fn surveying(patch: usize) -> ModelConfig {
    let survey = Some(ArcsParams { denoise_passes: 0, ..ArcsParams::default() });
    let output = Output::Correction;
    ModelConfig { survey, output, ..small(Features::normal_radius_horizon(), patch, KernelWeights::Off) }
}

/// The same, whose correction is smoothed.
pub(crate) fn smoothing(patch: usize) -> ModelConfig {
    ModelConfig { smooth: true, ..surveying(patch) }
}

/// The same, which weighs neighbours.
pub(crate) fn mixing(patch: usize) -> ModelConfig {
    ModelConfig { neighbours: vec![1, 3], ..smoothing(patch) }
}

/// The same, which embeds patches.
pub(crate) fn embedding(patch: usize) -> ModelConfig {
    ModelConfig { embedding: Some(9), ..mixing(patch) }
}

/// A small network that weighs shares of light and neighbours.
pub(crate) fn mixing_shares(patch: usize) -> ModelConfig {
    ModelConfig { neighbours: vec![1, 2, 4, 8], ..weighing_shares(patch) }
}

/// The paper's network with other features, and with a search if they show one.
pub(crate) fn seeing(features: Features) -> ModelConfig {
    let search = features.sees(Channel::HorizonOcclusion).then(SearchConfig::tuned);
    ModelConfig { features, search, ..ModelConfig::paper() }
}

/// The oracle's image for what the runtime's search finds: whether a tap between two pixels falls on the one or the other
/// is no matter of the network. `oracle.rs` compares the searches.
pub(crate) fn oracle(model: &Model, gbuffer: &GBuffer, params: AoParams) -> AoImage {
    let found = model.config().search.map(|search| {
        let rows = search_planes(&search, gbuffer, params).unwrap();
        Planes::from_rows((search.planes(), gbuffer.height(), gbuffer.width()), &rows)
    });
    let (config, step) = (model.config(), model.graph().alignment());
    let features = naive::features(&config.features, gbuffer, params, found.as_ref());
    let survey = config.survey.map(|arcs| survey(model, &arcs, gbuffer, params));
    naive::run_on(model, (gbuffer, params), &Inputs { features, search: found, survey }.padded(step)).unwrap()
}

/// What the runtime's survey finds.
pub(crate) fn survey(model: &Model, arcs: &ArcsParams, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let (patch, step) = (model.config().patch, model.graph().alignment());
    let cells = |side: usize| side.next_multiple_of(step) / patch;
    let (columns, rows) = (cells(gbuffer.width()), cells(gbuffer.height()));
    let found = survey_planes(arcs, gbuffer, params, [0, 0], (Size::px(columns, rows), patch)).unwrap();
    Planes::from_rows((SURVEYED, rows, columns), &found)
}

pub(crate) fn params() -> AoParams {
    AoParams::new(0.5).unwrap()
}

/// Largest absolute difference.
pub(crate) fn max_error(a: &AoImage, b: &AoImage) -> f32 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    a.visibility().iter().zip(b.visibility()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Mean absolute difference.
pub(crate) fn mean_error(a: &AoImage, b: &AoImage) -> f32 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let sum = a.visibility().iter().zip(b.visibility()).map(|(a, b)| (a - b).abs()).sum::<f32>();
    sum / a.visibility().len() as f32
}

/// How far the foreground of an image spreads, largest minus smallest value.
pub(crate) fn spread(image: &AoImage, gbuffer: &GBuffer) -> f32 {
    let foreground = image.visibility().iter().enumerate().filter(|(i, _)| gbuffer.is_foreground(*i));
    let (low, high) = foreground.fold((1f32, 0f32), |(low, high), (_, v)| (low.min(*v), high.max(*v)));
    high - low
}

/// Panics if two images differ by more than `tolerance` somewhere.
pub(crate) fn assert_close(a: &AoImage, b: &AoImage, (tolerance, what): (f32, &str)) {
    let error = max_error(a, b);
    assert!(error <= tolerance, "{what}: error {error:e}, tolerance {tolerance:e}");
}

/// A camera whose axis is far from the middle and whose pixels are higher than wide.
pub(crate) fn off_centre(size: Size) -> Camera {
    let camera = Camera::perspective(0.9, size).unwrap();
    let [x, y] = camera.focal_px();
    camera.with_focal_px([1.3 * x, y]).unwrap().with_centre_px([30.25, 70.5]).unwrap()
}

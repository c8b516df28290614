//! Compares the trainer with the oracle, the runtime, finite differences and itself.

use super::loss::Loss;
use super::net::Kernels;
use super::optimizer::Gradients;
use super::samples::{self, Crop};
use super::step::{Stepper, single_threaded_pools};
use super::{
    Augment, ExactSurvey, LossConfig, Optimizer, TrainConfig, TrainDevice, TrainRun, agreement, net, train,
};
use crate::dataset::{DatasetParams, DatasetPlan, Manifest, Preset, Work};
use crate::exact::{self, Extent};
use aonet::internals::graph::{Graph, SURVEYED};
use aonet::internals::naive::{self, Inputs, Planes};
use aonet::internals::weights::Weights;
use aonet::net::{
    Arch, Channel, Features, KernelWeights, Model, ModelConfig, Output, SearchConfig, Skips, TrainingFacts,
};
use aonet::search::ArcsParams;
use aonet_scene::scene::procedural::Kind;
use aonet_scene::staging::{SceneSpec, SceneSplit};
use burn::tensor::{Device, Tensor, TensorData};
use std::path::Path;

/// Largest difference between two f32 networks of this size; measured 4e-6, allowed ten times that.
const AGREEMENT: f32 = 4e-5;

fn noise(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

/// A network as training from scratch finds it.
pub(super) fn untrained(config: ModelConfig) -> Model {
    let weights = Weights::init(&Graph::new(&config).unwrap(), 3);
    Model::new(config, weights, TrainingFacts::default()).unwrap()
}

fn model(config: ModelConfig, seed: u64) -> Model {
    let graph = Graph::new(&config).unwrap();
    // Biases start at zero: give every parameter something to be wrong about.
    let mut random = noise(seed);
    let mut tensors = Weights::init(&graph, seed).tensors().clone();
    tensors.values_mut().filter(|t| t.shape.len() == 1).for_each(|t| t.values.fill_with(|| 0.1 * random()));
    // Training starts with a nearly flat image.
    let flat =
        |name: &str| name == "head.weight" || config.arch == Arch::DeepShading && name.ends_with("weight");
    let weights = tensors.iter_mut().filter(|(name, _)| flat(name));
    weights.for_each(|(_, t)| t.values.iter_mut().for_each(|v| *v *= 10.0));
    Model::new(config, Weights::new(&graph, tensors).unwrap(), TrainingFacts::default()).unwrap()
}

/// Random values in [-1, 1].
pub(super) fn features(channels: usize, (height, width): (usize, usize)) -> Planes {
    let mut random = noise(5);
    let values: Vec<f32> = (0..channels * height * width).map(|_| random()).collect();
    Planes { channels, height, width, values }
}

fn through_the_trainer(model: &Model, input: &Planes, by: Kernels) -> Vec<f32> {
    through_the_trainer_with(model, (input, None), by)
}

fn through_the_trainer_with(
    model: &Model,
    (input, survey): (&Planes, Option<&Planes>),
    by: Kernels,
) -> Vec<f32> {
    let device = Device::flex().autodiff();
    let params = net::upload(model.weights(), &device);
    let tensor = |planes: &Planes| {
        let shape = [1, planes.channels, planes.height, planes.width];
        Tensor::<4>::from_data(TensorData::new(planes.values.clone(), shape), &device)
    };
    let seen = net::Seen { planes: tensor(input), survey: survey.map(tensor) };
    net::forward(model.graph(), &params, seen, by).into_data().try_into_vec().unwrap()
}

fn largest_difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn small(config: ModelConfig) -> ModelConfig {
    ModelConfig { encoder: vec![5, 7, 6], decoder: vec![6, 4], ..config }
}

#[test]
fn the_trainer_agrees_with_the_oracle_for_every_row_of_the_tables() {
    for patch in [1, 4] {
        for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
            for features_kind in [Features::normal(), Features::normal_projected_radius()] {
                let config = small(ModelConfig {
                    patch,
                    kernel,
                    features: features_kind.clone(),
                    ..ModelConfig::paper()
                });
                let model = model(config, 3);
                let input = features(features_kind.channels().len(), (32, 48));
                let expected = naive::evaluate(&model, &input.clone().into()).values;
                for by in [Kernels::Framework, Kernels::Own] {
                    let found = through_the_trainer(&model, &input, by);
                    let difference = largest_difference(&expected, &found);
                    assert!(difference < AGREEMENT, "{:?}, {by:?}: {difference}", model.config());
                }
            }
        }
    }
}

#[test]
fn the_trainer_agrees_with_the_oracle_for_the_baselines_and_without_skips() {
    let no_skips = small(ModelConfig { skips: Skips::None, ..ModelConfig::paper() });
    for config in [ModelConfig::deep_shading(), ModelConfig::deep_ao(), no_skips] {
        let channels = config.features.channels().len();
        let model = model(config, 3);
        let input = features(channels, (32, 64));
        let expected = naive::evaluate(&model, &input.clone().into()).values;
        for by in [Kernels::Framework, Kernels::Own] {
            let difference = largest_difference(&expected, &through_the_trainer(&model, &input, by));
            assert!(difference < AGREEMENT, "{:?}, {by:?}: {difference}", model.config());
        }
    }
}

#[test]
fn the_trainer_agrees_with_the_oracle_about_searches() {
    let ours = small(ModelConfig::correcting());
    let unseen = ModelConfig { features: Features::normal(), ..ours.clone() };
    let uncorrected = ModelConfig { output: Output::Visibility, ..ours.clone() };
    let kernels = ModelConfig { kernel: KernelWeights::Linear, ..ours.clone() };
    let arcs = SearchConfig::Arcs(ArcsParams::default());
    let shares = ModelConfig {
        features: Features::normal_radius_light(),
        search: Some(arcs),
        output: Output::Shares,
        ..ours.clone()
    };
    let whole = ModelConfig { patch: 1, ..shares.clone() };
    let mixing = ModelConfig { neighbours: vec![1, 3], ..ours.clone() };
    let mixing_shares = ModelConfig { neighbours: vec![2], ..shares.clone() };
    let unseen_shares = ModelConfig { features: Features::normal(), ..shares.clone() };
    for config in [ours, unseen, uncorrected, kernels, shares, whole, unseen_shares, mixing, mixing_shares] {
        let search = config.search.expect("a search");
        let sampled = samples::sampled(config.features.clone(), config.search);
        let model = model(config, 3);
        let planes = features(sampled.channels().len(), (64, 64));
        let area = 64 * 64;
        let found = |plane: usize| {
            let channels = sampled.channels();
            let at = channels.iter().position(|c| c.search_plane() == Some(plane)).expect("it is sampled");
            let is_occlusion = channels[at] == Channel::HorizonOcclusion;
            let values = planes.values[at * area..][..area].iter();
            values.map(move |value| if is_occlusion { 1.0 - value } else { *value }).collect::<Vec<_>>()
        };
        let found = (0..search.planes()).flat_map(found).collect();
        let channels = model.config().features.channels().len();
        let plane = |channels: usize, values| Planes { channels, height: 64, width: 64, values };
        let inputs = Inputs {
            features: plane(channels, planes.values[..channels * area].to_vec()),
            search: Some(plane(search.planes(), found)),
            survey: None,
        };
        let expected = naive::evaluate(&model, &inputs).values;
        for by in [Kernels::Framework, Kernels::Own] {
            let difference = largest_difference(&expected, &through_the_trainer(&model, &planes, by));
            assert!(difference < AGREEMENT, "{:?}, {by:?}: {difference}", model.config());
        }
    }
}

#[test]
fn the_trainer_agrees_with_the_oracle_about_surveys() {
    let arcs = ArcsParams { denoise_passes: 0, ..ArcsParams::default() };
    for (patch, embedding) in [(1, None), (4, None), (4, Some(10))] {
        let config = ModelConfig { patch, embedding, survey: Some(arcs), ..small(ModelConfig::correcting()) };
        let model = model(config, 3);
        let planes = features(5, (64, 64));
        let cells = features(SURVEYED, (64 / patch, 64 / patch));
        let horizon = planes.values[4 * 64 * 64..].iter().map(|occlusion| 1.0 - occlusion).collect();
        let search = Some(Planes { channels: 1, height: 64, width: 64, values: horizon });
        let inputs = Inputs { features: planes.clone(), search, survey: Some(cells.clone()) };
        let expected = naive::evaluate(&model, &inputs).values;
        for by in [Kernels::Framework, Kernels::Own] {
            let found = through_the_trainer_with(&model, (&planes, Some(&cells)), by);
            let difference = largest_difference(&expected, &found);
            assert!(difference < AGREEMENT, "patches of {patch}, {by:?}: {difference}");
        }
    }
}

#[test]
fn the_agreement_check_sees_one_changed_weight() {
    let model = model(small(ModelConfig::paper()), 3);
    let input = features(3, (32, 32));
    let mut tensors = model.weights().tensors().clone();
    tensors.get_mut("dec0.conv1.weight").unwrap().values[11] += 0.05;
    let weights = Weights::new(model.graph(), tensors).unwrap();
    let changed = Model::new(model.config().clone(), weights, TrainingFacts::default()).unwrap();
    let expected = naive::evaluate(&model, &input.clone().into()).values;
    for by in [Kernels::Framework, Kernels::Own] {
        let difference = largest_difference(&expected, &through_the_trainer(&changed, &input, by));
        assert!(difference > 10.0 * AGREEMENT, "{by:?}: {difference}");
    }
}

fn gradients(model: &Model, crops: &[Crop], workers: usize) -> (f64, Gradients) {
    let device = Device::flex().autodiff();
    let config = LossConfig { dssim: 1.0, ..LossConfig::default() };
    let kernels = if workers == 0 { Kernels::Framework } else { Kernels::Own };
    let loss = Loss::new(&config, 32, None, (&device, kernels));
    let workers = single_threaded_pools(workers);
    let stepper = Stepper {
        graph: model.graph(),
        loss: &loss,
        device: &device,
        workers: &workers,
        side: 32,
        leak: 1.0,
    };
    let (losses, gradients) = stepper.gradients(model.weights(), crops);
    (losses.total, gradients)
}

fn crops(count: u64, channels: usize) -> Vec<Crop> {
    let crop = |seed| {
        let mut random = noise(seed);
        let foreground: Vec<f32> = (0..1024).map(|i| f32::from(i % 7 != 0)).collect();
        let target = (0..1024).map(|_| 0.5 + 0.5 * random()).collect();
        let features = (0..channels * 1024).map(|_| random()).collect();
        Crop { features, survey: None, target, foreground }
    };
    (0..count).map(crop).collect()
}

/// Directional derivatives along random directions through one layer at a time, the kernels' included.
#[test]
fn gradients_agree_with_finite_differences() {
    let model = model(small(ModelConfig::paper()), 9);
    let crops = crops(1, 3);
    let (_, exact) = gradients(&model, &crops, 1);
    for name in [
        "enc0.conv0.weight",
        "enc0.conv1.weight",
        "enc1.conv0.weight",
        "enc2.conv1.weight",
        "enc2.conv1.bias",
        "dec1.conv0.weight",
        "dec0.conv0.weight",
        "dec0.conv1.weight",
        "head.weight",
        "head.bias",
    ] {
        let mut random = noise(17);
        let direction: Vec<f32> = exact[name].iter().map(|_| random()).collect();
        let moved = |step: f32| {
            let mut tensors = model.weights().tensors().clone();
            let values = &mut tensors.get_mut(name).unwrap().values;
            values.iter_mut().zip(&direction).for_each(|(v, d)| *v += step * d);
            let weights = Weights::new(model.graph(), tensors).unwrap();
            let moved = Model::new(model.config().clone(), weights, TrainingFacts::default()).unwrap();
            gradients(&moved, &crops, 1).0
        };
        let analytic: f64 = exact[name].iter().zip(&direction).map(|(g, d)| f64::from(g * d)).sum();
        let step = 3e-4;
        let numeric = (moved(step) - moved(-step)) / (2.0 * f64::from(step));
        // The loss has no kinks of its own; its last digit is 6e-8, divided by the step: 1e-4.
        let tolerance = 0.02 * analytic.abs() + 1e-4;
        assert!((numeric - analytic).abs() < tolerance, "{name}: numeric {numeric}, analytic {analytic}");
    }
}

#[test]
fn workers_change_nothing() {
    let model = model(small(ModelConfig::paper()), 2);
    let crops = crops(5, 3);
    assert_eq!(gradients(&model, &crops, 1), gradients(&model, &crops, 2));
}

/// The framework in one batch against own kernels crop by crop, for every row of the tables.
#[test]
fn own_kernels_have_the_gradients_of_the_framework() {
    let mut configs = vec![ModelConfig::deep_shading(), ModelConfig::deep_ao()];
    for patch in [1, 4] {
        for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
            configs.push(small(ModelConfig { patch, kernel, ..ModelConfig::paper() }));
        }
    }
    for config in configs {
        let crops = crops(3, config.features.channels().len());
        let model = model(config, 2);
        let (whole, by_framework) = gradients(&model, &crops, 0);
        let (parts, own) = gradients(&model, &crops, 1);
        assert!((whole - parts).abs() < 1e-5, "{whole} in one batch, {parts} in parts");
        for (name, expected) in &by_framework {
            let largest = expected.iter().fold(0f32, |m, v| m.max(v.abs()));
            let difference = largest_difference(expected, &own[name]);
            assert!(difference < 1e-3 * largest, "{name}: {difference} of {largest}");
        }
    }
}

/// What a run on a device starts with.
#[test]
fn wrong_gradients_of_a_device_are_an_error() {
    let model = model(small(ModelConfig::paper()), 2);
    let crops = crops(2, 3);
    let device = Device::flex().autodiff();
    let [loss, other] = [(1.0, 0.0), (0.0, 1.0)].map(|(dssim, l1)| {
        Loss::new(&LossConfig { dssim, l1, ..LossConfig::default() }, 32, None, (&device, Kernels::Framework))
    });
    let pools = single_threaded_pools(2);
    let cpu =
        Stepper { graph: model.graph(), loss: &loss, device: &device, workers: &pools, side: 32, leak: 1.0 };
    // The whole batch at once by the framework's kernels, as on a device.
    let whole = Stepper { workers: &[], ..cpu };
    agreement::check(&whole, &cpu, model.weights(), &crops).unwrap();
    let wrong = Stepper { loss: &other, ..whole };
    let error = agreement::check(&wrong, &cpu, model.weights(), &crops).unwrap_err().to_string();
    assert!(error.contains("training device") && error.contains("differ by"), "{error}");
}

pub(super) fn tiny_dataset(dir: &Path) -> Manifest {
    let mut recipe = DatasetParams::preset(Preset::AnyRadius);
    (recipe.width, recipe.height, recipe.spp, recipe.eval_spp) = (64, 64, 64, 64);
    let scenes = vec![
        SceneSpec::procedural(Kind::ClutterPile, 1, SceneSplit::Train),
        SceneSpec::procedural(Kind::ClutterPile, 2, SceneSplit::Val),
    ];
    recipe.frames = recipe.frames.kept(|split| scenes.iter().any(|s| split.takes(s.split))).scaled_to(2);
    crate::dataset::generate(dir, &DatasetPlan::new(recipe, scenes).unwrap(), &Work::default(), &|_| ())
        .unwrap();
    Manifest::load(&dir.join("manifest.json")).unwrap()
}

pub(super) fn tiny_config(steps: u64) -> TrainConfig {
    let model = ModelConfig { encoder: vec![24, 32], decoder: vec![24], ..ModelConfig::correcting() };
    TrainConfig {
        steps,
        batch: 2,
        crop: 64,
        learning_rate: 4e-3,
        augment: Augment::default(),
        validate_every: 20,
        checkpoint_every: 5,
        ..TrainConfig::paper(model)
    }
}

pub(super) fn tiny_run(dir: &Path) -> TrainRun {
    TrainRun {
        dir: dir.to_owned(),
        start: None,
        vgg: None,
        device: TrainDevice::Flex { threads: 2 },
        time_limit: None,
        facts: TrainingFacts::default(),
    }
}

fn losses_in(dir: &Path) -> Vec<f64> {
    let log = std::fs::read_to_string(dir.join("log.jsonl")).unwrap();
    let lines = log.lines().map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap());
    lines.filter_map(|l| l["loss"].as_f64()).collect()
}

#[test]
fn a_run_learns_its_frames_and_leaves_a_usable_model() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = [tiny_dataset(&dir.path().join("frames"))];
    let run = tiny_run(&dir.path().join("run"));
    assert_eq!(train(&tiny_config(150), &manifest, &run, &|_| ()).unwrap(), 150);
    let losses = losses_in(&run.dir);
    let mean = |l: &[f64]| l.iter().sum::<f64>() / l.len() as f64;
    assert!(mean(&losses[140..]) < 0.6 * mean(&losses[..5]), "{losses:?}");
    let model = Model::from_bytes(&std::fs::read(run.dir.join("best.safetensors")).unwrap()).unwrap();
    assert!(model.facts().mean_visibility.is_some_and(|m| m > 0.2 && m < 1.0));
    assert!(run.dir.join("curves.svg").exists() && run.dir.join("config.json").exists());
}

#[test]
fn a_run_starts_from_given_weights() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = [tiny_dataset(&dir.path().join("frames"))];
    let config = TrainConfig { learning_rate: 1e-9, ..tiny_config(1) };
    let given = model(config.model.clone(), 7);
    let run = TrainRun { start: Some(given.clone()), ..tiny_run(&dir.path().join("run")) };
    train(&config, &manifest, &run, &|_| ()).unwrap();
    let trained = Model::from_bytes(&std::fs::read(run.dir.join("last.safetensors")).unwrap()).unwrap();
    for (name, tensor) in given.weights().tensors() {
        let difference = largest_difference(&tensor.values, &trained.weights().get(name).values);
        // Files hold half floats.
        assert!(difference < 2e-3, "{name}: {difference}");
    }
    // Widths may differ, levels may not.
    let [encoder, decoder] =
        [&config.model.encoder, &config.model.decoder].map(|widths| [&widths[..], &[8]].concat());
    let other = TrainConfig { model: ModelConfig { encoder, decoder, ..config.model.clone() }, ..config };
    let run = TrainRun { dir: dir.path().join("other"), ..run };
    assert!(train(&other, &manifest, &run, &|_| ()).unwrap_err().to_string().contains("enc2"));
}

#[test]
fn an_interrupted_run_ends_with_the_same_weights() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = [tiny_dataset(&dir.path().join("frames"))];
    for optimizer in [Optimizer::Adam, Optimizer::AdaDelta] {
        let config = TrainConfig { optimizer, ..tiny_config(12) };
        let dir = dir.path().join(format!("{optimizer:?}"));
        let (whole, parts) = (tiny_run(&dir.join("whole")), tiny_run(&dir.join("parts")));
        train(&config, &manifest, &whole, &|_| ()).unwrap();
        let at_once = TrainRun { time_limit: Some(std::time::Duration::ZERO), ..parts.clone() };
        for step in 1..=3 {
            assert_eq!(train(&config, &manifest, &at_once, &|_| ()).unwrap(), step);
        }
        assert_eq!(train(&config, &manifest, &parts, &|_| ()).unwrap(), 12);
        let model = |run: &TrainRun| std::fs::read(run.dir.join("last.safetensors")).unwrap();
        assert!(model(&whole) == model(&parts), "{optimizer:?}: weights differ");
        assert_eq!(losses_in(&whole.dir), losses_in(&parts.dir));
    }
}

#[test]
fn a_folder_of_another_configuration_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = [tiny_dataset(&dir.path().join("frames"))];
    let run = tiny_run(&dir.path().join("run"));
    train(&tiny_config(1), &manifest, &run, &|_| ()).unwrap();
    let error = train(&tiny_config(2), &manifest, &run, &|_| ()).unwrap_err().to_string();
    assert!(error.contains("config.json"), "{error}");
}

#[test]
fn exact_shares_stand_in_for_a_survey() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = [tiny_dataset(&dir.path().join("frames"))];
    let folder = dir.path().join("shares");
    let counted = std::cell::Cell::new(0);
    let save =
        || exact::save_all(&manifest[0], Path::new(""), (&folder, 4, 16), &|| counted.set(counted.get() + 1));
    save().unwrap();
    save().unwrap();
    assert_eq!(counted.get(), 2 * manifest[0].frames.len(), "frames that are there count as well");
    let arcs = ArcsParams { denoise_passes: 0, ..ArcsParams::default() };
    let tiny = tiny_config(1);
    let config = TrainConfig {
        model: ModelConfig { survey: Some(arcs), ..tiny.model.clone() },
        augment: Augment { without_margin: 1.0, without_second: 1.0, ..Augment::default() },
        exact_survey: Some(ExactSurvey { folder: folder.clone(), extent: Extent::OneLayer }),
        ..tiny
    };
    let scores = |config: &TrainConfig, run: &str| {
        let run = tiny_run(&dir.path().join(run));
        train(&config.clone().checked().unwrap(), &manifest, &run, &|_| ()).map(|_| {
            let log = std::fs::read_to_string(run.dir.join("log.jsonl")).unwrap();
            log.lines().last().unwrap().to_owned()
        })
    };
    let exact = scores(&config, "exact").unwrap();
    let searched = scores(&TrainConfig { exact_survey: None, ..config.clone() }, "searched").unwrap();
    assert_ne!(exact, searched, "the network sees other shares");
    let whole = ExactSurvey { extent: Extent::Whole, ..config.exact_survey.clone().unwrap() };
    let error =
        TrainConfig { exact_survey: Some(whole), ..config.clone() }.checked().unwrap_err().to_string();
    assert!(error.contains("without_margin"), "{error}");
    let blind = TrainConfig { model: tiny_config(1).model, ..config.clone() };
    assert!(blind.checked().unwrap_err().to_string().contains("a network with a survey"));
    std::fs::remove_dir_all(folder.join("one_layer")).unwrap();
    let error = scores(&config, "missing").unwrap_err().to_string();
    assert!(error.contains("one_layer"), "{error}");
}

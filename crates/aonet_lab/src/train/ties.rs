//! Networks that commute with mirroring: the image of a mirrored frame is the mirrored image.
//!
//! Ambient occlusion has this symmetry. A network that learns from mirrored crops has it only roughly, and least on scenes that it has not
//! seen. Here weights are tied: the channels between convolutions are two halves, and mirroring the frame mirrors both and swaps them. Such
//! a network has half as many free weights and runs like any other. Cohen and Welling 2016, *Group Equivariant Convolutional Networks*, for
//! the group of two elements.

use super::optimizer::Gradients;
use aonet::internals::graph::{Activation, Graph, Op};
use aonet::internals::neighbours;
use aonet::internals::weights::{Tensor, Weights};
use aonet::net::{Axis, Channel, ModelConfig};
use aonet_scene::error::{Error, Result};
use std::collections::BTreeMap;

/// For each place of a list, the place whose value it takes when the frame is mirrored, and that value's sign. Its own inverse.
type Mirrored = Vec<(usize, f32)>;

/// Which weights are tied, by parameter name.
pub(super) struct Ties(BTreeMap<String, Mirrored>);

impl Ties {
    /// The ties of a network that [`TrainConfig::checked`](super::TrainConfig::checked) lets be symmetric.
    pub(super) fn of(config: &ModelConfig, graph: &Graph) -> Self {
        let mut values: Vec<Mirrored> = Vec::new();
        let mut partners = BTreeMap::new();
        for node in graph.nodes() {
            let mirrored = match &node.op {
                Op::Input { features, .. } => {
                    let negated = |channel: &Channel| {
                        matches!(channel, Channel::Normal(Axis::X) | Channel::Position(Axis::X))
                    };
                    let signs = features.channels().iter().map(|c| if negated(c) { -1.0 } else { 1.0 });
                    signs.enumerate().collect()
                }
                Op::PatchPartition { input, patch } => partitioned(&values[*input], *patch),
                Op::Conv { input, name, size, activation, .. } => {
                    let outputs = match activation {
                        Activation::LeakyRelu => swapped(node.channels),
                        // The head: its channels are pixels of the image.
                        Activation::Linear => {
                            let planes = node.channels / (config.patch * config.patch);
                            partitioned(&head_planes(planes, &config.neighbours), config.patch)
                        }
                    };
                    partners.insert(format!("{name}.weight"), of_filters(&outputs, &values[*input], *size));
                    partners.insert(format!("{name}.bias"), outputs.clone());
                    outputs
                }
                Op::AvgPool2 { input } | Op::Upsample2 { input } => values[*input].clone(),
                Op::Concat { first, second } => side_by_side(&values[*first], &values[*second]),
                Op::Search { .. }
                | Op::Survey { .. }
                | Op::PatchMerge { .. }
                | Op::KernelPredict { .. }
                | Op::Correct { .. } => unchanged(node.channels),
            };
            values.push(mirrored);
        }
        Self(partners)
    }

    /// Random weights, symmetric and as widely spread as they were.
    pub(super) fn of_random(&self, graph: &Graph, weights: &Weights) -> Result<Weights> {
        self.tied(graph, weights, |tensor| if tensor.shape.len() > 1 { 2f32.sqrt() } else { 1.0 })
    }

    /// Checks that weights are symmetric.
    pub(super) fn expect(&self, graph: &Graph, weights: Weights) -> Result<Weights> {
        match self.tied(graph, &weights, |_| 1.0)? == weights {
            true => Ok(weights),
            false => Err(Error::request("weights to start from", "those of a symmetric network", "others")),
        }
    }

    /// Gradients of the free weights: the mean over those that are tied.
    pub(super) fn tie(&self, gradients: &mut Gradients) {
        for (name, values) in gradients {
            *values = mean_of_tied(values, &self.0[name]);
        }
    }

    fn tied(&self, graph: &Graph, weights: &Weights, scale: impl Fn(&Tensor) -> f32) -> Result<Weights> {
        let mut tensors = weights.tensors().clone();
        for (name, tensor) in &mut tensors {
            let scale = scale(tensor);
            tensor.values = mean_of_tied(&tensor.values, &self.0[name]);
            tensor.values.iter_mut().for_each(|value| *value *= scale);
        }
        Ok(Weights::new(graph, tensors)?)
    }
}

fn unchanged(count: usize) -> Mirrored {
    (0..count).map(|place| (place, 1.0)).collect()
}

/// The planes of a head: neighbours on the left become those on the right.
fn head_planes(count: usize, distances: &[usize]) -> Mirrored {
    let offsets = neighbours::offsets(distances);
    let first = count - offsets.len();
    let partner = |[down, right]: &[isize; 2]| {
        let place = offsets.iter().position(|offset| *offset == [*down, -right]);
        (first + place.expect("squares are symmetric"), 1.0)
    };
    unchanged(first).into_iter().chain(offsets.iter().map(partner)).collect()
}

fn swapped(count: usize) -> Mirrored {
    (0..count).map(|place| ((place + count / 2) % count, 1.0)).collect()
}

fn side_by_side(first: &Mirrored, second: &Mirrored) -> Mirrored {
    let second = second.iter().map(|(place, sign)| (first.len() + place, *sign));
    first.iter().copied().chain(second).collect()
}

/// Channels after [`Op::PatchPartition`]: columns of a patch change their order.
fn partitioned(channels: &Mirrored, patch: usize) -> Mirrored {
    let pixels = move |(channel, sign): &(usize, f32)| {
        let (channel, sign) = (*channel, *sign);
        let columns = move |y| (0..patch).rev().map(move |x| ((channel * patch + y) * patch + x, sign));
        (0..patch).flat_map(columns)
    };
    channels.iter().flat_map(pixels).collect()
}

/// A filter from `inputs` to `outputs`, OIHW.
fn of_filters(outputs: &Mirrored, inputs: &Mirrored, size: usize) -> Mirrored {
    let mut places = Vec::with_capacity(outputs.len() * inputs.len() * size * size);
    for (output, output_sign) in outputs {
        for (input, input_sign) in inputs {
            for y in 0..size {
                for x in (0..size).rev() {
                    let place = ((output * inputs.len() + input) * size + y) * size + x;
                    places.push((place, output_sign * input_sign));
                }
            }
        }
    }
    places
}

fn mean_of_tied(values: &[f32], partners: &Mirrored) -> Vec<f32> {
    values.iter().zip(partners).map(|(value, (place, sign))| 0.5 * (value + sign * values[*place])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::TrainConfig;
    use crate::train::tests::{features, tiny_config, tiny_dataset, tiny_run};
    use crate::train::train;
    use aonet::internals::graph::SURVEYED;
    use aonet::internals::naive::{self, Inputs, Planes};
    use aonet::net::{Features, Model, Output, SearchConfig, TrainingFacts};
    use aonet::search::ArcsParams;

    /// Tied weights, changed at one place if `broken`.
    fn model(config: &ModelConfig, broken: bool) -> Model {
        let graph = Graph::new(config).unwrap();
        let tied = Ties::of(config, &graph).of_random(&graph, &Weights::init(&graph, 3)).unwrap();
        let mut tensors = tied.tensors().clone();
        if broken {
            tensors.get_mut("dec0.conv1.weight").unwrap().values[11] += 0.3;
        }
        let weights = Weights::new(&graph, tensors).unwrap();
        Model::new(config.clone(), weights, TrainingFacts::default()).unwrap()
    }

    fn mirror(planes: &Planes, negated: Option<usize>) -> Planes {
        let Planes { channels, height, width, ref values } = *planes;
        Planes::from_fn((channels, height, width), |c, y, x| {
            let value = values[(c * height + y) * width + width - 1 - x];
            if negated == Some(c) { -value } else { value }
        })
    }

    /// Largest difference between the mirrored image and the image of the mirrored frame, and the image's range.
    fn asymmetry(config: &ModelConfig, broken: bool) -> (f32, f32) {
        let model = model(config, broken);
        let seen = features(config.features.channels().len(), (64, 64));
        let search = config.search.map(|search| features(search.planes(), (64, 64)));
        let survey = config.survey.map(|_| features(SURVEYED, (64 / config.patch, 64 / config.patch)));
        let image = naive::evaluate(
            &model,
            &Inputs { features: seen.clone(), search: search.clone(), survey: survey.clone() },
        );
        let of_mirrored = naive::evaluate(
            &model,
            &Inputs {
                features: mirror(&seen, Some(0)),
                search: search.map(|planes| mirror(&planes, None)),
                survey: survey.map(|planes| mirror(&planes, None)),
            },
        );
        let mirrored = mirror(&image, None).values;
        let differences = mirrored.iter().zip(&of_mirrored.values).map(|(a, b)| (a - b).abs());
        let (low, high) = mirrored.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        (differences.fold(0.0, f32::max), high - low)
    }

    fn small(config: ModelConfig) -> ModelConfig {
        ModelConfig { encoder: vec![8, 6, 4], decoder: vec![6, 4], ..config }
    }

    #[test]
    fn a_mirrored_frame_gives_the_mirrored_image() {
        let arcs = ArcsParams { denoise_passes: 0, ..ArcsParams::default() };
        let surveyed = ModelConfig { survey: Some(arcs), ..small(ModelConfig::correcting()) };
        let shares = ModelConfig {
            patch: 2,
            features: Features::normal_radius_light(),
            search: Some(SearchConfig::Arcs(ArcsParams::default())),
            output: Output::Shares,
            ..small(ModelConfig::correcting())
        };
        let plain = ModelConfig {
            patch: 1,
            features: Features::normal_position(),
            kernel: aonet::net::KernelWeights::Off,
            ..small(ModelConfig::paper())
        };
        let mixing = ModelConfig { neighbours: vec![1, 3], ..small(ModelConfig::correcting()) };
        let embedding = ModelConfig { embedding: Some(10), ..small(ModelConfig::correcting()) };
        // A head that starts small hides one weight of the body more than the others do.
        for (config, tells) in [(surveyed, 1e-4), (shares, 1e-4), (mixing, 3e-5), (embedding, 1e-4)] {
            let (difference, range) = asymmetry(&config, false);
            assert!(range > 0.1 && difference < 1e-5 * range, "{config:?}: {difference} of {range}");
            let (difference, _) = asymmetry(&config, true);
            assert!(difference > tells * range, "one free weight breaks it: {difference} of {range}");
        }
        // Position x changes its sign as well; the mirror above knows one channel.
        let graph = Graph::new(&plain).unwrap();
        let ties = &Ties::of(&plain, &graph).0["enc0.conv0.weight"];
        let signs: Vec<f32> = (0..6).map(|input| ties[input * 9].1).collect();
        assert_eq!(signs, [-1.0, 1.0, 1.0, -1.0, 1.0, 1.0]);
    }

    #[test]
    fn training_keeps_the_symmetry() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = [tiny_dataset(&dir.path().join("frames"))];
        let config = TrainConfig { symmetric: true, average: 0.9, ..tiny_config(3) };
        let run = tiny_run(&dir.path().join("run"));
        train(&config, &manifest, &run, &|_| ()).unwrap();
        let trained = Model::from_bytes(&std::fs::read(run.dir.join("last.safetensors")).unwrap()).unwrap();
        let graph = Graph::new(&config.model).unwrap();
        let ties = Ties::of(&config.model, &graph);
        ties.expect(&graph, trained.weights().clone()).unwrap();

        let other = crate::train::TrainRun {
            start: Some(model(&config.model, true)),
            ..tiny_run(&dir.path().join("other"))
        };
        let error = train(&config, &manifest, &other, &|_| ()).unwrap_err().to_string();
        assert!(error.contains("symmetric network"), "{error}");
    }
}

//! Weights that a run starts from, for a network that sees or says more than theirs did, or is narrower or wider.

use aonet::internals::graph::Graph;
use aonet::internals::neighbours;
use aonet::internals::weights::{Tensor, Weights};
use aonet::net::{Arch, Channel, KernelWeights, Model, ModelConfig, Output, SearchConfig, Skips};
use aonet::search::Share;
use std::collections::BTreeMap;

/// A channel of the first convolution.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Input {
    /// A feature of a pixel of the patch, by the pixel's number.
    Feature(Channel, usize),
    /// What the survey says of the patch: a share of light, or whether there is a second layer.
    Survey(Channel),
}

/// The tensors of `start` for the network of `config`, which may see channels that the other one did not, and say planes that it did not. New
/// channels of the first convolution get the weights of what said the same before, the other new ones and new planes zeros:
///
/// * A share of light was a part of what the horizon search lost. So it has the weight of the horizon occlusion, times the light that is lost for
///   this share.
/// * What the survey said of a patch is now said of each of its pixels. So each has an equal part of that weight, too.
///
/// Convolutions that are narrower keep the strongest channels. Those that are wider get channels with random weights, which nothing reads at first,
/// so the image stays the same. Tensors that differ in any other way stay as they are.
pub(super) fn fitted(config: &ModelConfig, start: &Model) -> BTreeMap<String, Tensor> {
    let mut tensors = resized(config, start);
    let (before, after) = (inputs(start.config()), inputs(config));
    if start.config().patch == config.patch
        && before != after
        && let Some(tensor) = tensors.get_mut(first_convolution(config))
        && tensor.shape[1] == before.len()
    {
        let parts = after.iter().map(|input| match before.contains(input) {
            true => vec![(*input, 1.0)],
            false => {
                stood_for(*input, config).into_iter().filter(|(part, _)| !after.contains(part)).collect()
            }
        });
        *tensor = mixed(tensor, &before, &parts.collect::<Vec<_>>());
    }
    if let (Some(before), Some(after)) = (head_planes(start.config()), head_planes(config))
        && before != after
    {
        for name in ["head.weight", "head.bias"] {
            if let Some(tensor) = tensors.get_mut(name) {
                *tensor = with_planes(tensor, before, after);
            }
        }
    }
    tensors
}

/// The weights that read features and survey.
fn first_convolution(config: &ModelConfig) -> &'static str {
    if config.embedding.is_some() { "embedding.weight" } else { "enc0.conv0.weight" }
}

/// Planes of the head of a network that corrects a search: the correction and weights of shares, and weights of neighbours.
fn head_planes(config: &ModelConfig) -> Option<[usize; 2]> {
    let shares = match config.output {
        Output::Visibility => return None,
        Output::Correction => 1,
        Output::Shares => config.search.map_or(1, |search| search.planes()),
    };
    (config.kernel == KernelWeights::Off).then(|| [shares, neighbours::count(&config.neighbours)])
}

/// A head's tensor with other planes, the new ones zeros. Planes come one after the other.
fn with_planes(tensor: &Tensor, before: [usize; 2], after: [usize; 2]) -> Tensor {
    let of_plane = tensor.values.len() / (before[0] + before[1]);
    let mut values = Vec::with_capacity(of_plane * (after[0] + after[1]));
    let mut rest = &tensor.values[..];
    for (had, has) in before.into_iter().zip(after) {
        let (own, others) = rest.split_at(had * of_plane);
        let kept = own.len().min(has * of_plane);
        values.extend(&own[..kept]);
        values.resize(values.len() + has * of_plane - kept, 0.0);
        rest = others;
    }
    let mut shape = tensor.shape.clone();
    shape[0] = shape[0] / (before[0] + before[1]) * (after[0] + after[1]);
    Tensor { shape, values }
}

/// The tensors of `start` with the widths of `config`; as they are if the networks differ in more. A narrower convolution loses its weakest channels,
/// a wider one gets new ones behind its own, with the weights of a new network. Those that read them start at zero.
// Li et al. 2017, Pruning Filters for Efficient ConvNets. A channel is as strong as the sum of its filter's absolute weights times that of all that
// read it.
fn resized(config: &ModelConfig, start: &Model) -> BTreeMap<String, Tensor> {
    let tensors = start.weights().tensors();
    let before = start.config();
    let mut resized = tensors.clone();
    let same_kind = before.embedding.is_some() == config.embedding.is_some()
        && before.arch == Arch::AoNet
        && config.arch == Arch::AoNet
        && before.skips == Skips::Concat
        && config.skips == Skips::Concat
        && before.encoder.len() == config.encoder.len();
    let widths = ModelConfig {
        embedding: config.embedding,
        encoder: config.encoder.clone(),
        decoder: config.decoder.clone(),
        ..before.clone()
    };
    let Some(graph) = Graph::new(&widths).ok().filter(|_| same_kind) else { return resized };
    let new = Weights::init(&graph, 0);
    for Conv { name, readers, width } in convolutions(before, config) {
        let (weight, bias) = (format!("{name}.weight"), format!("{name}.bias"));
        let had = tensors[&weight].shape[0];
        let kept = strongest(width, &tensors[&weight], &readers, tensors);
        for name in [weight, bias] {
            let mut filters = picked(&resized[&name], 0, &kept);
            let new = new.get(&name);
            filters.values.extend(&new.values[filters.values.len()..]);
            resized.insert(name, Tensor { shape: new.shape.clone(), ..filters });
        }
        for (reader, first) in readers {
            let tensor = &resized[&reader];
            let own = kept.iter().map(|channel| channel.map(|channel| first + channel));
            let unread = std::iter::repeat_n(None, width.saturating_sub(had));
            let rest = (first + had..tensor.shape[1]).map(Some);
            let inputs = (0..first).map(Some).chain(own).chain(unread).chain(rest);
            let read = picked(tensor, 1, &inputs.collect::<Vec<_>>());
            resized.insert(reader, read);
        }
    }
    resized
}

/// The strongest channels of a convolution, at most `width`, in order.
fn strongest(
    width: usize,
    filters: &Tensor,
    readers: &[(String, usize)],
    tensors: &BTreeMap<String, Tensor>,
) -> Vec<Option<usize>> {
    let strength = |channel: usize| {
        let read: f32 =
            readers.iter().map(|(reader, first)| size(&tensors[reader], 1, first + channel)).sum();
        size(filters, 0, channel) * read
    };
    let strengths: Vec<f32> = (0..filters.shape[0]).map(strength).collect();
    let mut kept: Vec<usize> = (0..filters.shape[0]).collect();
    kept.sort_by(|a, b| strengths[*b].total_cmp(&strengths[*a]));
    kept.truncate(width);
    kept.sort_unstable();
    kept.into_iter().map(Some).collect()
}

/// A convolution before the head.
struct Conv {
    name: String,
    /// The weights that read its outputs, and the first channel there.
    readers: Vec<(String, usize)>,
    /// Its outputs in the new network.
    width: usize,
}

/// The convolutions of a network, in an order in which the number of their outputs can change: what they read has changed before, and no channels
/// before these in a reader's input have.
fn convolutions(before: &ModelConfig, config: &ModelConfig) -> Vec<Conv> {
    let coarsest = before.encoder.len() - 1;
    let weight = |name: String| format!("{name}.weight");
    let conv = |side: &str, level: usize, readers: Vec<(String, usize)>, width: usize| {
        let [first, second] = [0, 1].map(|i| format!("{side}{level}.conv{i}"));
        let inner = vec![(weight(second.clone()), 0)];
        [Conv { name: first, readers: inner, width }, Conv { name: second, readers, width }]
    };
    // What follows an image at this level on the way up.
    let above = |level: usize| match level {
        0 => (weight("head".into()), 0),
        _ => (weight(format!("dec{}.conv0", level - 1)), 0),
    };
    let encoders = (0..=coarsest).flat_map(|level| {
        let readers = if level == coarsest {
            vec![above(level)]
        } else {
            let risen = if level + 1 == coarsest {
                before.encoder[coarsest]
            } else {
                before.decoder[coarsest - level - 2]
            };
            vec![(weight(format!("enc{}.conv0", level + 1)), 0), (weight(format!("dec{level}.conv0")), risen)]
        };
        conv("enc", level, readers, config.encoder[level])
    });
    let decoders = (0..coarsest)
        .rev()
        .flat_map(|level| conv("dec", level, vec![above(level)], config.decoder[coarsest - level - 1]));
    let readers = || vec![(weight("enc0.conv0".into()), 0)];
    let embedding =
        config.embedding.map(|width| Conv { name: "embedding".into(), readers: readers(), width });
    embedding.filter(|_| before.embedding.is_some()).into_iter().chain(encoders).chain(decoders).collect()
}

/// Sum of the absolute values at a place along an axis, 0 or 1.
fn size(tensor: &Tensor, axis: usize, at: usize) -> f32 {
    picked(tensor, axis, &[Some(at)]).values.iter().map(|value| value.abs()).sum()
}

/// The places along an axis, 0 or 1; zeros where there is none.
fn picked(tensor: &Tensor, axis: usize, places: &[Option<usize>]) -> Tensor {
    let mut shape = tensor.shape.clone();
    let (groups, inner) =
        (shape[..axis].iter().product::<usize>(), shape[axis + 1..].iter().product::<usize>());
    let mut values = Vec::with_capacity(groups * places.len() * inner);
    for group in 0..groups {
        for place in places {
            match place {
                Some(place) => {
                    values.extend(&tensor.values[(group * shape[axis] + place) * inner..][..inner])
                }
                None => values.resize(values.len() + inner, 0.0),
            }
        }
    }
    shape[axis] = places.len();
    Tensor { shape, values }
}

/// The channels of the first convolution, in order.
fn inputs(config: &ModelConfig) -> Vec<Input> {
    let pixels = config.patch * config.patch;
    let features = config.features.channels().iter();
    let features = features.flat_map(|channel| (0..pixels).map(|pixel| Input::Feature(*channel, pixel)));
    let surveyed = Share::ALL.into_iter().skip(1).map(Channel::Light).chain([Channel::SecondLayer]);
    let survey = surveyed.filter(|_| config.survey.is_some()).map(Input::Survey);
    features.chain(survey).collect()
}

/// What stood for a channel that is new, and how much of its weight the channel has.
fn stood_for(input: Input, config: &ModelConfig) -> Vec<(Input, f32)> {
    let Input::Feature(channel, pixel) = input else { return Vec::new() };
    let of_survey = (Input::Survey(channel), 1.0 / (config.patch * config.patch) as f32);
    match (channel, config.search) {
        (Channel::Light(share), Some(SearchConfig::Arcs(arcs))) => {
            let lost = Share::ALL.into_iter().skip(1).zip(arcs.lost()).find(|(found, _)| *found == share);
            let lost = lost.map_or(0.0, |(_, lost)| lost);
            vec![(Input::Feature(Channel::HorizonOcclusion, pixel), lost), of_survey]
        }
        (Channel::SecondLayer, _) => vec![of_survey],
        _ => Vec::new(),
    }
}

/// A convolution that sees the channels of `parts` instead of those of `before`.
fn mixed(tensor: &Tensor, before: &[Input], parts: &[Vec<(Input, f32)>]) -> Tensor {
    let [outputs, _, height, width] = tensor.shape[..] else { return tensor.clone() };
    let area = height * width;
    let mut values = vec![0.0; outputs * parts.len() * area];
    let of_outputs =
        values.chunks_exact_mut(parts.len() * area).zip(tensor.values.chunks_exact(before.len() * area));
    for (to, from) in of_outputs {
        for (to, parts) in to.chunks_exact_mut(area).zip(parts) {
            for (part, share) in parts {
                if let Some(channel) = before.iter().position(|input| input == part) {
                    let from = &from[channel * area..][..area];
                    to.iter_mut().zip(from).for_each(|(to, from)| *to += share * from);
                }
            }
        }
    }
    Tensor { shape: vec![outputs, parts.len(), height, width], values }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::tests::features;
    use aonet::internals::graph::Graph;
    use aonet::internals::naive::{self, Inputs};
    use aonet::internals::weights::Weights;
    use aonet::net::{Features, TrainingFacts};
    use aonet::search::ArcsParams;

    fn model(config: ModelConfig) -> Model {
        let weights = Weights::init(&Graph::new(&config).unwrap(), 3);
        Model::new(config, weights, TrainingFacts::default()).unwrap()
    }

    fn fits(config: &ModelConfig, start: &Model) -> Weights {
        Weights::new(&Graph::new(config).unwrap(), fitted(config, start)).unwrap()
    }

    /// What a network without a survey makes of a frame.
    fn image(model: &Model) -> Vec<f32> {
        let seen = features(model.config().features.channels().len(), (64, 64));
        let search = model.config().search.map(|search| features(search.planes(), (64, 64)));
        naive::evaluate(model, &Inputs { features: seen, search, survey: None }).values
    }

    #[test]
    fn channels_that_nothing_stood_for_have_no_weight() {
        for (embedding, name, area) in [(None, "enc0.conv0.weight", 9), (Some(24), "embedding.weight", 1)] {
            let start = model(ModelConfig { embedding, ..ModelConfig::correcting() });
            let fitted = fits(&ModelConfig { embedding, ..ModelConfig::balanced() }, &start);
            let (before, after) = (start.weights().get(name), fitted.get(name));
            assert!(after.shape[1] > before.shape[1]);
            let [old, new] = [before, after].map(|tensor| tensor.values.chunks_exact(tensor.shape[1] * area));
            for (old, new) in old.zip(new) {
                assert_eq!(old, &new[..old.len()]);
                assert!(new[old.len()..].iter().all(|weight| *weight == 0.0));
            }
            assert_eq!(start.weights().get("enc1.conv0.weight"), fitted.get("enc1.conv0.weight"));
        }
    }

    #[test]
    fn channels_without_weight_are_the_first_to_go() {
        let config = ModelConfig {
            embedding: Some(9),
            encoder: vec![8, 12, 10, 6],
            decoder: vec![12, 10, 8],
            ..ModelConfig::correcting()
        };
        let wide = model(config.clone());
        // These channels say nothing, so the image does not need them.
        let silent = [
            ("embedding", 4),
            ("enc0.conv0", 2),
            ("enc0.conv1", 5),
            ("enc1.conv1", 0),
            ("enc3.conv1", 4),
            ("dec2.conv1", 7),
            ("dec0.conv1", 3),
        ];
        let mut tensors = wide.weights().tensors().clone();
        for (name, channel) in silent {
            let weight = tensors.get_mut(&format!("{name}.weight")).unwrap();
            let each = weight.values.len() / weight.shape[0];
            weight.values[channel * each..][..each].fill(0.0);
        }
        // Their partners of the same level lose their weakest channel as well: nothing may read that one.
        for (name, channel) in [("enc1.conv0", 1), ("enc3.conv0", 0), ("dec2.conv0", 9), ("dec0.conv0", 6)] {
            let reader = tensors.get_mut(&format!("{}1.weight", name.strip_suffix('0').unwrap())).unwrap();
            let area = reader.shape[2] * reader.shape[3];
            let of_output = reader.shape[1] * area;
            for filter in reader.values.chunks_exact_mut(of_output) {
                filter[channel * area..][..area].fill(0.0);
            }
        }
        let graph = Graph::new(&config).unwrap();
        let wide =
            Model::new(config.clone(), Weights::new(&graph, tensors).unwrap(), TrainingFacts::default())
                .unwrap();
        let narrow = ModelConfig {
            embedding: Some(8),
            encoder: vec![7, 11, 10, 5],
            decoder: vec![11, 10, 7],
            ..config
        };
        let weights = fits(&narrow, &wide);
        let narrow = Model::new(narrow, weights, TrainingFacts::default()).unwrap();
        let images = [&wide, &narrow].map(image);
        let off = images[0].iter().zip(&images[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
        assert!(images[0].iter().any(|value| *value != images[0][0]), "a flat image");
    }

    #[test]
    fn a_wider_network_begins_with_the_same_image() {
        for embedding in [None, Some(9)] {
            let encoder = vec![8, 12, 10, 6];
            let config =
                ModelConfig { embedding, encoder, decoder: vec![12, 10, 8], ..ModelConfig::correcting() };
            let start = model(config.clone());
            let wider = ModelConfig {
                embedding: embedding.map(|width| width + 3),
                encoder: vec![9, 12, 14, 8],
                decoder: vec![13, 9, 11],
                ..config
            };
            let weights = fits(&ModelConfig { decoder: vec![13, 10, 11], ..wider.clone() }, &start);
            // The new channels say something, so they can learn to be read.
            let new = weights.get("dec0.conv1.weight");
            assert!(new.values[new.values.len() / 11 * 8..].iter().all(|weight| *weight != 0.0));
            let wide = Model::new(
                ModelConfig { decoder: vec![13, 10, 11], ..wider.clone() },
                weights,
                TrainingFacts::default(),
            );
            let [before, after] = [&start, &wide.unwrap()].map(image);
            assert_eq!(before, after);
            assert!(before.iter().any(|value| *value != before[0]), "a flat image");
            // Some levels may be narrower.
            fits(&wider, &start);
        }
    }

    #[test]
    fn shares_of_pixels_stand_for_horizon_and_survey() {
        let start = model(ModelConfig { patch: 2, ..ModelConfig::balanced() });
        let arcs = ArcsParams { hidden_close: 0.5, ..ArcsParams::default() };
        let light = Features::normal_radius_light();
        let config = ModelConfig {
            features: light,
            output: Output::Shares,
            search: Some(SearchConfig::Arcs(arcs)),
            survey: None,
            smooth: false,
            ..start.config().clone()
        };
        let fitted = fits(&config, &start);
        let name = "enc0.conv0.weight";
        let at = |weights: &Weights, config: &ModelConfig, input: Input| {
            let channel = inputs(config).iter().position(|found| *found == input).unwrap();
            weights.get(name).values[channel * 9..][..9].to_vec()
        };
        let close = Channel::Light(Share::HiddenClose);
        let found = at(&fitted, &config, Input::Feature(close, 3));
        let horizon = at(start.weights(), start.config(), Input::Feature(Channel::HorizonOcclusion, 3));
        let survey = at(start.weights(), start.config(), Input::Survey(close));
        for ((found, horizon), survey) in found.iter().zip(horizon).zip(survey) {
            assert!((found - (0.5 * horizon + 0.25 * survey)).abs() < 1e-6);
        }
        let radius = Input::Feature(Channel::ProjectedRadius, 1);
        assert_eq!(at(&fitted, &config, radius), at(start.weights(), start.config(), radius));
        // The correction, five shares, sixteen neighbours; four pixels of each.
        let (head, before) = (fitted.get("head.weight"), start.weights().get("head.weight"));
        assert_eq!((head.shape[0], before.shape[0]), (4 * 22, 4 * 17));
        let (correction, neighbours) = before.values.split_at(4 * before.shape[1]);
        let (shares, mixed) = head.values.split_at(4 * 6 * head.shape[1]);
        assert_eq!((&shares[..correction.len()], mixed), (correction, neighbours));
        assert!(shares[correction.len()..].iter().all(|weight| *weight == 0.0));
    }
}

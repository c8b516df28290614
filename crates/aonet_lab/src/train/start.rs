//! Weights that a run starts from, for a network that sees or says more than theirs did, or is narrower or wider.

use super::widths;
use aonet::internals::neighbours;
use aonet::internals::weights::Tensor;
use aonet::net::{Channel, KernelWeights, Model, ModelConfig, Output, SearchConfig};
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
    let mut tensors = widths::resized(config, start);
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
    use crate::train::tests::untrained;
    use aonet::internals::graph::Graph;
    use aonet::internals::weights::Weights;
    use aonet::net::Features;
    use aonet::search::ArcsParams;

    fn fits(config: &ModelConfig, start: &Model) -> Weights {
        Weights::new(&Graph::new(config).unwrap(), fitted(config, start)).unwrap()
    }

    #[test]
    fn channels_that_nothing_stood_for_have_no_weight() {
        for (embedding, name, area) in [(None, "enc0.conv0.weight", 9), (Some(24), "embedding.weight", 1)] {
            let start = untrained(ModelConfig { embedding, ..ModelConfig::correcting() });
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
    fn shares_of_pixels_stand_for_horizon_and_survey() {
        let start = untrained(ModelConfig { patch: 2, ..ModelConfig::balanced() });
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

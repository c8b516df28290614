//! Weights that a run starts from, for a network that sees or says more than theirs did.

use aonet::internals::weights::Tensor;
use aonet::net::{Channel, Model, ModelConfig, Output, SearchConfig};
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
/// Tensors that differ in any other way stay as they are.
pub(super) fn fitted(config: &ModelConfig, start: &Model) -> BTreeMap<String, Tensor> {
    let mut tensors = start.weights().tensors().clone();
    let (before, after) = (inputs(start.config()), inputs(config));
    if start.config().patch == config.patch
        && before != after
        && let Some(tensor) = tensors.get_mut("enc0.conv0.weight")
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
    if config.output == Output::Shares && start.config().output == Output::Correction {
        // Its planes come one after the other, the correction first.
        let planes = config.search.map_or(1, |search| search.planes());
        for name in ["head.weight", "head.bias"] {
            if let Some(tensor) = tensors.get_mut(name) {
                tensor.shape[0] *= planes;
                tensor.values.resize(tensor.values.len() * planes, 0.0);
            }
        }
    }
    tensors
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
    use aonet::internals::graph::Graph;
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

    #[test]
    fn channels_that_nothing_stood_for_have_no_weight() {
        let start = model(ModelConfig::correcting());
        let fitted = fits(&ModelConfig::balanced(), &start);
        let name = "enc0.conv0.weight";
        let (before, after) = (start.weights().get(name), fitted.get(name));
        assert!(after.shape[1] > before.shape[1]);
        for (old, new) in
            before.values.chunks_exact(before.shape[1] * 9).zip(after.values.chunks_exact(after.shape[1] * 9))
        {
            assert_eq!(old, &new[..old.len()]);
            assert!(new[old.len()..].iter().all(|weight| *weight == 0.0));
        }
        assert_eq!(start.weights().get("enc1.conv0.weight"), fitted.get("enc1.conv0.weight"));
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
        let (head, before) = (fitted.get("head.weight"), start.weights().get("head.weight"));
        assert_eq!((head.shape[0], before.shape[0]), (24, 4));
        assert_eq!(head.values[..before.values.len()], before.values);
        assert!(head.values[before.values.len()..].iter().all(|weight| *weight == 0.0));
    }
}

//! Weights that a run starts from, for a network that is narrower or wider than theirs.

use aonet::internals::graph::Graph;
use aonet::internals::weights::{Tensor, Weights};
use aonet::net::{Arch, Model, ModelConfig, Skips};
use std::collections::BTreeMap;

/// The tensors of `start` with the widths of `config`; as they are if the networks differ in more. A narrower convolution loses its weakest channels,
/// a wider one gets new ones behind its own, with the weights of a new network. Those that read them start at zero.
// Li et al. 2017, Pruning Filters for Efficient ConvNets. A channel is as strong as the sum of its filter's absolute weights times that of all that
// read it.
pub(super) fn resized(config: &ModelConfig, start: &Model) -> BTreeMap<String, Tensor> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::tests::{features, untrained};
    use aonet::internals::naive::{self, Inputs};
    use aonet::net::TrainingFacts;

    fn resized_model(config: ModelConfig, start: &Model) -> Model {
        let weights = Weights::new(&Graph::new(&config).unwrap(), resized(&config, start)).unwrap();
        Model::new(config, weights, TrainingFacts::default()).unwrap()
    }

    /// What a network without a survey makes of a frame.
    fn image(model: &Model) -> Vec<f32> {
        let seen = features(model.config().features.channels().len(), (64, 64));
        let search = model.config().search.map(|search| features(search.planes(), (64, 64)));
        naive::evaluate(model, &Inputs { features: seen, search, survey: None }).values
    }

    #[test]
    fn a_wider_network_begins_with_the_same_image() {
        for embedding in [None, Some(9)] {
            let config = ModelConfig {
                embedding,
                encoder: vec![8, 12, 10, 6],
                decoder: vec![12, 10, 8],
                ..ModelConfig::correcting()
            };
            let start = untrained(config.clone());
            let wider = ModelConfig {
                embedding: embedding.map(|width| width + 3),
                encoder: vec![9, 12, 14, 8],
                decoder: vec![13, 10, 11],
                ..config
            };
            let wide = resized_model(wider.clone(), &start);
            // The new channels say something, so they can learn to be read.
            let last = &wide.weights().get("dec0.conv1.weight").values;
            assert!(last[last.len() / 11 * 8..].iter().all(|weight| *weight != 0.0));
            let [before, after] = [&start, &wide].map(image);
            assert_eq!(before, after);
            assert!(before.iter().any(|value| *value != before[0]), "a flat image");
            // Some levels may be narrower at the same time.
            resized_model(ModelConfig { decoder: vec![13, 9, 11], ..wider }, &start);
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
        let wide = untrained(config.clone());
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
        let narrow = resized_model(narrow, &wide);
        let images = [&wide, &narrow].map(image);
        let off = images[0].iter().zip(&images[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
        assert!(images[0].iter().any(|value| *value != images[0][0]), "a flat image");
    }
}

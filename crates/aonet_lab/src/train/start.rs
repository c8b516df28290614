//! Weights that a run starts from, for a network that sees more than theirs did.

use aonet::internals::graph::Graph;
use aonet::internals::weights::{Tensor, Weights};
use std::collections::BTreeMap;

/// The tensors of `start` in the shapes of `graph`: where a convolution sees more channels, those after the known ones have zero weights.
/// Tensors that differ in any other way stay as they are.
pub(super) fn widened(graph: &Graph, start: &Weights) -> BTreeMap<String, Tensor> {
    let mut tensors = start.tensors().clone();
    for wanted in graph.params() {
        if let Some(tensor) = tensors.get_mut(&wanted.name)
            && let ([outputs, known, height, width], &[wanted_outputs, all, h, w]) =
                (tensor.shape.as_slice(), wanted.shape.as_slice())
            && [outputs, height, width] == [&wanted_outputs, &h, &w]
            && *known < all
        {
            let area = height * width;
            let mut values = Vec::with_capacity(outputs * all * area);
            for of_output in tensor.values.chunks_exact(known * area) {
                values.extend_from_slice(of_output);
                values.resize(values.len() + (all - known) * area, 0.0);
            }
            *tensor = Tensor { shape: wanted.shape, values };
        }
    }
    tensors
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::net::ModelConfig;
    use aonet::search::ArcsParams;

    #[test]
    fn channels_that_were_unknown_have_no_weight() {
        let survey = Some(ArcsParams { denoise_passes: 0, ..ArcsParams::default() });
        let narrow = Graph::new(&ModelConfig::correcting()).unwrap();
        let wide = Graph::new(&ModelConfig { survey, ..ModelConfig::correcting() }).unwrap();
        let start = Weights::init(&narrow, 3);
        let widened = Weights::new(&wide, widened(&wide, &start)).unwrap();
        let (before, after) = (start.get("enc0.conv0.weight"), widened.get("enc0.conv0.weight"));
        assert!(after.shape[1] > before.shape[1]);
        for (old, new) in
            before.values.chunks_exact(before.shape[1] * 9).zip(after.values.chunks_exact(after.shape[1] * 9))
        {
            assert_eq!(old, &new[..old.len()]);
            assert!(new[old.len()..].iter().all(|weight| *weight == 0.0));
        }
        assert_eq!(start.get("enc1.conv0.weight"), widened.get("enc1.conv0.weight"));
    }
}

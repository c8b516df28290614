//! What a network reads of a frame, as the runtime computes it: for measurements and for other runtimes.

use aonet::internals::features::{search_planes, write_features};
use aonet::internals::naive::{Inputs, Planes};
use aonet::net::Model;
use aonet::{AoParams, GBuffer};

/// Features of a frame and what the network's search finds, both of the frame's size.
///
/// # Errors
/// When a value of the frame or of the search is out of range.
pub(crate) fn network_inputs(model: &Model, gbuffer: &GBuffer, params: AoParams) -> aonet::Result<Inputs> {
    let (config, width, height) = (model.config(), gbuffer.width(), gbuffer.height());
    let (mut found, mut search) = (Vec::new(), None);
    if let Some(method) = config.search {
        found = search_planes(&method, gbuffer, params)?;
        search = Some(Planes::from_rows((method.planes(), height, width), &found));
    }
    let channels = config.features.channels().len();
    let mut values = vec![0.0; channels * height * width];
    write_features(&config.features, gbuffer, params, &found, &mut values);
    Ok(Inputs { features: Planes { channels, height, width, values }, search })
}

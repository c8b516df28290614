//! What a network reads of a frame, as the runtime computes it: for measurements and for other runtimes.

use aonet::internals::features::{search_planes, survey_planes, write_features};
use aonet::internals::graph::SURVEYED;
use aonet::internals::naive::{Inputs, Planes};
use aonet::net::Model;
use aonet::search::ArcsParams;
use aonet::{AoParams, GBuffer, Size};

/// Features of a frame and what the network's search finds, both of the frame's size, and its survey of the padded frame.
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
    let survey = config.survey.map(|arcs| survey(model, &arcs, gbuffer, params)).transpose()?;
    Ok(Inputs { features: Planes { channels, height, width, values }, search, survey })
}

fn survey(model: &Model, arcs: &ArcsParams, gbuffer: &GBuffer, params: AoParams) -> aonet::Result<Planes> {
    let (patch, step) = (model.config().patch, model.graph().alignment());
    let [width, height] = [gbuffer.width(), gbuffer.height()].map(|side| side.next_multiple_of(step) / patch);
    let found = survey_planes(arcs, gbuffer, params, [0, 0], (Size::new(width, height)?, patch))?;
    Ok(Planes::from_rows((SURVEYED, height, width), &found))
}

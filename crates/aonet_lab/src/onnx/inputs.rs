//! What an exported file takes, for a frame: to try the file in another runtime.

use super::{Extent, INPUT, SEARCH, SURVEY, own_channels};
use crate::network_inputs::network_inputs;
use aonet::internals::naive::Planes;
use aonet::net::Model;
use aonet::{AoParams, GBuffer};
use aonet_scene::error::{Error, Result};

/// The inputs of a file of this extent for a frame, by name: padded to the alignment where sizes are free.
///
/// # Errors
/// When the frame has another size than a fixed extent, or one of its values is out of range.
pub fn inputs(
    model: &Model,
    extent: Extent,
    (gbuffer, params): (&GBuffer, AoParams),
) -> Result<Vec<(&'static str, Planes)>> {
    let size = (gbuffer.width(), gbuffer.height());
    let step = match extent {
        Extent::Dynamic => model.graph().alignment(),
        Extent::Fixed { width, height } if size == (width, height) => 1,
        Extent::Fixed { width, height } => {
            let found = format!("{}x{}", size.0, size.1);
            return Err(Error::request("frame of an ONNX file", format!("{width}x{height}"), found));
        }
    };
    let all = network_inputs(model, gbuffer, params)?.padded(step);
    let further = [(SEARCH, all.search), (SURVEY, all.survey)];
    let features = all.features;
    let area = features.height * features.width;
    let planes = model.config().features.channels().iter().zip(features.values.chunks_exact(area));
    let planes = planes.filter(|(channel, _)| channel.search_plane().is_none());
    let values = planes.flat_map(|(_, plane)| plane).copied().collect();
    let own = Planes { channels: own_channels(model).count(), values, ..features };
    let further = further.into_iter().filter_map(|(name, planes)| planes.map(|planes| (name, planes)));
    Ok([(INPUT, own)].into_iter().chain(further).collect())
}

/// A file for NumPy: 1xCxHxW, f32.
// NumPy Enhancement Proposal 1: magic, version 1.0, length of the header, header padded with spaces to a multiple of 64.
pub fn npy(planes: &Planes) -> Vec<u8> {
    let shape = format!("(1, {}, {}, {})", planes.channels, planes.height, planes.width);
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).bytes());
    bytes.extend(planes.values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

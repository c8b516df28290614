//! What an exported file takes, for a frame: to try the file in another runtime.

use super::Extent;
use aonet::net::features::write_features;
use aonet::net::{Model, naive::Planes, naive::padded_features};
use aonet::{AoParams, GBuffer};
use aonet_scene::error::{Error, Result};

/// The features of a frame as a file of this extent takes them: padded to the alignment where sizes are free.
///
/// # Errors
/// When the frame has another size than a fixed extent.
pub fn features(model: &Model, extent: Extent, frame: (&GBuffer, AoParams)) -> Result<Planes> {
    let (gbuffer, params) = frame;
    let size = (gbuffer.width(), gbuffer.height());
    let (width, height) = match extent {
        Extent::Dynamic => return Ok(padded_features(model, gbuffer, params)),
        Extent::Fixed { width, height } => (width, height),
    };
    if size != (width, height) {
        let found = format!("{}x{}", size.0, size.1);
        return Err(Error::request("frame of an ONNX file", format!("{width}x{height}"), found));
    }
    let features = model.config().features;
    let channels = features.channels().len();
    let mut values = vec![0.0; channels * height * width];
    write_features(features, frame, &mut values, (width, height * width));
    Ok(Planes { channels, height, width, values })
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

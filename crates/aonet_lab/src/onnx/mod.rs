//! Networks as ONNX files, for other runtimes.
//!
//! A file takes `features` 1xCxHxW: the channels that [`write_features`](aonet::internals::features::write_features) writes, without
//! the search's. A network with a search also takes `search` 1xPxHxW: what the method finds whose parameters are in the
//! configuration, its filter included: the visibility, and the shares of light where the method reports them. A network with a survey
//! takes `survey` 1xSxH'xW': the cells of the padded frame, as [`survey_planes`](aonet::internals::features::survey_planes) finds
//! them. The output is
//! `visibility` 1x1xHxW in [0, 1]. It ignores the background: there the caller writes 1, as [`cpu::Session`](aonet::net::cpu::Session) does.
//! It is not smoothed ([`ModelConfig::smooth`](aonet::net::ModelConfig::smooth)): that takes the frame's depth.

mod inputs;
mod kernels;
mod network;
mod nodes;
mod proto;
#[cfg(test)]
mod tests;
mod tuned;
mod writer;

pub use inputs::{inputs, npy};

use aonet::Size;
use aonet::internals::graph::SURVEYED;
use aonet::net::{Channel, Model};
use aonet_scene::error::{Error, Result};
use prost::Message;
use serde::Serialize;
use writer::Writer;

/// Version of the metadata. In version 1 the features held what the search found.
const FORMAT: u32 = 2;
/// ONNX's operators of July 2022: the first set that every runtime of today has in full.
const OPSET: i64 = 17;
/// File format of the same time.
const IR_VERSION: i64 = 8;
/// Name of the input with the features.
pub const INPUT: &str = "features";
/// Name of the input with what the search found.
pub const SEARCH: &str = "search";
/// Name of the input with what the survey found.
pub const SURVEY: &str = "survey";
/// Name of the output.
pub const OUTPUT: &str = "visibility";

/// How a network is written down. Both forms compute the same function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Operation by operation, as one writes it by hand in a framework; ONNX Runtime, OpenVINO and ncnn (by way of pnnx) run
    /// it. The outputs of a head that predicts kernels are in the order of ONNX's pixel shuffle.
    Plain,
    /// Rewritten to be fast in ONNX Runtime: linear kernels; without them the same as plain.
    Tuned,
}

/// Which frames a file takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Any whose width and height are multiples of [`Graph::alignment`](aonet::internals::graph::Graph::alignment); the caller pads
    /// by repeating the edge.
    Dynamic,
    /// This size, whatever the alignment: the file pads by repeating the edge, as a session does, and crops.
    Fixed {
        /// (px).
        width: usize,
        /// (px).
        height: usize,
    },
}

/// An input or output of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Port {
    /// Its name in the file.
    pub name: &'static str,
    /// Batch, channels, height, width.
    pub shape: [Side; 4],
}

/// A size of a tensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Side {
    /// This one.
    Fixed(usize),
    /// Any, under this name.
    Named(&'static str),
}

/// A network as the bytes of an ONNX file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The file.
    pub bytes: Vec<u8>,
    /// What it takes.
    pub inputs: Vec<Port>,
    /// What it gives.
    pub outputs: Vec<Port>,
}

/// Writes `model` as an ONNX file. Equal models give equal bytes.
///
/// # Errors
/// When a side of a fixed size is 0 or too large.
pub fn export(model: &Model, form: Form, extent: Extent) -> Result<Exported> {
    if let Extent::Fixed { width, height } = extent {
        Size::named("ONNX input", width, height)?;
    }
    let mut writer = Writer::default();
    let features = padded(&mut writer, model, extent, INPUT);
    let search = model.config().search.map(|_| padded(&mut writer, model, extent, SEARCH));
    let survey = model.config().survey.map(|_| SURVEY);
    let inputs = network::Inputs { features: &features, search: search.as_deref(), survey };
    let raw = network::write(&mut writer, model, form, inputs);
    finish(&mut writer, &raw, (features != INPUT).then_some(extent));
    let port = |name, channels| {
        let [height, width] = match extent {
            Extent::Dynamic => [Side::Named("height"), Side::Named("width")],
            Extent::Fixed { width, height } => [Side::Fixed(height), Side::Fixed(width)],
        };
        Port { name, shape: [Side::Fixed(1), Side::Fixed(channels), height, width] }
    };
    let mut inputs = vec![port(INPUT, own_channels(model).count())];
    inputs.extend(model.config().search.map(|search| port(SEARCH, search.planes())));
    inputs.extend(model.config().survey.map(|_| survey_port(model, extent)));
    let outputs = vec![port(OUTPUT, 1)];
    let graph = proto::Graph {
        node: writer.nodes,
        name: "aonet".to_owned(),
        initializer: writer.constants,
        input: inputs.iter().map(value_info).collect(),
        output: outputs.iter().map(value_info).collect(),
    };
    let file = proto::Model {
        ir_version: IR_VERSION,
        producer_name: "aonet".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        graph: Some(graph),
        opset_import: vec![proto::OperatorSet { domain: String::new(), version: OPSET }],
        metadata_props: metadata(model)?,
    };
    Ok(Exported { bytes: file.encode_to_vec(), inputs, outputs })
}

/// The features that a file takes: all but what the search found, which is an input of its own.
fn own_channels(model: &Model) -> impl Iterator<Item = Channel> {
    let channels = model.config().features.channels().iter().copied();
    channels.filter(|channel| channel.search_plane().is_none())
}

/// An input, padded to the alignment where it has a size of its own.
fn padded(writer: &mut Writer, model: &Model, extent: Extent, input: &str) -> String {
    let step = model.graph().alignment();
    match extent {
        Extent::Fixed { width, height } if !(width.is_multiple_of(step) && height.is_multiple_of(step)) => {
            let missing = |side: usize| side.next_multiple_of(step) - side;
            let sides = [0, 0, missing(height), missing(width)];
            nodes::pad_edge(writer, &format!("{input}/pad"), input, sides)
        }
        Extent::Fixed { .. } | Extent::Dynamic => input.to_owned(),
    }
}

/// The input with what the survey found: a cell for every patch of the padded frame.
fn survey_port(model: &Model, extent: Extent) -> Port {
    let cells = |side: usize| side.next_multiple_of(model.graph().alignment()) / model.config().patch;
    let [height, width] = match extent {
        Extent::Dynamic => [Side::Named("cell_rows"), Side::Named("cell_columns")],
        Extent::Fixed { width, height } => [height, width].map(|side| Side::Fixed(cells(side))),
    };
    Port { name: SURVEY, shape: [Side::Fixed(1), Side::Fixed(SURVEYED), height, width] }
}

/// Crops to what was padded, and clamps.
fn finish(writer: &mut Writer, raw: &str, padded: Option<Extent>) {
    let cropped = match padded {
        Some(Extent::Fixed { width, height }) => {
            let part = nodes::Crop { rows: 0..height as i64, columns: 0..width as i64 };
            nodes::crop(writer, "crop", raw, &part)
        }
        Some(Extent::Dynamic) | None => raw.to_owned(),
    };
    let bounds = [0.0, 1.0].map(|bound| writer.scalar(bound));
    writer.node((OUTPUT, "Clip"), &[&cropped, &bounds[0], &bounds[1]], &[]);
}

fn value_info(port: &Port) -> proto::ValueInfo {
    let size = |side: &Side| match *side {
        Side::Fixed(side) => proto::Size::Value(side as i64),
        Side::Named(name) => proto::Size::Param(name.to_owned()),
    };
    let dim = port.shape.iter().map(|side| proto::Dimension { value: Some(size(side)) }).collect();
    let shape = Some(proto::TensorShape { dim });
    let tensor_type = Some(proto::TensorType { elem_type: proto::DataType::Float.into(), shape });
    proto::ValueInfo { name: port.name.to_owned(), r#type: Some(proto::Type { tensor_type }) }
}

/// Format number, configuration, names of the features and alignment (px); JSON.
fn metadata(model: &Model) -> Result<Vec<proto::Entry>> {
    let wrong = |e: serde_json::Error| Error::request("metadata", "JSON", e);
    let names: Vec<&str> = own_channels(model).map(Channel::name).collect();
    Ok([
        ("aonet.format", FORMAT.to_string()),
        ("aonet.config", serde_json::to_string(model.config()).map_err(wrong)?),
        ("aonet.features", serde_json::to_string(&names).map_err(wrong)?),
        ("aonet.alignment_px", model.graph().alignment().to_string()),
    ]
    .map(|(key, value)| proto::Entry { key: key.to_owned(), value })
    .into())
}

use super::*;
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{Features, KernelWeights, ModelConfig, Output, SearchConfig, TrainingFacts, shipped};
use aonet::search::ArcsParams;
use std::collections::BTreeMap;

fn decoded(config: ModelConfig, form: Form, extent: Extent) -> proto::Model {
    let weights = Weights::init(&Graph::new(&config).unwrap(), 7);
    let model = Model::new(config, weights, TrainingFacts::default()).unwrap();
    proto::Model::decode(export(&model, form, extent).unwrap().bytes.as_slice()).unwrap()
}

/// How often every operator occurs.
fn operators(file: &proto::Model) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for node in &file.graph.as_ref().unwrap().node {
        *counts.entry(node.op_type.clone()).or_insert(0) += 1;
    }
    counts
}

fn sides(info: &proto::ValueInfo) -> Vec<proto::Size> {
    let tensor = info.r#type.as_ref().unwrap().tensor_type.as_ref().unwrap();
    assert_eq!(tensor.elem_type, i32::from(proto::DataType::Float));
    tensor.shape.as_ref().unwrap().dim.iter().map(|d| d.value.clone().unwrap()).collect()
}

#[test]
fn the_papers_network_has_the_operators_worked_out_by_hand() {
    let plain = operators(&decoded(ModelConfig::paper(), Form::Plain, Extent::Dynamic));
    // Four levels down and three up with two convolutions each, and the head.
    let expected = [
        ("AveragePool", 3),
        ("Clip", 1),
        ("Concat", 5),
        ("Conv", 15),
        ("DepthToSpace", 1),
        ("LeakyRelu", 14),
        ("Mul", 2),
        ("Pad", 15),
        ("ReduceMean", 1),
        ("Resize", 3),
        ("Slice", 20),
        ("SpaceToDepth", 3),
    ];
    assert_eq!(plain, expected.map(|(name, count)| (name.to_owned(), count)).into());
    let tuned = operators(&decoded(ModelConfig::paper(), Form::Tuned, Extent::Dynamic));
    // No head; for each of 16 pixels a convolution of normals and a sum, and one convolution with all biases.
    assert_eq!((tuned["Conv"], tuned["Mul"], tuned["Slice"]), (14 + 33, 16, 3 + 1 + 3));
    assert!(!tuned.contains_key("ReduceMean"));
}

#[test]
fn nothing_is_written_that_pnnx_gets_wrong() {
    for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
        for form in [Form::Plain, Form::Tuned] {
            let graph = decoded(ModelConfig { kernel, ..ModelConfig::paper() }, form, Extent::Dynamic).graph;
            for node in graph.unwrap().node {
                assert_ne!(node.op_type, "ReduceSum", "its axes are lost");
                let modes =
                    node.attribute.iter().filter(|a| node.op_type == "DepthToSpace" && a.name == "mode");
                assert!(
                    modes.map(|mode| mode.s.as_deref()).all(|mode| mode == Some(b"CRD")),
                    "{}",
                    node.name
                );
            }
        }
    }
}

#[test]
fn a_network_without_kernels_stays_as_it_is() {
    let [plain, tuned] = [Form::Plain, Form::Tuned]
        .map(|form| operators(&decoded(ModelConfig::deep_ao(), form, Extent::Dynamic)));
    assert_eq!(plain, tuned);
}

#[test]
fn sizes_are_free_or_fixed_and_odd_ones_are_padded() {
    use proto::Size::{Param, Value};
    let free = decoded(ModelConfig::correcting(), Form::Plain, Extent::Dynamic).graph.unwrap();
    let named = [Param("height".to_owned()), Param("width".to_owned())];
    assert_eq!(sides(&free.input[0]), [&[Value(1), Value(4)][..], &named].concat());
    assert_eq!(sides(&free.input[1]), [&[Value(1), Value(1)][..], &named].concat());
    assert_eq!((free.input.len(), free.input[1].name.as_str()), (2, SEARCH));
    assert_eq!(sides(&free.output[0]), [&[Value(1), Value(1)][..], &named].concat());
    let odd = Extent::Fixed { width: 75, height: 41 };
    let odd = decoded(ModelConfig::paper(), Form::Tuned, odd).graph.unwrap();
    assert_eq!(sides(&odd.input[0]), [1, 3, 41, 75].map(Value));
    assert_eq!((odd.node[0].op_type.as_str(), odd.node[0].input[0].as_str()), ("Pad", INPUT));
    let pads = odd.constants_called(&odd.node[0].input[1]);
    assert_eq!(pads, [0, 0, 0, 0, 0, 0, 64 - 41, 96 - 75]);
    let even = Extent::Fixed { width: 96, height: 64 };
    let even = decoded(ModelConfig::paper(), Form::Plain, even).graph.unwrap();
    assert!(even.node.iter().all(|node| node.name != "features/pad" && node.name != "crop"));
}

impl proto::Graph {
    /// The integers of a constant.
    fn constants_called(&self, name: &str) -> Vec<i64> {
        let tensor = self.initializer.iter().find(|t| t.name == name).unwrap();
        assert_eq!(tensor.data_type, i32::from(proto::DataType::Int64));
        tensor.raw_data.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().unwrap())).collect()
    }
}

#[test]
fn parameters_and_metadata_are_the_models() {
    let model = Model::from_bytes(shipped::BALANCED).unwrap();
    let exported = export(&model, Form::Plain, Extent::Dynamic).unwrap();
    assert_eq!(exported, export(&model, Form::Plain, Extent::Dynamic).unwrap());
    let file = proto::Model::decode(exported.bytes.as_slice()).unwrap();
    assert_eq!((file.ir_version, file.opset_import[0].version), (8, 17));
    let graph = file.graph.unwrap();
    for (name, tensor) in model.weights().tensors() {
        let found = graph.initializer.iter().find(|t| t.name == *name).unwrap();
        assert!(found.dims.iter().map(|&d| d as usize).eq(tensor.shape.iter().copied()), "{name}");
        let bytes: Vec<u8> = tensor.values.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(found.raw_data, bytes, "{name}");
    }
    let facts: BTreeMap<_, _> = file.metadata_props.into_iter().map(|e| (e.key, e.value)).collect();
    assert_eq!((facts["aonet.format"].as_str(), facts["aonet.alignment_px"].as_str()), ("2", "64"));
    assert_eq!(serde_json::from_str::<ModelConfig>(&facts["aonet.config"]).unwrap(), *model.config());
    let names: Vec<String> = serde_json::from_str(&facts["aonet.features"]).unwrap();
    assert_eq!(names, ["normal x", "normal y", "normal z", "projected radius"]);
}

/// A network that weighs shares of light.
fn shares() -> ModelConfig {
    ModelConfig {
        features: Features::normal_radius_light(),
        search: Some(SearchConfig::Arcs(ArcsParams::default())),
        output: Output::Shares,
        ..ModelConfig::correcting()
    }
}

#[test]
fn a_search_that_reports_shares_is_an_input_of_as_many_planes() {
    let graph = decoded(shares(), Form::Plain, Extent::Dynamic).graph.unwrap();
    let channels = graph.input.iter().map(|input| sides(input)[1].clone()).collect::<Vec<_>>();
    // Normal, radius, second layer; visibility and five shares.
    assert_eq!(channels, [5, 6].map(proto::Size::Value));
}

#[test]
fn a_survey_is_an_input_with_a_value_for_every_patch() {
    use proto::Size::{Param, Value};
    let free = decoded(ModelConfig::balanced(), Form::Plain, Extent::Dynamic).graph.unwrap();
    assert_eq!((free.input.len(), free.input[2].name.as_str()), (3, SURVEY));
    let named = [Param("cell_rows".to_owned()), Param("cell_columns".to_owned())];
    assert_eq!(sides(&free.input[2]), [&[Value(1), Value(6)][..], &named].concat());
    let odd =
        decoded(ModelConfig::balanced(), Form::Plain, Extent::Fixed { width: 75, height: 41 }).graph.unwrap();
    assert_eq!(sides(&odd.input[2]), [1, 6, 64 / 4, 128 / 4].map(Value));
}

#[test]
fn every_input_is_written_before_it_is_read() {
    for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
        for patch in [1, 2, 4] {
            for form in [Form::Plain, Form::Tuned] {
                let shares = (kernel == KernelWeights::Off).then(shares);
                let mixing = shares.clone().map(|shares| ModelConfig { neighbours: vec![1, 3], ..shares });
                for config in [ModelConfig::paper(), ModelConfig::correcting(), ModelConfig::balanced()]
                    .into_iter()
                    .chain(shares)
                    .chain(mixing)
                {
                    let mut config = ModelConfig { patch, kernel, ..config };
                    if kernel != KernelWeights::Off {
                        config.neighbours.clear();
                    }
                    let graph = decoded(config, form, Extent::Dynamic).graph.unwrap();
                    let mut known: Vec<&str> = graph.initializer.iter().map(|t| t.name.as_str()).collect();
                    known.extend(graph.input.iter().map(|input| input.name.as_str()).chain([""]));
                    for node in &graph.node {
                        let unknown = node.input.iter().find(|input| !known.contains(&input.as_str()));
                        assert_eq!(unknown, None, "{} of {kernel:?} {patch} {form:?}", node.name);
                        known.push(&node.output[0]);
                    }
                    assert!(known.contains(&OUTPUT));
                }
            }
        }
    }
}

#[test]
fn sizes_out_of_range_are_refused() {
    let model = Model::from_bytes(shipped::PAPER).unwrap();
    for (width, height) in [(0, 8), (8, 0), (usize::MAX, 8)] {
        let message = export(&model, Form::Plain, Extent::Fixed { width, height }).unwrap_err().to_string();
        assert!(message.contains("ONNX input"), "{message}");
    }
}

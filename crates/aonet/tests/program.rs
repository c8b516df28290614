//! Programs are described, written and read without a graphics interface.

use aonet::Size;
use aonet::gpu::program::{Binding, Usage};
use aonet::gpu::{Describe, Layers, Precision, Program, ProgramOptions, TextureEncoding};
use aonet::internals::weights::Weights;
use aonet::net::gpu::Network;
use aonet::net::{Model, ModelConfig};
use aonet::search::Classic;
use aonet::search::gpu::Method;

/// A network with weights of zero.
fn network(config: ModelConfig, precision: Precision) -> Network {
    let graph = aonet::internals::graph::Graph::new(&config).unwrap();
    let tensor = |spec: aonet::internals::graph::ParamSpec| {
        let values = vec![0.0; spec.shape.iter().product()];
        (spec.name, aonet::internals::weights::Tensor { shape: spec.shape, values })
    };
    let weights = Weights::new(&graph, graph.params().into_iter().map(tensor).collect()).unwrap();
    let model = Model::new(config, weights, Default::default()).unwrap();
    Network::new(&model, ProgramOptions { precision, ..Default::default() }).unwrap()
}

fn classic(name: &str) -> Method {
    Method::new(&Classic::named(name).unwrap(), TextureEncoding::default()).unwrap()
}

/// Reads what is written, and asserts that nothing is lost.
fn read(program: &Program) -> Program {
    let bytes = program.to_bytes().unwrap();
    let read = Program::from_bytes(&bytes.json, &bytes.blob).unwrap();
    assert_eq!(read.to_bytes().unwrap(), bytes);
    assert_eq!((read.buffers(), read.shaders()), (program.buffers(), program.shaders()));
    assert_eq!((read.passes(), read.image()), (program.passes(), program.image()));
    read
}

#[test]
fn networks_are_described_written_and_read() {
    for precision in [Precision::F32, Precision::F16] {
        // Depths in world units do not fit in half floats.
        for (config, fits) in
            [(ModelConfig::paper(), true), (ModelConfig::balanced(), true), (ModelConfig::deep_ao(), false)]
        {
            let network = network(config, precision);
            let program = read(&network.program(Size::px(65, 43)).unwrap());
            assert_eq!(program.size(), Size::px(65, 43));
            let asks = program.shaders().iter().all(|source| source.starts_with("enable f16"));
            assert_eq!(asks, fits && precision == Precision::F16);
        }
    }
    let labels = |program: &Program| program.pass_labels().iter().map(|l| l.to_string()).collect::<Vec<_>>();
    let paper = network(ModelConfig::paper(), Precision::F32).program(Size::px(64, 64)).unwrap();
    let labels = labels(&paper);
    assert_eq!((labels.first().unwrap().as_str(), labels.last().unwrap().as_str()), ("features", "image"));
    assert!(labels.contains(&"enc1.conv1".to_owned()), "{labels:?}");
}

#[test]
fn classic_methods_are_described_written_and_read() {
    for name in ["ssao", "hbao", "ssdo", "gtao", "vbao", "agtao", "arcs", "vbao:tuned"] {
        let program = read(&classic(name).program(Size::px(20, 10)).unwrap());
        assert!(program.memory_bytes() >= 2 * 4 * 20 * 10, "{name}");
        assert!(program.pass_labels().contains(&name.split(':').next().unwrap()));
    }
    let nnao = Method::new(&Classic::named("nnao").unwrap(), TextureEncoding::default());
    assert!(nnao.unwrap_err().to_string().contains("gtao"));
}

#[test]
fn sizes_differ_in_numbers_and_share_weights() {
    let network = network(ModelConfig::paper(), Precision::F32);
    let [small, large] = [Size::px(64, 64), Size::px(128, 96)].map(|size| network.program(size).unwrap());
    let weights = |program: &Program| -> Vec<_> {
        let filled = program.buffers().iter().filter(|b| b.usage == Usage::Storage);
        filled.filter_map(|b| b.contents.clone()).collect()
    };
    let (a, b) = (weights(&small), weights(&large));
    assert!(!a.is_empty() && a.len() == b.len());
    assert!(a.iter().zip(&b).all(|(a, b)| std::sync::Arc::ptr_eq(a, b)), "one copy of the weights");
    assert!(small.memory_bytes() < large.memory_bytes());
}

/// Buffers that no pass has written yet hold anything.
#[test]
fn passes_read_what_was_written_before() {
    let networks = [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_ao()];
    let networks = networks.map(|config| network(config, Precision::F32).program(Size::px(65, 43)).unwrap());
    let methods = ["ssao", "hbao", "ssdo", "gtao", "vbao", "agtao", "arcs"].map(classic);
    let methods = methods.map(|method| method.program(Size::px(65, 43)).unwrap());
    let textures = TextureEncoding { layers: Layers::Two, ..TextureEncoding::default() };
    let deep = Method::new(&Classic::named("arcs").unwrap(), textures).unwrap();
    let deep = deep.program(Size::px(65, 43)).unwrap();
    assert_eq!(deep.pass_labels(), ["surfels", "arcs", "denoise", "image"]);
    for program in networks.iter().chain(&methods).chain([&deep]) {
        let mut known: Vec<_> = program.buffers().iter().map(|b| b.contents.is_some() || b.cleared).collect();
        let mut check = |label: &str, bindings: &[Binding]| {
            for binding in bindings {
                match binding {
                    Binding::Write(buffer) => known[*buffer] = true,
                    Binding::Read(buffer) | Binding::Uniform(buffer) => {
                        assert!(known[*buffer], "{label} reads {buffer}");
                    }
                }
            }
        };
        program.passes().iter().for_each(|pass| check(&pass.label, &pass.bindings));
        check("image", &program.image().bindings);
    }
}

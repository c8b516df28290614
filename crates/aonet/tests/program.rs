//! Programs are described, written and read without a graphics interface.

use aonet::Size;
use aonet::gpu::program::{Binding, Usage};
use aonet::gpu::{
    DepthEncoding, Describe, Layers, NormalEncoding, Precision, Program, ProgramOptions, Template,
    TextureEncoding,
};
use aonet::internals::weights::Weights;
use aonet::net::gpu::Network;
use aonet::net::{Model, ModelConfig};
use aonet::search::Classic;
use aonet::search::gpu::Method;

/// A network with weights of zero.
fn network(config: ModelConfig, precision: Precision) -> Network {
    network_of(config, ProgramOptions { precision, ..Default::default() })
}

fn network_of(config: ModelConfig, options: ProgramOptions) -> Network {
    let graph = aonet::internals::graph::Graph::new(&config).unwrap();
    let tensor = |spec: aonet::internals::graph::ParamSpec| {
        let values = vec![0.0; spec.shape.iter().product()];
        (spec.name, aonet::internals::weights::Tensor { shape: spec.shape, values })
    };
    let weights = Weights::new(&graph, graph.params().into_iter().map(tensor).collect()).unwrap();
    let model = Model::new(config, weights, Default::default()).unwrap();
    Network::new(&model, options).unwrap()
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
            [(ModelConfig::paper(), true), (ModelConfig::correcting(), true), (ModelConfig::deep_ao(), false)]
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
    let networks = [ModelConfig::paper(), ModelConfig::correcting(), ModelConfig::deep_ao()];
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

/// Sizes with every remainder that matters, and some at which dispatches are cut in another way.
fn sizes() -> impl Iterator<Item = Size> {
    let known = [[1, 1], [2, 1], [1, 3], [128, 72], [640, 360], [1280, 720], [1920, 1080], [3840, 2160]];
    let any = (8..50).map(|i| [1 + i * i * 7919 % 2111, 1 + i * i * 104_729 % 1181]);
    known.into_iter().chain(any).map(|[width, height]| Size::px(width, height))
}

/// Networks and classic methods of every kind, by name.
fn templates(precision: Precision, textures: TextureEncoding) -> Vec<(String, Template)> {
    let options = ProgramOptions { precision, textures, ..Default::default() };
    let networks = [
        ModelConfig::paper(),
        ModelConfig::correcting(),
        ModelConfig { smooth: true, ..ModelConfig::correcting() },
        ModelConfig { neighbours: vec![1, 3], embedding: Some(24), ..ModelConfig::correcting() },
        ModelConfig::deep_shading(),
        ModelConfig::deep_ao(),
    ];
    let networks = networks.into_iter().map(|config| {
        let network = network_of(config.clone(), options);
        (format!("{config:?}"), network.template().unwrap())
    });
    let methods = ["ssao", "hbao", "ssdo", "gtao", "vbao", "agtao:tuned", "arcs:deep"].map(|name| {
        let method = Method::new(&Classic::named(name).unwrap(), textures).unwrap();
        (name.to_owned(), method.template().unwrap())
    });
    networks.chain(methods).collect()
}

#[test]
fn templates_of_files_give_the_programs_of_fifty_sizes() {
    for layers in [Layers::One, Layers::Two] {
        let textures = TextureEncoding { layers, ..TextureEncoding::default() };
        for precision in [Precision::F32, Precision::F16] {
            for (name, template) in templates(precision, textures) {
                let bytes = template.to_bytes().unwrap();
                let read = Template::from_bytes(&bytes.json, &bytes.blob).unwrap();
                assert_eq!(read.to_bytes().unwrap(), bytes, "{name}");
                for size in sizes() {
                    let (program, of_file) = (template.at(size).unwrap(), read.at(size).unwrap());
                    assert_eq!(of_file.to_bytes().unwrap(), program.to_bytes().unwrap(), "{name} at {size}");
                    assert_eq!(program.size(), size);
                }
            }
        }
    }
}

#[test]
fn passes_cover_frames_of_every_size() {
    for (name, template) in templates(Precision::F32, TextureEncoding::default()) {
        for size in sizes() {
            let program = template.at(size).unwrap();
            for pass in program.passes().iter().filter(|pass| pass.sees_frame && pass.label != "features") {
                // Tiles of passes over pixels have at most 16 columns and rows.
                let [x, y, z] = pass.workgroups.map(|n| n as usize);
                let covered = x * 16 >= size.width() && y * 16 >= size.height() && z == 1;
                assert!(covered, "{name} at {size}: {pass:?}");
            }
            let pixels = (4 * size.pixels()) as u64;
            let images = program.buffers().iter().filter(|b| b.contents.is_none() && b.bytes >= pixels);
            assert!(images.count() >= 2, "{name} at {size}");
        }
    }
}

/// Lines of one choice in place of those of another give the program that was made for it.
#[test]
fn shaders_of_other_choices_differ_in_the_lines_that_the_file_lists() {
    let plain = TextureEncoding::default();
    let network = |precision, textures| {
        let options = ProgramOptions { precision, textures, ..Default::default() };
        network_of(ModelConfig::correcting(), options).template().unwrap()
    };
    let from = network(Precision::F16, plain);
    let json: serde_json::Value = serde_json::from_slice(&from.to_bytes().unwrap().json).unwrap();
    let lines = |kind: &str, choice: &str| json["choices"][kind][choice].as_str().unwrap().to_owned();
    fn name(choice: impl serde::Serialize) -> String {
        serde_json::to_value(choice).unwrap().as_str().unwrap().to_owned()
    }
    for normals in NormalEncoding::ALL {
        for depth in DepthEncoding::ALL {
            for precision in [Precision::F32, Precision::F16] {
                let to = network(precision, TextureEncoding { normals, depth, ..plain });
                let swaps = [
                    ("normals", name(plain.normals), name(normals)),
                    ("depth", name(plain.depth), name(depth)),
                    ("precision", name(Precision::F16), name(precision)),
                ];
                let swapped: Vec<String> = (from.shaders().iter())
                    .map(|source| {
                        swaps.iter().fold(source.to_string(), |source, (kind, from, to)| {
                            source.replace(&lines(kind, from), &lines(kind, to))
                        })
                    })
                    .collect();
                let expected: Vec<_> = to.shaders().iter().map(|source| source.to_string()).collect();
                assert_eq!(swapped, expected);
            }
        }
    }
}

#[test]
fn broken_templates_are_errors_that_say_what_is_wrong() {
    let bytes = classic("gtao").template().unwrap().to_bytes().unwrap();
    let text = String::from_utf8(bytes.json.clone()).unwrap();
    for (from, to, expected) in [
        ("\"format\":2", "\"format\":1", "format"),
        ("\"enough_workgroups\":256", "\"enough_workgroups\":1", "enough_workgroups"),
        ("\"requires\":[]", "\"requires\":[\"shader-f16\"]", "requires"),
        ("const NORMALS: u32 = 0u;\",\"unorm", "const NORMALS: u32 = 9u;\",\"unorm", "choices"),
        ("\"div_ceil\":[\"width\",2]", "\"div_ceil\":[\"width\",0]", "memory"),
        ("\"div_ceil\":[\"width\",2]", "\"halved\":[\"width\",2]", "JSON"),
        ("\"bytes\":32,", "\"bytes\":36,", "32"),
        ("\"variants\":[{\"shader\":0", "\"variants\":[{\"shader\":99", "shader of pyramid"),
        ("\"image\":{\"shader\":3", "\"image\":{\"shader\":99", "shader of image"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        let error = Template::from_bytes(changed.as_bytes(), &bytes.blob).unwrap_err().to_string();
        assert!(error.contains(expected), "{from}: {error}");
    }
    let longer = [&bytes.blob[..], &[0; 4]].concat();
    assert!(Template::from_bytes(&bytes.json, &longer).unwrap_err().to_string().contains("block"));
    assert!(Template::from_bytes(b"{}", &[]).is_err());
}

//! Every command in the README and the documents runs here with small numbers, is run by a script of the project, or has a reason
//! why not. Commands of `engines/` are those of the `test` in each folder; those of `results/` made the numbers there, in hours.

mod common;

use common::{aonet, ok, refusal};
use std::path::Path;

const DOCUMENTS: [&str; 6] = [
    "README.md",
    "docs/guide.md",
    "docs/guard_band_and_layers.md",
    "docs/program_format.md",
    "docs/trust.md",
    "fuzz/README.md",
];

/// What happens to a command.
enum Fate {
    /// It runs, after these replacements: files of the desk in the place of those of the reader, and small numbers.
    Run(&'static [(&'static str, &'static str)]),
    /// It runs in programs that are built with a feature, which tests of their own do. Others say how to get it.
    Feature(&'static str),
    /// A script of the project runs it: a file, and the words in it.
    By(&'static str, &'static str),
    /// It runs nowhere, for this reason.
    Not(&'static str),
}
use Fate::{By, Feature, Not, Run};

/// Commands by their first words; other commands of `aonet` run as they are.
const FATES: &[(&str, Fate)] = &[
    ("aonet demo", Run(&[("demo", "demo --size 96x64 --spp 4")])),
    ("aonet view", Feature("viewer")),
    ("aonet train", Feature("train")),
    ("aonet bench --device gpu", Feature("gpu")),
    ("aonet trace scene.glb --view view.json -o frame.exr --device gpu", Feature("gpu")),
    (
        "aonet dataset data/any",
        Run(&[("0..20", "0..1"), ("--frames 2000", "--frames 8 --size 48x32 --spp 4")]),
    ),
    (
        "aonet dataset data/deep --scenes-dir DIR",
        Run(&[("--scenes-dir DIR --frames 3400", "--procedural hall:1 --frames 8 --size 48x32 --spp 4")]),
    ),
    ("aonet dataset mix", Run(&[("DIR --count 100", ". --count 1")])),
    (
        "aonet dataset data/mixed",
        Run(&[("--frames 1000", "--procedural hall:1 --frames 8 --size 48x32 --spp 4")]),
    ),
    (
        "aonet dataset import",
        Run(&[(
            "--normal DIR --depth DIR --ao DIR",
            "--normal theirs --depth theirs --ao theirs --normals plain",
        )]),
    ),
    ("aonet bench --size", Run(&[("1280x720", "64x36 --runs 1")])),
    (
        "aonet dataset data/test",
        Run(&[("23..26", "23..24"), ("--frames 48 --spp 512", "--frames 2 --size 48x32 --spp 4")]),
    ),
    (
        "aonet dataset data/val",
        Run(&[("20..23", "20..21"), ("--frames 48", "--frames 2 --size 48x32 --spp 4")]),
    ),
    ("aonet eval data/deep", Run(&[("--classic", "--split train --classic")])),
    ("aonet bent", Run(&[("--scenes-dir DIR --frames 16", "--scenes-dir . --spp 4 --model fast")])),
    ("aonet exact-shares", Run(&[("--scenes-dir DIR", "--scenes-dir . --spp 4")])),
    ("aonet ladder", Run(&[("--scenes-dir DIR", "--scenes-dir . --spp 4")])),
    ("aonet tune gtao", Run(&[("-o gtao", "--frames 2 --trials 2 -o gtao")])),
    ("aonet paper all", Not("needs every trained network; the test of the paper's tables makes single ones")),
    ("cargo test --workspace --release", By(".ci/run", "cargo test --workspace --release")),
    ("cargo build --release --features train", By(".ci/run", "aonet_cli/train")),
    ("rustup target add wasm32-unknown-unknown", By(".github/workflows/site.yml", "rustup target add")),
    ("web/build", By("docs/site/build", "web/build")),
    ("web/test", By(".github/workflows/ci.yml", "web/test")),
    ("python3 -m http.server", Not("serves until it is stopped; web/test serves the same folder")),
    ("fuzz/run", Not("runs for half an hour; .github/workflows/fuzz.yml fuzzes every week")),
    ("scripts/kills.py", Not("200 kills of every command take a quarter of an hour")),
    ("cargo install", Not("installs a program for good")),
    ("MIRIFLAGS=", Not("needs a nightly toolchain, and minutes to half an hour")),
    ("cargo +nightly fuzz", Not("needs a nightly toolchain; the test fuzz_seeds replays all seeds")),
];

/// A command of a document, without its comment. What Cargo runs counts as `aonet`.
fn command(line: &str) -> String {
    let code = line.split(" #").next().unwrap_or(line).trim();
    match code.strip_prefix("cargo run --release ").and_then(|rest| rest.split_once("-- ")) {
        Some((_, rest)) => format!("aonet {rest}"),
        None => code.to_owned(),
    }
}

/// The commands of a document: lines of `sh` blocks, and code in its sentences that calls `aonet` with arguments.
fn commands(text: &str) -> Vec<String> {
    let (mut found, mut fence) = (Vec::new(), None);
    let joined = text.replace("\\\n", " ");
    let mut prose = String::new();
    for line in joined.lines() {
        if let Some(language) = line.strip_prefix("```") {
            fence = if fence.is_none() { Some(language) } else { None };
        } else if fence == Some("sh") && !line.trim().is_empty() {
            found.push(command(line));
        } else if fence.is_none() {
            prose += line;
            prose.push(' ');
        }
    }
    let spans = prose.split('`').skip(1).step_by(2).map(|span| span.replace('\n', " "));
    found.extend(spans.filter(|span| span.starts_with("aonet ") && span.split(' ').count() > 3));
    found
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// A folder with the files that the documents name.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let desk = dir.path();
    let view = r#"{"eye":[0.5,3,5],"target":[0,0.5,0],"fov_y_deg":50,"width":48,"height":32,"radius":0.5}"#;
    std::fs::copy(root().join("fuzz/seeds/gltf/everything.glb"), desk.join("scene.glb")).unwrap();
    std::fs::write(desk.join("scenes.csv"), "name,environment,split\nscene,no,train\n").unwrap();
    for name in ["view.json", "camera.json"] {
        std::fs::write(desk.join(name), view).unwrap();
    }
    ok(desk, "trace scene.glb --view view.json --spp 4 -o frame.exr");
    ok(desk, "render scene.glb --view view.json --margin 0.15 --layers 2 -o deep.exr");
    for folder in ["theirs", "runs/any", "assets"] {
        std::fs::create_dir_all(desk.join(folder)).unwrap();
    }
    for copy in ["engine.exr", "blender.exr", "behind.exr", "theirs/frame.exr"] {
        std::fs::copy(desk.join("frame.exr"), desk.join(copy)).unwrap();
    }
    for name in ["model", "mine", "my_network", "runs/any/best"] {
        std::fs::write(desk.join(format!("{name}.safetensors")), aonet::net::shipped::BALANCED).unwrap();
    }
    dir
}

/// Whether this program was built with a feature.
fn has(feature: &str) -> bool {
    match feature {
        "gpu" => cfg!(feature = "gpu"),
        "train" => cfg!(feature = "train"),
        "viewer" => cfg!(feature = "viewer"),
        other => panic!("the feature {other}"),
    }
}

#[test]
fn every_command_runs_or_has_a_reason() {
    let desk = desk();
    let (mut used, mut ran) = (vec![false; FATES.len()], 0);
    for document in DOCUMENTS {
        let text = std::fs::read_to_string(root().join(document)).unwrap();
        let commands = commands(&text);
        assert!(!commands.is_empty(), "{document} has no commands");
        for line in commands {
            let fate = FATES.iter().position(|(start, _)| line.starts_with(start));
            if let Some(i) = fate {
                used[i] = true;
            }
            let arguments = line.strip_prefix("aonet ");
            match (fate.map(|i| &FATES[i].1), arguments) {
                (Some(By(file, words)), _) => {
                    let script = std::fs::read_to_string(root().join(file)).unwrap();
                    assert!(script.contains(words), "{document}: {line}: {file} does not run {words}");
                }
                (Some(Not(reason)), _) => assert!(!reason.is_empty()),
                (Some(Feature(feature)), Some(arguments)) => {
                    if !has(feature) {
                        let said = refusal(&aonet(desk.path(), arguments).output().unwrap());
                        let how = format!("--features {feature}");
                        assert!(said.contains(&how), "{document}: {line}\n{said}");
                    }
                }
                (Some(Run(replacements)), Some(arguments)) => {
                    let small = replacements.iter().fold(arguments.to_owned(), |line, (word, other)| {
                        assert!(line.contains(word), "{document}: {line} without {word}");
                        line.replace(word, other)
                    });
                    ok(desk.path(), &small);
                    ran += 1;
                }
                (None, Some(arguments)) => {
                    ok(desk.path(), arguments);
                    ran += 1;
                }
                _ => panic!("{document}: {line}: run it here, or say why not"),
            }
        }
    }
    assert!(ran > 20, "{ran} commands ran");
    let idle: Vec<_> =
        FATES.iter().zip(&used).filter(|(_, used)| !**used).map(|((start, _), _)| start).collect();
    assert!(idle.is_empty(), "no document has {idle:?}");
}

#[test]
fn commands_are_found_in_blocks_and_sentences() {
    let text = "Say `aonet info frame.exr --json` and `aonet info`.\n```sh\naonet a \\\n  b   # c\ncargo run --release --features x -- d\n```\n```rust\nf();\n```\n";
    assert_eq!(commands(text), ["aonet a    b", "aonet d", "aonet info frame.exr --json"]);
}

#[test]
fn every_engine_has_a_test_of_its_commands() {
    let engines = std::fs::read_dir(root().join("engines")).unwrap().map(|entry| entry.unwrap().path());
    let engines: Vec<_> = engines.filter(|path| path.join("README.md").exists()).collect();
    assert!(engines.len() > 3, "{engines:?}");
    let without: Vec<_> = engines.iter().filter(|path| !path.join("test").is_file()).collect();
    assert!(without.is_empty(), "{without:?}");
}

//! The program under bad conditions: closed pipes, full disks, truncated files, invalid numbers.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A folder with one file of each kind that the program reads.
struct Desk {
    dir: tempfile::TempDir,
}

const VIEW: &str = r#"{"eye":[0.3,0.2,3.0],"target":[0,0,0],"width":24,"height":16,"radius":0.5}"#;

impl Desk {
    fn new() -> Self {
        let desk = Self { dir: tempfile::tempdir().unwrap() };
        let glb = include_bytes!("../../../fuzz/seeds/gltf/triangle.glb");
        desk.write("scene.glb", glb);
        desk.write("view.json", VIEW.as_bytes());
        desk.write("model.safetensors", aonet::net::shipped::PAPER);
        desk.run("trace scene.glb --view view.json --spp 4 --ground -o frame.exr --png ao.png");
        desk.run("infer frame.exr -o ao.exr");
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aonet"));
        command.args(line.split_whitespace()).current_dir(self.dir.path());
        command
    }

    /// Runs a command that must neither panic nor be killed.
    fn run(&self, line: &str) -> Output {
        let output = self.command(line).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_some_and(|c| c <= 2), "aonet {line}: {:?}\n{stderr}", output.status);
        output
    }

    fn json(&self, line: &str) -> Value {
        let output = self.run(line);
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("aonet {line}: {e}: {output:?}"))
    }
}

#[test]
fn info_knows_every_kind_of_file() {
    let desk = Desk::new();
    desk.run(
        "dataset data --procedural clutter_pile:1 --split test --frames 1 --width 32 --height 24 --spp 2",
    );
    desk.write("nnao.safetensors", include_bytes!("../../aonet/models/nnao.safetensors"));
    std::fs::rename(desk.path("data/manifest.json"), desk.path("data/renamed.json")).unwrap();
    for (file, kind) in [
        ("scene.glb", "scene"),
        ("view.json", "view"),
        ("model.safetensors", "model"),
        ("frame.exr", "frame"),
        ("ao.exr", "AO image"),
        ("ao.png", "AO image"),
        ("data/renamed.json", "dataset"),
        ("procedural:clutter_pile:1", "scene"),
        ("nnao", "classic method"),
        ("gtao:tuned", "classic method"),
        ("nnao.safetensors", "weights of nnao, a classic method"),
    ] {
        assert_eq!(desk.json(&format!("info {file} --json"))["kind"], kind, "{file}");
    }
    // As the model card lists them.
    assert_eq!(desk.json("info nnao.safetensors --json")["parameters"], 15421);
    assert_eq!(desk.json("info nnao --json")["trained_weights"], 15421);
    assert!(desk.json("info model.safetensors --json")["parameters"].as_u64().is_some_and(|n| n > 1000));
}

#[test]
fn files_cut_anywhere_are_refused_by_name() {
    let desk = Desk::new();
    for (file, line) in [
        ("frame.exr", "infer cut.frame.exr -o out.exr"),
        ("scene.glb", "render cut.scene.glb --view view.json -o out.exr"),
        ("view.json", "render scene.glb --view cut.view.json -o out.exr"),
        ("model.safetensors", "infer frame.exr --model cut.model.safetensors -o out.exr"),
        ("ao.exr", "compare ao.exr cut.ao.exr"),
        ("ao.png", "compare ao.png cut.ao.png"),
        ("frame.exr", "info cut.frame.exr"),
        ("model.safetensors", "info cut.model.safetensors"),
    ] {
        let bytes = std::fs::read(desk.path(file)).unwrap();
        for end in [0, 1, 9, bytes.len() / 3, bytes.len() / 2, bytes.len() - 1] {
            desk.write(&format!("cut.{file}"), &bytes[..end]);
            let output = desk.run(line);
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert_eq!(
                output.status.code(),
                Some(2),
                "aonet {line}, {end} of {} bytes\n{stderr}",
                bytes.len()
            );
            assert!(stderr.starts_with("aonet: ") && stderr.contains(&format!("cut.{file}")), "{stderr}");
        }
    }
    assert!(!desk.path("out.exr").exists());
}

#[test]
fn numbers_that_are_none_are_refused() {
    let desk = Desk::new();
    for line in [
        "compare ao.exr ao.exr --min-ssim nan",
        "compare ao.exr ao.exr --min-psnr x",
        "trace scene.glb --view view.json --spp 0 -o out.exr",
        "trace scene.glb --view view.json --spp 4294967295 -o out.exr",
        "render scene.glb --view view.json --width 0 -o out.exr",
        "render scene.glb --view view.json --height 99999999999 -o out.exr",
        "render scene.glb --view view.json --radius=-inf -o out.exr",
        "infer frame.exr -o out.exr --fov-y 0",
        "infer frame.exr -o out.exr --fov-y nan",
        "infer frame.exr -o out.exr --fov-y 180",
        "infer frame.exr -o out.exr --device abacus",
        "demo --width 0",
        "demo --view view.json",
        "eval . --constant nan",
    ] {
        let output = desk.run(line);
        assert_eq!(output.status.code(), Some(2), "aonet {line}\n{output:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "aonet {line}\n{output:?}");
    }
    assert!(!desk.path("out.exr").exists() && !desk.path("aonet_demo").exists());
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("folder.exr")).unwrap();
    desk.run("dataset data --procedural hall:1 --frames 1 --spp 1 --size 32x24");
    for line in [
        "infer frame.exr -o view.json/x.exr",
        "infer frame.exr -o folder.exr",
        "render scene.glb --view view.json -o view.json/x.exr",
        "trace scene.glb --view view.json --spp 1 -o folder.exr",
        "compare ao.exr ao.exr --picture view.json/x.png",
        "demo --width 32 --height 24 --spp 1 -o view.json/out",
        "dataset view.json/data --procedural hall:1 --frames 1 --spp 1 --size 32x24",
        "dataset view.json --procedural hall:1 --frames 1 --spp 1 --size 32x24",
        "export paper --onnx view.json/paper.onnx",
        "eval data --split train -o view.json/table.md",
        "tune gtao --on data --trials 1 -o view.json/gtao.json",
    ] {
        let output = desk.run(line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "aonet {line}\n{stderr}");
        assert!(stderr.contains("view.json") || stderr.contains("folder.exr"), "aonet {line}\n{stderr}");
    }
    assert_eq!(std::fs::read(desk.path("view.json")).unwrap(), VIEW.as_bytes());
    assert_eq!(std::fs::read_dir(desk.path("folder.exr")).unwrap().count(), 0);
}

#[test]
fn readers_that_hang_up_are_no_error() {
    let desk = Desk::new();
    for line in ["completions bash", "info model.safetensors --json", "--help", "infer frame.exr -o x.exr"] {
        let mut command = desk.command(line);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command.stdout(writer).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "aonet {line}\n{output:?}");
        assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_stderr_stops_nothing_and_a_full_stdout_is_an_error() {
    let desk = Desk::new();
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    let trace = "trace scene.glb --view view.json --spp 1 -o x.exr";
    for (line, code) in [(trace, 0), ("infer frame.exr -o x.exr", 0), ("infer missing.exr -o x.exr", 2)] {
        let status = desk.command(line).stdout(Stdio::null()).stderr(full()).status().unwrap();
        assert_eq!(status.code(), Some(code), "aonet {line}");
    }
    for line in [trace, "completions zsh", "info view.json", "compare ao.exr ao.exr"] {
        let output = desk.command(line).stdout(full()).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "aonet {line}\n{stderr}");
        assert!(stderr.contains("standard output"), "aonet {line}\n{stderr}");
    }
}

//! `--device gpu` as a user meets it. Without a device a test says that it was skipped; with `AONET_REQUIRE_GPU=1` it
//! fails.

use aonet::AoImage;
use aonet::gpu::{Device, wgpu};
use aonet::net::shipped;
use aonet::search::Classic;
use aonet_lab::ao_file::load_ao;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// Largest and mean difference from the CPU's image in f32, whichever network runs and whatever the GPU multiplies.
/// Measured: largest 2.3e-6, 2.0e-3, 0.034, 0.034, where a tap between two pixels falls on the other one; mean 3.4e-8, 3.0e-5,
/// 7.1e-6, 1.1e-5.
const MOST: [(&str, &str, [f32; 2]); 6] = [
    ("paper", "f32", [2e-5, 5e-7]),
    ("paper", "f16", [6e-3, 2e-4]),
    ("balanced", "f32", [0.1, 1e-4]),
    ("balanced", "f16", [0.1, 1e-4]),
    ("high", "f32", [0.1, 1e-4]),
    ("high", "f16", [0.1, 2e-4]),
];

/// Mean difference of a classic method from the CPU's image: see the library's tests. Measured: 1.1e-5.
const CLASSIC_MEAN: f32 = 1e-4;

const VIEW: &str =
    r#"{"eye":[0.5,3.0,5.0],"target":[0.0,0.5,0.0],"fov_y_deg":50,"width":97,"height":61,"radius":0.5}"#;

/// Whether there is a device; where there is none, says so.
fn has_device() -> bool {
    match Device::wait_for() {
        Ok(_) => true,
        Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            false
        }
    }
}

fn aonet(dir: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_aonet"));
    command.current_dir(dir);
    command
}

fn status(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn ok(dir: &Path, line: &str) -> String {
    let (code, stderr) = status(&aonet(dir).args(line.split_whitespace()).output().unwrap());
    assert_eq!(code, Some(0), "aonet {line}\n{stderr}");
    stderr
}

/// What a user looks up first.
#[test]
fn info_describes_the_graphics_processor() {
    if !has_device() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let output = aonet(dir.path()).args(["info", "gpu", "--json"]).output().unwrap();
    assert_eq!(status(&output).0, Some(0));
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let device = Device::wait_for().unwrap();
    assert_eq!(facts["name"], device.adapter.name);
    assert_eq!(
        facts["half_floats"],
        device.device.features().contains(aonet::gpu::wgpu::Features::SHADER_F16)
    );
    assert_eq!(facts["matrices"], device.matrices.is_some());
}

/// The estimates need no device.
#[test]
fn scores_are_drawn_over_estimated_times() {
    let dir = tempfile::tempdir().unwrap();
    ok(
        dir.path(),
        "dataset frames --procedural clutter_pile:1 --split test --frames 1 --width 64 --height 48 --spp 8",
    );
    ok(
        dir.path(),
        "eval frames --model fast --classic gtao --classic nnao --plot-gpu gpu.svg --plot cpu.svg",
    );
    let [gpu, cpu] =
        ["gpu.svg", "cpu.svg"].map(|name| std::fs::read_to_string(dir.path().join(name)).unwrap());
    assert!(gpu.contains("estimated ms") && gpu.contains("fast") && gpu.contains("gtao"), "{gpu}");
    assert!(!gpu.contains("nnao"), "it has no shaders: {gpu}");
    assert!(!cpu.contains("estimated") && cpu.contains("nnao"), "{cpu}");
}

/// A folder with a frame, and the same with a guard band and a second layer.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("view.json"), VIEW).unwrap();
    for (surround, name) in [("", "frame.exr"), ("--margin 0.15 --layers 2", "deep.exr")] {
        ok(dir.path(), &format!("render procedural:clutter_pile:1 --view view.json {surround} -o {name}"));
    }
    dir
}

/// Largest and mean difference.
fn differences(a: &AoImage, b: &AoImage) -> [f32; 2] {
    let pairs = a.visibility().iter().zip(b.visibility());
    let off: Vec<_> = pairs.map(|(a, b)| (a - b).abs()).collect();
    [off.iter().copied().fold(0.0, f32::max), off.iter().sum::<f32>() / off.len() as f32]
}

#[test]
fn both_devices_write_the_same_picture() {
    if !has_device() {
        return;
    }
    let desk = desk();
    let dir = desk.path();
    for (network, precision, most) in MOST {
        let file = if network == "high" { "deep.exr" } else { "frame.exr" };
        let infer = |flags: &str| {
            let said = ok(dir, &format!("infer {file} -o ao.exr --model {network} {flags}"));
            (load_ao(&dir.join("ao.exr")).unwrap(), said)
        };
        let (expected, _) = infer("--precision f32");
        let (found, said) = infer(&format!("--device gpu --precision {precision}"));
        let what = format!("{network}, {precision}");
        assert!(said.contains(", f16") || said.contains(", f32"), "{what}: {said}");
        let off = differences(&found, &expected);
        eprintln!("{what}: {off:?}");
        assert!((0..2).all(|i| off[i] <= most[i]), "{what}: {off:?} beyond {most:?}");
        // Another radius, where a network sees it, is another picture.
        if network != "paper" {
            let (other, _) = infer("--device gpu --radius 0.6");
            let off = differences(&other, &expected);
            assert!(off[1] > most[1], "{what}: {off:?} within {most:?}");
        }
    }
}

#[test]
fn classic_methods_write_the_same_picture_on_both_devices() {
    if !has_device() {
        return;
    }
    let desk = desk();
    let classic = |flags: &str| {
        ok(desk.path(), &format!("classic {flags} frame.exr -o ao.exr"));
        load_ao(&desk.path().join("ao.exr")).unwrap()
    };
    for method in ["ssao:tuned", "gtao:tuned"] {
        let off = differences(&classic(&format!("{method} --device gpu")), &classic(method));
        eprintln!("{method}: {off:?}");
        assert!(off[1] <= CLASSIC_MEAN, "{method}: {off:?}");
        let other = differences(&classic(&format!("{method} --device gpu --radius 0.6")), &classic(method));
        assert!(other[1] > CLASSIC_MEAN, "{method}: {other:?}");
    }
}

#[test]
fn a_precision_of_the_other_device_is_refused() {
    let desk = desk();
    for (flags, word) in [
        ("--precision f16", "--device gpu"),
        ("--device gpu --precision bf16", "--device cpu"),
        ("--device gpu --precision int8", "--device cpu"),
    ] {
        let line = format!("infer frame.exr -o ao.exr {flags}");
        let (code, stderr) = status(&aonet(desk.path()).args(line.split_whitespace()).output().unwrap());
        assert_eq!(code, Some(2), "{line}\n{stderr}");
        assert!(stderr.contains(word) && !stderr.contains("panicked"), "{line}\n{stderr}");
    }
}

#[test]
fn times_are_those_of_passes_or_none() {
    if !has_device() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let bench = |flags: &str| -> serde_json::Value {
        let line =
            format!("bench --device gpu --size 64x48 --runs 2 --json --peak-tflops 2 --bandwidth 50 {flags}");
        let output = aonet(dir.path()).args(line.split_whitespace()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", status(&output).1);
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/aonet/models/paper.safetensors");
    let found = bench(&format!(
        "--software --kernels plain --model {} --classic gtao --classic nnao",
        paper.display()
    ));
    let rows = found["rows"].as_array().unwrap();
    // The method that has no shaders is left out.
    let precisions: Vec<_> = rows.iter().map(|row| row["precision"].as_str().unwrap()).collect();
    assert!(precisions == ["f32", "f16", "f32"] || precisions == ["f32", "f32"], "{precisions:?}");
    for row in rows {
        let sum = |what: &str| {
            row["passes"].as_array().unwrap().iter().map(|p| p[what].as_f64().unwrap()).sum::<f64>()
        };
        assert!(row["frame"]["median_ms"].as_f64().unwrap() > 0.0, "{row}");
        assert!((row["flop"].as_f64().unwrap() / sum("flop") - 1.0).abs() < 1e-9, "{row}");
        // A pass takes at least the time of its operations and of its bytes; 1 TFLOP/s is 1e9 a millisecond.
        let floor = row["floor_ms"].as_f64().unwrap();
        assert!(floor >= (sum("flop") / 2e9).max(sum("bytes") / 50e6) * 0.999_999, "{row}");
        assert!(floor <= sum("flop") / 2e9 + sum("bytes") / 50e6, "{row}");
        // Slower than at every peak.
        assert!(row["estimate_ms"].as_f64().unwrap() > sum("flop") / 12.7e9, "{row}");
    }
    if found["type"] == "Cpu" {
        let found = bench("");
        assert!(found["not_measured"].as_str().unwrap().contains("--software"), "{found}");
        let rows = found["rows"].as_array().unwrap();
        // Every shipped network, at most in two precisions with two kernels, and every classic method with shaders.
        let mut counts = BTreeMap::new();
        for row in rows {
            assert!(row["frame"].is_null(), "{row}");
            *counts.entry(row["method"].as_str().unwrap()).or_insert(0) += 1;
        }
        let networks: Vec<_> = shipped::ALL.iter().map(|(name, _)| *name).collect();
        let classic = Classic::all().iter().filter(|m| !matches!(m, Classic::Nnao(_))).count();
        assert_eq!(counts.len(), networks.len() + classic, "{counts:?}");
        for (method, count) in counts {
            let most = if networks.contains(&method) { 4 } else { 1 };
            assert!((1..=most).contains(&count), "{method}: {count} rows");
        }
    }
}

/// The Vulkan loader takes its drivers from these variables.
#[cfg(target_os = "linux")]
#[test]
fn without_a_driver_the_message_says_what_to_install() {
    let desk = desk();
    let mut command = aonet(desk.path());
    command.args(["infer", "frame.exr", "-o", "ao.exr", "--device", "gpu"]);
    command.env("VK_DRIVER_FILES", "none.json").env("VK_ICD_FILENAMES", "none.json");
    let (code, stderr) = status(&command.output().unwrap());
    assert_eq!(code, Some(2), "{stderr}");
    for word in ["mesa-vulkan-drivers", "--device cpu", "adapter"] {
        assert!(stderr.contains(word), "{stderr}");
    }
    assert!(!desk.path().join("ao.exr").exists());
}

/// A driver that computes on the CPU takes its memory from the process, so a limit of the process is one of the device.
#[test]
#[cfg(target_os = "linux")]
fn a_device_without_enough_memory_is_an_error() {
    let of_the_cpu = |device: Device| device.adapter.device_type == wgpu::DeviceType::Cpu;
    let on_the_cpu = has_device() && Device::wait_for().is_ok_and(of_the_cpu);
    if !on_the_cpu {
        return eprintln!("skipped: the device has memory of its own");
    }
    let dir = tempfile::tempdir().unwrap();
    let view = VIEW.replace("\"width\":97,\"height\":61", "\"width\":1600,\"height\":1200");
    std::fs::write(dir.path().join("view.json"), view).unwrap();
    ok(dir.path(), "render procedural:clutter_pile:5 --view view.json --ground -o frame.exr");
    let mut refusals = Vec::new();
    for mebibytes in (400..4000).step_by(40) {
        let script = format!("ulimit -c 0; ulimit -v {}; exec \"$@\"", mebibytes << 10);
        let mut command = Command::new("sh");
        command.current_dir(dir.path()).args(["-c", &script, "sh", env!("CARGO_BIN_EXE_aonet")]);
        command.args("infer frame.exr --model fast --device gpu -o ao.exr".split_whitespace());
        let (code, said) = status(&command.output().unwrap());
        assert!(!said.contains("panicked"), "{mebibytes} MiB: {said}");
        match code {
            Some(0) => break,
            Some(2) => refusals.push(said),
            // The loader of programs, the driver or Rust's allocator got no memory and ended the process.
            _ => {}
        }
        assert!(!dir.path().join("ao.exr").exists(), "{mebibytes} MiB: an image without success");
    }
    assert!(dir.path().join("ao.exr").exists(), "enough memory is enough");
    let of_the_device = |said: &&String| said.contains("enough memory") && said.contains("Out of Memory");
    assert!(refusals.iter().any(|said| of_the_device(&said)), "{refusals:#?}");
}

//! `aonet bench` and `aonet export --config` as a user meets them.

mod common;

use aonet::simd::Level;
use common::{aonet, json, ok};
use serde_json::Value;
use std::path::Path;

fn project() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

const SMALL: &str =
    r#"{"arch":"ao_net","features":"normal","patch":4,"kernel":"linear","encoder":[16],"decoder":[]}"#;

/// A folder with the configuration of a small network, alone and as part of one of training.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("alone.json"), SMALL).unwrap();
    std::fs::write(dir.path().join("training.json"), format!(r#"{{"model":{SMALL},"steps":1}}"#)).unwrap();
    dir
}

#[test]
fn a_configuration_is_a_network() {
    let dir = desk();
    let dir = dir.path();
    ok(dir, "export --config alone.json --onnx alone.onnx");
    ok(dir, "export --config training.json --onnx training.onnx");
    let [alone, training] =
        ["alone", "training"].map(|n| std::fs::read(dir.join(format!("{n}.onnx"))).unwrap());
    assert_eq!(alone, training);
    let bench = json(dir, "bench --config training.json --size 64x64 --threads 1 --runs 3 --json");
    let (network, row) = (&bench["networks"][0], &bench["timings"][0]);
    // 3x3 from 48 and from 16 to 16, 1x1 from 16 to 768, and biases.
    assert_eq!(network["parameters"], (48 + 16) * 16 * 9 + 2 * 16 + 16 * 768 + 768);
    let ms = |what: &str| row[what].as_f64().unwrap();
    assert!(
        0.0 < ms("min_ms") && ms("min_ms") <= ms("median_ms") && ms("median_ms") <= ms("max_ms"),
        "{row}"
    );
    assert!(ms("features_ms") < ms("median_ms") && ms("first_ms") > 0.0, "{row}");
    for (line, words) in [
        ("bench --config none.json", "none.json"),
        ("export --config training.json alone.json --onnx x.onnx", "cannot be used with"),
        ("bench --methods some", "all"),
        ("bench --precision f8", "f32, f16, bf16, int8"),
        ("bench --precision f16", "--device gpu"),
        ("bench --ops --classic ssao", "cannot be used with"),
        ("bench --level sse9", "portable, avx2, avx512"),
        ("bench --level portable --device gpu", "--device cpu"),
    ] {
        let output = aonet(dir, line).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(words), "aonet {line}\n{stderr}");
    }
    std::fs::write(dir.join("wrong.json"), SMALL.replace("\"patch\":4", "\"patch\":3")).unwrap();
    let stderr = aonet(dir, "export --config wrong.json --onnx x.onnx").output().unwrap().stderr;
    let stderr = String::from_utf8_lossy(&stderr).into_owned();
    assert!(stderr.contains("wrong.json") && stderr.contains("patch"), "{stderr}");
}

#[test]
fn the_given_instructions_are_used() {
    let dir = desk();
    let run = |level: Level| {
        let level = format!("{level:?}").to_lowercase();
        let methods = "--config alone.json --classic ssao --size 64x64 --threads 1 --runs 1 --json";
        aonet(dir.path(), &format!("bench {methods} --level {level}")).output().unwrap()
    };
    for level in [Level::Portable, Level::Avx2, Level::Avx512] {
        let output = run(level);
        let stderr = String::from_utf8_lossy(&output.stderr);
        if !Level::available().any(|available| available == level) {
            assert!(output.status.code() == Some(2) && stderr.contains(&format!("{level:?}")), "{stderr}");
            continue;
        }
        let bench: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(bench["machine"].as_str().unwrap().ends_with(&format!(", {level:?}")), "{bench}");
        assert_eq!(bench["timings"].as_array().unwrap().len(), 2);
    }
}

#[test]
fn every_precision_of_the_machine_has_its_rows() {
    let dir = desk();
    let precisions: Vec<_> = aonet::net::cpu::Precision::available().map(|p| p.to_string()).collect();
    let flags: String = precisions.iter().map(|p| format!(" --precision {p}")).collect();
    let line =
        format!("bench --config alone.json --classic ssao --size 64x64 --threads 1 --runs 1 --json{flags}");
    let bench = json(dir.path(), &line);
    let of = |method: &str| {
        let rows = bench["timings"].as_array().unwrap().iter().filter(|row| row["method"] == method);
        rows.map(|row| row["precision"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(of("alone"), precisions);
    assert_eq!(of("ssao"), [Value::Null]);
}

#[test]
fn all_methods_are_every_classic_one_and_every_configuration_once() {
    let bench = json(project(), "bench --methods all --size 64x64 --threads 1 --runs 1 --json");
    let names: Vec<_> =
        bench["timings"].as_array().unwrap().iter().map(|row| row["method"].as_str().unwrap()).collect();
    for name in ["balanced", "paper", "deep_ao", "deep_shading", "base_patch", "ssao", "gtao", "agtao"] {
        assert_eq!(names.iter().filter(|n| **n == name).count(), 1, "{name} of {names:?}");
    }
    // The same network with other weights takes the same time.
    assert!(!names.contains(&"l1_only") && !names.contains(&"deep_ao-2"), "{names:?}");
}

#[test]
fn every_step_stands_beside_its_floor() {
    let dir = desk();
    let bench = json(dir.path(), "bench --config alone.json --ops --size 128x64 --threads 1 --runs 3 --json");
    let network = &bench["networks"][0];
    let ops = network["ops"].as_array().unwrap();
    let names: Vec<_> = ops.iter().map(|op| op["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["features", "enc0.conv0", "enc0.conv1", "head"]);
    let peak = network["gflop_per_s"].as_f64().unwrap();
    for op in &ops[1..] {
        let of = |what: &str| op[what].as_f64().unwrap();
        assert!((of("flop_floor_ms") - of("flop") / peak / 1e6).abs() < 1e-9, "{op}");
        let floor = of("flop_floor_ms").max(of("bytes_floor_ms"));
        assert!((of("over_floor") - of("median_ms") / floor).abs() < 1e-6 * of("over_floor"), "{op}");
    }
    let shares: f64 = ops.iter().map(|op| op["share"].as_f64().unwrap()).sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
    let text = ok(dir.path(), "bench --config alone.json --ops --size 128x64 --threads 1 --runs 3");
    assert!(text.contains("GFLOP/s, copy") && text.contains("frame "), "{text}");
}

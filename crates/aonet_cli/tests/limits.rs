//! Limits of optimised builds: memory, time to the first image, and the size of the released program.
//!
//!     cargo test --release -p aonet_cli --test limits -- --nocapture --include-ignored
//!     cargo test --profile dist -p aonet_cli --test limits -- --nocapture

use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// Most memory of the process with frame and parameters at 1280x720 (MiB).
const PEAK_MIB: f64 = 100.0;
/// Most that a first image may take longer than the others, once a model is in memory (ms).
const START_MS: f64 = 30.0;
/// Largest program of the profile `dist`, without training (bytes).
const PROGRAM_BYTES: u64 = 8_000_000;

/// Held while a test measures, so that other tests do not disturb it.
static ALONE: Mutex<()> = Mutex::new(());

fn json(folder: &Path, line: &str) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_aonet"));
    let output = command.args(line.split_whitespace()).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "aonet {line}\n{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap_or(Value::Null)
}

/// A folder with a frame.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
    let view =
        r#"{"eye":[1.2,1.4,1.9],"target":[0,0.3,0],"fov_y_deg":60,"radius":0.5,"width":1280,"height":720}"#;
    write("view.json", view.as_bytes());
    json(dir.path(), "render procedural:clutter_pile:5 --view view.json --ground -o frame.exr");
    dir
}

#[test]
#[cfg_attr(debug_assertions, ignore = "holds for the release build")]
fn frames_of_720p_need_little_memory() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let desk = desk();
    for network in ["balanced", "paper"] {
        for line in ["infer frame.exr -o ao.exr", "infer frame.exr -o ao.png"] {
            let facts = json(desk.path(), &format!("{line} --model {network} --threads 2 --json"));
            let Some(peak) = facts["peak_mib"].as_f64() else {
                eprintln!("skipped: the system does not tell");
                return;
            };
            eprintln!("{network}, {line}: {peak:.1} MiB");
            // A frame alone, depth and normal, is 14 MiB.
            assert!(peak > 14.0 && peak <= PEAK_MIB, "{network}, {line}: {peak} MiB");
        }
    }
}

#[test]
#[ignore = "takes times: for an idle machine"]
fn the_first_image_comes_soon() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let desk = desk();
    for network in ["balanced", "paper"] {
        for threads in [1, 2] {
            let line = format!("bench --model {network} --size 1280x720 --threads {threads} --runs 5 --json");
            // On a busy machine, one of a few tries is undisturbed.
            let late = (0..5).map(|_| {
                let row = &json(desk.path(), &line)["timings"][0];
                row["first_ms"].as_f64().unwrap() - row["median_ms"].as_f64().unwrap()
            });
            let late = late.fold(f64::INFINITY, f64::min);
            eprintln!("{network}, {threads} threads: {late:.1} ms");
            assert!(late <= START_MS, "{network}, {threads} threads: {late} ms");
        }
    }
}

#[test]
#[cfg_attr(any(debug_assertions, feature = "train"), ignore = "holds without training")]
fn the_program_is_small() {
    let program = Path::new(env!("CARGO_BIN_EXE_aonet"));
    if !program.components().any(|part| part.as_os_str() == "dist") {
        eprintln!("skipped: not of the profile `dist`");
        return;
    }
    let bytes = std::fs::metadata(program).unwrap().len();
    eprintln!("{bytes} bytes");
    assert!(bytes <= PROGRAM_BYTES, "{bytes} bytes");
}

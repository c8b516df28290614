//! `--device`: references of graphics processors, and the message without one.

mod common;

use common::{aonet, refusal};

const VIEW: &str =
    r#"{"eye":[0.5,3,5],"target":[0,0.5,0],"fov_y_deg":50,"width":48,"height":32,"radius":0.5}"#;

const TRACE: &str = "trace procedural:clutter_pile:1 --view view.json --spp 16 --json -o";

/// A folder with a view.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("view.json"), VIEW).unwrap();
    dir
}

#[test]
#[cfg(not(feature = "gpu"))]
fn a_program_without_the_feature_says_so() {
    let dir = desk();
    for line in [&format!("{TRACE} x.exr --device gpu"), "dataset x --device gpu"] {
        let said = refusal(&aonet(dir.path(), line).output().unwrap());
        assert!(said.contains("feature gpu"), "{said}");
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing was written");
}

#[cfg(feature = "gpu")]
mod gpu {
    use super::common::{json, ok};
    use super::*;
    use std::path::Path;

    /// Whether there is a device; without one a test says that it was skipped, or fails.
    fn is_there(dir: &Path) -> bool {
        let output = aonet(dir, &format!("{TRACE} probe.exr --device gpu")).output().unwrap();
        let required = std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1");
        if !output.status.success() {
            let said = refusal(&output);
            assert!(!required && said.contains("adapter"), "{said}");
            eprintln!("skipped: {said}");
        }
        output.status.success()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_machine_without_a_graphics_processor_says_so() {
        let dir = desk();
        for line in [&format!("{TRACE} x.exr --device gpu"), "dataset x --device gpu"] {
            // Vulkan finds drivers by these files.
            let mut command = aonet(dir.path(), line);
            command.env("VK_ICD_FILENAMES", "/nowhere").env("VK_DRIVER_FILES", "/nowhere");
            let said = refusal(&command.output().unwrap());
            assert!(said.contains("--device gpu") && said.contains("adapter"), "{said}");
        }
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing was written");
    }

    #[test]
    fn frames_agree_with_the_cpu() {
        let dir = desk();
        if !is_there(dir.path()) {
            return;
        }
        let cpu = json(dir.path(), &format!("{TRACE} cpu.exr --device cpu"));
        let gpu = json(dir.path(), &format!("{TRACE} gpu.exr --device gpu"));
        assert!(cpu["device"] == "cpu" && gpu["device"] != "cpu");
        assert_eq!(cpu["rays"], gpu["rays"]);
        assert!(gpu["seconds"].as_f64().is_some_and(|s| s > 0.0));
        ok(dir.path(), "compare cpu.exr gpu.exr --min-psnr 45");
        ok(dir.path(), &format!("{TRACE} other.exr --device gpu --seed 1"));
        let apart = aonet(dir.path(), "compare cpu.exr other.exr --min-psnr 45").output().unwrap();
        assert_eq!(apart.status.code(), Some(1), "other rays make another image");
    }

    #[test]
    fn datasets_have_the_same_manifest_and_go_on_on_another_device() {
        let dir = desk();
        if !is_there(dir.path()) {
            return;
        }
        let make = |to: &str, device: &str| {
            let what = "--procedural sculpture --frames 2 --width 48 --height 32 --spp 16 --json";
            json(dir.path(), &format!("dataset {to} {what} --device {device}"))
        };
        let (cpu, gpu) = (make("cpu", "cpu"), make("gpu", "gpu"));
        assert_eq!((&cpu["made"], &cpu["rays"]), (&gpu["made"], &gpu["rays"]));
        let manifest = |of: &str| std::fs::read_to_string(dir.path().join(of).join("manifest.json")).unwrap();
        assert_eq!(manifest("cpu"), manifest("gpu"));
        let frames = dir.path().join("gpu/frames");
        let scene = std::fs::read_dir(frames).unwrap().next().unwrap().unwrap().path();
        let frame = std::fs::read_dir(scene).unwrap().next().unwrap().unwrap().path();
        std::fs::remove_file(&frame).unwrap();
        let again = make("gpu", "cpu");
        assert_eq!((again["made"].as_u64(), again["kept"].as_u64()), (Some(1), Some(1)));
        assert!(frame.exists() && manifest("cpu") == manifest("gpu"));
    }
}

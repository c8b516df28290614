//! `aonet view` without a window, and its messages when it cannot draw.

mod common;

use common::{aonet, refusal};

#[test]
#[cfg(not(feature = "viewer"))]
fn a_program_without_the_viewer_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let said = refusal(&aonet(dir.path(), "view --headless --out x").output().unwrap());
    assert!(said.contains("--features viewer"), "{said}");
}

#[cfg(feature = "viewer")]
mod viewer {
    use super::*;
    use std::path::Path;

    const WAY: &str = r#"{"keys": [{"seconds": 0, "eye": [1.55, 1.5, 1.75], "target": [-1.2, 0.75, -1.5]},
        {"seconds": 2, "eye": [1.0, 1.5, 1.0], "target": [-1.2, 0.75, -1.5]}]}"#;

    /// Whether there is a device; without one a test says that it was skipped, or fails.
    fn is_there(dir: &Path) -> bool {
        let output = aonet(dir, "view --headless --size 8x8 --method off --out probe").output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let required = std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1");
        assert!(output.status.success() || !required, "{stderr}");
        if !output.status.success() {
            assert!(stderr.contains("adapter"), "{stderr}");
            eprintln!("skipped: {stderr}");
        }
        output.status.success()
    }

    fn picture(path: &Path) -> image::RgbImage {
        image::open(path).unwrap().to_rgb8()
    }

    #[test]
    fn pictures_along_a_way() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        std::fs::write(dir.path().join("way.json"), WAY).unwrap();
        let line = "view --headless --size 64x36 --method gtao --show ao --camera-path way.json --frames 3 --out film/a";
        let output = aonet(dir.path(), line).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let stdout = String::from_utf8(output.stdout).unwrap();
        let named: Vec<_> = stdout.lines().map(|line| dir.path().join(line)).collect();
        let mut there: Vec<_> =
            std::fs::read_dir(dir.path().join("film/a")).unwrap().map(|e| e.unwrap().path()).collect();
        there.sort();
        assert_eq!(named, there);
        let pictures: Vec<_> = named.iter().map(|path| picture(path)).collect();
        assert_eq!(pictures.len(), 3);
        assert!(pictures.iter().all(|p| p.dimensions() == (64, 36)));
        assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
        let dark = pictures[0].pixels().filter(|p| p.0[0] < 128).count();
        assert!(dark > 20, "{dark} dark pixels");
    }

    #[test]
    fn a_radius_that_networks_do_not_know_is_warned_of() {
        let dir = tempfile::tempdir().unwrap();
        // Without a device as well: it is asked for afterwards.
        let line = "view --headless --size 32x18 --method balanced --against paper --out x";
        let stderr = |radius: &str| {
            let output = aonet(dir.path(), &format!("{line} {radius}")).output().unwrap();
            String::from_utf8(output.stderr).unwrap()
        };
        let said = stderr("--radius 1e4");
        for words in ["the network balanced was trained with 2 to 40 %", "the network paper does not see"] {
            assert!(said.contains(words), "{said}");
        }
        assert!(!stderr("--radius 0.5").contains("balanced"));
        assert!(stderr("--radius -1").contains("--radius"));
    }

    #[test]
    fn one_picture_is_the_view_and_many_go_around() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        for (folder, frames) in [("one", 1), ("four", 4)] {
            let line = format!("view --headless --size 32x18 --method off --frames {frames} --out {folder}");
            assert!(aonet(dir.path(), &line).output().unwrap().status.success());
        }
        let [one, first, second] = ["one/frame_0000.png", "four/frame_0000.png", "four/frame_0001.png"]
            .map(|name| picture(&dir.path().join(name)));
        let far = |a: &image::RgbImage, b: &image::RgbImage| {
            a.pixels()
                .zip(b.pixels())
                .filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 3))
                .count()
        };
        // The way around begins at the view, up to rounding.
        assert!(
            far(&one, &first) < 12 && far(&first, &second) > 100,
            "{} {}",
            far(&one, &first),
            far(&first, &second)
        );
    }

    #[test]
    fn frames_have_their_guard_band_and_second_layer_in_their_files() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        let line = "view --headless --size 64x36 --method gtao --margin 0.25 --layers 2 --frames 2 --exr --times --out deep";
        let output = aonet(dir.path(), line).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{stderr}");
        assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 4);
        assert_eq!(picture(&dir.path().join("deep/frame_0001.png")).dimensions(), (64, 36));
        let timed = stderr.lines().filter(|line| line.contains("second layer") && line.contains("GTAO"));
        assert!(timed.count() == 2 || stderr.contains("does not time passes"), "{stderr}");
        let info = common::json(dir.path(), "info deep/frame_0001.exr --json");
        assert_eq!(info["margin"], serde_json::json!({ "x": 16, "y": 9 }));
        assert_eq!((&info["second_layer"], &info["camera_known"]), (&true.into(), &true.into()));
        common::ok(dir.path(), "classic gtao deep/frame_0001.exr -o ao.png");
    }

    #[test]
    fn one_layer_has_no_pass_of_a_second() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        let line = "view --headless --size 64x36 --method arcs:tuned --times --out flat";
        let output = aonet(dir.path(), line).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && !stderr.contains("second layer"), "{stderr}");
        assert!(
            stderr.contains("connected arcs, tuned") || stderr.contains("does not time passes"),
            "{stderr}"
        );
    }

    #[test]
    fn a_view_keeps_its_size_and_the_command_line_changes_it() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        let view = r#"{"eye": [1, 1, 3], "target": [0, 0, 0], "width": 40, "height": 24, "radius": 0.5}"#;
        std::fs::write(dir.path().join("view.json"), view).unwrap();
        for (size, expected) in [("", (40, 24)), ("--width 20", (20, 24)), ("--size 16x8", (16, 8))] {
            let line =
                format!("view procedural:hall:1 --view view.json {size} --headless --method off --out x");
            common::ok(dir.path(), &line);
            assert_eq!(picture(&dir.path().join("x/frame_0000.png")).dimensions(), expected, "{size}");
        }
    }

    #[test]
    fn the_help_names_every_method_and_picture() {
        let help = common::ok(Path::new("."), "view --help").replace('\n', " ");
        let names = aonet_view::Method::ALL.map(aonet_view::Method::name);
        let shows = aonet_view::Show::ALL.map(aonet_view::Show::name);
        for name in names.into_iter().chain(shows) {
            let ends = [",", ".", " "].map(|end| format!(" {name}{end}"));
            assert!(ends.iter().any(|word| help.contains(word)), "{name} in {help}");
        }
        for name in names.into_iter().filter(|name| name.contains(":")) {
            assert!(aonet::search::Classic::named(name).is_ok(), "{name}");
        }
    }

    /// A triangle in the plane z = 0 with an image that is not there.
    fn without_its_image() -> String {
        let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0f32];
        let bytes: String =
            corners.iter().flat_map(|c| c.to_le_bytes()).map(|b| format!("%{b:02x}")).collect();
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
            "buffers": [{{"byteLength": 60, "uri": "data:application/octet-stream,{bytes}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 60}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
                {{"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC2"}}],
            "images": [{{"uri": "wood.png"}}], "textures": [{{"source": 0}}],
            "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "material": 0}}]}}]}}"#
        )
    }

    #[test]
    fn an_image_that_is_missing_is_named_and_the_scene_is_drawn() {
        let dir = tempfile::tempdir().unwrap();
        if !is_there(dir.path()) {
            return;
        }
        std::fs::write(dir.path().join("bare.gltf"), without_its_image()).unwrap();
        let view =
            r#"{"eye": [0.3, 0.3, 3], "target": [0.3, 0.3, 0], "width": 8, "height": 8, "radius": 0.5}"#;
        std::fs::write(dir.path().join("view.json"), view).unwrap();
        let line = "view bare.gltf --view view.json --headless --size 8x8 --method off --out pictures";
        let output = aonet(dir.path(), line).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && stderr.contains("wood.png"), "{stderr}");
        picture(&dir.path().join("pictures/frame_0000.png"));
    }

    #[test]
    fn what_cannot_be_is_refused_before_anything_is_written() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("empty.json"), r#"{"keys": []}"#).unwrap();
        for (rest, named) in [
            ("--method magic", "magic"),
            ("--against magic", "magic"),
            ("--show magic", "magic"),
            ("--margin 1.5", "margin"),
            ("--margin NaN", "margin"),
            ("--layers 3", "1..=2"),
            ("--layers 1 --separation 0.1", "--layers 2"),
            ("--layers 2 --separation=-1", "separation"),
            ("--size 0x0", "1..=32768"),
            ("--size 12", "WxH"),
            ("--radius=-1", "radius"),
            ("--camera-path empty.json", "empty.json"),
            ("--camera-path absent.json", "absent.json"),
            ("absent.glb", "absent.glb"),
        ] {
            let line = format!("view --headless --out pictures --size 8x8 {rest}");
            let line = if rest.contains("--size") { line.replacen("--size 8x8 ", "", 1) } else { line };
            let said = refusal(&aonet(dir.path(), &line).output().unwrap());
            assert!(said.contains(named), "{rest}: {said}");
        }
        assert!(!dir.path().join("pictures").exists());
    }

    #[test]
    fn without_an_adapter_the_missing_thing_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let mut command = aonet(dir.path(), "view --headless --size 8x8 --out pictures");
        // The Vulkan loader finds no driver then. Other systems bring theirs along.
        command.env("VK_ICD_FILENAMES", "/nowhere.json").env("VK_DRIVER_FILES", "/nowhere.json");
        let output = command.output().unwrap();
        if cfg!(target_os = "linux") {
            let said = refusal(&output);
            assert!(said.contains("adapter"), "{said}");
            assert!(!dir.path().join("pictures").exists());
        }
    }

    #[test]
    fn frames_and_times_are_for_pictures_without_a_window() {
        let dir = tempfile::tempdir().unwrap();
        for option in ["--exr", "--times"] {
            let said = refusal(&aonet(dir.path(), &format!("view {option}")).output().unwrap());
            assert!(said.contains("--headless"), "{said}");
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn without_a_display_a_window_is_no_panic() {
        let dir = tempfile::tempdir().unwrap();
        let mut command = aonet(dir.path(), "view --size 8x8");
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        let said = refusal(&command.output().unwrap());
        assert!(said.contains("display"), "{said}");
    }
}

//! Frames with a guard band and a second layer, from scene to AO.

mod common;
use common::{aonet, json, ok, refusal};

const SCENE: &str = "procedural:clutter_pile:1";

fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let view = r#"{"eye":[0.5,3,5],"target":[0,0.5,0],"fov_y_deg":50,"width":48,"height":32,"radius":0.5}"#;
    std::fs::write(dir.path().join("view.json"), view).unwrap();
    dir
}

#[test]
fn a_deep_frame_becomes_ao_of_the_size_of_its_picture() {
    let desk = desk();
    let desk = desk.path();
    ok(desk, &format!("render {SCENE} --view view.json --margin 0.25 --layers 2 -o deep.exr"));
    let info = json(desk, "info deep.exr --json");
    assert_eq!(info["margin"], serde_json::json!({ "x": 12, "y": 8 }));
    assert_eq!((&info["second_layer"], &info["width"]), (&true.into(), &48.into()));
    assert!((info["view"]["separation"].as_f64().unwrap() - 0.1).abs() < 1e-6, "{info}");
    for command in ["infer deep.exr", "classic agtao deep.exr", "classic vbao deep.exr"] {
        let made = json(desk, &format!("{command} -o ao.exr --json"));
        assert_eq!((&made["width"], &made["height"]), (&48.into(), &32.into()), "{command}");
    }
    ok(desk, &format!("trace {SCENE} --view view.json --margin 0.25 --layers 2 --spp 8 -o truth.exr"));
    ok(desk, "compare truth.exr ao.exr");
}

#[test]
fn datasets_are_made_again_with_more_than_they_had() {
    let desk = desk();
    let desk = desk.path();
    let size = "--width 48 --height 32 --spp 4";
    ok(desk, &format!("dataset flat --procedural hall:1 --frames 2 {size}"));
    ok(desk, "dataset deep --from flat/manifest.json --margin 0.25 --layers 2 --separation 0.2");
    let info = json(desk, "info deep/manifest.json --json");
    assert_eq!((&info["margin"], &info["width"]), (&0.25.into(), &48.into()));
    assert!((info["separation"].as_f64().unwrap() - 0.2).abs() < 1e-6, "{info}");
    let count = |name: &str| std::fs::read_dir(desk.join(name).join("frames/hall_1")).unwrap().count();
    assert_eq!(count("flat"), count("deep"));
}

#[test]
fn impossible_layers_are_refused() {
    let desk = desk();
    let render = format!("render {SCENE} --view view.json -o frame.exr");
    for (options, word) in [
        ("--layers 3", "1..=2"),
        ("--layers 1 --separation 0.1", "--layers 2"),
        ("--separation=-1", "separation"),
        ("--layers 2 --separation NaN", "separation"),
        ("--margin 2", "margin"),
    ] {
        for command in [&render[..], "dataset made --procedural hall:1 --frames 1"] {
            let message = refusal(&aonet(desk.path(), &format!("{command} {options}")).output().unwrap());
            assert!(message.contains(word), "{options}: {message}");
        }
        assert!(!desk.path().join("frame.exr").exists() && !desk.path().join("made").exists());
    }
}

/// A second layer can come from another file: here from the same scene behind a near plane.
#[test]
fn a_second_file_is_read_by_every_command_that_reads_frames() {
    let desk = desk();
    let desk = desk.path();
    ok(desk, &format!("render {SCENE} --view view.json --margin 0.25 -o first.exr"));
    let view = std::fs::read_to_string(desk.join("view.json")).unwrap();
    std::fs::write(desk.join("cut.json"), view.replacen('{', r#"{"near":5.5,"#, 1)).unwrap();
    ok(desk, &format!("render {SCENE} --view cut.json --margin 0.25 -o behind.exr"));
    let info = json(desk, "info first.exr --second behind.exr --json");
    assert_eq!(info["second_layer"], true);
    let share = info["second_share"].as_f64().unwrap();
    assert!(share > 0.01 && share < info["foreground_share"].as_f64().unwrap(), "{info}");
    for command in ["infer first.exr", "classic agtao first.exr"] {
        ok(desk, &format!("{command} --second behind.exr -o ao.exr"));
    }
    ok(desk, &format!("render {SCENE} --view view.json -o narrow.exr"));
    std::fs::write(desk.join("broken.exr"), "no image").unwrap();
    for (line, words) in [
        ("infer behind.exr --second first.exr -o x.exr", ["first.exr", "second depth at"]),
        ("infer first.exr --second narrow.exr -o x.exr", ["narrow.exr", "48x32"]),
        ("classic ssao first.exr --second broken.exr -o x.exr", ["broken.exr", "EXR"]),
        ("info first.exr --second absent.exr", ["absent.exr", ""]),
        ("info view.json --second behind.exr", ["--second", "view.json"]),
    ] {
        let message = refusal(&aonet(desk, line).output().unwrap());
        assert!(words.iter().all(|word| message.contains(word)), "{line}: {message}");
        assert!(!desk.join("x.exr").exists());
    }
}

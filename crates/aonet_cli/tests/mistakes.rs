//! Mistakes that a newcomer makes: each gets a sentence that names it.

mod common;

use aonet::search::Classic;
use aonet::{AoImage, Camera, GBuffer, Size};
use aonet_lab::frame::Frame;
use common::{aonet, json, ok, refusal};
use std::path::Path;

const VIEW: &str = r#"{"eye":[0.3,0.2,3.0],"target":[0,0,0],"width":48,"height":32,"radius":0.5}"#;

/// A folder with a view and a frame of it.
fn desk() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "view.json", VIEW);
    ok(dir.path(), "render procedural:clutter_pile:5 --view view.json --ground -o frame.exr");
    dir
}

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

fn refused(folder: &Path, line: &str) -> String {
    refusal(&aonet(folder, line).output().unwrap())
}

fn holds(message: &str, words: &[&str]) {
    assert!(words.iter().all(|word| message.contains(word)), "expected {words:?} in {message}");
}

#[test]
fn a_view_with_a_misspelt_field_is_refused() {
    let desk = desk();
    write(desk.path(), "typo.json", &VIEW.replace("\"eye\"", "\"fov_y\":90,\"eye\""));
    let message = refused(desk.path(), "render procedural:clutter_pile:5 --view typo.json -o x.exr");
    holds(&message, &["typo.json", "`fov_y`", "fov_y_deg"]);
    write(desk.path(), "noted.json", &VIEW.replace("\"eye\"", "\"name\":\"a view\",\"eye\""));
    ok(desk.path(), "render procedural:clutter_pile:5 --view noted.json -o x.exr");
}

/// A folder with a frame of a wall at a depth of 3: its radius is exactly the wanted share of the image's height.
fn wall() -> tempfile::TempDir {
    let desk = desk();
    let size = Size::px(48, 32);
    let camera = Camera::perspective(60f32.to_radians(), size).unwrap();
    let (depth, normal) = (vec![3.0; size.pixels()], vec![[0.0, 0.0, 1.0]; size.pixels()]);
    let gbuffer = GBuffer::new(camera, depth, normal).unwrap();
    let ao = Some(AoImage::open(size));
    let frame = Frame { gbuffer, geo_normal: None, ao, radius: None, view: None };
    frame.save(&desk.path().join("wall.exr")).unwrap();
    desk
}

/// The radius that has this share of the wall's height.
fn of_height(share: f32) -> f32 {
    share * 2.0 * 3.0 * 30f32.to_radians().tan()
}

fn notes(folder: &Path, line: &str) -> String {
    let output = aonet(folder, line).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_radius_outside_of_the_trained_range_is_warned_of() {
    let desk = wall();
    let warning = |share: f32| {
        let stderr = notes(desk.path(), &format!("infer wall.exr -o ao.png --radius {}", of_height(share)));
        stderr.lines().find(|line| line.starts_with("warning")).map(str::to_owned)
    };
    for (share, shown) in [(0.016, " 1.60 %"), (0.0198, " 1.98 %"), (0.404, " 40.4 %"), (1e30, "e32 %")] {
        let line = warning(share).unwrap_or_else(|| panic!("no warning at {share}"));
        holds(&line, &["balanced", "2 to 40 %"]);
        assert!(share > 1e3 || line.contains(shown), "{line}");
        assert!(line.len() < 150, "{line}");
    }
    for share in [0.02, 0.1, 0.4] {
        assert_eq!(warning(share), None, "{share}");
    }
    let info = json(desk.path(), "info balanced --json");
    let range = info["radius_in_image_heights"].as_array().unwrap();
    assert_eq!(range.iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>(), [0.02, 0.4]);
}

#[test]
fn every_command_with_a_network_and_a_radius_warns() {
    let desk = wall();
    for line in [
        "gallery wall.exr -o g.png --method gtao --radius 1e4",
        "flicker --size 40x24 --frames 2 --spp 1 --radius 1e4",
        "demo --size 40x24 --spp 1 -o demo --radius 1e4",
    ] {
        holds(&notes(desk.path(), line), &["warning", "balanced", "2 to 40 %"]);
    }
    assert!(!notes(desk.path(), "flicker --size 40x24 --frames 2 --spp 1").contains("warning"));
}

#[test]
fn a_network_that_does_not_see_the_radius_says_so() {
    let desk = wall();
    let ignored = notes(desk.path(), "infer wall.exr -o ao.png --model paper --radius 0.5");
    holds(&ignored, &["note", "paper", "--radius 0.5"]);
    assert!(!notes(desk.path(), "infer wall.exr -o ao.png --model paper").contains("note"));
}

#[test]
fn numbers_out_of_range_are_answered_in_the_units_they_were_given_in() {
    let desk = desk();
    for line in [
        "infer frame.exr -o ao.png",
        "trace procedural:clutter_pile:5 --view view.json -o x.exr",
        "render procedural:clutter_pile:5 --view view.json -o x.exr",
        "flicker --size 40x24",
        "demo --size 40x24",
    ] {
        holds(&refused(desk.path(), &format!("{line} --radius -1")), &["--radius", "-1"]);
    }
    holds(&refused(desk.path(), "infer frame.exr -o ao.png --fov-y 180"), &["degrees", "180"]);
    holds(&refused(desk.path(), "infer frame.exr -o ao.png --fov-y -5"), &["degrees", "-5"]);
}

#[test]
fn files_that_are_no_openexr_files_are_said_to_be_none() {
    let desk = desk();
    write(desk.path(), "empty.exr", "");
    holds(
        &refused(desk.path(), "infer empty.exr -o ao.png"),
        &["empty.exr", "OpenEXR file", "an empty file"],
    );
    write(desk.path(), "text.exr", VIEW);
    holds(&refused(desk.path(), "infer text.exr -o ao.png"), &["text.exr", "begins"]);
    // Its sixth byte has the bit that says "deep data" in a file of the format.
    write(desk.path(), "words.exr", "hello\n");
    holds(&refused(desk.path(), "infer words.exr -o ao.png"), &["words.exr", "begins"]);
}

#[test]
fn outputs_keep_the_extension_of_their_format() {
    let desk = desk();
    let render = "render procedural:clutter_pile:5 --view view.json";
    for (line, extension) in [
        (format!("{render} -o frame.png"), ".exr"),
        (format!("{render} -o a.exr --png a.jpg"), ".png"),
        ("trace procedural:clutter_pile:5 --view view.json --spp 1 -o ao.png".to_owned(), ".exr"),
        ("gallery frame.exr -o gallery".to_owned(), ".png"),
        ("compare frame.exr frame.exr --picture a.exr".to_owned(), ".png"),
    ] {
        holds(&refused(desk.path(), &line), &["expected a name that ends in", extension]);
    }
    assert!(!desk.path().join("frame.png").exists());
}

#[test]
fn the_list_of_parameters_fits_a_terminal() {
    let desk = desk();
    let help = ok(desk.path(), "classic --help");
    let list = help.split_once("Parameters:").unwrap().1;
    for method in ["gtao", "agtao", "arcs", "vbao", "hbao", "ssao", "ssdo", "nnao"] {
        assert!(list.lines().any(|line| line.starts_with(&format!("{method} "))), "{method} in {list}");
    }
}

#[test]
fn help_is_at_most_100_letters_wide() {
    let desk = desk();
    let commands = ok(desk.path(), "--help");
    let commands = commands.split_once("Commands:").unwrap().1.split("\n\n").next().unwrap();
    let names: Vec<_> = commands
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(names.len() > 15 && names.contains(&"classic"), "{names:?}");
    for name in names {
        let help = ok(desk.path(), &format!("{name} --help"));
        // An example stays on one line, so that it can be copied.
        let lines = help.lines().filter(|line| !line.trim_start().starts_with("aonet "));
        let widest = lines.max_by_key(|line| line.chars().count()).unwrap();
        assert!(widest.chars().count() <= 100, "{name}: {widest}");
    }
}

#[test]
fn the_help_of_dataset_names_no_view() {
    let desk = desk();
    let help = ok(desk.path(), "dataset --help");
    assert!(!help.contains("view"), "{help}");
    holds(&help, &["[default: the preset's]"]);
}

#[test]
fn names_of_outputs_are_checked_before_the_work() {
    let desk = desk();
    for (line, words) in [
        ("infer absent.exr -o ao.jpg", ["ao.jpg", ".exr or .png"]),
        ("classic gtao absent.exr -o ao", ["'ao'", ".exr or .png"]),
        ("classic arcs absent.exr -o ao.png --shares shares.jpg", ["shares.jpg", ".exr or .png"]),
        ("tune gtao --on absent -o gtao.txt", ["gtao.txt", ".json"]),
        ("tune nnao --on absent -o nnao.json", ["nnao.json", ".safetensors"]),
    ] {
        holds(&refused(desk.path(), line), &words);
    }
    // The name is right, so the dataset is looked for.
    holds(&refused(desk.path(), "tune nnao --on absent -o nnao.safetensors"), &["absent"]);
}

#[test]
fn every_command_that_makes_pictures_takes_their_size_in_both_ways() {
    let desk = desk();
    let scene = "procedural:clutter_pile:5 --view view.json";
    let size_of = |line: &str| {
        let made = json(desk.path(), line);
        [&made["width"], &made["height"]].map(|side| side.as_u64().unwrap())
    };
    assert_eq!(size_of(&format!("render {scene} -o x.exr --json --size 40x24")), [40, 24]);
    assert_eq!(size_of(&format!("render {scene} -o x.exr --json --width 40")), [40, 32]);
    assert_eq!(size_of(&format!("trace {scene} --spp 1 -o x.exr --json --size 40x24")), [40, 24]);
    ok(desk.path(), "demo --size 40x24 --spp 1 -o demo");
    assert_eq!(size_of("info demo/frame.exr --json"), [40, 24]);
    ok(desk.path(), "dataset data --procedural hall:1 --frames 1 --spp 1 --size 40x24");
    assert_eq!(size_of("info data --json"), [40, 24]);
    ok(desk.path(), "flicker --size 40x24 --frames 2 --spp 1");
    let both = refused(desk.path(), &format!("render {scene} -o x.exr --size 40x24 --width 40"));
    holds(&both, &["--size", "--width"]);
    holds(&refused(desk.path(), "demo --size 40"), &["--size", "WxH"]);
}

#[test]
fn mixtures_do_not_replace_a_list_of_other_scenes() {
    let desk = desk();
    let list = "name,environment,split\nrobot,no,train\n";
    std::fs::write(desk.path().join("scenes.csv"), list).unwrap();
    holds(&refused(desk.path(), "dataset mix . --scenes-dir ."), &["scenes.csv", "list of other scenes"]);
    assert_eq!(std::fs::read_to_string(desk.path().join("scenes.csv")).unwrap(), list);
    holds(&refused(desk.path(), "dataset mix mixed --scenes-dir ."), &["robot.glb"]);
    assert!(!desk.path().join("mixed").exists());
}

#[test]
fn all_means_the_same_methods_in_every_command() {
    let desk = desk();
    ok(desk.path(), "trace procedural:clutter_pile:5 --view view.json --ground --spp 4 -o traced.exr");
    ok(desk.path(), "dataset data --procedural hall:1 --split test --frames 1 --spp 1 --size 40x24");
    // Where a command's JSON has its rows. Some are networks or constants.
    let commands = [
        ("gallery traced.exr -o g.png --json --method", "/methods"),
        ("eval data --json --classic", "/overall"),
        ("bench --size 64x64 --threads 1 --runs 1 --json --classic", "/timings"),
        ("flicker --size 40x24 --frames 2 --spp 1 --json --classic", ""),
    ];
    let names = |all: &str, (line, rows): (&str, &str)| -> Vec<String> {
        let found = json(desk.path(), &format!("{line} {all}"));
        let rows = found.pointer(rows).unwrap().as_array().unwrap().iter();
        let names = rows.map(|row| row["method"].as_str().unwrap().to_owned());
        let classic = |name: &String| Classic::named(name).is_ok();
        names.filter(classic).collect()
    };
    let plain: Vec<_> = Classic::all().iter().map(|method| method.name().to_owned()).collect();
    for command in commands {
        assert_eq!(names("all", command), plain, "{command:?}");
    }
    let tuned = names("all:tuned", commands[0]);
    assert!(tuned.contains(&"agtao:tuned".to_owned()) && !tuned.contains(&"agtao".to_owned()), "{tuned:?}");
    assert_eq!(tuned.len(), plain.len());
    for command in commands {
        assert_eq!(names("all:tuned", command), tuned, "{command:?}");
    }
}

//! The program as a user meets it: files in, files out, exit codes, messages.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of inputs, and the program run in it.
struct Desk {
    dir: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        let desk = Self { dir: tempfile::tempdir().unwrap() };
        desk.write("view.json", &view(48, 32, "0.5"));
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn run(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_aonet"))
            .args(line.split_whitespace())
            .current_dir(self.dir.path())
            .output()
            .unwrap()
    }

    /// Runs a command that must succeed; returns stdout.
    fn ok(&self, line: &str) -> String {
        let output = self.run(line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "aonet {line}\n{stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs a command that must fail with a message; returns stderr.
    fn fails(&self, line: &str) -> String {
        let output = self.run(line);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "aonet {line}\n{stderr}");
        assert!(!stderr.contains("panicked"), "aonet {line}\n{stderr}");
        stderr
    }

    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.ok(line)).unwrap()
    }
}

fn view(width: usize, height: usize, radius: &str) -> String {
    format!(
        r#"{{"eye":[0.5,3.0,5.0],"target":[0.0,0.5,0.0],"fov_y_deg":50,"width":{width},"height":{height},"radius":{radius}}}"#
    )
}

const SCENE: &str = "procedural:clutter_pile:1";

#[test]
fn a_scene_becomes_a_frame_becomes_ao_that_can_be_compared() {
    let desk = Desk::new();
    let traced =
        desk.json(&format!("trace {SCENE} --view view.json --spp 16 -o frame.exr --png ao.png --json"));
    assert_eq!(traced["spp"], 16);
    assert!(traced["mean_visibility"].as_f64().is_some_and(|m| m > 0.1 && m < 1.0));
    let inferred = desk.json("infer frame.exr -o net.exr --json");
    assert_eq!((inferred["width"].as_u64(), inferred["radius"].as_f64()), (Some(48), Some(0.5)));
    desk.ok("infer frame.exr -o net.png");
    let scores = desk.json("compare frame.exr net.exr net.png --picture sheet.png --json");
    let ssim = |i: usize| scores["images"][i]["full"]["ssim"].as_f64().unwrap();
    assert!((ssim(0) - ssim(1)).abs() < 1e-3 && ssim(0) < 1.0, "{scores}");
    for name in ["ao.png", "sheet.png"] {
        let picture = image::open(desk.path(name)).unwrap();
        assert!(picture.width() >= 48, "{name}");
    }
}

#[test]
fn render_leaves_out_ao_and_infer_does_not_need_it() {
    let desk = Desk::new();
    desk.ok(&format!("render {SCENE} --view view.json -o frame.exr --png normal.png"));
    assert_eq!(desk.json("info frame.exr --json")["mean_visibility"], Value::Null);
    desk.ok("infer frame.exr -o ao.exr --threads 1");
    assert!(desk.fails("compare normal.png").contains("IMAGES"));
}

#[test]
fn a_requested_check_that_fails_is_exit_code_1() {
    let desk = Desk::new();
    desk.ok(&format!("trace {SCENE} --view view.json --spp 4 -o frame.exr"));
    desk.ok("infer frame.exr -o net.exr");
    assert_eq!(desk.run("compare net.exr net.exr --min-ssim 0.999").status.code(), Some(0));
    assert_eq!(desk.run("compare frame.exr net.exr --min-ssim 0.9999").status.code(), Some(1));
    assert_eq!(desk.run("compare frame.exr net.exr --min-psnr 90").status.code(), Some(1));
}

#[test]
fn odd_sizes_work() {
    let desk = Desk::new();
    for (width, height) in [(1, 1), (7, 3), (4001, 17)] {
        desk.write("odd.json", &view(width, height, "0.5"));
        desk.ok(&format!("render {SCENE} --view odd.json -o odd.exr"));
        let inferred = desk.json("infer odd.exr -o odd_ao.exr --json");
        assert_eq!(
            (inferred["width"].as_u64(), inferred["height"].as_u64()),
            (Some(width as u64), Some(height as u64))
        );
    }
}

#[test]
fn bad_radii_and_sizes_are_refused() {
    let desk = Desk::new();
    desk.ok(&format!("render {SCENE} --view view.json -o frame.exr"));
    for radius in ["0", "-1", "inf", "nan"] {
        assert!(
            desk.fails(&format!("infer frame.exr -o ao.exr --radius={radius}")).contains("radius"),
            "{radius}"
        );
    }
    for (width, height, radius) in
        [(0, 4, "1"), (4, 0, "1"), (4, 4, "0"), (1_000_000, 4, "1"), (4, 4, "1e999")]
    {
        desk.write("bad.json", &view(width, height, radius));
        assert!(desk.fails(&format!("render {SCENE} --view bad.json -o bad.exr")).contains("bad.json"));
    }
    assert!(!desk.path("ao.exr").exists() && !desk.path("bad.exr").exists());
}

#[test]
fn broken_files_are_named_and_leave_nothing_behind() {
    let desk = Desk::new();
    desk.ok(&format!("render {SCENE} --view view.json -o frame.exr"));
    let whole = std::fs::read(desk.path("frame.exr")).unwrap();
    std::fs::write(desk.path("cut.exr"), &whole[..whole.len() / 2]).unwrap();
    desk.write("text.exr", "not an image");
    desk.write("text.safetensors", "not a model");
    desk.write("text.glb", "not a scene");
    desk.write("text.json", "not a view");
    let before = listing(desk.dir.path());
    for (line, name) in [
        ("infer cut.exr -o ao.exr", "cut.exr"),
        ("infer text.exr -o ao.exr", "text.exr"),
        ("infer missing.exr -o ao.exr", "missing.exr"),
        ("infer frame.exr -o ao.jpg", "ao.jpg"),
        ("infer frame.exr -o no/such/folder/ao.exr", "ao.exr"),
        ("infer frame.exr -o ao.exr --model text.safetensors", "text.safetensors"),
        ("render text.glb --view view.json -o x.exr", "text.glb"),
        ("render procedural:clutter_pile:1 --view text.json -o x.exr", "text.json"),
        ("render procedural:unicorn:1 --view view.json -o x.exr", "unicorn"),
        ("compare frame.exr text.exr", "frame.exr"),
        ("info text.json", "text.json"),
        ("eval no_such_dataset", "no_such_dataset"),
        ("demo --scene text.glb", "text.glb"),
    ] {
        let stderr = desk.fails(line);
        assert!(stderr.contains(name), "aonet {line}\n{stderr}");
    }
    assert_eq!(listing(desk.dir.path()), before);
}

fn listing(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error() {
    let desk = Desk::new();
    desk.ok(&format!("render {SCENE} --view view.json -o frame.exr"));
    std::os::unix::fs::symlink("/dev/full", desk.path("full")).unwrap();
    let output = Command::new("sh")
        .args(["-c", &format!("{} infer frame.exr -o ao.exr --json > full", env!("CARGO_BIN_EXE_aonet"))])
        .current_dir(desk.dir.path())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn the_demo_writes_its_pictures() {
    let desk = Desk::new();
    let demo = desk.json("demo --width 96 --height 64 --spp 8 -o out --json");
    assert!(demo["network"]["full"]["psnr"].as_f64().is_some_and(f64::is_finite));
    for name in [
        "normal.png",
        "depth.png",
        "ao_reference.png",
        "ao_network.png",
        "error.png",
        "side_by_side.png",
        "frame.exr",
    ] {
        assert!(desk.path("out").join(name).exists(), "{name}");
    }
}

#[test]
fn a_dataset_is_made_described_and_evaluated() {
    let desk = Desk::new();
    desk.ok(
        "dataset frames --procedural clutter_pile:1 --split test --frames 2 --width 64 --height 48 --spp 8",
    );
    assert_eq!(desk.json("info frames --json")["frames"]["test"], 2);
    let table = desk.json("eval frames --constant 0.8 --by-scene --json");
    assert_eq!(table["overall"][0]["method"], "constant 0.800");
    assert_eq!(table["overall"][1]["scores"]["frames"], 2);
    assert!(desk.ok("eval frames --markdown -o table.md").starts_with("| method"));
    assert!(desk.path("table.md").exists());
    #[cfg(not(feature = "gpu"))]
    assert!(desk.fails("eval frames --plot-gpu p.svg").contains("--features gpu"));
}

#[test]
fn classic_methods_run_are_tuned_and_drawn() {
    let desk = Desk::new();
    desk.ok("dataset frames --procedural clutter_pile:1 --frames 2 --width 64 --height 48 --spp 8");
    let first = |dir: PathBuf| std::fs::read_dir(dir).unwrap().next().unwrap().unwrap().path();
    std::fs::copy(first(first(desk.path("frames/frames"))), desk.path("frame.exr")).unwrap();
    let tuned = desk.json("tune gtao --on frames --frames 1 --trials 4 -o gtao.json --json");
    assert!(tuned["loss"].as_f64() <= tuned["loss_before"].as_f64(), "{tuned}");
    let facts = desk.json("classic gtao frame.exr -o ao.exr --preset gtao.json --set steps=2 --json");
    assert_eq!((&facts["method"], &facts["width"]), (&json!("gtao"), &json!(64)));
    assert_eq!(desk.json("classic gtao.json frame.exr -o ao.exr --json")["method"], "gtao");
    assert!(desk.ok("classic --help").contains("thickness"));
    let gallery = desk.json("gallery frame.exr -o all.png --columns 3 --json");
    assert_eq!(gallery["methods"].as_array().unwrap().len(), 10);
    assert!(desk.path("all.png").exists() && desk.path("ao.exr").exists());
    desk.ok("classic arcs frame.exr -o ao.exr --shares shares.exr");
    desk.ok("classic arcs:deep frame.exr -o ao.exr --shares shares.png");
    let bytes = std::fs::read(desk.path("shares.exr")).unwrap();
    for channel in ["open", "hit", "hidden.close", "hidden.middle", "hidden.deep", "off"] {
        let name = format!("{channel}\0");
        assert!(bytes.windows(name.len()).any(|found| found == name.as_bytes()), "{channel}");
    }
    assert!(desk.path("shares.png").exists());
    for (line, word) in [
        ("classic gtao frame.exr -o x.exr --shares x.png", "arcs"),
        ("classic arcs frame.exr -o x.exr --shares x.jpg", ".png"),
        ("classic arcs frame.exr -o x.exr --shares x.png --device gpu", "--device cpu"),
        ("classic gtoa frame.exr -o x.exr", "gtao"),
        ("classic gtao frame.exr -o x.exr --set slices=0", "slices"),
        ("classic gtao frame.exr -o x.exr --set thickness=1", "thickness"),
        ("classic vbao frame.exr -o x.exr --preset gtao.json", "parameters of vbao"),
        ("classic gtao frame.exr -o x.exr --radius nan", "radius"),
        ("classic gtao", "<FRAME>"),
    ] {
        assert!(desk.fails(line).contains(word), "{line}");
    }
}

#[test]
fn bent_normals_are_channels_or_a_file_of_their_own() {
    let desk = Desk::new();
    let channel = |file: &str| {
        let bytes = std::fs::read(desk.path(file)).unwrap();
        bytes.windows(14).any(|found| found == b"bent_normal.X\0")
    };
    desk.ok("trace procedural:clutter_pile:1 --view view.json --spp 8 -o frame.exr --bent-normals");
    desk.ok("trace procedural:clutter_pile:1 --view view.json --spp 8 -o plain.exr");
    assert!(channel("frame.exr") && !channel("plain.exr"));
    desk.ok("classic gtao frame.exr -o gtao.exr --bent-normals");
    desk.ok("classic arcs frame.exr -o arcs.exr --bent-normals");
    let facts = desk.json("infer frame.exr -o balanced.exr --bent-normals=bent.exr --json");
    assert_eq!(facts["bent_normals"], json!("bent.exr"));
    assert!(channel("gtao.exr") && channel("arcs.exr") && channel("bent.exr") && !channel("balanced.exr"));
    desk.ok("infer frame.exr --model high -o high.png --bent-normals=bent.png");
    assert!(desk.path("bent.png").exists() && desk.path("high.png").exists());
    let times =
        desk.json("bench --classic agtao:tuned --bent-normals --size 48x32 --threads 1 --runs 1 --json");
    assert!(times["bent_normals"][0]["times"]["ratio"].as_f64().unwrap() > 0.0, "{times}");
    desk.ok("dataset views --procedural clutter_pile:1 --frames 1 --width 48 --height 32 --spp 4");
    let rows = desk.json("bent views --spp 16 --model fast --json");
    assert_eq!(rows["rows"].as_array().unwrap().len(), 6);
    for (line, word) in [
        ("classic vbao frame.exr -o x.exr --bent-normals", "gtao, agtao or arcs"),
        ("classic gtao frame.exr -o x.png --bent-normals", "--bent-normals=FILE"),
        ("classic gtao frame.exr -o x.exr --bent-normals=x.jpg", ".png"),
        ("infer frame.exr --model paper -o x.exr --bent-normals", "without a search"),
        (
            "trace procedural:clutter_pile:1 --view view.json -o x.exr --bent-normals --device gpu",
            "--device cpu",
        ),
        ("bent views --spp 16 --model paper", "without a search"),
    ] {
        assert!(desk.fails(line).contains(word), "{line}");
    }
    assert!(!desk.path("x.exr").exists());
}

#[test]
fn flicker_tells_networks_and_classic_methods_apart() {
    let desk = Desk::new();
    let rows = desk.json(
        "flicker --width 96 --height 64 --frames 2 --spp 64 --classic ssao --classic agtao:tuned --json",
    );
    let names: Vec<_> = rows.as_array().unwrap().iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["balanced", "ssao", "agtao:tuned", "reference, other rays"]);
    let excess: Vec<_> = rows.as_array().unwrap().iter().map(|row| row["excess"].as_f64().unwrap()).collect();
    assert!(excess.iter().all(|e| *e > 0.0 && *e < 0.5) && excess[1] != excess[2], "{rows}");
    assert!(desk.fails("flicker --frames 1").contains("at least 2 frames"));
}

#[test]
fn the_papers_tables_say_what_is_not_trained() {
    let desk = Desk::new();
    let table = desk.ok("paper table2 -o out");
    assert!(table.contains("not trained") && desk.path("out/table2.md").exists(), "{table}");
    desk.ok(
        "dataset frames --procedural clutter_pile:1 --split test --frames 1 --width 48 --height 32 --spp 8",
    );
    std::fs::create_dir(desk.path("rows")).unwrap();
    std::fs::write(desk.path("rows/ours.safetensors"), aonet::net::shipped::BALANCED).unwrap();
    let json = desk.json("paper table1 --test frames --weights rows -o out --runs 1 --threads 1 --json");
    let rows = json["table1"]["rows"].as_array().unwrap();
    let row = |key: &str| rows.iter().find(|r| r["row"] == key).unwrap();
    assert_eq!(row("deep_ao")["trained"], Value::Bool(false));
    for key in ["ours", "gtao"] {
        assert_eq!(row(key)["trained"], Value::Bool(true));
        assert!(row(key)["ssim"]["mean"].as_f64().is_some_and(|ssim| ssim > 0.2), "{json}");
    }
    desk.write("rows/base.safetensors", "not a model");
    for (line, name) in [
        ("paper table1", "table1"),
        ("paper table1 --test no_such_dataset", "no_such_dataset"),
        ("paper table2 --weights no_such_folder", "no_such_folder"),
        ("paper table2 --weights rows", "base.safetensors"),
        ("paper table9", "table9"),
    ] {
        let stderr = desk.fails(line);
        assert!(stderr.contains(name), "aonet {line}\n{stderr}");
    }
}

#[test]
fn frames_of_another_program_are_imported_and_evaluated() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("theirs")).unwrap();
    std::fs::write(desk.path("model.safetensors"), aonet::net::shipped::PAPER).unwrap();
    for (name, width) in [("a", 64), ("b", 48)] {
        desk.write("theirs.json", &view(width, 40, "0.5"));
        desk.ok(&format!("trace {SCENE} --view theirs.json --spp 8 -o theirs/{name}.exr"));
    }
    let import = "dataset import ours --normal theirs --depth theirs --ao theirs --fov-y";
    for (rest, word) in [
        ("0 --radius 1", "field of view"),
        ("-50 --radius 1", "field of view"),
        ("50 --radius 0", "radius"),
        ("50 --radius 1", "exr: normals"),
    ] {
        assert!(desk.fails(&format!("{import} {rest}")).contains(word), "{rest}");
    }
    assert!(!desk.path("ours").exists());
    let facts = desk.json(&format!("{import} 50 --radius 0.5 --normals plain --json"));
    assert_eq!((facts["imported"].as_u64(), facts["kept"].as_u64()), (Some(2), Some(0)));
    assert_eq!(desk.json(&format!("{import} 50 --radius 0.5 --normals plain --json"))["kept"], 2);
    assert!(desk.fails(&format!("{import} 51 --radius 0.5 --normals plain")).contains("fov_y_deg"));
    assert_eq!(desk.json("info ours --json")["frames"]["test"], 2);
    let table = desk.json("eval ours --constant 0.8 --json");
    assert_eq!(table["conditions"]["reference_spp"], Value::Null);
    // The same frames one by one.
    let ssim = ["a", "b"].map(|name| {
        desk.ok(&format!("infer theirs/{name}.exr -o net.exr"));
        let scores = desk.json(&format!("compare theirs/{name}.exr net.exr --json"));
        scores["images"][0]["full"]["ssim"].as_f64().unwrap()
    });
    let found = table["overall"][1]["scores"]["ssim"].as_f64().unwrap();
    assert!((found - 0.5 * (ssim[0] + ssim[1])).abs() < 1e-3, "{found} {ssim:?}");
    assert!(desk.fails("eval ours --constant 0.8 --model model.safetensors").contains("Given(0.5)"));
    let text = desk.ok("eval ours --constant 0.8 --model model.safetensors --any-radius");
    assert!(text.contains("model *") && text.contains("reference imported"), "{text}");
    assert!(desk.fails("dataset again --from ours/manifest.json").contains("imported frames"));
}

#[test]
fn programs_are_exported_as_data() {
    use aonet::gpu::{Precision, Template};
    let desk = Desk::new();
    let read = |folder: &str| {
        let file = |name: &str| std::fs::read(desk.path(folder).join(name)).unwrap();
        (serde_json::from_slice::<Value>(&file("program.json")).unwrap(), file("program.bin"))
    };
    for (name, flags, precision) in [
        ("fast", "--depth standard", "f16"),
        ("paper", "--precision f32 --normals unorm --normal-space world", "f32"),
        ("agtao:tuned", "--depth linear", "f32"),
        ("arcs:deep", "--layers 2", "f32"),
    ] {
        let facts = desk.json(&format!("export {name} --program new/out --json {flags}"));
        let (document, blob) = read("new/out");
        assert_eq!(facts["program"]["precision"], precision, "{name}");
        assert_eq!(facts["program"]["textures"], document["textures"]);
        assert_eq!(document["blob"]["bytes"], blob.len());
        assert_eq!(document["blob"]["sha256"], facts["program"]["sha256"]);
        let template = Template::from_bytes(&serde_json::to_vec(&document).unwrap(), &blob).unwrap();
        assert_eq!(template.precision() == Precision::F16, precision == "f16");
        template.at(aonet::Size::px(75, 41)).unwrap();
    }
    let (document, _) = read("new/out");
    assert_eq!(document["textures"]["layers"], "two");
    assert_eq!(document["textures"]["depth"], "reversed");
    // The program of one size is what the template says.
    desk.ok("export paper --program any --precision f32");
    desk.ok("export paper --program one --precision f32 --size 75x41");
    let ((any, any_blob), (one, one_blob)) = (read("any"), read("one"));
    let any = Template::from_bytes(&serde_json::to_vec(&any).unwrap(), &any_blob).unwrap();
    let expected = any.at(aonet::Size::px(75, 41)).unwrap().to_bytes().unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&expected.json).unwrap(), one);
    assert_eq!(expected.blob, one_blob);
    // One command writes both.
    let facts = desk.json("export paper --onnx both.onnx --program both --json");
    assert!(facts["path"] == "both.onnx" && facts["program"]["paths"].as_array().unwrap().len() == 2);
    assert_eq!(desk.ok("export paper --program both").lines().count(), 2);
    desk.write("file", "");
    for (line, word) in [
        ("export nnao --program x", "ssao, hbao"),
        ("export nothing --program x", "nothing"),
        ("export paper --program file", "--program file"),
        ("export paper --program x --depth inverse", "reversed"),
        ("export paper --program x --normals rgb", "octahedral"),
        ("export paper --program x --layers 3", "1..=2"),
        ("export paper --program x --precision bf16", "f32"),
    ] {
        let stderr = desk.fails(line);
        assert!(stderr.contains(word), "aonet {line}\n{stderr}");
        assert!(!desk.path("x").exists(), "aonet {line}");
    }
}

#[test]
fn networks_are_exported_to_onnx() {
    let desk = Desk::new();
    std::fs::write(desk.path("paper.safetensors"), aonet::net::shipped::PAPER).unwrap();
    let facts = desk.json("export paper.safetensors --onnx free.onnx --json");
    let bytes = std::fs::metadata(desk.path("free.onnx")).unwrap().len();
    assert_eq!((&facts["path"], &facts["bytes"]), (&json!("free.onnx"), &json!(bytes)));
    let features = json!({ "name": "features", "shape": [1, 3, "height", "width"] });
    assert_eq!(facts["inputs"], json!([features]));
    let facts = desk.json("export paper.safetensors --onnx fixed.onnx --size 75x41 --tuned --json");
    assert_eq!(facts["outputs"], json!([{ "name": "visibility", "shape": [1, 1, 41, 75] }]));
    assert_ne!(bytes, std::fs::metadata(desk.path("fixed.onnx")).unwrap().len());
    assert_eq!(desk.ok("export paper.safetensors --onnx free.onnx"), "free.onnx\n");
    desk.write("text.safetensors", "not a model");
    let before = listing(desk.dir.path());
    for (line, word) in [
        ("export text.safetensors --onnx x.onnx", "text.safetensors"),
        ("export missing.safetensors --onnx x.onnx", "missing.safetensors"),
        ("export paper.safetensors --onnx paper.safetensors", ".onnx"),
        ("export paper.safetensors --onnx no/such/x.onnx", "x.onnx"),
        ("export paper.safetensors --onnx x.onnx --size 75", "WxH"),
        ("export paper.safetensors --onnx x.onnx --size 0x41", "0x41"),
        ("export paper.safetensors", "--onnx"),
        ("export paper.safetensors", "--program"),
        ("export gtao --onnx x.onnx", "gtao"),
        ("export paper.safetensors --onnx x.onnx --layers 2", "--program"),
        ("export paper.safetensors --onnx x.onnx --depth linear", "--program"),
    ] {
        let stderr = desk.fails(line);
        assert!(stderr.contains(word), "aonet {line}\n{stderr}");
    }
    assert_eq!(listing(desk.dir.path()), before);
    aonet::net::Model::from_bytes(&std::fs::read(desk.path("paper.safetensors")).unwrap()).unwrap();
}

#[test]
fn help_and_completions_are_complete() {
    let desk = Desk::new();
    let help = desk.ok("--help");
    for command in
        ["demo", "render", "trace", "infer", "compare", "dataset", "train", "eval", "paper", "info", "export"]
    {
        assert!(help.contains(command), "{command}");
        assert!(desk.ok(&format!("{command} --help")).contains("Usage"), "{command}");
    }
    for shell in ["bash", "zsh", "fish"] {
        assert!(desk.ok(&format!("completions {shell}")).contains("aonet"));
    }
}

#[cfg(not(feature = "gpu"))]
#[test]
fn a_program_without_the_gpu_runtime_says_how_to_get_it() {
    let desk = Desk::new();
    desk.ok(&format!("render {SCENE} --view view.json -o frame.exr"));
    for line in ["infer frame.exr -o ao.exr", "classic gtao frame.exr -o ao.exr", "bench"] {
        let said = desk.fails(&format!("{line} --device gpu"));
        assert!(said.contains("--features gpu") && said.contains("--device cpu"), "{line}: {said}");
    }
    assert!(desk.fails("infer frame.exr -o ao.exr --precision f16").contains("--device gpu"));
}

//! Imports of generated frames, and of invalid files.

use super::super::fixtures::stack;
use super::super::{Split, Work};
use super::*;
use crate::exr_file::{Plane, encode_images};
use crate::frame::{Frame, FrameHints};
use aonet::{AoImage, Size};
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::trace::Tracer;
use aonet_scene::{View, gbuffer};
use exr::image::FlatSamples;
use half::f16;
use std::sync::LazyLock;

const SIZE: Size = Size::px(48, 32);

/// A frame with background, in a camera's own space.
static FRAME: LazyLock<Frame> = LazyLock::new(|| {
    let json =
        r#"{"eye":[0.8,1.4,3],"target":[0.4,0.7,0],"fov_y_deg":30,"width":48,"height":32,"radius":0.5}"#;
    let view: View = serde_json::from_str(json).unwrap();
    let tracer = Tracer::new(stack());
    let surface = gbuffer::render(&tracer, &view).unwrap();
    let sampling = Sampling { spp: 16, seed: 1 };
    let ao = reference_ao(&tracer, &surface, view.params().unwrap(), sampling, &|_| ()).unwrap();
    let hidden = surface.gbuffer.depth().iter().filter(|d| d.is_infinite()).count();
    assert!((100..48 * 32 - 100).contains(&hidden), "{hidden}");
    Frame { gbuffer: surface.gbuffer, geo_normal: None, ao: Some(ao), radius: Some(0.5), view: Some(view) }
});

/// Three folders, and how they are read.
struct Desk {
    dir: tempfile::TempDir,
    wanted: Import,
}

fn halves(name: &'static str, values: impl Iterator<Item = f32>) -> Plane {
    Plane { name, samples: FlatSamples::F16(values.map(f16::from_f32).collect()) }
}

fn floats(name: &'static str, values: impl Iterator<Item = f32>) -> Plane {
    Plane { name, samples: FlatSamples::F32(values.collect()) }
}

/// Normals as R, G, B in half floats.
fn normals(store: impl Fn(f32) -> f32) -> Vec<Plane> {
    let axis = |(c, name)| halves(name, FRAME.gbuffer.normal().iter().map(|n| store(n[c])));
    [(0, "R"), (1, "G"), (2, "B")].map(axis).into()
}

fn encoded() -> Vec<Plane> {
    normals(|c| 0.5 * c + 0.5)
}

fn depth(store: impl Fn(f32) -> f32) -> Vec<Plane> {
    vec![floats("Z", FRAME.gbuffer.depth().iter().map(|&d| store(d)))]
}

fn visibility() -> Vec<f32> {
    FRAME.ao.as_ref().unwrap().visibility().to_vec()
}

fn ao() -> Vec<Plane> {
    vec![halves("Y", visibility().into_iter())]
}

impl Desk {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let [normal, depth, ao] = ["normal", "depth", "ao"].map(|name| dir.path().join(name));
        for folder in [&normal, &depth, &ao] {
            std::fs::create_dir(folder).unwrap();
        }
        let rule = ImportRule { fov_y_deg: 30.0, normals: NormalCoding::Encoded };
        let (split, unmatched) = (SceneSplit::Test, Unmatched::Refuse);
        Self { wanted: Import { normal, depth, ao, rule, radius: 0.5, split, unmatched }, dir }
    }

    /// Triples of valid files.
    fn with(names: &[[&str; 3]]) -> Self {
        let desk = Self::new();
        for [normal, distance, visibility] in names {
            desk.write(&format!("normal/{normal}.exr"), encoded());
            desk.write(&format!("depth/{distance}.exr"), depth(|d| d));
            desk.write(&format!("ao/{visibility}.exr"), ao());
        }
        desk
    }

    fn write(&self, name: &str, planes: Vec<Plane>) {
        let path = self.dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, encode_images(SIZE, planes).unwrap()).unwrap();
    }

    fn out(&self) -> PathBuf {
        self.dir.path().join("out")
    }

    fn import(&self) -> Result<ImportSummary> {
        import(&self.out(), &self.wanted, &|_| ())
    }

    fn manifest(&self) -> Manifest {
        Manifest::load(&self.out()).unwrap()
    }

    /// The first frame of an import that succeeds.
    fn frame(&self) -> Frame {
        self.import().unwrap();
        let manifest = self.manifest();
        Frame::load(&manifest.path(&manifest.frames[0]), &FrameHints::default()).unwrap()
    }

    /// Checks that an import fails with these words, and leaves no manifest.
    #[track_caller]
    fn refuses(&self, words: &[&str]) {
        let message = self.import().unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
        assert!(!self.out().join("manifest.json").exists());
    }
}

fn same(name: &str) -> [&str; 3] {
    [name; 3]
}

/// Half floats have 11 bits: 2^-11 for AO in [0.5, 1], twice that for encoded normals, which are then made unit
/// length and stored in half floats again.
fn assert_close(found: &Frame) {
    let expected = &*FRAME;
    assert_eq!(found.gbuffer.depth(), expected.gbuffer.depth());
    for (a, b) in found.gbuffer.normal().iter().zip(expected.gbuffer.normal()) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3), "{a:?} {b:?}");
    }
    for (a, b) in found.ao.as_ref().unwrap().visibility().iter().zip(visibility()) {
        assert!((a - b).abs() <= 1.0 / 2048.0, "{a} {b}");
    }
}

#[test]
fn a_triple_becomes_the_frame_it_came_from() {
    let frame = Desk::with(&[same("0001")]).frame();
    assert_close(&frame);
    assert_eq!(frame.radius, Some(0.5));
    let (found, expected) = (frame.gbuffer.camera(), FRAME.gbuffer.camera());
    assert_eq!(found.projection(), expected.projection());
    assert!(
        std::panic::catch_unwind(|| {
            let mut other = FRAME.clone();
            other.ao = Some(AoImage::open(Size::px(48, 32)));
            assert_close(&other);
        })
        .is_err()
    );
}

#[test]
fn other_ways_to_store_the_same_are_read() {
    let desk = Desk::with(&[same("0001")]);
    let stored = |d: f32| if d.is_finite() { -d } else { -1e10 };
    desk.write("depth/0001.exr", depth(stored));
    assert_close(&desk.frame());
    let mut desk = Desk::with(&[same("0001")]);
    desk.wanted.rule.normals = NormalCoding::Plain;
    desk.write("normal/0001.exr", normals(|c| c));
    desk.write("depth/0001.exr", ["R", "G", "B", "A"].map(|n| depth(|d| d).remove(0).named(n)).into());
    desk.write("ao/0001.exr", ["R", "G", "B"].map(|n| ao().remove(0).named(n)).into());
    assert_close(&desk.frame());
}

impl Plane {
    fn named(self, name: &'static str) -> Self {
        Self { name, ..self }
    }
}

#[test]
fn background_is_told_by_depth_or_normal() {
    for hidden in [0.0, f32::NAN, f32::NEG_INFINITY, 1e9, 3e38] {
        let desk = Desk::with(&[same("0001")]);
        // As in an image with a colour everywhere: a normal alone does not make a pixel foreground.
        desk.write("normal/0001.exr", normals_without_background());
        desk.write("depth/0001.exr", depth(|d| if d.is_finite() { d } else { hidden }));
        assert_close(&desk.frame());
    }
    let desk = Desk::with(&[same("0001")]);
    desk.write("normal/0001.exr", normals_without_background());
    desk.write("depth/0001.exr", vec![halves("Z", FRAME.gbuffer.depth().iter().map(|d| d.min(65504.0)))]);
    assert_eq!(hidden_pixels(&desk.frame()), hidden_pixels(&FRAME));
    // The pixels of the background have zero normals, stored as 0.5; and, as an empty image has them, as 0.
    for store in [|c: f32| 0.5 * c + 0.5, |c: f32| if c == 0.0 { 0.0 } else { 0.5 * c + 0.5 }] {
        let desk = Desk::new();
        desk.write("normal/0001.exr", zero_stays_zero(store));
        desk.write("depth/0001.exr", depth(|d| d.min(7.0)));
        desk.write("ao/0001.exr", ao());
        assert_eq!(hidden_pixels(&desk.frame()), hidden_pixels(&FRAME));
    }
}

fn hidden_pixels(frame: &Frame) -> Vec<usize> {
    (0..SIZE.pixels()).filter(|&i| !frame.gbuffer.is_foreground(i)).collect()
}

/// Normals that point to the viewer on the background.
fn normals_without_background() -> Vec<Plane> {
    let value = |n: &[f32; 3], c: usize| if *n == [0.0; 3] { [0.5, 0.5, 1.0][c] } else { 0.5 * n[c] + 0.5 };
    let axis = |(c, name)| halves(name, FRAME.gbuffer.normal().iter().map(|n| value(n, c)));
    [(0, "R"), (1, "G"), (2, "B")].map(axis).into()
}

/// Normals of which only whole pixels of zero are stored as `store` has zero.
fn zero_stays_zero(store: impl Fn(f32) -> f32) -> Vec<Plane> {
    let value = |n: &[f32; 3], c: usize| if *n == [0.0; 3] { store(0.0) } else { 0.5 * n[c] + 0.5 };
    let axis = |(c, name)| halves(name, FRAME.gbuffer.normal().iter().map(|n| value(n, c)));
    [(0, "R"), (1, "G"), (2, "B")].map(axis).into()
}

#[test]
fn folders_are_scenes_and_names_are_in_order() {
    let mut desk = Desk::with(&[same("b room/2"), same("b room/1"), same("a/x/1"), same("9")]);
    desk.wanted.split = SceneSplit::Val;
    assert_eq!(desk.import().unwrap(), ImportSummary { made: 4, kept: 0, skipped: 0 });
    let manifest = desk.manifest();
    let frames: Vec<_> =
        manifest.frames.iter().map(|f| (&*f.file, &*f.source.as_ref().unwrap().name)).collect();
    assert_eq!(
        frames,
        [
            ("frames/a/000000.exr", "a/x/1"),
            ("frames/b_room/000000.exr", "b room/1"),
            ("frames/b_room/000001.exr", "b room/2"),
            ("frames/imported/000000.exr", "9"),
        ]
    );
    assert_eq!((manifest.missing(), manifest.frames(Split::Val).count()), (0, 4));
    assert_eq!(manifest.plan.recipe.radius, RadiusRule::Given(0.5));
    let recipe = &manifest.plan.recipe;
    assert_eq!(Size::px(recipe.width, recipe.height), SIZE);
}

#[test]
fn words_that_a_folder_has_in_common_do_not_count() {
    for (names, expected) in [
        ([["a/1_normal", "a/1_depth", "a/1_ao"], ["b/2_normal", "b/2_depth", "b/2_ao"]], ["a/1", "b/2"]),
        ([["normal.1", "depth.1", "ao.1"], ["normal.2", "depth.2", "ao.2"]], ["1", "2"]),
        (
            [["hall_left", "hall_left-z", "hall_left-ao"], ["hall", "hall-z", "hall-ao"]],
            ["hall", "hall_left"],
        ),
        ([same("x_left"), same("y_left")], ["x_left", "y_left"]),
    ] {
        let desk = Desk::with(&names);
        desk.import().unwrap();
        let found = desk.manifest().frames;
        let found: Vec<&str> = found.iter().map(|f| &*f.source.as_ref().unwrap().name).collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn a_file_without_partners_is_named_or_left_out() {
    let mut desk = Desk::with(&[same("1_n"), same("2_n")]);
    desk.write("depth/3_n.exr", depth(|d| d));
    desk.write("normal/3_n.exr", encoded());
    desk.write("normal/.hidden.exr", encoded());
    std::fs::write(desk.dir.path().join("ao/notes.txt"), b"3").unwrap();
    desk.refuses(&["normal/3_n.exr", "an image called 3_n in", "ao as well"]);
    desk.wanted.unmatched = Unmatched::Skip;
    assert_eq!(desk.import().unwrap(), ImportSummary { made: 2, kept: 0, skipped: 2 });
    let mut desk = Desk::with(&[["1", "2", "3"]]);
    desk.wanted.unmatched = Unmatched::Skip;
    desk.refuses(&["normal/1.exr", "an image called 1"]);
}

#[test]
fn scenes_that_would_share_a_name_are_refused() {
    Desk::with(&[same("b room/1"), same("b_room/1")]).refuses(&["b_room twice"]);
    Desk::with(&[same("imported/1"), same("1")]).refuses(&["imported twice"]);
}

#[test]
fn an_import_goes_on_where_it_was_and_another_is_refused() {
    let mut desk = Desk::with(&[same("1"), same("2"), same("3")]);
    desk.write("ao/2.exr", vec![halves("Y", visibility().into_iter().map(|v| 0.5 * v))]);
    assert_eq!(desk.import().unwrap().made, 3);
    let path = desk.out().join("frames/imported/000001.exr");
    let bytes = [&path, &desk.out().join("manifest.json")].map(|p| std::fs::read(p).unwrap());
    std::fs::remove_file(&path).unwrap();
    assert_eq!(desk.import().unwrap(), ImportSummary { made: 1, kept: 2, skipped: 0 });
    assert_eq!(desk.import().unwrap(), ImportSummary { made: 0, kept: 3, skipped: 0 });
    let again = [&path, &desk.out().join("manifest.json")].map(|p| std::fs::read(p).unwrap());
    assert_eq!(again, bytes);
    let refused = |desk: &Desk, word: &str| {
        let message = desk.import().unwrap_err().to_string();
        assert!(message.contains(word) && message.contains("manifest.json"), "{word}: {message}");
    };
    for (change, word) in [
        (Box::new(|w: &mut Import| w.rule.fov_y_deg = 60.0) as Box<dyn Fn(&mut Import)>, "fov_y_deg"),
        (Box::new(|w| w.rule.normals = NormalCoding::Plain), "normals"),
        (Box::new(|w| w.radius = 0.25), "recipe.radius"),
        (Box::new(|w| w.split = SceneSplit::Train), "frames.te"),
    ] {
        let same = desk.wanted.clone();
        change(&mut desk.wanted);
        refused(&desk, word);
        desk.wanted = same;
    }
    desk.write("ao/3.exr", vec![halves("A longer name", visibility().into_iter())]);
    refused(&desk, "000002.exr imported from 3 of");
    desk.write("ao/3.exr", ao());
    assert_eq!(desk.import().unwrap().made, 0);
    assert_eq!(std::fs::read(desk.out().join("manifest.json")).unwrap(), bytes[1]);
}

#[test]
fn imported_frames_are_not_made_again() {
    let desk = Desk::with(&[same("1")]);
    desk.import().unwrap();
    let manifest = desk.manifest();
    let elsewhere = desk.dir.path().join("elsewhere");
    let refusals = [
        super::super::generate(&elsewhere, &manifest.plan, &Work::default(), &|_| ()).unwrap_err(),
        super::super::remake(&elsewhere, &manifest, &Work::default(), &|_| ()).unwrap_err(),
    ];
    for refusal in refusals {
        assert!(refusal.to_string().contains("another program made them"), "{refusal}");
    }
    let refusal =
        aonet_scene::staging::propose_view(&manifest.plan.scenes[0], SIZE, 0).map(|_| ()).unwrap_err();
    assert!(refusal.to_string().contains("no triangles"), "{refusal}");
    assert!(!elsewhere.exists());
}

#[test]
fn bad_images_are_named_with_what_is_wrong() {
    let size = |name: &str, size: Size| {
        let planes = vec![floats("Y", (0..size.pixels()).map(|_| 0.5))];
        (name.to_owned(), encode_images(size, planes).unwrap())
    };
    let file = |name: &str, planes| (name.to_owned(), encode_images(SIZE, planes).unwrap());
    let cut = |name: &str, planes| {
        let (name, mut bytes) = file(name, planes);
        bytes.truncate(bytes.len() / 2);
        (name, bytes)
    };
    let constant = |name, value: f32| halves(name, (0..SIZE.pixels()).map(move |_| value));
    for ((name, bytes), words) in [
        (file("normal/1.exr", ao()), ["three channels", "found Y"]),
        (file("depth/1.exr", encoded()), ["R, G and B alike", " at ("]),
        (file("ao/1.exr", encoded()), ["R, G and B alike", " at ("]),
        (file("depth/1.exr", vec![constant("U", 1.0), constant("V", 1.0)]), ["one channel", "U, V"]),
        (file("depth/1.exr", vec![constant("ao", 1.0)]), ["one channel", "found ao"]),
        (file("depth/1.exr", ["X", "Y", "Z"].map(|n| constant(n, 1.0)).into()), ["one channel", "X, Y, Z"]),
        (size("depth/1.exr", Size::px(32, 48)), ["48x32 as in", "found 32x48"]),
        (size("ao/1.exr", Size::px(48, 31)), ["48x32 as in", "found 48x31"]),
        (cut("normal/1.exr", encoded()), ["OpenEXR", "found"]),
        (cut("depth/1.exr", depth(|d| d)), ["OpenEXR", "found"]),
        (cut("ao/1.exr", ao()), ["OpenEXR", "found"]),
        (("ao/1.exr".into(), b"not an image".to_vec()), ["OpenEXR", "found"]),
        (file("normal/1.exr", normals(|c| c)), ["normals: expected colours", "`plain`"]),
        (file("normal/1.exr", normals(|c| 0.5 * (0.1 * c + 1.0))), ["a depth and a normal", "background"]),
        (file("normal/1.exr", normals(|c| 3.0 * c)), ["normals: expected colours", "not of unit length"]),
        (file("normal/1.exr", normals(|c| 0.5 - 0.5 * c)), ["towards the viewer", "face away"]),
        (file("normal/1.exr", normals(|_| f32::NAN)), ["normals: expected colours", "not of unit length"]),
        (file("depth/1.exr", depth(|_| 0.0)), ["a depth and a normal", "background"]),
        (file("ao/1.exr", vec![constant("Y", 255.0)]), ["visibility at (", "255"]),
        (file("ao/1.exr", vec![constant("Y", f32::NAN)]), ["visibility at (", "NaN"]),
    ] {
        let desk = Desk::with(&[same("1")]);
        std::fs::write(desk.dir.path().join(&name), bytes).unwrap();
        // What has too little to show is known by its depth.
        let named = if words[1] == "background" { "depth/1.exr" } else { &*name };
        desk.refuses(&[named, words[0], words[1]]);
    }
    let mut desk = Desk::with(&[same("1")]);
    desk.wanted.rule.normals = NormalCoding::Plain;
    desk.refuses(&["normal/1.exr", "normals: expected vectors", "`encoded`"]);
}

#[test]
fn bad_requests_are_refused() {
    for fov_y_deg in [0.0, -1.0, 180.0, f32::NAN, f32::INFINITY] {
        let mut desk = Desk::with(&[same("1")]);
        desk.wanted.rule.fov_y_deg = fov_y_deg;
        desk.refuses(&["field of view", "(0, 180) degrees"]);
    }
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut desk = Desk::with(&[same("1")]);
        desk.wanted.radius = radius;
        desk.refuses(&["radius", "a finite length > 0"]);
    }
    let mut desk = Desk::with(&[same("1")]);
    std::fs::remove_file(desk.dir.path().join("depth/1.exr")).unwrap();
    desk.refuses(&["depth: expected OpenEXR images", "found none"]);
    desk.wanted.ao = desk.dir.path().join("absent");
    desk.wanted.depth = desk.wanted.normal.clone();
    desk.refuses(&["absent"]);
}

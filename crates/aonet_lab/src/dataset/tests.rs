//! Datasets as files: equal bytes whatever the shards, the interruptions and the order.

use super::fixtures::{room, stack, write_glb};
use super::*;
use crate::frame::{Frame, FrameHints};
use aonet_scene::staging::{SceneSpec, SceneSplit};
use aonet_scene::view::Surround;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

fn recipe(seed: u64) -> DatasetParams {
    let frames = Counts { train: 5, val: 2, val_seen: 2, test: 2 };
    DatasetParams {
        seed,
        frames,
        width: 48,
        height: 32,
        spp: 4,
        eval_spp: 8,
        ..DatasetParams::preset(Preset::AnyRadius)
    }
}

/// Scenes on disk, one folder for all tests.
static DIR: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let dir = tempfile::tempdir().unwrap();
    for (name, scene) in [("hall", room()), ("cabin", room()), ("tower", stack()), ("attic", room())] {
        write_glb(dir.path(), name, &scene);
    }
    dir
});

fn plan(seed: u64) -> DatasetPlan {
    let scene = |name: &str, split, environment| {
        let file = DIR.path().join(name).with_extension("glb");
        SceneSpec::from_file(&file, split).unwrap().with_environment(environment)
    };
    let scenes = vec![
        scene("hall", SceneSplit::Train, true),
        scene("cabin", SceneSplit::Train, true),
        scene("tower", SceneSplit::Val, false),
        scene("attic", SceneSplit::Test, true),
    ];
    DatasetPlan::new(recipe(seed), scenes).unwrap()
}

fn make(dir: &Path, plan: &DatasetPlan, shard: Option<Shard>) -> Summary {
    generate(dir, plan, &Work { shard, ..Work::default() }, &|_| ()).unwrap()
}

/// Every file below a folder except shard manifests and temporary files, with its bytes.
fn contents(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(dir).unwrap().to_string_lossy().into_owned();
            match path.is_dir() {
                true => folders.push(path),
                false if name.starts_with("manifest-") || name.ends_with(".tmp") => {}
                false => drop(files.insert(name, std::fs::read(path).unwrap())),
            }
        }
    }
    files
}

#[test]
fn one_seed_gives_equal_bytes_and_another_does_not() {
    let [a, b, c] = [1, 1, 2].map(|seed| {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(make(dir.path(), &plan(seed), None).made, 11);
        contents(dir.path())
    });
    assert_eq!(a.len(), 12);
    assert_eq!(a, b);
    assert!(a.keys().eq(c.keys()) && a.iter().all(|(name, bytes)| c[name] != *bytes));
}

#[test]
fn shards_from_several_folders_merge_into_the_whole() {
    let (whole, first, second) =
        (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(whole.path(), &plan(1), None);
    let shard = |index| Some(Shard::new(index, 3).unwrap());
    make(second.path(), &plan(1), shard(2));
    make(first.path(), &plan(1), shard(3));
    let dirs = [first.path().to_owned(), second.path().to_owned()];
    assert!(merge(&dirs).unwrap_err().to_string().contains("manifest-1-of-3.json"));
    make(first.path(), &plan(1), shard(1));
    assert_eq!(merge(&dirs).unwrap().missing(), 0);
    assert_eq!(contents(first.path()), contents(whole.path()));
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let dirs = [a.path().to_owned(), b.path().to_owned()];
    assert!(merge(&dirs).is_err());
    make(a.path(), &plan(1), Some(Shard::new(1, 2).unwrap()));
    make(b.path(), &plan(2), Some(Shard::new(2, 2).unwrap()));
    let message = merge(&dirs).unwrap_err().to_string();
    assert!(message.contains("seed"), "{message}");
    let other = tempfile::tempdir().unwrap();
    make(other.path(), &plan(1), Some(Shard::new(2, 2).unwrap()));
    std::fs::remove_file(other.path().join(DatasetPlan::file(&plan(1), plan(1).jobs(None)[1]))).unwrap();
    let message = merge(&[a.path().to_owned(), other.path().to_owned()]).unwrap_err().to_string();
    assert!(message.contains(".exr"), "{message}");
}

#[test]
fn a_killed_run_resumes_to_the_same_bytes() {
    let (whole, killed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(whole.path(), &plan(1), None);
    let frames = AtomicUsize::new(0);
    let die = |event: Event| {
        if matches!(event, Event::Frame(_)) && frames.fetch_add(1, Ordering::Relaxed) == 6 {
            panic!("killed on purpose");
        }
    };
    let run = AssertUnwindSafe(|| generate(killed.path(), &plan(1), &Work::default(), &die));
    assert!(catch_unwind(run).is_err());
    let before = contents(killed.path()).len();
    assert!((2..12).contains(&before), "{before}");
    let frame = Manifest::load(killed.path()).unwrap().frames[0].clone();
    std::fs::write(killed.path().join(frame.file.clone() + ".1.tmp"), b"half a frame").unwrap();
    std::fs::remove_file(killed.path().join(&frame.file)).unwrap();
    let summary = make(killed.path(), &plan(1), None);
    assert!(summary.kept > 0 && summary.made + summary.kept == 11, "{summary:?}");
    assert_eq!(contents(killed.path()), contents(whole.path()));
    assert_eq!(make(killed.path(), &plan(1), None).made, 0);
}

#[test]
fn a_folder_with_another_dataset_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    make(dir.path(), &plan(1), None);
    let before = contents(dir.path());
    let mut sharper = plan(1);
    sharper.recipe.spp = 5;
    for (other, named) in [(plan(2), "recipe.seed"), (sharper, "recipe.spp")] {
        let message = generate(dir.path(), &other, &Work::default(), &|_| ()).unwrap_err().to_string();
        assert!(message.contains(named), "{message}");
    }
    assert_eq!(contents(dir.path()), before);
}

#[test]
fn frames_depend_on_their_scene_and_not_on_others() {
    let (all, few) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(all.path(), &plan(1), None);
    let mut scenes = plan(1).scenes;
    scenes.retain(|s| s.name == "hall");
    let frames = Counts { train: 2, val: 0, val_seen: 0, test: 0 };
    make(few.path(), &DatasetPlan::new(DatasetParams { frames, ..recipe(1) }, scenes).unwrap(), None);
    let (all, few) = (contents(all.path()), contents(few.path()));
    for name in ["frames/hall/000000.exr", "frames/hall/000001.exr"] {
        assert!(all[name] == few[name], "{name}");
    }
}

/// The same frames, with the files of their scenes in `dir`.
fn located(original: &Manifest, dir: &Path) -> Manifest {
    let mut manifest = original.clone();
    manifest.plan = manifest.plan.located(dir);
    manifest
}

#[test]
fn frames_are_made_again_with_a_margin_and_a_second_layer() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(first.path(), &plan(1), None);
    let mut deep = located(&Manifest::load(first.path()).unwrap(), DIR.path());
    deep.plan.recipe.surround = Surround { margin: 0.25, separation: Some(0.1) };
    remake(second.path(), &deep, &Work::default(), &|_| ()).unwrap();
    let deep = Manifest::load(second.path()).unwrap();
    assert_eq!(deep.plan.recipe.surround, Surround { margin: 0.25, separation: Some(0.1) });
    for entry in &deep.frames {
        let load = |dir: &Path| Frame::load(&dir.join(&entry.file), &FrameHints::default()).unwrap();
        let (flat, deep) = (load(first.path()), load(second.path()));
        let window = deep.gbuffer.window();
        assert!(window.has_margin() && deep.gbuffer.second().is_some());
        assert_eq!(window.cropped(deep.gbuffer.depth().to_vec()), flat.gbuffer.depth());
        assert_eq!(deep.ao, flat.ao);
    }
}

#[test]
fn a_manifest_is_enough_to_make_its_frames_again() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(first.path(), &plan(1), None);
    let mut original = Manifest::load(first.path()).unwrap();
    // A view that no sampler would choose.
    original.frames[3].view.fov_y_deg = 34.0;
    original.save().unwrap();
    let original = Manifest::load(first.path()).unwrap();
    let summary = remake(second.path(), &located(&original, DIR.path()), &Work::default(), &|_| ()).unwrap();
    assert_eq!((summary.made, summary.chosen), (11, 0));
    let (a, b) = (contents(first.path()), contents(second.path()));
    let differing: Vec<&String> = a.keys().filter(|name| a[*name] != b[*name]).collect();
    assert_eq!(differing, [&original.frames[3].file]);
    let frame = Frame::load(&second.path().join(differing[0]), &FrameHints::default()).unwrap();
    assert_eq!(frame.view.unwrap().fov_y_deg, 34.0);
    let elsewhere =
        remake(&second.path().join("x"), &located(&original, second.path()), &Work::default(), &|_| ());
    assert!(elsewhere.unwrap_err().to_string().contains(".glb"));
}

#[test]
fn frames_hold_what_the_manifest_says() {
    let dir = tempfile::tempdir().unwrap();
    make(dir.path(), &plan(1), None);
    let manifest = Manifest::load(dir.path()).unwrap();
    for entry in &manifest.frames {
        let frame = Frame::load(&manifest.path(entry), &FrameHints::default()).unwrap();
        assert_eq!((frame.gbuffer.width(), frame.gbuffer.height()), (48, 32));
        assert_eq!(frame.radius, Some(entry.radius));
        assert_eq!(frame.view.as_ref(), Some(&entry.view));
        let depth = frame.gbuffer.depth();
        let mut depth: Vec<f32> = depth.iter().copied().filter(|d| d.is_finite()).collect();
        depth.sort_by(f32::total_cmp);
        let projected = frame.gbuffer.camera().projected_px(entry.radius, depth[depth.len() / 2]) / 32.0;
        // The rule holds at the median of the probe's pixels, of which these are a coarser sample.
        assert!((0.018..0.44).contains(&projected), "{}: {projected}", entry.file);
    }
    let sheet = contact_sheet(&manifest, 4, 3).unwrap();
    assert!(sheet.pixels().any(|p| p.0[0] != p.0[1]), "normals are coloured");
    assert!(sheet.width() > 3 * 48 && sheet.height() > 2 * 2 * 32);
    assert!(contact_sheet(&manifest, 0, 3).is_err() && contact_sheet(&manifest, 4, 0).is_err());
}

#[test]
fn splits_share_no_scene_and_have_their_numbers() {
    let plan = plan(1);
    let mut scenes: BTreeMap<Split, BTreeSet<usize>> = BTreeMap::new();
    let jobs = plan.jobs(None);
    for job in &jobs {
        scenes.entry(job.split).or_default().insert(job.scene);
    }
    for (split, count) in [(Split::Train, 5), (Split::ValSeen, 2), (Split::Val, 2), (Split::Test, 2)] {
        assert_eq!(jobs.iter().filter(|j| j.split == split).count(), count);
    }
    assert!(scenes[&Split::Train].is_superset(&scenes[&Split::ValSeen]));
    for (a, b) in [(Split::Train, Split::Test), (Split::Train, Split::Val), (Split::Val, Split::Test)] {
        assert!(scenes[&a].is_disjoint(&scenes[&b]), "{a:?} {b:?}");
    }
    let files: BTreeSet<String> = jobs.iter().map(|&j| plan.file(j)).collect();
    assert_eq!(files.len(), jobs.len());
    for count in 1..=13 {
        let mut joined = Vec::new();
        for index in 1..=count {
            let shard = Some(Shard::new(index, count).unwrap());
            assert_eq!(plan.jobs(shard).len(), plan.job_count(shard));
            joined.extend(plan.jobs(shard));
        }
        joined.sort_by_key(|j| (j.scene, j.index));
        assert_eq!(joined, jobs);
    }
}

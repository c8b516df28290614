//! The manifest of a dataset: its frames, and everything needed to make them again.

use super::imported::ImportedFrom;
use super::plan::{DatasetPlan, Shard};
use super::split::Split;
use aonet_scene::error::{Error, Result};
use aonet_scene::scene::SceneSource;
use aonet_scene::staging::SceneSpec;
use aonet_scene::view::View;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// Version of the manifest's layout; other versions are refused.
pub const FORMAT: u32 = 1;

/// One frame of a dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameEntry {
    /// The EXR file, relative to the manifest's folder, with `/` between its parts.
    pub file: String,
    /// Name of the scene it shows.
    pub scene: String,
    /// Which frame of its scene it is.
    pub index: u32,
    /// Its split.
    pub split: Split,
    /// Camera and radius.
    pub view: View,
    /// AO radius (world units), the view's.
    pub radius: f32,
    /// Reference rays per pixel; 0 if an imported frame does not record them.
    pub spp: u32,
    /// Seed of the reference rays.
    pub seed: u64,
    /// The source of an imported frame; absent for generated frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<ImportedFrom>,
}

/// The frames of a dataset or of one shard of it, complete or still growing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: u32,
    /// Name and version of the program that made the frames.
    pub tool: String,
    /// The plan of the whole dataset.
    #[serde(flatten)]
    pub plan: DatasetPlan,
    /// The part of the dataset that these frames are; absent for the whole dataset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// The frames that exist, in the order of the plan.
    pub frames: Vec<FrameEntry>,
    #[serde(skip)]
    dir: PathBuf,
}

impl Manifest {
    /// A manifest without frames.
    pub(super) fn new(dir: &Path, plan: DatasetPlan, shard: Option<Shard>) -> Self {
        let tool = concat!("aonet ", env!("CARGO_PKG_VERSION")).to_owned();
        Self { format: FORMAT, tool, plan, shard, frames: Vec::new(), dir: dir.to_owned() }
    }

    /// Name of the manifest of a whole dataset, or of one shard.
    pub fn file_name(shard: Option<Shard>) -> String {
        match shard {
            None => "manifest.json".into(),
            Some(shard) => format!("manifest-{}-of-{}.json", shard.index, shard.count),
        }
    }

    /// Reads a manifest, or the `manifest.json` of a folder.
    ///
    /// # Errors
    /// When the file cannot be read or [`Manifest::from_bytes`] refuses it.
    pub fn load(path: &Path) -> Result<Self> {
        let path = if path.is_dir() { path.join("manifest.json") } else { path.to_owned() };
        let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
        Self::from_bytes(&bytes, &path)
    }

    /// A manifest from JSON that was, or would be, at `path`.
    ///
    /// # Errors
    /// When the bytes are no manifest of this [`FORMAT`], a value is out of range, a path leaves the
    /// manifest's folder, a frame is listed twice, or a split contains scenes of another.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Versioned {
            format: u32,
        }
        let not_manifest = |e: serde_json::Error| Error::file(path, "a dataset manifest (JSON)", e);
        let Versioned { format } = serde_json::from_slice(bytes).map_err(not_manifest)?;
        if format != FORMAT {
            return Err(Error::file(path, format!("manifest format {FORMAT}"), format!("format {format}")));
        }
        let mut manifest: Self = serde_json::from_slice(bytes).map_err(not_manifest)?;
        manifest.dir = path.parent().unwrap_or(Path::new("")).to_owned();
        manifest.check(path)?;
        Ok(manifest)
    }

    /// Writes the manifest into its folder under a temporary name, then renames it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self) -> Result<()> {
        let path = self.dir.join(Self::file_name(self.shard));
        let mut json = serde_json::to_vec_pretty(self).map_err(|e| Error::file(&path, "JSON", e))?;
        json.push(b'\n');
        aonet_scene::atomic_file::write(&path, &json)
    }

    /// The folder that frame files are relative to.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Path of the file of `frame`.
    pub fn path(&self, frame: &FrameEntry) -> PathBuf {
        self.dir.join(&frame.file)
    }

    /// The frames of one split, in the order of the plan.
    pub fn frames(&self, split: Split) -> impl Iterator<Item = &FrameEntry> {
        self.frames.iter().filter(move |f| f.split == split)
    }

    /// Number of planned frames that do not exist yet.
    pub fn missing(&self) -> usize {
        self.plan.job_count(self.shard).saturating_sub(self.frames.len())
    }

    /// Inserts a frame in the order of the plan.
    pub(super) fn insert(&mut self, frame: FrameEntry) {
        let place = (&*frame.scene, frame.index);
        let at = self.frames.partition_point(|f| (&*f.scene, f.index) < place);
        self.frames.insert(at, frame);
    }

    /// Checks that both belong to one dataset.
    ///
    /// # Errors
    /// Names the first value of the plan, or the program, that differs.
    pub(super) fn check_same(&self, wanted: &Self) -> Result<()> {
        let path = self.dir.join(Self::file_name(self.shard));
        if self.tool != wanted.tool {
            return Err(Error::file(&path, format!("frames made by {}", wanted.tool), &self.tool));
        }
        let json = |m: &Self| serde_json::to_value(&m.plan).map_err(|e| Error::file(&path, "a plan", e));
        match first_difference("", &json(wanted)?, &json(self)?) {
            None => Ok(()),
            Some((place, wanted, found)) => {
                Err(Error::file(&path, format!("a dataset with {place} = {wanted}"), found))
            }
        }
    }

    fn check(&self, path: &Path) -> Result<()> {
        self.plan.check().map_err(|e| Error::file(path, "a valid plan", e))?;
        if let Some(shard) = self.shard {
            Shard::new(shard.index, shard.count).map_err(|e| Error::file(path, "a valid shard", e))?;
        }
        let scenes: BTreeMap<&str, &SceneSpec> = self.plan.scenes.iter().map(|s| (&*s.name, s)).collect();
        let mut seen = BTreeSet::new();
        for (i, frame) in self.frames.iter().enumerate() {
            let wrong = |(expected, found): (&str, String)| {
                Error::file(path, format!("frame {i}: {expected}"), found)
            };
            let Some(&scene) = scenes.get(&*frame.scene) else {
                return Err(wrong(("one of the manifest's scenes", format!("{:?}", frame.scene))));
            };
            frame.check(scene).map_err(wrong)?;
            if !seen.insert(&frame.file) {
                return Err(wrong(("a file of its own", format!("{} again", frame.file))));
            }
        }
        Ok(())
    }
}

impl FrameEntry {
    /// The expected and the found value, as text.
    fn check(&self, scene: &SceneSpec) -> std::result::Result<(), (&'static str, String)> {
        let mut parts = Path::new(&self.file).components();
        let inside = !self.file.is_empty() && parts.all(|c| matches!(c, Component::Normal(_)));
        if !inside || self.file.contains(['\\', ':', '\0']) {
            return Err(("a file inside the manifest's folder", format!("{:?}", self.file)));
        }
        if !self.split.takes(scene.split) {
            let found = format!("{} of a scene kept for {}", self.split.name(), scene.split.name());
            return Err(("a split that its scene is for", found));
        }
        let has_rays = self.spp > 0 || scene.source == SceneSource::Imported;
        if self.radius != self.view.radius || !has_rays {
            let found = format!("{} and {}, {} rays", self.radius, self.view.radius, self.spp);
            return Err(("the view's radius and at least one ray per pixel", found));
        }
        self.view.camera().map_err(|e| ("a valid camera", e.to_string()))?;
        self.view.params().map_err(|e| ("a valid radius", e.to_string()))?;
        Ok(())
    }
}

/// The first position at which two JSON values differ, and both values.
fn first_difference(place: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) if x.keys().eq(y.keys()) => {
            x.iter().find_map(|(key, v)| first_difference(&format!("{place}.{key}"), v, &y[key]))
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => x
            .iter()
            .zip(y)
            .enumerate()
            .find_map(|(i, (v, w))| first_difference(&format!("{place}[{i}]"), v, w)),
        (Value::Array(x), Value::Array(y)) => {
            Some((format!("{}.length", &place[1..]), x.len().to_string(), y.len().to_string()))
        }
        _ => (a != b).then(|| (place.trim_start_matches('.').to_owned(), a.to_string(), b.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::{DatasetParams, Preset};
    use super::*;
    use aonet_scene::scene::procedural::Kind;
    use aonet_scene::staging::SceneSplit;
    use serde_json::json;

    fn manifest() -> Value {
        let scene = |seed, split| SceneSpec::procedural(Kind::Hall, seed, split);
        let scenes = vec![scene(0, SceneSplit::Train), scene(1, SceneSplit::Val), scene(2, SceneSplit::Test)];
        let plan = DatasetPlan::new(DatasetParams::preset(Preset::AnyRadius), scenes).unwrap();
        let mut json = serde_json::to_value(Manifest::new(Path::new("d"), plan, None)).unwrap();
        json["frames"] = json!([{
            "file": "frames/hall_0/000000.exr", "scene": "hall_0", "index": 0, "split": "train", "radius": 0.5,
            "view": {"eye": [0, 1, 2], "target": [0, 0, 0], "width": 8, "height": 8, "radius": 0.5},
            "spp": 64, "seed": 1
        }]);
        json
    }

    fn load(json: &Value) -> Result<Manifest> {
        Manifest::from_bytes(json.to_string().as_bytes(), Path::new("d/manifest.json"))
    }

    #[test]
    fn a_manifest_gives_its_frames_and_paths() {
        let m = load(&manifest()).unwrap();
        assert_eq!(m.frames(Split::Train).count(), 1);
        assert_eq!(m.frames(Split::Test).count(), 0);
        assert_eq!(m.path(&m.frames[0]), Path::new("d/frames/hall_0/000000.exr"));
        assert_eq!(m.missing(), 6639);
    }

    #[test]
    fn hostile_manifests_are_refused_by_name() {
        let frame = "/frames/0";
        for (at, value, named) in [
            ("/format", json!(2), "format 1"),
            ("/format", json!(null), "manifest"),
            ("/recipe/spp", json!(0), "rays per pixel"),
            ("/recipe/width", json!(0), "frame size"),
            ("/recipe/frames/train", json!(4_294_967_295u32), "number of frames"),
            ("/recipe/radius", json!({"scene_fraction": -1.0}), "radius rule"),
            ("/recipe/radius", json!({"image_fraction": {"min": 0.5, "max": 0.1}}), "radius rule"),
            ("/scenes/0/name", json!("../x"), "scene name"),
            ("/scenes/0/crease_deg", json!(1e300), "crease angle"),
            ("/scenes/0/source", json!("../x.glb"), "without a folder"),
            ("/scenes/0/source", json!("/x.glb"), "without a folder"),
            ("/scenes/0/source", json!("x.obj"), ".glb"),
            ("/scenes/0/source", json!("imported"), "in no others"),
            ("/recipe/preset", json!({"imported": {"fov_y_deg": 60, "normals": "plain"}}), "in all scenes"),
            ("/recipe/preset", json!({"imported": {"fov_y_deg": 180, "normals": "plain"}}), "field of view"),
            ("/recipe/radius", json!({"given": 0.0}), "radius rule"),
            ("/scenes/0/name", json!("HALL_1"), "hall_1 twice"),
            ("/scenes/1/split", json!("test"), "split val"),
            ("/shard", json!({"index": 3, "count": 2}), "3/2"),
            ("/shard", json!({"index": 0, "count": 0}), "0/0"),
            ("/frames/0/file", json!("../secret.exr"), "inside the manifest's folder"),
            ("/frames/0/file", json!("/etc/passwd"), "inside the manifest's folder"),
            ("/frames/0/file", json!("a/../../b"), "inside the manifest's folder"),
            ("/frames/0/file", json!("C:\\x"), "inside the manifest's folder"),
            ("/frames/0/file", json!(""), "inside the manifest's folder"),
            ("/frames/0/scene", json!("nowhere"), "one of the manifest's scenes"),
            ("/frames/0/split", json!("test"), "test of a scene kept for train"),
            ("/frames/0/radius", json!(-0.5), "radius"),
            ("/frames/0/radius", json!(1e99), "manifest"),
            ("/frames/0/view/radius", json!(null), "manifest"),
            ("/frames/0/view/eye", json!([0, 0, 0]), "camera"),
            ("/frames/0/view/width", json!(-8), "manifest"),
            ("/frames/0/spp", json!(0), "ray per pixel"),
        ] {
            let mut json = manifest();
            match json.pointer_mut(at) {
                Some(place) => *place = value.clone(),
                None => json[&at[1..]] = value.clone(),
            }
            let message = load(&json).unwrap_err().to_string();
            assert!(
                message.contains(named) && message.contains("manifest.json"),
                "{at} = {value}: {message}"
            );
        }
        let mut twice = manifest();
        let copy = twice.pointer(frame).unwrap().clone();
        twice["frames"].as_array_mut().unwrap().push(copy);
        assert!(load(&twice).unwrap_err().to_string().contains("again"));
    }

    #[test]
    fn cut_bytes_never_panic() {
        let bytes = manifest().to_string().into_bytes();
        for end in 0..bytes.len() {
            assert!(Manifest::from_bytes(&bytes[..end], Path::new("m")).is_err(), "{end}");
        }
    }

    #[test]
    fn the_first_difference_is_named() {
        let difference = |a, b| first_difference("", &a, &b).map(|d| d.0);
        assert_eq!(
            difference(json!({"a": [1, {"b": 2}]}), json!({"a": [1, {"b": 3}]})),
            Some("a[1].b".into())
        );
        assert_eq!(difference(json!({"a": [1]}), json!({"a": [1, 2]})), Some("a.length".into()));
        assert_eq!(difference(json!({"a": 1}), json!({"a": 1})), None);
    }
}

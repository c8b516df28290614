//! The plan of a dataset: its scenes, its parameters, and the list of its frames.

use super::imported::ImportRule;
use super::split::Split;
use aonet::Size;
use aonet_scene::error::{Error, Result};
use aonet_scene::scene::SceneSource;
use aonet_scene::staging::{Framing, RadiusRule, SceneSpec};
use aonet_scene::view::Surround;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// The set of default values that a dataset was made from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// As many frames, scenes and pixels as the paper; one radius a scene. // AO-Net §4.1
    Paper,
    /// All scenes, and a separate radius for every frame.
    AnyRadius,
    /// None: another program made the frames.
    Imported(ImportRule),
}

/// Number of frames in each split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// [`Split::Train`].
    pub train: u32,
    /// [`Split::Val`].
    pub val: u32,
    /// [`Split::ValSeen`].
    pub val_seen: u32,
    /// [`Split::Test`].
    pub test: u32,
}

impl Counts {
    /// The number of frames of `split`.
    pub fn of(&self, split: Split) -> u32 {
        match split {
            Split::Train => self.train,
            Split::Val => self.val,
            Split::ValSeen => self.val_seen,
            Split::Test => self.test,
        }
    }

    /// All frames.
    pub fn total(&self) -> usize {
        SPLITS.iter().map(|&s| self.of(s) as usize).sum()
    }

    /// The same proportions with `total` frames, rounded so that they add up.
    pub fn scaled_to(self, total: u32) -> Self {
        let whole = self.total().max(1) as u64;
        let mut before = 0;
        let mut share = |n: u32| {
            let upto = |frames: u64| (frames * u64::from(total) / whole) as u32;
            let share = upto(before + u64::from(n)) - upto(before);
            before += u64::from(n);
            share
        };
        Self {
            train: share(self.train),
            val: share(self.val),
            val_seen: share(self.val_seen),
            test: share(self.test),
        }
    }

    /// The same with the frames of the other splits left out.
    pub fn kept(self, keep: impl Fn(Split) -> bool) -> Self {
        let of = |split| if keep(split) { self.of(split) } else { 0 };
        Self {
            train: of(Split::Train),
            val: of(Split::Val),
            val_seen: of(Split::ValSeen),
            test: of(Split::Test),
        }
    }
}

/// All splits, in the order in which they take the frames of a scene.
const SPLITS: [Split; 4] = [Split::Train, Split::ValSeen, Split::Val, Split::Test];

/// Most frames of one dataset: names have six digits.
const MAX_FRAMES: usize = 1_000_000;

/// The parameters of a dataset; `recipe` in a manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DatasetParams {
    /// The default values; the fields below may differ from them.
    pub preset: Preset,
    /// Seed of everything random.
    pub seed: u64,
    /// Image width (px); for imported frames, which may differ, the width of the first.
    pub width: usize,
    /// Image height (px); for imported frames the height of the first.
    pub height: usize,
    /// Frames in each split.
    pub frames: Counts,
    /// Reference rays per pixel of training frames; 0 if imported frames do not record them.
    pub spp: u32,
    /// Reference rays per pixel of validation and test frames; 0 as above.
    pub eval_spp: u32,
    /// How radii are chosen.
    pub radius: RadiusRule,
    /// Guard band and second layer of every frame; by default neither.
    #[serde(flatten)]
    pub surround: Surround,
}

impl DatasetParams {
    /// The values of a preset. For imported frames the caller fills in the values.
    pub fn preset(preset: Preset) -> Self {
        let (width, height) = match preset {
            Preset::Paper => (1280, 720),
            Preset::AnyRadius => (640, 360),
            Preset::Imported(_) => (0, 0),
        };
        let frames = match preset {
            Preset::Paper => Counts { train: 3200, val: 0, val_seen: 398, test: 398 },
            Preset::AnyRadius => Counts { train: 6000, val: 240, val_seen: 0, test: 400 },
            Preset::Imported(_) => Counts { train: 0, val: 0, val_seen: 0, test: 0 },
        };
        let radius = match preset {
            Preset::Paper => RadiusRule::SceneFraction(0.1), // guess: crevices of an object, corners of a room
            Preset::AnyRadius => RadiusRule::ANY,
            Preset::Imported(_) => RadiusRule::Given(0.0),
        };
        let (spp, eval_spp) = match preset {
            // The noise of 64 rays averages out in training; in an evaluation it limits SSIM (512 rays: 0.989).
            Preset::Paper | Preset::AnyRadius => (64, 512),
            Preset::Imported(_) => (0, 0),
        };
        Self { preset, seed: 0, width, height, frames, spp, eval_spp, radius, surround: Surround::default() }
    }

    /// Whether the frames come from another program, so that they cannot be made again.
    pub fn is_imported(&self) -> bool {
        matches!(self.preset, Preset::Imported(_))
    }

    /// Size and radius of the frames' views.
    pub fn framing(&self) -> Framing {
        Framing { width: self.width, height: self.height, radius: self.radius }
    }

    /// Reference rays per pixel of a split.
    pub fn spp(&self, split: Split) -> u32 {
        match split {
            Split::Train => self.spp,
            Split::Val | Split::ValSeen | Split::Test => self.eval_spp,
        }
    }

    fn check(&self) -> Result<()> {
        Size::named("frame size", self.width, self.height)?;
        self.surround.check()?;
        if self.frames.total() == 0 || self.frames.total() > MAX_FRAMES {
            return Err(Error::request(
                "number of frames",
                format!("1 to {MAX_FRAMES}"),
                self.frames.total(),
            ));
        }
        if let Preset::Imported(rule) = self.preset {
            rule.check()?;
        } else if self.spp == 0 || self.eval_spp == 0 {
            return Err(Error::request("rays per pixel", "at least 1", 0));
        }
        let (low, high) = match self.radius {
            RadiusRule::SceneFraction(fraction) => (fraction, fraction),
            RadiusRule::ImageFraction { min, max } => (min, max),
            RadiusRule::Given(radius) => (radius, radius),
        };
        if low > 0.0 && low <= high && high.is_finite() {
            return Ok(());
        }
        Err(Error::request("radius rule", "finite, 0 < min <= max", format!("{low} and {high}")))
    }
}

/// One of several equal parts of a dataset, made by separate runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// 1 to `count`.
    pub index: usize,
    /// Number of parts.
    pub count: usize,
}

impl Shard {
    /// Part `index` of `count`.
    ///
    /// # Errors
    /// When `index` is not in 1..=`count`.
    pub fn new(index: usize, count: usize) -> Result<Self> {
        if (1..=count).contains(&index) {
            return Ok(Self { index, count });
        }
        Err(Error::request("shard", "I/N with 1 <= I <= N", format!("{index}/{count}")))
    }
}

/// A frame to make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Job {
    /// Index into [`DatasetPlan::scenes`].
    pub scene: usize,
    /// Index of the frame in its scene.
    pub index: u32,
    /// Its split.
    pub split: Split,
}

/// A whole dataset, before its frames are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DatasetPlan {
    /// Its parameters.
    pub recipe: DatasetParams,
    /// Its scenes, sorted by name.
    pub scenes: Vec<SceneSpec>,
}

impl DatasetPlan {
    /// A plan for `scenes`, in any order.
    ///
    /// # Errors
    /// When a number is out of range, two scenes have the same name, or a split has frames and no scenes.
    pub fn new(recipe: DatasetParams, mut scenes: Vec<SceneSpec>) -> Result<Self> {
        scenes.sort_by(|a, b| a.name.cmp(&b.name));
        let plan = Self { recipe, scenes };
        plan.check()?;
        Ok(plan)
    }

    pub(super) fn check(&self) -> Result<()> {
        self.recipe.check()?;
        let mut names = BTreeSet::new();
        for scene in &self.scenes {
            scene.check()?;
            if !names.insert(scene.name.to_lowercase()) {
                return Err(Error::request("scenes", "names of their own", format!("{} twice", scene.name)));
            }
            if (scene.source == SceneSource::Imported) != self.recipe.is_imported() {
                let what = format!("source of scene {}", scene.name);
                let expected = "`imported` in all scenes of imported frames, and in no others";
                return Err(Error::request(what, expected, &scene.source));
            }
        }
        for split in SPLITS {
            let frames = self.recipe.frames.of(split);
            if frames > 0 && !self.scenes.iter().any(|s| split.takes(s.split)) {
                let what = format!("scenes for {} frames of split {}", frames, split.name());
                return Err(Error::request(what, "at least one", "none"));
            }
        }
        Ok(())
    }

    /// The frames to make of the dataset or of a shard, scene by scene (imported frames are not made). Every n-th frame belongs to a shard, so
    /// that shards take equally long.
    pub fn jobs(&self, shard: Option<Shard>) -> Vec<Job> {
        let mut next_index = vec![0; self.scenes.len()];
        let mut jobs = Vec::with_capacity(self.recipe.frames.total());
        for split in SPLITS {
            let scenes: Vec<usize> =
                (0..self.scenes.len()).filter(|&s| split.takes(self.scenes[s].split)).collect();
            let total = self.recipe.frames.of(split) as usize;
            for (k, &scene) in scenes.iter().enumerate() {
                // Spreads the remainder of the division over the whole list.
                let share = total * (k + 1) / scenes.len() - total * k / scenes.len();
                jobs.extend((0..share as u32).map(|i| Job { scene, index: next_index[scene] + i, split }));
                next_index[scene] += share as u32;
            }
        }
        jobs.sort_by_key(|j| (j.scene, j.index));
        let Shard { index, count } = shard.unwrap_or(Shard { index: 1, count: 1 });
        jobs.into_iter().skip(index - 1).step_by(count).collect()
    }

    /// The length of [`DatasetPlan::jobs`].
    pub fn job_count(&self, shard: Option<Shard>) -> usize {
        let Shard { index, count } = shard.unwrap_or(Shard { index: 1, count: 1 });
        self.recipe.frames.total().saturating_sub(index - 1).div_ceil(count)
    }

    /// The same plan with the files of its scenes in `dir`.
    pub fn located(&self, dir: &Path) -> Self {
        let scenes = self.scenes.iter().map(|s| s.clone().located(dir)).collect();
        Self { recipe: self.recipe.clone(), scenes }
    }

    /// The file of a frame, relative to the manifest.
    pub fn file(&self, job: Job) -> String {
        format!("frames/{}/{:06}.exr", self.scenes[job.scene].name, job.index)
    }
}

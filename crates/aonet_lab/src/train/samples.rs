//! Training frames in memory, and the crops drawn from them.

use super::config::{Augment, TrainConfig};
use super::survey::{CropSurvey, Survey};
use crate::dataset::FrameEntry;
use crate::dataset::Manifest;
use crate::frame::{Frame, FrameHints};
use aonet::internals::features::{search_planes, write_features};
use aonet::net::{Channel, Features, SearchConfig};
use aonet::{AoImage, AoParams, GBuffer};
use aonet_scene::error::{Error, Result};
use aonet_scene::random::Random;
use half::f16;
use rayon::prelude::*;

/// Features and reference of the picture of a frame.
pub(crate) struct Sample {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// What is stored: see [`sampled`].
    features_of: Features,
    /// A plane for each channel.
    features: Vec<Plane>,
    /// If the network has a survey.
    survey: Option<Survey>,
    /// Visibility.
    target: Plane,
}

/// HxW values, small: thousands of frames are held in memory.
pub(super) enum Plane {
    /// Values in [0, 1] as multiples of 1/255. Rounding costs a reference nothing: 59 dB.
    Bytes(Vec<u8>),
    /// Any others.
    Halves(Vec<f16>),
}

impl Plane {
    pub(super) fn bytes(values: &[f32]) -> Self {
        Self::Bytes(values.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect())
    }

    fn halves(values: &[f32]) -> Self {
        Self::Halves(values.iter().map(|v| f16::from_f32(*v)).collect())
    }

    pub(super) fn value(&self, pixel: usize) -> f32 {
        match self {
            Self::Bytes(values) => f32::from(values[pixel]) / 255.0,
            Self::Halves(values) => values[pixel].to_f32(),
        }
    }
}

/// A part of a frame (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct Square {
    /// Left edge.
    pub(super) x: usize,
    /// Upper edge.
    pub(super) y: usize,
    pub(super) side: usize,
}

/// A square crop: features CxSxS, target SxS, 1 where geometry is seen SxS.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Crop {
    pub(crate) features: Vec<f32>,
    /// If the network has a survey.
    pub(crate) survey: Option<CropSurvey>,
    pub(crate) target: Vec<f32>,
    pub(crate) foreground: Vec<f32>,
}

/// Crops with less geometry than this are drawn again, a few times. guess
const LEAST_FOREGROUND: f32 = 0.3;
const DRAWS: u64 = 6;

/// The planes of a sample for training a network: its features, and what its search found where they do not show it.
pub(crate) fn sampled(features: Features, search: Option<SearchConfig>) -> Features {
    let planes = search.map_or(0, |search| search.planes());
    let found = Channel::all().filter(|channel| channel.search_plane().is_some_and(|plane| plane < planes));
    found.fold(features, |all, channel| if all.sees(channel) { all } else { all.with(channel) })
}

impl Sample {
    /// Reads a frame of a dataset.
    ///
    /// # Errors
    /// When the file is broken or holds no reference.
    pub(crate) fn load(manifest: &Manifest, entry: &FrameEntry, config: &TrainConfig) -> Result<Self> {
        let path = manifest.path(entry);
        let hints = FrameHints {
            view: Some(entry.view.clone()),
            radius: Some(entry.radius),
            ..FrameHints::default()
        };
        let frame = Frame::load(&path, &hints)?;
        let ao = frame.ao.ok_or_else(|| Error::file(&path, "a channel `ao`", "none"))?;
        let params = AoParams::new(entry.radius).map_err(Error::in_file(&path))?;
        let gbuffer = seen_of(frame.gbuffer, config, entry);
        let model = &config.model;
        let all = sampled(model.features.clone(), model.search);
        let mut sample =
            Self::new((&gbuffer, params), &ao, all, model.search).map_err(Error::in_file(&path))?;
        sample.survey = match (&config.exact_survey, &model.survey) {
            (Some(exact), _) => Some(Survey::exact(&exact.read(entry, model.patch)?, model.patch)),
            (None, Some(arcs)) => {
                Some(Survey::new(arcs, (&gbuffer, params), model.patch).map_err(Error::in_file(&path))?)
            }
            (None, None) => None,
        };
        Ok(sample)
    }

    fn new(
        (gbuffer, params): (&GBuffer, AoParams),
        ao: &AoImage,
        features_of: Features,
        search: Option<SearchConfig>,
    ) -> aonet::Result<Self> {
        let (window, pixels) = (gbuffer.window(), gbuffer.size().pixels());
        let (width, height) = (window.size().width(), window.size().height());
        let found = search.map(|search| search_planes(&search, gbuffer, params)).transpose()?;
        let found = found.as_deref().unwrap_or(&[]);
        let mut planes = vec![0.0; features_of.channels().len() * pixels];
        write_features(&features_of, gbuffer, params, found, &mut planes);
        let plane = |(channel, plane): (&Channel, &[f32])| {
            let picture = window.cropped(plane.to_vec());
            match channel {
                Channel::HorizonOcclusion | Channel::Light(_) | Channel::SecondLayer => {
                    Plane::bytes(&picture)
                }
                Channel::Normal(_)
                | Channel::NormalEncoded(_)
                | Channel::Position(_)
                | Channel::Depth
                | Channel::DepthNormalized
                | Channel::ProjectedRadius => Plane::halves(&picture),
            }
        };
        let features = features_of.channels().iter().zip(planes.chunks_exact(pixels)).map(plane).collect();
        let target = Plane::bytes(ao.visibility());
        Ok(Self { width, height, features_of, features, survey: None, target })
    }

    /// Mean visibility over the whole frame.
    pub(crate) fn mean(&self) -> f64 {
        let pixels = self.width * self.height;
        (0..pixels).map(|i| f64::from(self.target.value(i))).sum::<f64>() / pixels as f64
    }

    /// The crop of a square, turned by `symmetry`.
    fn crop(&self, square: Square, symmetry: Symmetry) -> Crop {
        let Square { x, y, side } = square;
        let area = side * side;
        let mut crop = Crop {
            features: vec![0.0; self.features_of.channels().len() * area],
            survey: self.survey.as_ref().map(|survey| survey.crop(square, symmetry)),
            target: vec![0.0; area],
            foreground: vec![0.0; area],
        };
        for to in 0..area {
            let (row, column) = symmetry.source(to / side, to % side, side);
            let from = (y + row) * self.width + x + column;
            self.pixel(from, symmetry, |c, value| crop.features[c * area + to] = value);
            crop.foreground[to] = f32::from((0..3).any(|c| crop.features[c * area + to] != 0.0));
            crop.target[to] = self.target.value(from);
        }
        crop
    }

    /// Hands out the turned channels of pixel `from`.
    fn pixel(&self, from: usize, symmetry: Symmetry, mut put: impl FnMut(usize, f32)) {
        let value = |c: usize| self.features[c].value(from);
        for (c, channel) in self.features_of.channels().iter().enumerate() {
            match channel {
                Channel::Normal(axis) | Channel::Position(axis) => {
                    let first = c - axis.index();
                    put(c, symmetry.vector([0, 1, 2].map(|k| value(first + k)))[axis.index()]);
                }
                Channel::NormalEncoded(axis) => {
                    let first = c - axis.index();
                    let encoded = [0, 1, 2].map(|k| value(first + k));
                    let turned = symmetry.vector(encoded.map(|e| 2.0 * e - 1.0)).map(|n| 0.5 * n + 0.5);
                    put(c, if encoded == [0.0; 3] { 0.0 } else { turned[axis.index()] });
                }
                Channel::Depth
                | Channel::DepthNormalized
                | Channel::ProjectedRadius
                | Channel::HorizonOcclusion
                | Channel::Light(_)
                | Channel::SecondLayer => put(c, value(c)),
            }
        }
    }
}

/// What a run shows its network of a frame: all of it, or less where [`Augment`] says so. The same in every run with
/// this seed.
pub(crate) fn seen_of(
    gbuffer: GBuffer<'static>,
    config: &TrainConfig,
    entry: &FrameEntry,
) -> GBuffer<'static> {
    let mut random = Random::of_frame(config.seed, &entry.scene, entry.index);
    let mut falls = |share: f64| random.unit_f64() < share;
    let (no_margin, no_second) = (falls(config.augment.without_margin), falls(config.augment.without_second));
    let gbuffer = if no_second { gbuffer.without_second() } else { gbuffer };
    if no_margin && gbuffer.window().has_margin() { gbuffer.without_margin().into_owned() } else { gbuffer }
}

/// A symmetry of the image plane: first mirrored left to right, then rolled counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Symmetry {
    pub(crate) mirror: bool,
    pub(crate) quarter_turns: u64,
}

impl Symmetry {
    /// Where pixel (`row`, `column`) of the result comes from.
    pub(super) fn source(self, row: usize, column: usize, side: usize) -> (usize, usize) {
        let last = side - 1;
        let (row, column) = match self.quarter_turns {
            0 => (row, column),
            1 => (column, last - row),
            2 => (last - row, last - column),
            _ => (last - column, row),
        };
        (row, if self.mirror { last - column } else { column })
    }

    /// The same symmetry on a view-space vector (+x right, +y up).
    fn vector(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let x = if self.mirror { -x } else { x };
        match self.quarter_turns {
            0 => [x, y, z],
            1 => [-y, x, z],
            2 => [-x, -y, z],
            _ => [y, -x, z],
        }
    }
}

/// Reads every frame of `entries` on all cores; `progress` is called once a frame.
///
/// # Errors
/// When a frame is broken or smaller than the crop.
pub(crate) fn load_all(
    entries: &[(&Manifest, &FrameEntry)],
    config: &TrainConfig,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Sample>> {
    let load = |&(manifest, entry): &(&Manifest, &FrameEntry)| {
        let sample = Sample::load(manifest, entry, config)?;
        if sample.width < config.crop || sample.height < config.crop {
            let expected = format!("a frame of at least {0}x{0}, the training crop", config.crop);
            return Err(Error::file(
                &manifest.path(entry),
                expected,
                format!("{}x{}", sample.width, sample.height),
            ));
        }
        progress();
        Ok(sample)
    };
    entries.par_iter().map(load).collect()
}

/// Crop number `index` of step `step`: depends on nothing else but the seed and the frames.
pub(crate) fn draw(samples: &[Sample], config: &TrainConfig, step: u64, index: usize) -> Crop {
    let mut random = Random::of_crop(config.seed, step, index as u64);
    let mut best: Option<(f32, Crop)> = None;
    for _ in 0..DRAWS {
        let sample = &samples[random.below(samples.len())];
        // Cells of a survey cannot be divided.
        let grid = sample.survey.as_ref().map_or(1, Survey::patch);
        let mut edge = |side: usize| grid * place(&mut random, config, [side / grid, config.crop / grid]);
        let (x, y) = (edge(sample.width), edge(sample.height));
        let crop = sample.crop(Square { x, y, side: config.crop }, symmetry(config.augment, &mut random));
        let share = crop.foreground.iter().sum::<f32>() / crop.foreground.len() as f32;
        if share >= LEAST_FOREGROUND {
            return crop;
        }
        if best.as_ref().is_none_or(|(least, _)| share > *least) {
            best = Some((share, crop));
        }
    }
    best.expect("at least one draw").1
}

/// Where a crop begins on a line of a frame; both lengths in cells.
///
/// With [`Augment::borders`], a crop may lie beyond the frame by up to its length, and is then moved inside. So the pixels at the borders are in
/// as many crops as those in the middle. Otherwise every place inside is equally likely, and the pixels at the borders are in few crops.
fn place(random: &mut Random, config: &TrainConfig, [frame, crop]: [usize; 2]) -> usize {
    if config.augment.borders {
        random.below(frame + crop + 1).saturating_sub(crop).min(frame - crop)
    } else {
        random.below(frame - crop + 1)
    }
}

fn symmetry(augment: Augment, random: &mut Random) -> Symmetry {
    let mirror = random.below(2) == 1 && augment.mirror;
    let rolled = random.unit_f64() < augment.roll;
    let turns = 1 + random.below(3) as u64;
    Symmetry { mirror, quarter_turns: if rolled { turns } else { 0 } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::net::ModelConfig;
    use aonet::{Camera, Projection, Size};

    /// Height z(x, y) = a x + b y has normal (-a, -b, 1) up to length: turning the image must turn the normal with it.
    #[test]
    fn symmetries_keep_normals_and_heights_consistent() {
        let side = 5;
        let height = |row: f32, column: f32| 0.3 * column + 0.7 * (side as f32 - 1.0 - row);
        let normal = [-0.3, -0.7, 1.0];
        for mirror in [false, true] {
            for quarter_turns in 0..4 {
                let s = Symmetry { mirror, quarter_turns };
                let turned = |row, column| {
                    let (r, c) = s.source(row, column, side);
                    height(r as f32, c as f32)
                };
                let (dx, dy) = (turned(2, 3) - turned(2, 2), turned(1, 2) - turned(2, 2));
                let n = s.vector(normal);
                assert!(
                    (n[0] + dx).abs() < 1e-5 && (n[1] + dy).abs() < 1e-5,
                    "{s:?}: {n:?} but slope {dx}, {dy}"
                );
            }
        }
    }

    #[test]
    fn encoded_normals_turn_as_normals_do() {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(projection, Size::px(16, 16)).unwrap();
        let depth = (0..256).map(|i| if i == 7 { f32::INFINITY } else { 2.0 }).collect::<Vec<_>>();
        let normal = |i| if i == 7 { [0.0; 3] } else { [0.6, 0.0, 0.8] };
        let gbuffer = GBuffer::new(camera, depth, (0..256).map(normal).collect::<Vec<_>>()).unwrap();
        let crop = |features| {
            let ao = AoImage::open(Size::px(16, 16));
            let sample = Sample::new((&gbuffer, AoParams::new(1.0).unwrap()), &ao, features, None).unwrap();
            sample.crop(Square { x: 0, y: 0, side: 16 }, Symmetry { mirror: true, quarter_turns: 1 })
        };
        let (plain, encoded) = (crop(Features::normal()), crop(Features::normal_encoded()));
        assert_eq!(plain.foreground, encoded.foreground);
        for (i, (n, e)) in plain.features.iter().zip(&encoded.features).enumerate() {
            let expected = 0.5 * (n + 1.0) * plain.foreground[i % 256];
            assert!((e - expected).abs() < 1e-3, "{i}: {n} {e}");
        }
    }

    /// Share of the crops of 48 px that a pixel is in, on a line of 160 px.
    fn covered(config: &TrainConfig, pixel: usize) -> f64 {
        let mut random = Random::of_crop(1, 2, 3);
        let crops: Vec<_> = (0..20_000).map(|_| place(&mut random, config, [160, 48])).collect();
        assert!(crops.iter().all(|from| from + 48 <= 160));
        crops.iter().filter(|&&from| (from..from + 48).contains(&pixel)).count() as f64 / crops.len() as f64
    }

    #[test]
    fn pixels_at_borders_are_in_as_many_crops_as_others() {
        let mut config = TrainConfig::paper(ModelConfig::balanced());
        assert!(covered(&config, 0) < 0.05 * covered(&config, 80));
        config.augment.borders = true;
        for border in [0, 159] {
            let ratio = covered(&config, border) / covered(&config, 80);
            assert!((ratio - 1.0).abs() < 0.1, "{border}: {ratio}");
        }
    }

    #[test]
    fn crops_depend_on_seed_step_and_index_only() {
        let draw = |seed, step, index| Random::of_crop(seed, step, index).bits();
        assert_eq!(draw(1, 2, 3), draw(1, 2, 3));
        let all = [draw(1, 2, 3), draw(2, 2, 3), draw(1, 3, 3), draw(1, 2, 4), draw(1, 3, 2)];
        assert!((1..5).all(|i| !all[..i].contains(&all[i])));
    }
}

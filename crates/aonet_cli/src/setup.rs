//! Parts that several commands share: a model, a scene with a view, the traced reference.

use crate::{output, radius};
use anyhow::{Context, Result, bail};
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{Model, ModelConfig, TrainingFacts, shipped};
use aonet::search::Classic;
use aonet::{AoImage, AoParams, BentNormals, Size};
use aonet_lab::preset::Preset;
use aonet_scene::backend::Rays;
use aonet_scene::gbuffer::Surface;
use aonet_scene::reference::{Sampling, reference_with_bent_normals};
use aonet_scene::scene::MissingNormals;
use aonet_scene::scene::ground::add_ground;
use aonet_scene::scene::procedural;
use aonet_scene::scene::source::SceneSource;
use aonet_scene::staging::{SceneSpec, SceneSplit, propose_view};
use aonet_scene::trace::Tracer;
use aonet_scene::view::{DEFAULT_SEPARATION, Surround};
use aonet_scene::{Error, View};
use std::path::{Path, PathBuf};

/// A scene and a view of it, with overrides.
#[derive(Debug, clap::Args)]
pub(crate) struct SceneArgs {
    /// A .glb or .gltf file, or procedural:KIND:SEED.
    pub(crate) scene: SceneSource,
    /// View (JSON): eye, target, width, height, radius; optional up, fov_y_deg, near, far, ortho_height, margin, separation.
    #[arg(long, value_name = "VIEW.json")]
    pub(crate) view: PathBuf,
    #[command(flatten)]
    pub(crate) size: SizeArgs,
    /// AO radius instead of the view's (world units).
    #[arg(long)]
    pub(crate) radius: Option<f32>,
    #[command(flatten)]
    pub(crate) surround: SurroundArgs,
    /// Put a large floor below the scene's lowest point.
    #[arg(long)]
    pub(crate) ground: bool,
    /// Smooth the normals of meshes that have none, across edges that bend less than 40 degrees.
    #[arg(long)]
    pub(crate) smooth: bool,
}

impl SceneArgs {
    /// Loads the scene and the view.
    pub(crate) fn load(&self) -> Result<(Tracer, View)> {
        let mut view = View::load(&self.view)?;
        [view.width, view.height] = self.size.or([view.width, view.height]);
        view.radius = radius::given_or(self.radius, view.radius)?;
        let view = self.surround.applied(view)?;
        view.camera()?;
        view.params()?;
        let missing = if self.smooth { MissingNormals::CREASE } else { MissingNormals::Flat };
        let mut scene = self.scene.load(missing)?;
        if self.ground {
            add_ground(&mut scene);
        }
        Ok((Tracer::new(scene), view))
    }
}

/// The size of pictures. The defaults are the command's.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct SizeArgs {
    /// Image size (px), such as 1280x720 [default: that of --view, else 1280x720].
    #[arg(long, value_name = "WxH", value_parser = parse_size, conflicts_with_all = ["width", "height"])]
    size: Option<Size>,
    /// Image width (px).
    #[arg(long, value_name = "PX")]
    width: Option<usize>,
    /// Image height (px).
    #[arg(long, value_name = "PX")]
    height: Option<usize>,
}

impl SizeArgs {
    /// The given width and height (px), and for what is not given those of `default`.
    pub(crate) fn or(self, [width, height]: [usize; 2]) -> [usize; 2] {
        match self.size {
            Some(size) => [size.width(), size.height()],
            None => [self.width.unwrap_or(width), self.height.unwrap_or(height)],
        }
    }
}

/// A size (px) from `WxH`.
pub(crate) fn parse_size(text: &str) -> Result<Size> {
    let (width, height) =
        text.split_once('x').ok_or_else(|| anyhow::anyhow!("expected WxH, such as 1280x720"))?;
    Ok(Size::named("--size", width.parse()?, height.parse()?)?)
}

/// What a frame shows besides the visible surfaces of its picture.
#[derive(Debug, clap::Args)]
pub(crate) struct SurroundArgs {
    /// Guard band on each side, as a share of the image's width and height [default: that of --view, else 0].
    #[arg(long, value_name = "SHARE")]
    margin: Option<f32>,
    /// Layers of depth and normals: 2 adds the nearest surface behind the visible one [default: that of --view, else 1].
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u8).range(1..=2))]
    layers: Option<u8>,
    /// Least distance of the second layer behind the first, as a share of the AO radius [default: 0.1].
    #[arg(long, value_name = "SHARE")]
    separation: Option<f32>,
}

impl SurroundArgs {
    /// The given values, and for those that are not given the values of `default`.
    ///
    /// # Errors
    /// When a value is out of range, or a separation is given for a single layer.
    pub(crate) fn or(&self, default: Surround) -> Result<Surround> {
        let separation = match (self.layers, self.separation) {
            (Some(1), Some(_)) => bail!("--separation needs --layers 2: one layer has no separation"),
            (Some(1), None) => None,
            (Some(_), given) => Some(given.or(default.separation).unwrap_or(DEFAULT_SEPARATION)),
            (None, given) => given.or(default.separation),
        };
        let surround = Surround { margin: self.margin.unwrap_or(default.margin), separation };
        surround.check()?;
        Ok(surround)
    }

    /// A view with the given values.
    ///
    /// # Errors
    /// When a value is out of range, or a separation is given for a single layer.
    pub(crate) fn applied(&self, view: View) -> Result<View> {
        let surround = self.or(view.surround())?;
        Ok(view.surrounded(surround))
    }
}

/// A scene and a view of it, both optional: by default the demo's scene.
#[derive(Debug, clap::Args)]
pub(crate) struct StageArgs {
    /// A .glb or .gltf file, or procedural:KIND:SEED.
    #[arg(long)]
    pub(crate) scene: Option<SceneSource>,
    /// View (JSON); otherwise the program places a camera.
    #[arg(long, value_name = "VIEW.json")]
    pub(crate) view: Option<PathBuf>,
    /// The scene is an interior: no floor is added, and the camera is placed between its walls.
    #[arg(long)]
    pub(crate) environment: bool,
    #[command(flatten)]
    pub(crate) size: SizeArgs,
    /// Seed of the camera that the program places.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
}

impl StageArgs {
    /// The scene with its camera.
    pub(crate) fn load(&self) -> Result<(Tracer, View)> {
        let [width, height] = self.size.or([1280, 720]);
        let size = Size::new(width, height)?;
        let resized = |mut view: View| -> Result<View> {
            [view.width, view.height] = self.size.or([view.width, view.height]);
            view.camera()?;
            Ok(view)
        };
        match (&self.scene, &self.view) {
            (None, None) => {
                let (scene, view) = procedural::demo();
                Ok((Tracer::new(scene), resized(view)?))
            }
            (None, Some(_)) => bail!("--view needs --scene: which scene is it a view of?"),
            (Some(source), Some(path)) => {
                let scene = source.load(MissingNormals::CREASE)?;
                Ok((Tracer::new(scene), resized(View::load(path)?)?))
            }
            (Some(SceneSource::Procedural { kind, seed }), None) => {
                Ok(propose_view(&SceneSpec::procedural(*kind, *seed, SceneSplit::Train), size, self.seed)?)
            }
            (Some(SceneSource::Imported), None) => {
                bail!("--scene imported: imported frames have no triangles")
            }
            (Some(SceneSource::File(path)), None) => {
                let spec = SceneSpec::from_file(path, SceneSplit::Train)?.with_environment(self.environment);
                Ok(propose_view(&spec, size, self.seed)?)
            }
        }
    }
}

/// The automatic radius, in image heights.
// guess: contact shadows of furniture in a room.
const RADIUS_ON_SCREEN: f32 = 0.12;

/// A radius (world units) that suits a view.
pub(crate) fn radius_on_screen(surface: &Surface) -> f32 {
    let camera = surface.gbuffer.camera();
    RADIUS_ON_SCREEN * camera.height() as f32 / camera.projected_px(1.0, middle_depth(surface))
}

/// The median depth of the foreground (world units).
pub(crate) fn middle_depth(surface: &Surface) -> f32 {
    let mut depths: Vec<f32> = surface.gbuffer.depth().iter().copied().filter(|d| d.is_finite()).collect();
    depths.sort_by(f32::total_cmp);
    depths.get(depths.len() / 2).copied().unwrap_or(1.0)
}

/// The network of a file or with the name of a shipped one; a file of that name goes first. Without either, `balanced`. [`Taps`] may
/// follow.
pub(crate) fn model(of: Option<&Path>) -> Result<Model> {
    let Some(path) = of else { return Model::from_bytes(shipped::BALANCED).context("the shipped network") };
    let (path, taps) = Taps::after(path);
    let mut model = model_of(path)?;
    let place = || format!("{}{taps}", path.display());
    if let Some([slices, taps]) = taps.search {
        model = model.with_taps(slices, taps).with_context(place)?;
    }
    if let Some([slices, taps]) = taps.survey {
        model = model.with_survey_taps(slices, taps).with_context(place)?;
    }
    Ok(model)
}

fn model_of(path: &Path) -> Result<Model> {
    // `any_radius`: the name of `balanced` before there were three sizes.
    let path = if path == Path::new("any_radius") && !path.is_file() { Path::new("balanced") } else { path };
    let named = shipped::ALL.into_iter().find(|(name, _)| path.as_os_str() == *name);
    if let (false, Some((name, bytes))) = (path.is_file(), named) {
        return Model::from_bytes(bytes).with_context(|| format!("the shipped network {name}"));
    }
    let bytes = std::fs::read(path).map_err(Error::io(path)).context(SHIPPED)?;
    Ok(Model::from_bytes(&bytes).map_err(Error::in_file(path))?)
}

/// Slices and taps that follow a network's name: `:4x8` for its search, `:survey=2x24` for its survey, or both.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Taps {
    search: Option<[u32; 2]>,
    survey: Option<[u32; 2]>,
}

impl Taps {
    /// The network's name, and what follows it. The name is all of it if there is a file of that name.
    fn after(path: &Path) -> (&Path, Self) {
        let mut taps = Self::default();
        let Some(mut name) = path.to_str().filter(|_| !path.is_file()) else { return (path, taps) };
        while let Some((before, part)) = name.rsplit_once(':') {
            let (place, numbers) = match part.strip_prefix("survey=") {
                Some(numbers) => (&mut taps.survey, numbers),
                None => (&mut taps.search, part),
            };
            let number = |text: &str| text.parse().ok();
            let Some([Some(slices), Some(steps)]) =
                numbers.split_once('x').map(|(slices, steps)| [number(slices), number(steps)])
            else {
                break;
            };
            *place = Some([slices, steps]);
            name = before;
        }
        (Path::new(name), taps)
    }
}

impl std::fmt::Display for Taps {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (name, taps) in [("", self.search), ("survey=", self.survey)] {
            if let Some([slices, taps]) = taps {
                write!(f, ":{name}{slices}x{taps}")?;
            }
        }
        Ok(())
    }
}

/// What else a network can be, beside a file that cannot be read.
const SHIPPED: &str = "expected a network: a file, fast, balanced, high or paper, or one of them with slices and taps, such as high:4x16";

/// Seed of the weights of [`untrained`] networks.
const SEED: u64 = 1;

/// A network with random weights, from the configuration of a model or of a training run (JSON). It serves what needs no
/// training, such as run-times. Equal files give equal networks.
pub(crate) fn untrained(path: &Path) -> Result<Model> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let expected = "the configuration of a model, or of training";
    let wrong = |e: serde_json::Error| Error::file(path, expected, e);
    let mut value: serde_json::Value = serde_json::from_slice(&bytes).map_err(wrong)?;
    let model = value.get_mut("model").map(serde_json::Value::take).unwrap_or(value);
    let config: ModelConfig = serde_json::from_value(model).map_err(wrong)?;
    let graph = Graph::new(&config).map_err(Error::in_file(path))?;
    Ok(Model::new(config, Weights::init(&graph, SEED), TrainingFacts::default())?)
}

/// The name of a model file in tables: the file's name without extension, and its slices and taps if they are given.
pub(crate) fn name_of(path: &Path) -> String {
    let (path, taps) = Taps::after(path);
    format!("{}{taps}", path.file_stem().unwrap_or_default().to_string_lossy())
}

/// Traces the reference with a progress bar.
pub(crate) fn reference(
    rays: &mut Rays<'_>,
    surface: &Surface,
    params: AoParams,
    sampling: Sampling,
) -> Result<AoImage> {
    let pixels = surface.gbuffer.depth().iter().filter(|d| d.is_finite()).count() as u64;
    let bar = output::ray_bar(pixels * u64::from(sampling.spp));
    let ao = rays.reference_ao(surface, params, sampling, &|rays| output::traced(&bar, rays))?;
    bar.finish_and_clear();
    Ok(ao)
}

/// Traces the reference with bent normals, on the CPU, with a progress bar.
pub(crate) fn bent_reference(
    tracer: &Tracer,
    surface: &Surface,
    params: AoParams,
    sampling: Sampling,
) -> Result<(AoImage, BentNormals)> {
    let pixels = surface.gbuffer.depth().iter().filter(|d| d.is_finite()).count() as u64;
    let bar = output::ray_bar(pixels * u64::from(sampling.spp));
    let traced = |rays| output::traced(&bar, rays);
    let found = reference_with_bent_normals(tracer, surface, params, sampling, &traced)?;
    bar.finish_and_clear();
    Ok(found)
}

/// The given number of threads, by default all cores.
pub(crate) fn threads(requested: Option<usize>) -> usize {
    requested.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).clamp(1, 1024)
}

/// Threads for work on many frames at once.
pub(crate) fn pool(requested: Option<usize>) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads(requested))
        .build()
        .context("cannot start the threads")
}

/// A method with parameters from a file.
pub(crate) fn preset(path: &Path) -> Result<Classic> {
    Ok(Preset::load(path)?.method)
}

/// A method by name or by preset file.
pub(crate) fn one_classic(name: &str) -> Result<Classic> {
    if name.ends_with(".json") { preset(name.as_ref()) } else { Ok(Classic::named(name)?) }
}

/// Methods by name and by preset file. `all`: every one with its defaults; `all:tuned`: with tuned parameters where there are some.
pub(crate) fn classic(names: &[String]) -> Result<Vec<(String, Classic)>> {
    let mut methods = Vec::new();
    for name in names {
        if name == "all" {
            methods.extend(Classic::all().into_iter().map(|m| (m.name().to_owned(), m)));
        } else if name == "all:tuned" {
            methods.extend(Classic::all().into_iter().map(|m| {
                let tuned = format!("{}:tuned", m.name());
                Classic::named(&tuned).map_or((m.name().to_owned(), m), |found| (tuned, found))
            }));
        } else {
            let method = one_classic(name)?;
            let shown = match name.ends_with(".json") {
                true => format!("{}, {}", method.name(), name_of(name.as_ref())),
                false => name.clone(),
            };
            methods.push((shown, method));
        }
    }
    Ok(methods)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_and_taps_follow_a_colon() {
        let search = |search| Taps { search: Some(search), survey: None };
        let both = Taps { search: Some([4, 8]), survey: Some([2, 24]) };
        for (text, name, taps) in [
            ("high:4x16", "high", search([4, 16])),
            ("C:/runs/best.safetensors:2x8", "C:/runs/best.safetensors", search([2, 8])),
            ("balanced:survey=2x24", "balanced", Taps { search: None, ..both }),
            ("balanced:4x8:survey=2x24", "balanced", both),
            ("balanced:survey=2x24:4x8", "balanced", both),
        ] {
            assert_eq!(Taps::after(Path::new(text)), (Path::new(name), taps), "{text}");
        }
        for whole in
            ["high", "C:/runs/best.safetensors", "high:4", "high:4x", "high:ax16", "high:survey=4", ":"]
        {
            assert_eq!(Taps::after(Path::new(whole)), (Path::new(whole), Taps::default()), "{whole}");
        }
        assert_eq!(name_of(Path::new("runs/best.safetensors:4x16")), "best:4x16");
        assert_eq!(name_of(Path::new("balanced:survey=2x24:4x8")), "balanced:4x8:survey=2x24");
        assert_eq!(name_of(Path::new("runs/best.safetensors")), "best");
    }

    #[test]
    fn taps_that_a_network_cannot_have_are_named() {
        let of = |name: &str| model(Some(Path::new(name))).map(|model| model.config().clone());
        assert_eq!(of("balanced:survey=3x24").unwrap().survey.unwrap().steps, 24);
        assert_eq!(of("balanced:4x8").unwrap().survey, of("balanced").unwrap().survey);
        assert_ne!(of("balanced:4x8").unwrap().search, of("balanced").unwrap().search);
        for (name, part) in [
            ("paper:4x16", "with a search"),
            ("fast:survey=4x16", "with a survey"),
            ("balanced:0x16", "slices"),
            ("absent:4x16", "absent"),
        ] {
            let error = format!("{:#}", of(name).unwrap_err());
            assert!(error.contains(part), "{name}: {error}");
        }
    }
}

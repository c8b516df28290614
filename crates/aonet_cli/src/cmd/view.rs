//! `aonet view`: a scene in motion, with ambient occlusion by the methods that run on a graphics device.

#[cfg(feature = "viewer")]
mod headless;
#[cfg(feature = "viewer")]
mod stage;

#[cfg(feature = "viewer")]
use crate::output;
#[cfg(feature = "viewer")]
use crate::setup::{SizeArgs, SurroundArgs};
use anyhow::Result;
#[cfg(feature = "viewer")]
use aonet_scene::scene::source::SceneSource;
use clap::Parser;
#[cfg(feature = "viewer")]
use std::path::PathBuf;

/// Show a scene with ambient occlusion in a window, or draw it into pictures.
///
/// Without a scene, the scene is procedural. Without --view, the program places a camera. In the window: drag to turn, shift and
/// drag to move, scroll to come nearer, W A S D Q E to walk, drop a .glb or .gltf to load it.
#[derive(Debug, Parser)]
#[command(after_help = help())]
#[cfg(feature = "viewer")]
pub(crate) struct Args {
    /// A .glb or .gltf file, or procedural:KIND:SEED.
    scene: Option<SceneSource>,
    /// View (JSON); otherwise the program places a camera.
    #[arg(long, value_name = "VIEW.json", requires = "scene")]
    view: Option<PathBuf>,
    /// The scene is an interior: no floor is added, and the camera is placed between its walls.
    #[arg(long)]
    environment: bool,
    /// Method that computes visibility.
    #[arg(long, default_value = "balanced")]
    method: String,
    /// Another method, right of the slider.
    #[arg(long, value_name = "METHOD")]
    against: Option<String>,
    /// Place of the slider, in picture widths.
    #[arg(long, default_value_t = 0.5)]
    split: f32,
    /// Picture to draw: shaded, ao, normals, error (method minus reference), second (normals of the second layer), or shares
    /// (of light, as arcs finds them: open, hit, hidden, off the frame), or bent (bent normals).
    #[arg(long, default_value = "shaded")]
    show: String,
    /// Light by bent normals, where the method has some: gtao, agtao, arcs, and the networks but the paper's.
    #[arg(long)]
    bent_normals: bool,
    /// AO radius instead of the view's (world units).
    #[arg(long)]
    radius: Option<f32>,
    #[command(flatten)]
    surround: SurroundArgs,
    #[command(flatten)]
    size: SizeArgs,
    /// Camera path (JSON) with keys of seconds, eye and target, as the window records it.
    #[arg(long, value_name = "P.json")]
    camera_path: Option<PathBuf>,
    /// Draw pictures, without a window.
    #[arg(long, requires = "out")]
    headless: bool,
    /// Number of pictures: along the camera path, or around the middle of the view.
    #[arg(long, default_value_t = 1, requires = "headless")]
    frames: usize,
    /// Folder of the pictures, frame_0000.png and so on.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Rays a pixel of the reference in each picture.
    #[arg(long, default_value_t = 64, requires = "headless")]
    spp: u32,
    /// Also write the G-buffer of each picture, with its guard band and layers: frame_0000.exr and so on.
    #[arg(long, requires = "headless")]
    exr: bool,
    /// Report the time of every pass of each picture, where the device has a clock.
    #[arg(long, requires = "headless")]
    times: bool,
}

/// The methods, and examples.
#[cfg(feature = "viewer")]
fn help() -> String {
    let names = aonet_view::Method::ALL.map(aonet_view::Method::name).join(", ");
    let methods = output::wrapped(&format!("Methods: {names}."), 100).join("\n");
    format!("{methods}\n\n{EXAMPLES}")
}

#[cfg(feature = "viewer")]
const EXAMPLES: &str = "Examples:
  aonet view
  aonet view robot.glb --method agtao:tuned --against reference
  aonet view --headless --frames 1 --size 640x360 --method balanced --against off --out pictures
  aonet view robot.glb --headless --margin 0.15 --layers 2 --exr --times --out deep
  aonet view --headless --method balanced --bent-normals --out pictures
  aonet view hall.glb --headless --camera-path way.json --frames 120 --out film";

/// Show a scene with ambient occlusion in a window: in programs built with `--features viewer`.
#[derive(Debug, Parser)]
#[cfg(not(feature = "viewer"))]
pub(crate) struct Args {
    /// Arguments of a program with the viewer.
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _all: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// When this build cannot draw.
#[cfg(not(feature = "viewer"))]
pub(crate) fn run(_: Args) -> Result<()> {
    anyhow::bail!(
        "cannot show scenes: this program was built without the viewer; build it with `cargo build --release --features viewer`"
    )
}

/// Runs the command.
///
/// # Errors
/// When a file is broken or there is no graphics device, and without --headless, no display.
#[cfg(feature = "viewer")]
pub(crate) fn run(args: Args) -> Result<()> {
    let stage = stage::Stage::new(&args)?;
    match &args.out {
        Some(out) if args.headless => headless::run(&args, stage, out),
        _ => Ok(aonet_view::window::run(stage.into_start())?),
    }
}

//! What the page shows and what its controls do. The page itself, in `page/`, handles the document; this crate uses the
//! renderer, and knows only the canvas of the document.

mod canvas;
mod errors;
mod stage;

use aonet::gpu::Device;
use aonet::{AoParams, Margin, Size, Window};
use aonet_scene::Scene;
use aonet_scene::scene::{MissingNormals, colours, gltf, procedural};
use aonet_scene::trace::Tracer;
use aonet_scene::view::DEFAULT_SEPARATION;
use aonet_view::renderer::{FrameParams, Method, Renderer, Show};
use canvas::Canvas;
use errors::DeviceErrors;
use stage::Stage;
use std::fmt::Display;
use wasm_bindgen::prelude::*;
use wasm_bindgen::throw_str;

/// A scene on a canvas.
#[wasm_bindgen]
pub struct Viewer {
    device: Device,
    canvas: Canvas,
    renderer: Renderer,
    scene: Shown,
    stage: Stage,
    /// Guard band on each side, as a share of the picture.
    margin: f32,
    frame: FrameParams,
    errors: DeviceErrors,
}

/// The scene on the canvas. Building the hierarchy takes a while, so it is built when rays are first needed.
enum Shown {
    Drawn(Scene),
    Traced,
}

/// Rays per pixel of the reference: in one frame, and at most.
// guess: a frame takes as long as a network's on cards without ray tracing units; the standard deviation of 512 rays is 2 % at most.
const SAMPLES: u32 = 4;
const MOST_SAMPLES: u32 = 512;

#[wasm_bindgen]
impl Viewer {
    /// The demo scene on a canvas in the browser's preferred format.
    ///
    /// # Errors
    /// When the browser has no device with WebGPU's default limits, or none for the canvas.
    pub async fn create(canvas: web_sys::HtmlCanvasElement, format: &str) -> Result<Viewer, JsError> {
        // A panic is a bug in aonet: the page shows its text.
        std::panic::set_hook(Box::new(|panic| throw_str(&panic.to_string())));
        let device = Device::request().await.map_err(shown)?;
        let errors = DeviceErrors::of(&device.device);
        let size = Size::new(canvas.width() as usize, canvas.height() as usize).map_err(shown)?;
        let (mut scene, view) = procedural::demo();
        colours::add_plain(&mut scene);
        let renderer = Renderer::new((&device.device, &device.queue), &scene, size).map_err(shown)?;
        let stage = Stage::of_view(&view);
        let mut frame = FrameParams::new(stage.camera(size).map_err(shown)?, view.params().map_err(shown)?);
        frame.far = stage.far;
        let canvas = Canvas::new(&device, canvas, format).map_err(shown)?;
        Ok(Self { device, canvas, renderer, scene: Shown::Drawn(scene), stage, margin: 0.0, frame, errors })
    }

    /// A promise of the device's next error message. After `lost: ..` there are no more.
    pub fn next_error(&self) -> js_sys::Promise {
        self.errors.next()
    }

    /// Follows the canvas to another size (px).
    ///
    /// # Errors
    /// When a side is 0 or too large for the device.
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), JsError> {
        let size = Size::new(width as usize, height as usize).map_err(shown)?;
        self.surround(size, self.margin)?;
        self.canvas.resize(&self.device.device, size);
        Ok(())
    }

    /// Draws a frame; returns a promise that resolves when it is done.
    ///
    /// # Errors
    /// When a method cannot run on the device, or the canvas takes no picture.
    pub fn draw(&mut self) -> Result<js_sys::Promise, JsError> {
        self.frame.camera = self.stage.camera(self.renderer.size()).map_err(shown)?;
        self.frame.samples = SAMPLES.min(MOST_SAMPLES.saturating_sub(self.renderer.samples()));
        self.trace().map_err(shown)?;
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.renderer.encode(&mut encoder, &self.frame).map_err(shown)?;
        self.canvas.show(&self.device, encoder, self.renderer.picture()).map_err(shown)?;
        Ok(errors::end_of(&self.device.queue))
    }

    /// Whether the next frame would show more than the last, though nothing has changed.
    pub fn converges(&self) -> bool {
        self.frame.traces() && self.renderer.samples() < MOST_SAMPLES
    }

    /// Shows a glTF file in one piece: a `.glb`, or a `.gltf` with its buffers inside.
    ///
    /// # Errors
    /// Describes what is wrong with the file; the scene then stays.
    pub fn open(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsError> {
        let named = |error: &dyn Display| JsError::new(&format!("{name}: {error}"));
        let mut scene = gltf::from_bytes(bytes, None, name, MissingNormals::CREASE).map_err(|e| named(&e))?;
        colours::add_plain(&mut scene);
        self.renderer.set_scene(&scene).map_err(|e| named(&e))?;
        self.scene = Shown::Drawn(scene);
        self.stage = Stage::around(self.renderer.bounds());
        self.frame.far = self.stage.far;
        self.set_radius(self.stage.radius)
    }

    /// Names images of the scene that are not shown; empty when all are shown.
    pub fn missing(&self) -> String {
        self.renderer.missing().unwrap_or_default()
    }

    /// Methods left and right of the slider, by name.
    ///
    /// # Errors
    /// When there is no such method.
    pub fn set_methods(&mut self, left: &str, right: &str) -> Result<(), JsError> {
        self.frame.methods = [left.parse().map_err(shown)?, right.parse().map_err(shown)?];
        Ok(())
    }

    /// Place of the slider, from 0 at the left edge to 1.
    pub fn set_split(&mut self, split: f32) {
        self.frame.split = split.clamp(0.0, 1.0);
    }

    /// What is drawn, by name.
    ///
    /// # Errors
    /// When there is no such picture.
    pub fn set_show(&mut self, show: &str) -> Result<(), JsError> {
        self.frame.show = show.parse().map_err(shown)?;
        Ok(())
    }

    /// Guard band on each side, as a share of the picture.
    ///
    /// # Errors
    /// When the picture and its guard band are too large for the device; both then stay.
    pub fn set_margin(&mut self, margin: f32) -> Result<(), JsError> {
        self.surround(self.renderer.size(), margin)?;
        self.margin = margin;
        Ok(())
    }

    /// Whether frames have a second layer.
    pub fn set_second(&mut self, has_second: bool) {
        self.frame.separation = has_second.then_some(DEFAULT_SEPARATION);
    }

    /// The AO radius (world units).
    ///
    /// # Errors
    /// When it is not above 0.
    pub fn set_radius(&mut self, radius: f32) -> Result<(), JsError> {
        self.frame.params = AoParams::new(radius).map_err(shown)?;
        Ok(())
    }

    /// The AO radius (world units).
    pub fn radius(&self) -> f32 {
        self.frame.params.radius()
    }

    /// A length to compare radii with: the radius of the scene (world units).
    pub fn scene_radius(&self) -> f32 {
        self.renderer.bounds().radius()
    }

    /// Turns about the middle by angles (rad): to the left, and up.
    pub fn turn(&mut self, yaw: f32, pitch: f32) {
        self.stage.orbit.turn(yaw, pitch);
    }

    /// Moves the viewer in the plane of the picture by parts of the distance: to the right, and up.
    pub fn pan(&mut self, right: f32, up: f32) {
        self.stage.orbit.pan(right, up);
    }

    /// Multiplies the distance.
    pub fn zoom(&mut self, factor: f32) {
        self.stage.orbit.zoom(factor);
    }

    /// The camera and the AO radius as the command line reads them: `aonet trace SCENE.glb --view VIEW.json`.
    ///
    /// # Errors
    /// Never.
    pub fn view(&self) -> Result<String, JsError> {
        Ok(serde_json::to_string(&self.stage.view(self.renderer.size(), self.radius()))?)
    }

    /// Times of a recent frame's steps on the device (ms), if the device has a clock, and the number of rays of the
    /// reference.
    pub fn times(&self) -> String {
        let steps = self.renderer.times().iter().map(|time| format!("{} {:.1} ms", time.label, time.ms));
        let rays = self.frame.traces().then(|| format!("{} rays a pixel", self.renderer.samples()));
        steps.chain(rays).collect::<Vec<_>>().join(", ")
    }

    /// Name and driver of the graphics device.
    pub fn adapter(&self) -> String {
        let of = &self.device.adapter;
        [&of.name, &of.driver].into_iter().filter(|s| !s.is_empty()).cloned().collect::<Vec<_>>().join(", ")
    }
}

impl Viewer {
    /// Changes the size of the picture and its guard band.
    fn surround(&mut self, size: Size, margin: f32) -> Result<(), JsError> {
        let window = Window::new(size, Margin::share(size, margin)).map_err(shown)?;
        self.renderer.resize(window).map_err(shown)
    }

    /// Gives the renderer the hierarchy when a frame first needs rays.
    fn trace(&mut self) -> aonet_view::Result<()> {
        let Shown::Drawn(scene) = &mut self.scene else { return Ok(()) };
        if !self.frame.traces() {
            return Ok(());
        }
        let tracer = Tracer::new(std::mem::take(scene));
        self.scene = Shown::Traced;
        self.renderer.set_tracer(&tracer)
    }
}

/// Names of the methods in the order of their titles.
#[wasm_bindgen]
pub fn method_names() -> Vec<String> {
    Method::ALL.map(|method| method.name().to_owned()).into()
}

/// Titles of the methods.
#[wasm_bindgen]
pub fn method_titles() -> Vec<String> {
    Method::ALL.map(|method| method.title().to_owned()).into()
}

/// Names of the pictures.
#[wasm_bindgen]
pub fn show_names() -> Vec<String> {
    Show::ALL.map(|show| show.name().to_owned()).into()
}

fn shown(error: impl Display) -> JsError {
    JsError::new(&error.to_string())
}

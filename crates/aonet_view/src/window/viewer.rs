//! What the window shows and how the camera moves. Nothing here is on the device, so a lost device does not reset it.

use super::Start;
use super::graph::History;
use super::load::{Loaded, Loading, coloured};
use crate::renderer::{CameraPath, FrameParams, Method, Orbit, Show};
use crate::{Error, Result};
use aonet::frame::MAX_SIDE;
use aonet::{AoParams, Margin, Size, Window};
use aonet_scene::View;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use glam::Vec3;
use std::collections::HashSet;
use std::time::{Duration, Instant};
use winit::keyboard::KeyCode;

/// Rays per pixel that a comparison needs.
// guess: their noise is below the differences between methods; `aonet demo` uses half as many.
pub(super) const SCORE_SAMPLES: u32 = 256;

/// Shortest time between keys of a recorded path.
const KEY_SPACING: f32 = 0.1;

/// Settings of the window.
#[derive(Debug)]
pub(super) struct Viewer {
    pub(super) tracer: Tracer,
    /// Field of view, planes, guard band and separation; camera and radius at the start.
    pub(super) view: View,
    pub(super) orbit: Orbit,
    pub(super) methods: [Method; 2],
    pub(super) split: f32,
    pub(super) show: Show,
    pub(super) bent_normals: bool,
    /// AO radius (world units).
    pub(super) radius: f32,
    /// Texels of the frame per pixel of the window, along a side.
    pub(super) scale: f32,
    /// Rays per pixel of the reference in each frame.
    pub(super) samples: u32,
    pub(super) controls: bool,
    pub(super) message: String,
    pub(super) history: History,
    pub(super) held: HashSet<KeyCode>,
    pub(super) loading: Option<Loading>,
    /// Whether to compare the methods with the reference when it has converged.
    pub(super) wants_scores: bool,
    pub(super) way: CameraPath,
    pub(super) motion: Motion,
}

/// What moves the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    /// Mouse and keyboard.
    Free,
    /// Mouse and keyboard, recorded since this time.
    Recording(Instant),
    /// The recorded path, replayed since this time.
    Replaying(Instant),
}

impl Viewer {
    pub(super) fn new(start: Start) -> Self {
        let Start { tracer, view, methods, split, show, bent_normals, way } = start;
        let replays = way.is_some();
        Self {
            tracer: coloured(tracer.scene().clone()),
            orbit: Orbit::of_view(&view),
            radius: view.radius,
            view,
            methods,
            split,
            show,
            bent_normals,
            scale: 1.0,
            samples: 2,
            controls: true,
            message: String::new(),
            history: History::default(),
            held: HashSet::new(),
            loading: None,
            wants_scores: false,
            way: way.unwrap_or_default(),
            motion: if replays { Motion::Replaying(Instant::now()) } else { Motion::Free },
        }
    }

    /// The current frame for `size`.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub(super) fn frame(&self, size: Size) -> Result<FrameParams> {
        let camera = self.orbit.camera(self.view.fov_y_deg.to_radians(), size, self.view.near)?;
        Ok(FrameParams {
            camera,
            far: self.view.far,
            params: AoParams::new(self.radius)?,
            methods: self.methods,
            split: self.split,
            show: self.show,
            bent_normals: self.bent_normals,
            separation: self.view.separation,
            // While scores are pending, rays matter more than the frame rate.
            samples: if self.wants_scores { self.samples.max(16) } else { self.samples },
            traced: self.wants_scores,
        })
    }

    /// Size of the frames in a window of a size, and their guard band; with it no side is above `most` (px).
    ///
    /// # Errors
    /// When the guard band leaves no picture.
    pub(super) fn frame_window(&self, window: Size, most: usize) -> Result<Window> {
        let share = self.view.margin;
        let most = most.min(MAX_SIDE) as f32;
        // A margin is rounded, by half a pixel on each side.
        let most = if share > 0.0 { ((most - 1.0) / (1.0 + 2.0 * share)).floor() } else { most };
        let side = |pixels: usize| (pixels as f32 * self.scale).round().clamp(1.0, most) as usize;
        let size = Size::px(side(window.width()), side(window.height()));
        Ok(Window::new(size, Margin::share(size, share))?)
    }

    /// Moves the camera by pressed keys or the recorded path.
    pub(super) fn advance(&mut self, since_last: Duration) {
        let now = Instant::now();
        match self.motion {
            Motion::Free => self.walk(since_last.as_secs_f32()),
            Motion::Recording(since) => {
                self.walk(since_last.as_secs_f32());
                let seconds = (now - since).as_secs_f32();
                if self.way.keys.is_empty() || seconds >= self.way.span().1 + KEY_SPACING {
                    self.way.record(seconds, &self.orbit);
                }
            }
            Motion::Replaying(since) => {
                let (first, last) = self.way.span();
                let seconds = first + (now - since).as_secs_f32();
                self.orbit = self.way.at(seconds).unwrap_or(self.orbit);
                if seconds >= last {
                    self.motion = Motion::Free;
                }
            }
        }
    }

    /// Moves by keys as in games: W A S D walk, Q and E move down and up, shift is faster.
    fn walk(&mut self, seconds: f32) {
        let held = |key| f32::from(u8::from(self.held.contains(&key)));
        let step = Vec3::new(
            held(KeyCode::KeyD) - held(KeyCode::KeyA),
            held(KeyCode::KeyE) - held(KeyCode::KeyQ),
            held(KeyCode::KeyW) - held(KeyCode::KeyS),
        );
        let hurry = if self.held.contains(&KeyCode::ShiftLeft) { 4.0 } else { 1.0 };
        // guess: the target is reached within two seconds. A stalled frame must not cause a jump.
        self.orbit.walk(step * hurry * 0.5 * self.orbit.distance * seconds.min(0.25));
    }

    /// Starts or stops recording a path; returns a finished one, to be saved.
    pub(super) fn toggle_record(&mut self) -> Option<&CameraPath> {
        if let Motion::Recording(_) = self.motion {
            self.motion = Motion::Free;
            return Some(&self.way).filter(|way| !way.keys.is_empty());
        }
        self.way = CameraPath::default();
        self.motion = Motion::Recording(Instant::now());
        self.message = "recording the camera's way".into();
        None
    }

    /// Starts or stops replaying the recorded path.
    pub(super) fn toggle_replay(&mut self) {
        self.motion = match self.motion {
            Motion::Replaying(_) => Motion::Free,
            _ if self.way.keys.is_empty() => {
                self.message = "nothing is recorded yet".into();
                Motion::Free
            }
            _ => Motion::Replaying(Instant::now()),
        };
    }

    /// Starts reading a dropped file.
    pub(super) fn open(&mut self, path: std::path::PathBuf) {
        self.message = format!("reading {}", path.display());
        self.loading = Some(Loading::start(path, &self.view));
    }

    /// Takes a scene that has been read; returns whether there is a new one.
    pub(super) fn take_loaded(&mut self) -> bool {
        let Some(loaded) = self.loading.as_ref().and_then(Loading::poll) else { return false };
        let path = self.loading.take().map(|loading| loading.path).unwrap_or_default();
        match loaded {
            Ok(loaded) => {
                let triangles = loaded.0.scene().triangle.len();
                self.message = format!("{}: {triangles} triangles", path.display());
                self.show_scene(loaded);
                true
            }
            Err(error) => {
                self.message = format!("cannot show it: {error}");
                false
            }
        }
    }

    fn show_scene(&mut self, (tracer, view): Loaded) {
        self.orbit = Orbit::of_view(&view);
        self.radius = view.radius;
        let surround = Surround { margin: self.view.margin, separation: self.view.separation };
        (self.tracer, self.view) = (tracer, view.surrounded(surround));
        self.way = CameraPath::default();
        self.motion = Motion::Free;
    }

    /// Adds missing images of a scene to the message.
    pub(super) fn name_missing(&mut self, images: Option<String>) {
        let Some(images) = images else { return };
        let begin = if self.message.is_empty() { "" } else { "\n" };
        self.message += &format!("{begin}{images}");
    }

    /// Shows an error as the message.
    pub(super) fn complain(&mut self, error: &Error) {
        self.message = error.to_string();
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use aonet_scene::Scene;

    /// A triangle in a window.
    pub(in super::super) fn viewer() -> Viewer {
        Viewer::new(start())
    }

    pub(in super::super) fn start() -> Start {
        let position = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let scene =
            Scene { position, normal: vec![Vec3::Z; 3], triangle: vec![[0, 1, 2]], ..Scene::default() };
        let text = br#"{"eye": [0, 0, 3], "target": [0, 0, 0], "width": 200, "height": 100, "radius": 0.5}"#;
        let view = serde_json::from_slice(text).unwrap();
        let methods = [Method::Gtao, Method::Balanced];
        let (split, show, way) = (0.5, Show::Shaded, None);
        Start { tracer: Tracer::new(scene), view, methods, split, show, bent_normals: false, way }
    }

    #[test]
    fn held_keys_walk_and_stalls_are_no_leaps() {
        let mut viewer = viewer();
        viewer.held.insert(KeyCode::KeyW);
        viewer.advance(Duration::from_millis(100));
        assert!((viewer.orbit.eye().z - 2.85).abs() < 1e-4, "{}", viewer.orbit.eye());
        viewer.advance(Duration::from_secs(3600));
        assert!(viewer.orbit.eye().z > 2.0, "{}", viewer.orbit.eye());
    }

    #[test]
    fn a_way_is_recorded_and_gone() {
        let mut viewer = viewer();
        viewer.toggle_replay();
        assert_eq!((viewer.motion, viewer.message.as_str()), (Motion::Free, "nothing is recorded yet"));
        assert!(viewer.toggle_record().is_none());
        viewer.advance(Duration::ZERO);
        let begin = viewer.orbit;
        assert_eq!(viewer.toggle_record().map(|way| way.keys.len()), Some(1));
        viewer.orbit.turn(1.0, 0.0);
        viewer.toggle_replay();
        viewer.advance(Duration::ZERO);
        assert!(viewer.orbit.eye().distance(begin.eye()) < 1e-4);
        assert_eq!(viewer.motion, Motion::Free);
    }

    #[test]
    fn a_broken_file_is_a_message_and_the_scene_stays() {
        let mut viewer = viewer();
        viewer.open("no/such.glb".into());
        let since = Instant::now();
        while viewer.loading.is_some() && since.elapsed() < Duration::from_secs(60) {
            assert!(!viewer.take_loaded());
        }
        assert!(viewer.message.contains("such.glb"), "{}", viewer.message);
        assert_eq!(viewer.tracer.scene().triangle.len(), 1);
    }

    #[test]
    fn missing_images_are_named_after_what_was_said() {
        let mut viewer = viewer();
        viewer.name_missing(None);
        assert_eq!(viewer.message, "");
        viewer.name_missing(Some("not shown: a".into()));
        viewer.name_missing(Some("not shown: b".into()));
        assert_eq!(viewer.message, "not shown: a\nnot shown: b");
    }

    #[test]
    fn frames_have_a_size_at_any_scale() {
        let mut viewer = viewer();
        let size = |viewer: &Viewer, window| viewer.frame_window(window, 8192).unwrap().size();
        assert_eq!(size(&viewer, Size::px(201, 100)), Size::px(201, 100));
        viewer.scale = 0.25;
        assert_eq!(
            [Size::px(201, 100), Size::px(1, 1)].map(|window| size(&viewer, window)),
            [Size::px(50, 25), Size::px(1, 1)]
        );
        viewer.scale = 2.0;
        assert_eq!(size(&viewer, Size::px(5000, 100)), Size::px(8192, 200));
    }

    #[test]
    fn guard_bands_follow_the_frame_and_fit_the_device() {
        let mut viewer = viewer();
        viewer.view.margin = 0.15;
        let window = viewer.frame_window(Size::px(200, 100), 8192).unwrap();
        assert_eq!((window.size(), window.margin()), (Size::px(200, 100), Margin { x: 30, y: 15 }));
        for share in [0.1, 0.15, 0.33, 1.0] {
            viewer.view.margin = share;
            for most in [64, 8191, 8192] {
                let sides = viewer.frame_window(Size::px(9000, 9000), most).unwrap().buffer_size();
                assert!(sides.width() <= most && sides.width() + 4 > most, "{share} {most}: {sides}");
            }
        }
    }

    #[test]
    fn another_scene_keeps_guard_band_and_layers() {
        let mut viewer = viewer();
        (viewer.view.margin, viewer.view.separation) = (0.25, Some(0.5));
        let Start { tracer, view, .. } = start();
        viewer.show_scene((tracer, view));
        assert_eq!((viewer.view.margin, viewer.view.separation), (0.25, Some(0.5)));
        let frame = viewer.frame(Size::px(20, 10)).unwrap();
        assert_eq!(frame.separation, Some(0.5));
    }
}

//! A device and frames for the tests of the renderer. Without a device a test says that it was skipped; with
//! `AONET_REQUIRE_GPU=1` it fails.
#![allow(dead_code, reason = "each test program uses some of it")]

use aonet::gpu::Device;
use aonet::{Size, Window};
use aonet_scene::scene::colours;
use aonet_scene::scene::procedural::{self, Kind};
use aonet_scene::staging::{SceneSpec, SceneSplit, propose_view};
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use aonet_view::{FrameParams, Renderer};

/// A device, or none with a message.
pub(crate) fn device() -> Option<Device> {
    match Device::wait_for() {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// The room of `aonet demo` in plain colours, small.
pub(crate) fn demo(size: Size) -> (Tracer, View) {
    let (mut scene, view) = procedural::demo();
    colours::add_plain(&mut scene);
    (Tracer::new(scene), View { width: size.width(), height: size.height(), ..view })
}

/// A scene and a view of it that a dataset could contain.
pub(crate) fn proposed(kind: Kind, size: Size) -> (Tracer, View) {
    propose_view(&SceneSpec::procedural(kind, 3, SceneSplit::Train), size, 5).unwrap()
}

pub(crate) fn renderer(device: &Device, scene: &Scene, window: impl Into<Window>) -> Renderer {
    Renderer::on(device, scene, window).unwrap()
}

/// The picture and the guard band of a view.
pub(crate) fn window(view: &View) -> Window {
    Window::new(view.size().unwrap(), view.margin_px().unwrap()).unwrap()
}

/// A frame of a view.
pub(crate) fn frame(view: &View) -> FrameParams {
    FrameParams {
        far: view.far,
        separation: view.separation,
        ..FrameParams::new(view.camera().unwrap(), view.params().unwrap())
    }
}

/// Draws a frame.
pub(crate) fn draw(device: &Device, renderer: &mut Renderer, frame: &FrameParams) {
    let mut encoder = device.device.create_command_encoder(&Default::default());
    renderer.encode(&mut encoder, frame).unwrap();
    device.queue.submit([encoder.finish()]);
}

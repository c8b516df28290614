//! The window: an interactive camera, a panel of controls, dropped and written files.

mod app;
mod controls;
mod graph;
mod input;
mod load;
mod save;
mod screen;
mod surface;
mod viewer;

use crate::renderer::CameraPath;
use crate::{Error, Method, Result, Show};
use aonet_scene::View;
use aonet_scene::trace::Tracer;
use winit::event_loop::{ControlFlow, EventLoop};

/// The start of a window.
#[derive(Debug)]
pub struct Start {
    /// The scene.
    pub tracer: Tracer,
    /// Camera, AO radius, guard band, separation of the second layer, and the size of the window (px).
    pub view: View,
    /// The methods left and right of the slider.
    pub methods: [Method; 2],
    /// Place of the slider in window widths, in [0, 1]; at 1 only the first method is shown.
    pub split: f32,
    /// The picture that is drawn.
    pub show: Show,
    /// Whether ambient light comes from about bent normals.
    pub bent_normals: bool,
    /// A camera path that is replayed at the start.
    pub way: Option<CameraPath>,
}

/// Opens a window and shows it until it is closed. It writes files into the current folder.
///
/// # Errors
/// When there is no display, no graphics device, or not enough memory on it.
pub fn run(start: Start) -> Result<()> {
    let no_display = |e: &dyn std::fmt::Display| Error::request("window", "a display", e);
    let events = EventLoop::new().map_err(|e| no_display(&e))?;
    events.set_control_flow(ControlFlow::Wait);
    let mut app = app::App::new(start);
    events.run_app(&mut app).map_err(|e| no_display(&e))?;
    app.end()
}

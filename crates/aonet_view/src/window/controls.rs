//! The panel of controls.

use super::input::Request;
use super::viewer::{Motion, Viewer};
use crate::renderer::{Method, Show};
use aonet::Window as FrameWindow;
use aonet_scene::view::{DEFAULT_SEPARATION, MAX_SEPARATION};
use egui::{ComboBox, Context, Slider, Ui, Window};

/// Width and height of the panel (points) with a message of a few lines. In a lower window the panel scrolls.
const SIZE: [f32; 2] = [290.0, 670.0];

/// Facts about the frame that the controls display.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facts {
    pub(super) window: FrameWindow,
    /// Rays a pixel of the reference so far.
    pub(super) samples: u32,
    /// Whether the device times passes.
    pub(super) has_clock: bool,
}

/// Shows the controls; returns a request that the viewer cannot serve alone.
pub(super) fn show(context: &Context, viewer: &mut Viewer, facts: Facts) -> Option<Request> {
    if !viewer.controls {
        return None;
    }
    let panel = Window::new("aonet").default_pos([12.0, 12.0]).default_size(SIZE).vscroll(true);
    let shown = panel.show(context, |ui| {
        methods(ui, viewer);
        ui.separator();
        numbers(ui, viewer);
        surround(ui, viewer);
        ui.separator();
        let request = buttons(ui, viewer);
        if !viewer.message.is_empty() {
            ui.label(&viewer.message);
        }
        ui.separator();
        ui.label(format!("{} px, reference: {} rays", facts.window.size(), facts.samples));
        if facts.window.has_margin() {
            ui.label(format!("{} px with the guard band", facts.window.buffer_size()));
        }
        if facts.has_clock {
            viewer.history.show(ui);
        } else {
            ui.label("This device does not time passes.");
        }
        request
    });
    shown.and_then(|window| window.inner).flatten()
}

fn methods(ui: &mut Ui, viewer: &mut Viewer) {
    for (method, side) in viewer.methods.iter_mut().zip(["left", "right"]) {
        ComboBox::from_label(side).selected_text(method.title()).show_ui(ui, |ui| {
            for other in Method::ALL {
                ui.selectable_value(method, other, other.title());
            }
        });
    }
    ui.add(Slider::new(&mut viewer.split, 0.0..=1.0).text("slider"));
    ui.horizontal_wrapped(|ui| {
        for show in Show::ALL {
            ui.selectable_value(&mut viewer.show, show, show.name());
        }
    });
    ui.checkbox(&mut viewer.bent_normals, "light by bent normals");
}

fn numbers(ui: &mut Ui, viewer: &mut Viewer) {
    let begin = viewer.view.radius;
    ui.add(Slider::new(&mut viewer.radius, 0.02 * begin..=10.0 * begin).logarithmic(true).text("AO radius"));
    ui.add(Slider::new(&mut viewer.scale, 0.25..=2.0).text("resolution"));
    ui.add(Slider::new(&mut viewer.samples, 1..=64).logarithmic(true).text("rays a frame"));
}

/// What frames show besides the visible surfaces of the picture.
fn surround(ui: &mut Ui, viewer: &mut Viewer) {
    let view = &mut viewer.view;
    ui.add(Slider::new(&mut view.margin, 0.0..=1.0).text("guard band"));
    let mut has_second = view.separation.is_some();
    if ui.checkbox(&mut has_second, "second layer").changed() {
        view.separation = has_second.then_some(DEFAULT_SEPARATION);
    }
    if let Some(separation) = &mut view.separation {
        ui.add(Slider::new(separation, 0.0..=MAX_SEPARATION).logarithmic(true).text("separation, in radii"));
    }
}

fn buttons(ui: &mut Ui, viewer: &mut Viewer) -> Option<Request> {
    let (record, replay) = match viewer.motion {
        Motion::Free => ("record (R)", "replay (T)"),
        Motion::Recording(_) => ("stop and save (R)", "replay (T)"),
        Motion::Replaying(_) => ("record (R)", "stop (T)"),
    };
    let rows = [
        vec![
            ("picture (P)", Request::Screenshot),
            ("frame (F)", Request::Export),
            ("score (C)", Request::Score),
        ],
        vec![(record, Request::Record), (replay, Request::Replay)],
    ];
    let mut request = None;
    for row in rows {
        ui.horizontal(|ui| {
            for (text, what) in row {
                if ui.button(text).clicked() {
                    request = Some(what);
                }
            }
        });
    }
    request
}

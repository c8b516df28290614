//! Mice and keys: what they do to the camera and to the slider.

use super::viewer::{Motion, Viewer};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};

/// Turn of a drag over the height of the window [rad]. guess: half a turn.
const TURN: f32 = std::f32::consts::PI;

/// Distance from the slider at which it is taken hold of [px].
const GRAB: f64 = 8.0;

/// What a pressed mouse moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Drag {
    Turn,
    Look,
    Pan,
    Slide,
}

/// Where the mouse is and what it holds.
#[derive(Debug, Default)]
pub(super) struct Mouse {
    at: (f64, f64),
    drag: Option<Drag>,
}

/// What a key asks of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Request {
    /// A picture of the frame.
    Screenshot,
    /// The G-buffer and the reference.
    Export,
    /// SSIM and PSNR.
    Score,
    /// Begin or end the record of the camera's way.
    Record,
    /// Begin or end to go it.
    Replay,
}

impl Mouse {
    /// Follows an event in a window of `size` [px].
    pub(super) fn on(&mut self, event: &WindowEvent, (width, height): (u32, u32), viewer: &mut Viewer) {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let (dx, dy) = (position.x - self.at.0, position.y - self.at.1);
                self.at = (position.x, position.y);
                let unit = f64::from(height.max(1));
                self.moved(((dx / unit) as f32, (dy / unit) as f32), f64::from(width.max(1)), viewer);
            }
            WindowEvent::MouseInput { state: ElementState::Released, .. } | WindowEvent::Focused(false) => {
                self.drag = None;
            }
            WindowEvent::MouseInput { button, .. } => {
                let slider = f64::from(viewer.split) * f64::from(width);
                let shift = viewer.held.contains(&KeyCode::ShiftLeft);
                self.drag = match button {
                    MouseButton::Left if (self.at.0 - slider).abs() <= GRAB => Some(Drag::Slide),
                    MouseButton::Left if !shift => Some(Drag::Turn),
                    MouseButton::Left | MouseButton::Middle => Some(Drag::Pan),
                    MouseButton::Right => Some(Drag::Look),
                    _ => None,
                };
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, y) => *y,
                    // guess: a line of text.
                    MouseScrollDelta::PixelDelta(by) => by.y as f32 / 20.0,
                };
                viewer.orbit.zoom(0.9f32.powf(lines));
            }
            _ => {}
        }
    }

    /// `by` is in window heights.
    fn moved(&mut self, (dx, dy): (f32, f32), width: f64, viewer: &mut Viewer) {
        let Some(drag) = self.drag else { return };
        if let (Motion::Replaying(_), false) = (viewer.motion, drag == Drag::Slide) {
            viewer.motion = Motion::Free;
        }
        // A picture is as high as twice the tangent at the distance of what is looked at.
        let seen = 2.0 * (0.5 * viewer.view.fov_y_deg.to_radians()).tan();
        match drag {
            Drag::Turn => viewer.orbit.turn(-TURN * dx, -TURN * dy),
            Drag::Look => viewer.orbit.look(-TURN * dx, -TURN * dy),
            Drag::Pan => viewer.orbit.pan(-seen * dx, seen * dy),
            Drag::Slide => viewer.split = (self.at.0 / width).clamp(0.0, 1.0) as f32,
        }
    }
}

/// Follows a key; some ask for more than the viewer can do.
pub(super) fn key(event: &WindowEvent, viewer: &mut Viewer) -> Option<Request> {
    if let WindowEvent::Focused(false) = event {
        viewer.held.clear();
    }
    let WindowEvent::KeyboardInput { event, .. } = event else { return None };
    let PhysicalKey::Code(code) = event.physical_key else { return None };
    if event.state == ElementState::Released {
        viewer.held.remove(&code);
        return None;
    }
    viewer.held.insert(code);
    if event.repeat {
        return None;
    }
    pressed(code, viewer)
}

fn pressed(code: KeyCode, viewer: &mut Viewer) -> Option<Request> {
    let shows = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4];
    if let Some(i) = shows.iter().position(|key| *key == code) {
        viewer.show = crate::Show::ALL[i];
    }
    match code {
        KeyCode::KeyH => viewer.controls = !viewer.controls,
        KeyCode::KeyX => viewer.methods.swap(0, 1),
        KeyCode::KeyP => return Some(Request::Screenshot),
        KeyCode::KeyF => return Some(Request::Export),
        KeyCode::KeyC => return Some(Request::Score),
        KeyCode::KeyR => return Some(Request::Record),
        KeyCode::KeyT => return Some(Request::Replay),
        _ => {}
    }
    None
}

//! Mouse and keyboard: they move the camera and the slider.

use super::viewer::{Motion, Viewer};
use aonet::Size;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};

/// Turn of a drag over the height of the window (rad). guess: half a turn.
const TURN: f32 = std::f32::consts::PI;

/// Distance at which the mouse grabs the slider (px).
const GRAB: f64 = 8.0;

/// What a drag moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Drag {
    Turn,
    Look,
    Pan,
    Slide,
}

/// Position of the mouse, and the drag.
#[derive(Debug, Default)]
pub(super) struct Mouse {
    at: (f64, f64),
    drag: Option<Drag>,
}

/// A request of a key or control to the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Request {
    /// A picture of the frame.
    Screenshot,
    /// The G-buffer and the reference.
    Export,
    /// SSIM and PSNR.
    Score,
    /// Start or stop recording the camera path.
    Record,
    /// Start or stop replaying it.
    Replay,
}

impl Mouse {
    /// Handles an event in a window of `size`.
    pub(super) fn on(&mut self, event: &WindowEvent, size: Size, viewer: &mut Viewer) {
        let (width, height) = (size.width() as f64, size.height() as f64);
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let (dx, dy) = (position.x - self.at.0, position.y - self.at.1);
                self.at = (position.x, position.y);
                self.moved(((dx / height) as f32, (dy / height) as f32), width, viewer);
            }
            WindowEvent::MouseInput { state: ElementState::Released, .. } | WindowEvent::Focused(false) => {
                self.drag = None;
            }
            WindowEvent::MouseInput { button, .. } => {
                let slider = f64::from(viewer.split) * width;
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
        // The picture's height at the target's distance is twice the tangent times that distance.
        let seen = 2.0 * (0.5 * viewer.view.fov_y_deg.to_radians()).tan();
        match drag {
            Drag::Turn => viewer.orbit.turn(-TURN * dx, -TURN * dy),
            Drag::Look => viewer.orbit.look(-TURN * dx, -TURN * dy),
            Drag::Pan => viewer.orbit.pan(-seen * dx, seen * dy),
            Drag::Slide => viewer.split = (self.at.0 / width).clamp(0.0, 1.0) as f32,
        }
    }
}

/// Whether a button or a key was released.
pub(super) fn is_release(event: &WindowEvent) -> bool {
    match event {
        WindowEvent::MouseInput { state, .. } => *state == ElementState::Released,
        WindowEvent::KeyboardInput { event, .. } => event.state == ElementState::Released,
        _ => false,
    }
}

/// Handles a key; returns a request that the viewer cannot serve alone.
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
    use KeyCode::{Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7};
    let shows: [_; crate::Show::ALL.len()] = [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7];
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

#[cfg(test)]
mod tests {
    use super::super::viewer::tests::viewer;
    use super::*;
    use winit::dpi::PhysicalPosition;
    use winit::event::DeviceId;

    const SIZE: Size = Size::px(200, 100);

    fn to(x: f64, y: f64) -> WindowEvent {
        WindowEvent::CursorMoved { device_id: DeviceId::dummy(), position: PhysicalPosition::new(x, y) }
    }

    fn mouse(button: MouseButton, state: ElementState) -> WindowEvent {
        WindowEvent::MouseInput { device_id: DeviceId::dummy(), state, button }
    }

    /// Drags from a place to another one.
    fn drag(viewer: &mut Viewer, button: MouseButton, [from, by]: [(f64, f64); 2]) {
        let (pressed, released) =
            (mouse(button, ElementState::Pressed), mouse(button, ElementState::Released));
        let mut mouse = Mouse::default();
        let moves = [to(from.0, from.1), pressed, to(from.0 + by.0, from.1 + by.1), released, to(0.0, 0.0)];
        moves.iter().for_each(|event| mouse.on(event, SIZE, viewer));
    }

    #[test]
    fn drags_turn_look_pan_and_slide() {
        let begin = viewer();
        let dragged = |button, from| {
            let mut viewer = viewer();
            drag(&mut viewer, button, [from, (25.0, 0.0)]);
            viewer
        };
        let turned = dragged(MouseButton::Left, (10.0, 50.0));
        assert!((turned.orbit.yaw - begin.orbit.yaw + 0.25 * TURN).abs() < 1e-5);
        assert!(turned.orbit.target.distance(begin.orbit.target) < 1e-5);
        let looked = dragged(MouseButton::Right, (10.0, 50.0));
        assert!(looked.orbit.eye().distance(begin.orbit.eye()) < 1e-4 && looked.orbit.yaw != begin.orbit.yaw);
        let panned = dragged(MouseButton::Middle, (10.0, 50.0));
        assert!(panned.orbit.yaw == begin.orbit.yaw && panned.orbit.target != begin.orbit.target);
        let slid = dragged(MouseButton::Left, (103.0, 50.0));
        assert!((slid.split - 0.64).abs() < 1e-6 && slid.orbit == begin.orbit, "{}", slid.split);
    }

    #[test]
    fn panning_keeps_what_is_looked_at_below_the_mouse() {
        let mut viewer = viewer();
        let before = viewer.orbit.target;
        drag(&mut viewer, MouseButton::Middle, [(20.0, 50.0), (10.0, -20.0)]);
        let camera = viewer.frame(SIZE).unwrap().camera;
        let p = camera.view_from_world().transform_point3(before);
        let (x, y) = (p.x / -p.z * camera.focal_px()[0], p.y / -p.z * camera.focal_px()[1]);
        assert!((x - 10.0).abs() < 0.01 && (y - 20.0).abs() < 0.01, "{x} {y}");
    }

    #[test]
    fn keys_choose_and_ask() {
        let mut viewer = viewer();
        assert_eq!(pressed(KeyCode::Digit3, &mut viewer), None);
        assert_eq!(viewer.show, crate::Show::Normals);
        let methods = viewer.methods;
        pressed(KeyCode::KeyX, &mut viewer);
        assert_eq!(viewer.methods, [methods[1], methods[0]]);
        pressed(KeyCode::KeyH, &mut viewer);
        assert!(!viewer.controls);
        assert_eq!(pressed(KeyCode::KeyP, &mut viewer), Some(Request::Screenshot));
        assert_eq!(pressed(KeyCode::KeyZ, &mut viewer), None);
    }
}

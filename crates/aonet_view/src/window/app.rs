//! The event loop of the window: events in, frames out, and recovery from a lost device.

use super::Start;
use super::input::{self, Mouse};
use super::screen::Screen;
use super::viewer::Viewer;
use crate::{Error, Result};
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::ActiveEventLoop;
use winit::window::{Window, WindowId};

/// A program with one window.
pub(super) struct App {
    viewer: Viewer,
    screen: Option<Screen>,
    mouse: Mouse,
    last: Instant,
    failed: Option<Error>,
}

impl App {
    pub(super) fn new(start: Start) -> Self {
        let (viewer, mouse) = (Viewer::new(start), Mouse::default());
        Self { viewer, screen: None, mouse, last: Instant::now(), failed: None }
    }

    /// The outcome of the event loop.
    ///
    /// # Errors
    /// When an error ended it; closing the window is none.
    pub(super) fn end(self) -> Result<()> {
        self.failed.map_or(Ok(()), Err)
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let size = PhysicalSize::new(self.viewer.view.width as u32, self.viewer.view.height as u32);
        let attributes = Window::default_attributes().with_title("aonet").with_inner_size(size);
        let window = match self.screen.take() {
            // The window stays when its device is lost.
            Some(screen) => screen.window,
            None => {
                let window = events.create_window(attributes);
                Arc::new(window.map_err(|e| Error::request("window", "a display that opens one", e))?)
            }
        };
        self.screen = Some(Screen::new(window, &mut self.viewer)?);
        Ok(())
    }

    fn redraw(&mut self, events: &ActiveEventLoop) {
        let Some(screen) = &mut self.screen else { return };
        if screen.surface.is_lost() {
            self.viewer.message = "the graphics device was lost; this is a new one".into();
            self.stop_on(events, Self::open);
            return;
        }
        let now = Instant::now();
        self.viewer.advance(now - self.last);
        self.last = now;
        if self.viewer.take_loaded()
            && let Err(error) = screen.show_scene(&mut self.viewer)
        {
            self.viewer.complain(&error);
        }
        match screen.draw(&mut self.viewer) {
            Ok(Some(request)) => screen.answer(request, &mut self.viewer),
            Ok(None) => {}
            Err(error) => self.viewer.complain(&error),
        }
        screen.score(&mut self.viewer);
        if let Some(complaint) = screen.surface.complaint() {
            self.viewer.message = complaint;
        }
    }

    fn stop_on(
        &mut self,
        events: &ActiveEventLoop,
        step: impl FnOnce(&mut Self, &ActiveEventLoop) -> Result<()>,
    ) {
        if let Err(error) = step(self, events) {
            self.failed = Some(error);
            events.exit();
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_none() {
            self.stop_on(events, Self::open);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(screen) = &mut self.screen else { return };
        let for_controls = screen.on(&event);
        let size = screen.surface.size();
        match &event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => screen.surface.resize(size.width, size.height),
            WindowEvent::DroppedFile(path) => self.viewer.open(path.clone()),
            WindowEvent::RedrawRequested => self.redraw(events),
            // A drag continues where it began, wherever the mouse is.
            WindowEvent::CursorMoved { .. } => self.mouse.on(&event, size, &mut self.viewer),
            // A drag or key press that began outside the controls also ends there.
            _ if for_controls && !input::is_release(&event) => {}
            _ => {
                self.mouse.on(&event, size, &mut self.viewer);
                if let Some(request) = input::key(&event, &mut self.viewer) {
                    screen.answer(request, &mut self.viewer);
                }
            }
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        // A minimised window has no pixels: nothing is drawn until it comes back.
        let seen = |screen: &&Screen| {
            let size = screen.window.inner_size();
            size.width > 0 && size.height > 0 && screen.window.is_minimized() != Some(true)
        };
        if let Some(screen) = self.screen.as_ref().filter(seen) {
            screen.window.request_redraw();
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::super::viewer::tests::start;
    use super::*;
    use crate::renderer::readback;
    use crate::{Method, Show};
    use aonet::Size;
    use aonet::gpu::Device;
    use std::time::Duration;
    use winit::dpi::PhysicalPosition;
    use winit::event::{DeviceId, MouseScrollDelta, TouchPhase};
    use winit::event_loop::EventLoop;
    use winit::platform::pump_events::EventLoopExtPumpEvents;
    use winit::platform::x11::EventLoopBuilderExtX11;

    /// Whether tests must not be skipped.
    fn is_required() -> bool {
        std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1")
    }

    /// A window of an X server, real or virtual.
    struct Live {
        events: EventLoop<()>,
        app: App,
    }

    impl Live {
        /// None without an X server or a device, with a message. With `AONET_REQUIRE_GPU` that is an error.
        fn open() -> Option<Self> {
            if std::env::var_os("DISPLAY").is_none() {
                eprintln!("skipped: no display");
                return None;
            }
            if let (false, Err(error)) = (is_required(), Device::wait_for()) {
                eprintln!("skipped: {error}");
                return None;
            }
            let events = EventLoop::builder().with_x11().with_any_thread(true).build().unwrap();
            let methods = [Method::Reference, Method::Gtao];
            let mut start = Start { methods, show: Show::Visibility, ..start() };
            // The window is wider than the controls.
            start.view.width = 400;
            let app = App::new(start);
            Some(Self { events, app })
        }

        /// Runs the event loop until a condition holds; returns whether it did in time.
        fn within(&mut self, seconds: u64, is_so: impl Fn(&App) -> bool) -> bool {
            let since = Instant::now();
            while !is_so(&self.app) && since.elapsed() < Duration::from_secs(seconds) {
                self.events.pump_app_events(Some(Duration::from_millis(5)), &mut self.app);
                assert!(self.app.failed.is_none(), "{:?}", self.app.failed);
            }
            is_so(&self.app)
        }

        #[track_caller]
        fn until(&mut self, what: &str, is_so: impl Fn(&App) -> bool) {
            let is_so = self.within(120, is_so);
            assert!(is_so, "never {what}; it says {:?}", self.app.viewer.message);
        }

        fn screen(&mut self) -> &mut Screen {
            self.app.screen.as_mut().unwrap()
        }

        fn ask(&mut self, request: input::Request) {
            self.app.screen.as_mut().unwrap().answer(request, &mut self.app.viewer);
        }
    }

    /// Number of rays that the window has traced: above 0 once frames are drawn.
    fn samples(app: &App) -> u32 {
        app.screen.as_ref().map_or(0, |screen| screen.renderer.samples())
    }

    /// The wheel scrolls the controls above them and moves the camera beside them, even if the last frame is old.
    fn whose_wheel(screen: &mut Screen) {
        let device_id = DeviceId::dummy();
        let mut wheel_at = |x: f64| {
            screen.on(&WindowEvent::CursorMoved { device_id, position: PhysicalPosition::new(x, 50.0) });
            let (delta, phase) = (MouseScrollDelta::LineDelta(0.0, 1.0), TouchPhase::Moved);
            screen.on(&WindowEvent::MouseWheel { device_id, delta, phase })
        };
        let (beside, above) = (390.0, 60.0);
        assert_eq!([wheel_at(above), wheel_at(beside), wheel_at(above)], [true, false, true]);
    }

    /// A process can have one event loop only, so one test contains everything that needs it.
    #[test]
    fn a_window_outlives_its_device_and_sizes_and_tells_scores() {
        let Some(mut live) = Live::open() else { return };
        live.until("drawn", |app| samples(app) >= 4);
        whose_wheel(live.screen());

        readback::image(&live.screen().renderer).unwrap();
        live.screen().surface.device.device.destroy();
        assert!(readback::image(&live.screen().renderer).is_err());
        live.until("made anew", |app| app.viewer.message.contains("was lost"));
        live.until("drawn on the new device", |app| samples(app) >= 2);
        readback::image(&live.screen().renderer).unwrap();

        for size in [Size::px(1, 1), Size::px(3, 300), Size::px(96, 64)] {
            let asked = PhysicalSize::new(size.width() as u32, size.height() as u32);
            let _ = live.screen().window.request_inner_size(asked);
            let seconds = if is_required() { 120 } else { 5 };
            if !live.within(seconds, |app| app.screen.as_ref().is_some_and(|s| s.surface.size() == size)) {
                assert!(!is_required(), "never {size}");
                eprintln!("skipped: {size}, which this window manager does not give");
                continue;
            }
            live.until("drawn at its size", |app| {
                app.screen.as_ref().is_some_and(|s| s.renderer.size() == size)
            });
            live.until("traced at its size", |app| samples(app) >= 2);
        }

        let view = &mut live.app.viewer.view;
        (view.margin, view.separation) = (0.25, Some(0.1));
        live.until("drawn with a guard band", |app| {
            app.screen.as_ref().is_some_and(|s| s.renderer.window().has_margin())
        });
        live.until("traced with a guard band", |app| samples(app) >= 2);

        live.ask(input::Request::Score);
        live.until("scored", |app| app.viewer.message.contains("GTAO: SSIM"));

        live.ask(input::Request::Replay);
        assert_eq!(live.app.viewer.message, "nothing is recorded yet");
        assert!(live.app.viewer.toggle_record().is_none());
        live.until("recorded", |app| app.viewer.way.keys.len() >= 3);
        assert!(live.app.viewer.toggle_record().is_some());
        live.app.viewer.orbit.turn(1.0, 0.0);
        live.ask(input::Request::Replay);
        live.until("gone", |app| app.viewer.motion == super::super::viewer::Motion::Free);
    }
}

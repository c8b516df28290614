//! The window's life: events in, frames out, and what to do when the device goes away.

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

    /// How it went.
    ///
    /// # Errors
    /// What ended it, unless it was closed.
    pub(super) fn end(self) -> Result<()> {
        self.failed.map_or(Ok(()), Err)
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let size = PhysicalSize::new(self.viewer.view.width as u32, self.viewer.view.height as u32);
        let attributes = Window::default_attributes().with_title("aonet").with_inner_size(size);
        let window = match self.screen.take() {
            // The window outlives its device.
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
            // Where a drag has begun it goes on, wherever the mouse is.
            WindowEvent::CursorMoved { .. } => self.mouse.on(&event, size, &mut self.viewer),
            // What has begun outside of the controls ends, wherever the mouse is and whoever hears the keys.
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
    use aonet::net::gpu::Device;
    use std::time::Duration;
    use winit::event_loop::EventLoop;
    use winit::platform::pump_events::EventLoopExtPumpEvents;
    use winit::platform::x11::EventLoopBuilderExtX11;

    /// A window of an X server, real or virtual.
    struct Live {
        events: EventLoop<()>,
        app: App,
    }

    impl Live {
        /// None where there is no X server or no device, said so. Who requires a device has one.
        fn open() -> Option<Self> {
            let required = std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1");
            if std::env::var_os("DISPLAY").is_none() {
                eprintln!("skipped: no display");
                return None;
            }
            if let (false, Err(error)) = (required, Device::wait_for()) {
                eprintln!("skipped: {error}");
                return None;
            }
            let events = EventLoop::builder().with_x11().with_any_thread(true).build().unwrap();
            let methods = [Method::Reference, Method::Gtao];
            let app = App::new(Start { methods, show: Show::Visibility, ..start() });
            Some(Self { events, app })
        }

        /// Lets the window live until it is as it should be.
        #[track_caller]
        fn until(&mut self, what: &str, is_so: impl Fn(&App) -> bool) {
            let since = Instant::now();
            while !is_so(&self.app) {
                self.events.pump_app_events(Some(Duration::from_millis(5)), &mut self.app);
                assert!(self.app.failed.is_none(), "{what}: {:?}", self.app.failed);
                let message = &self.app.viewer.message;
                assert!(since.elapsed() < Duration::from_secs(120), "never {what}; it says {message:?}");
            }
        }

        fn screen(&mut self) -> &mut Screen {
            self.app.screen.as_mut().unwrap()
        }

        fn ask(&mut self, request: input::Request) {
            self.app.screen.as_mut().unwrap().answer(request, &mut self.app.viewer);
        }
    }

    /// Rays that the window has traced: frames are drawn.
    fn samples(app: &App) -> u32 {
        app.screen.as_ref().map_or(0, |screen| screen.renderer.samples())
    }

    /// One event loop is all that a process may have, so one test has all that takes one.
    #[test]
    fn a_window_outlives_its_device_and_sizes_and_tells_scores() {
        let Some(mut live) = Live::open() else { return };
        live.until("drawn", |app| samples(app) >= 4);

        readback::image(&live.screen().renderer).unwrap();
        live.screen().surface.device.device.destroy();
        assert!(readback::image(&live.screen().renderer).is_err());
        live.until("made anew", |app| app.viewer.message.contains("was lost"));
        live.until("drawn on the new device", |app| samples(app) >= 2);
        readback::image(&live.screen().renderer).unwrap();

        for (width, height) in [(1, 1), (3, 300), (96, 64)] {
            let _ = live.screen().window.request_inner_size(PhysicalSize::new(width, height));
            live.until("resized", |app| {
                app.screen.as_ref().is_some_and(|s| s.surface.size() == (width, height))
            });
            let frame = (width as usize, height as usize);
            live.until("drawn at its size", |app| {
                app.screen.as_ref().is_some_and(|s| s.renderer.size() == frame)
            });
            live.until("traced at its size", |app| samples(app) >= 2);
        }

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

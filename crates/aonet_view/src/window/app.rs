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
            _ if for_controls => {}
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

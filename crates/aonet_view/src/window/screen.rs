//! Everything on the device; it is created again when the device is lost.

use super::controls::{self, Facts};
use super::input::Request;
use super::surface::Surface;
use super::viewer::Viewer;
use super::{save, viewer::SCORE_SAMPLES};
use crate::renderer::{FrameParams, PassClock, Present, Renderer};
use crate::{Error, Result};
use aonet::gpu::wgpu;
use egui_wgpu::ScreenDescriptor;
use std::sync::Arc;
use winit::event::WindowEvent;
use winit::window::Window;

/// A window with its device and renderer.
pub(super) struct Screen {
    pub(super) window: Arc<Window>,
    pub(super) surface: Surface,
    pub(super) renderer: Renderer,
    present: Present,
    egui: egui_winit::State,
    /// Position of the mouse (points of the controls).
    pointer: egui::Pos2,
    painter: egui_wgpu::Renderer,
}

impl Screen {
    /// # Errors
    /// When there is no device for the window, or not enough memory on it.
    pub(super) fn new(window: Arc<Window>, viewer: &mut Viewer) -> Result<Self> {
        let surface = Surface::new(&window)?;
        let device = &surface.device;
        let pair = (&device.device, &device.queue);
        let most = device.device.limits().max_texture_dimension_2d as usize;
        let window_of_frames = viewer.frame_window(surface.size(), most)?;
        let mut renderer = Renderer::on(device, viewer.tracer.scene(), window_of_frames)?;
        renderer.set_tracer(&viewer.tracer)?;
        viewer.name_missing(renderer.missing());
        let present = Present::new(pair, surface.format());
        let painter = egui_wgpu::Renderer::new(&device.device, surface.format(), Default::default());
        let (context, id) = (egui::Context::default(), egui::ViewportId::ROOT);
        let scale = Some(window.scale_factor() as f32);
        let egui = egui_winit::State::new(context, id, &window, scale, None, Some(most));
        Ok(Self { window, surface, renderer, present, egui, pointer: egui::Pos2::ZERO, painter })
    }

    /// Passes an event to the controls; returns whether they used it.
    pub(super) fn on(&mut self, event: &WindowEvent) -> bool {
        if let WindowEvent::CursorMoved { position, .. } = event {
            let scale = egui_winit::pixels_per_point(self.egui.egui_ctx(), &self.window);
            self.pointer = egui::pos2(position.x as f32, position.y as f32) / scale;
        }
        let wants = match event {
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => {
                let context = self.egui.egui_ctx();
                // The controls' own answer about the mouse is as old as their last frame.
                let above = context.layer_id_at(self.pointer);
                context.egui_is_using_pointer() || above.is_some_and(|l| l.order != egui::Order::Background)
            }
            WindowEvent::KeyboardInput { .. } => self.egui.egui_ctx().egui_wants_keyboard_input(),
            _ => false,
        };
        self.egui.on_window_event(&self.window, event).consumed || wants
    }

    /// Shows the scene that the viewer has now.
    ///
    /// # Errors
    /// When it is too large for the device; the old scene then stays.
    pub(super) fn show_scene(&mut self, viewer: &mut Viewer) -> Result<()> {
        self.renderer.set_scene(viewer.tracer.scene())?;
        viewer.name_missing(self.renderer.missing());
        self.renderer.set_tracer(&viewer.tracer)
    }

    /// Draws a frame with the controls; returns whether it was shown. Requests of the controls are added to `requested`.
    ///
    /// # Errors
    /// When the frame cannot be drawn.
    pub(super) fn draw(&mut self, viewer: &mut Viewer) -> Result<Option<Request>> {
        let Some(texture) = self.surface.acquire()? else { return Ok(None) };
        let target = texture.texture.create_view(&Default::default());
        let device = self.surface.device.device.clone();
        let mut encoder = device.create_command_encoder(&Default::default());
        let drawn = self.frame(viewer).and_then(|frame| self.renderer.begin(&mut encoder, &frame));
        if let Err(error) = &drawn {
            // The commands so far are not a complete frame. The controls are still drawn: they can correct the error.
            viewer.complain(error);
            encoder = device.create_command_encoder(&Default::default());
        }
        let clock = self.renderer.clock("presenting");
        self.present.encode_timed(&mut encoder, (self.renderer.picture(), &target), clock.as_ref());
        let (window, samples) = (self.renderer.window(), self.renderer.samples());
        let facts = Facts { window, samples, has_clock: self.renderer.has_clock() };
        let input = self.egui.take_egui_input(&self.window);
        let mut request = None;
        let output = self.egui.egui_ctx().clone().run_pass(input, |context| {
            request = controls::show(context, viewer, facts).or(request);
        });
        self.egui.handle_platform_output(&self.window, output.platform_output.clone());
        let commands = self.paint(&mut encoder, output, &target);
        self.renderer.finish(&mut encoder);
        self.window.pre_present_notify();
        self.surface.device.queue.submit(commands.into_iter().chain([encoder.finish()]));
        self.surface.device.queue.present(texture);
        viewer.history.push(self.renderer.times());
        Ok(request)
    }

    /// The current frame, of the renderer's size.
    fn frame(&mut self, viewer: &Viewer) -> Result<FrameParams> {
        let most = self.surface.device.device.limits().max_texture_dimension_2d as usize;
        self.renderer.resize(viewer.frame_window(self.surface.size(), most)?)?;
        viewer.frame(self.renderer.size())
    }

    /// Draws the controls.
    fn paint(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        output: egui::FullOutput,
        target: &wgpu::TextureView,
    ) -> Vec<wgpu::CommandBuffer> {
        let device = &self.surface.device;
        let egui::FullOutput { mut textures_delta, shapes, pixels_per_point, .. } = output;
        let size = self.surface.size();
        let size_in_pixels = [size.width() as u32, size.height() as u32];
        let screen = ScreenDescriptor { size_in_pixels, pixels_per_point };
        let mut changed: Vec<_> = textures_delta.set.drain().collect();
        changed.sort_by_key(|(id, _)| *id);
        for (id, deltas) in changed {
            for delta in deltas {
                self.painter.update_texture(&device.device, &device.queue, id, &delta);
            }
        }
        let shapes = self.egui.egui_ctx().tessellate(shapes, pixels_per_point);
        let commands = self.painter.update_buffers(&device.device, &device.queue, encoder, &shapes, &screen);
        let clock = self.renderer.clock("controls");
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("controls"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            timestamp_writes: clock.as_ref().map(PassClock::render),
            ..Default::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), &shapes, &screen);
        textures_delta.free.drain().for_each(|id| self.painter.free_texture(&id));
        commands
    }

    /// Serves a request that the viewer cannot serve alone.
    pub(super) fn answer(&mut self, request: Request, viewer: &mut Viewer) {
        let answered = match request {
            Request::Screenshot => save::screenshot(&self.renderer),
            Request::Export => {
                viewer.frame(self.renderer.size()).and_then(|of| save::export(&self.renderer, viewer, &of))
            }
            Request::Score => {
                viewer.wants_scores = true;
                Ok(format!("tracing {SCORE_SAMPLES} rays a pixel: hold still"))
            }
            Request::Record => match viewer.toggle_record().map(save::way) {
                Some(saved) => saved,
                None => return,
            },
            Request::Replay => return viewer.toggle_replay(),
        };
        viewer.message = answered.unwrap_or_else(|error: Error| error.to_string());
    }

    /// Compares the methods with the reference if that was requested and the reference has converged.
    pub(super) fn score(&mut self, viewer: &mut Viewer) {
        if !viewer.wants_scores {
            return;
        }
        let scores = viewer.frame(self.renderer.size()).and_then(|of| save::scores(&self.renderer, &of));
        match scores {
            Ok(None) => {
                let samples = self.renderer.samples();
                viewer.message = format!("{samples} of {SCORE_SAMPLES} rays a pixel: hold still");
                return;
            }
            Ok(Some(scores)) => viewer.message = scores,
            Err(error) => viewer.complain(&error),
        }
        viewer.wants_scores = false;
    }
}

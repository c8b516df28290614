//! A frame, its camera and the AO radius in f64.

use super::lens::Lens;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use glam::DVec3;

/// What a search and its filter see.
pub(super) struct Screen<'a> {
    pub(super) gbuffer: &'a GBuffer<'a>,
    pub(super) lens: Lens,
    /// AO radius (world units).
    pub(super) radius: f64,
}

impl<'a> Screen<'a> {
    pub(super) fn new(gbuffer: &'a GBuffer<'a>, params: AoParams) -> Self {
        Self { gbuffer, lens: Lens::new(gbuffer), radius: f64::from(params.radius()) }
    }

    pub(super) fn depth(&self, x: usize, y: usize) -> f64 {
        f64::from(self.gbuffer.depth()[y * self.gbuffer.width() + x])
    }

    pub(super) fn normal(&self, x: usize, y: usize) -> DVec3 {
        DVec3::from(self.gbuffer.normal()[y * self.gbuffer.width() + x].map(f64::from))
    }
}

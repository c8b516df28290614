//! A classic method ready to run on the CPU at one size.

use super::agtao::{Agtao, AgtaoParams};
use super::arcs::{Arcs, ArcsParams};
use super::bent::{self, BEND, BENT_PLANES, BENT_SHARES};
use super::denoise::{Denoise, Filter, Input};
use super::gtao::{Gtao, GtaoParams};
use super::hbao::{Hbao, HbaoParams};
use super::nnao::{Nnao, Taps};
use super::nnao_taps::NnaoParams;
use super::nnao_weights::NnaoWeights;
use super::pyramid::Pyramid;
use super::screen::Screen;
use super::shares::{PLANES, Shares};
use super::ssao::{Ssao, SsaoParams};
use super::ssdo::{Ssdo, SsdoParams};
use super::surfels::Surfels;
use super::vbao::{Vbao, VbaoParams};
use super::{Classic, NNAO_WEIGHTS, PixelMethod, PixelShares, Rows};
use crate::error::{Error, Result};
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::bent_normals::BentNormals;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::frame::window::Window;
use crate::simd::aligned::Aligned;
use crate::simd::{Isa, Level};
use crate::threads::Workers;

/// Consecutive rows that a thread works on. guess
const BAND: usize = 45;

/// How a session computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Threads, the caller's included.
    pub threads: usize,
    /// Vector instructions.
    pub level: Level,
}

impl Default for Options {
    /// One thread, the best instructions of this machine.
    fn default() -> Self {
        Self { threads: 1, level: Level::best() }
    }
}

/// A classic method, its memory and its threads, for frames of one size.
///
/// A result does not depend on the number of threads.
#[derive(Debug)]
pub struct Session {
    method: Prepared,
    memory: Memory,
}

/// A method with what does not depend on the frame.
#[derive(Debug)]
enum Prepared {
    Ssao(SsaoParams, Vec<[f32; 3]>),
    Hbao(HbaoParams),
    Ssdo(SsdoParams, Vec<([f32; 3], f32)>),
    Nnao(NnaoParams, Box<NnaoWeights>, Vec<Taps>),
    Gtao(GtaoParams, Pyramid),
    Vbao(VbaoParams),
    Agtao(AgtaoParams),
    /// Row by row, plane by plane.
    Arcs(ArcsParams, Surfels, Aligned),
}

impl Prepared {
    fn new(method: Classic, size: Size) -> Result<Self> {
        Ok(match method.checked()? {
            Classic::Ssao(p) => Self::Ssao(p, p.points()),
            Classic::Hbao(p) => Self::Hbao(p),
            Classic::Ssdo(p) => Self::Ssdo(p, p.directions()),
            Classic::Nnao(p) => {
                let weights = Box::new(NnaoWeights::from_bytes(NNAO_WEIGHTS)?);
                let taps = Taps::all(&p, &weights);
                Self::Nnao(p, weights, taps)
            }
            Classic::Gtao(p) => Self::Gtao(p, Pyramid::new(size, p.depth_levels, p.depth_offset)?),
            Classic::Vbao(p) => Self::Vbao(p),
            Classic::Agtao(p) => Self::Agtao(p),
            Classic::Arcs(p) => Self::Arcs(p, Surfels::new(size)?, Aligned::zeros(size.pixels() * PLANES)?),
        })
    }
}

impl Session {
    /// A session for frames of one size, with a guard band or without; the caller of [`Session::run`] is one of the threads.
    ///
    /// # Errors
    /// When a parameter of the method is out of its range, `threads` is 0 or cannot be started,
    /// the machine does not have the instructions, or there is not enough memory.
    pub fn new(method: &Classic, window: impl Into<Window>, options: Options) -> Result<Self> {
        Self::of_planes(1, method, window.into(), options)
    }

    /// [`Session::new`] for [`Session::run_with_bent_normals`]; it needs four times the memory, with connected arcs three times.
    ///
    /// # Errors
    /// As [`Session::new`]; also when the method has no bent normals: only GTAO, attenuated GTAO and connected arcs have.
    pub fn with_bent_normals(method: &Classic, window: impl Into<Window>, options: Options) -> Result<Self> {
        method.check_bent_normals()?;
        Self::of_planes(method.planes() + BEND, method, window.into(), options)
    }

    /// A session that finds so many values for a pixel.
    fn of_planes(planes: usize, method: &Classic, window: Window, options: Options) -> Result<Self> {
        let size = window.buffer_size();
        let method = Prepared::new(*method, size)?;
        let memory = Memory {
            window,
            isa: Isa::new(options.level)?,
            workers: Workers::new(options.threads, 0)?,
            planes,
            found: Aligned::zeros(size.pixels() * planes)?,
            filtered: Aligned::zeros(size.pixels() * planes)?,
        };
        Ok(Self { method, memory })
    }

    /// Writes the visibility of a frame's picture: in [0, 1], 1 on the background. Allocates nothing.
    ///
    /// # Errors
    /// When the frame has another size or margin than the session, or the image another size than its picture.
    pub fn run(&mut self, gbuffer: &GBuffer, params: AoParams, image: &mut AoImage) -> Result<()> {
        self.memory.check(gbuffer)?;
        self.memory.window.size().expect("AO image of a session", image.size())?;
        self.find(gbuffer, params);
        self.memory.write(gbuffer, image);
        Ok(())
    }

    /// [`Session::run`] that also writes the picture's bent normals. Allocates nothing.
    ///
    /// # Errors
    /// As [`Session::run`]; also when the session is not one of [`Session::with_bent_normals`], or `bent` has another size.
    pub fn run_with_bent_normals(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        bent: &mut BentNormals,
    ) -> Result<()> {
        let Memory { planes, window, .. } = self.memory;
        bent::check(planes > 1, window, bent)?;
        self.run(gbuffer, params, image)?;
        bent::write(&mut self.memory.workers, gbuffer, &self.memory.found, bent);
        Ok(())
    }

    /// Runs the method and its filter on a frame of the session's size.
    fn find(&mut self, gbuffer: &GBuffer, params: AoParams) {
        let screen = &Screen::new(gbuffer, params);
        let memory = &mut self.memory;
        match &mut self.method {
            Prepared::Ssao(p, points) => memory.run(screen, &Ssao::new(screen, *p, points), p.denoise()),
            Prepared::Hbao(p) => memory.run(screen, &Hbao::new(screen, *p), p.denoise()),
            Prepared::Ssdo(p, samples) => memory.run(screen, &Ssdo::new(screen, *p, samples), p.denoise()),
            Prepared::Nnao(p, weights, taps) => {
                memory.run(screen, &Nnao::new(screen, *p, weights, taps), p.denoise());
            }
            Prepared::Gtao(p, pyramid) => {
                pyramid.fill(screen, p.pyramid_range(screen.radius), memory.isa, &mut memory.workers);
                memory.run_with_bend(screen, &Gtao::new(screen, *p, pyramid), p.denoise());
            }
            Prepared::Vbao(p) => memory.run(screen, &Vbao::new(screen, *p), p.denoise()),
            Prepared::Agtao(p) => memory.run_with_bend(screen, &Agtao::new(screen, *p), p.denoise()),
            Prepared::Arcs(p, surfels, shares) => {
                surfels.fill(memory.isa, screen, &mut memory.workers);
                let Memory { workers, isa, planes, found, .. } = memory;
                let arcs = &Arcs::new(screen, *p, surfels.layers());
                match *planes {
                    BENT_SHARES => find::<BENT_SHARES>(workers, *isa, screen, arcs, found),
                    _ => {
                        find::<PLANES>(workers, *isa, screen, arcs, shares);
                        memory.take_visibility(shares);
                    }
                }
                memory.filter(screen, p.denoise());
            }
        }
    }

    /// Returns what the method knows of the light of a frame's picture, before it weighs and filters it.
    ///
    /// # Errors
    /// When the frame has another size or margin than the session, or the method is not connected arcs: no other one reports shares.
    pub fn shares(&mut self, gbuffer: &GBuffer, params: AoParams) -> Result<Shares> {
        self.memory.check(gbuffer)?;
        let Prepared::Arcs(p, surfels, shares) = &mut self.method else {
            return Err(Error::value("method that reports shares", "arcs", "another one"));
        };
        let (memory, screen) = (&mut self.memory, &Screen::new(gbuffer, params));
        surfels.fill(memory.isa, screen, &mut memory.workers);
        let arcs = &Arcs::new(screen, *p, surfels.layers());
        find::<PLANES>(&mut memory.workers, memory.isa, screen, arcs, shares);
        Ok(Shares::of_picture(gbuffer, shares))
    }

    /// Bytes of the images, the depth pyramid and the packed normals that the session owns.
    pub fn memory_bytes(&self) -> usize {
        let own = match &self.method {
            Prepared::Gtao(_, pyramid) => pyramid.len(),
            Prepared::Arcs(_, surfels, shares) => surfels.len() + shares.len(),
            _ => 0,
        };
        (self.memory.found.len() + self.memory.filtered.len() + own) * size_of::<f32>()
    }
}

/// What all methods need.
#[derive(Debug)]
struct Memory {
    window: Window,
    isa: Isa,
    workers: Workers,
    /// Values for a pixel: 1, [`BENT_PLANES`] or [`BENT_SHARES`].
    planes: usize,
    /// Visibility, and with bent normals what else the method finds, before a pass of the filter, and after it: row by row, plane by plane.
    found: Aligned,
    filtered: Aligned,
}

impl Memory {
    /// Refuses frames of another size or margin.
    fn check(&self, gbuffer: &GBuffer) -> Result<()> {
        if gbuffer.window() == self.window {
            return Ok(());
        }
        Err(Error::size("G-buffer of a session", self.window, gbuffer.window()))
    }

    /// Runs the method for all pixels, then the filter. The result is in `found`.
    fn run(&mut self, screen: &Screen<'_>, method: &impl PixelMethod, by: Denoise) {
        let Self { workers, found, isa, .. } = self;
        find(workers, *isa, screen, method, found);
        self.filter(screen, by);
    }

    /// The same with the bend where there is memory for it.
    fn run_with_bend(
        &mut self,
        screen: &Screen<'_>,
        method: &(impl PixelMethod + PixelShares<BENT_PLANES>),
        by: Denoise,
    ) {
        let Self { workers, found, isa, .. } = self;
        match self.planes {
            BENT_PLANES => find::<BENT_PLANES>(workers, *isa, screen, method, found),
            _ => find::<1>(workers, *isa, screen, method, found),
        }
        self.filter(screen, by);
    }

    /// Copies the first plane of what a method found to `found`.
    fn take_visibility(&mut self, planes: &[f32]) {
        let width = self.window.buffer_size().width();
        let rows = self.found.chunks_exact_mut(width).zip(planes.chunks_exact(width * PLANES));
        rows.for_each(|(row, planes)| row.copy_from_slice(&planes[..width]));
    }

    /// Filters what is in `found`.
    fn filter(&mut self, screen: &Screen<'_>, by: Denoise) {
        let (row_len, isa) = (self.window.buffer_size().width() * self.planes, self.isa);
        for pass in by.passes() {
            let filter = Filter::new(screen, by, pass, Input::Planes(&self.found));
            self.workers.for_each_band(&mut self.filtered, row_len, |band| {
                filter.run(isa, band.first, band.values);
            });
            std::mem::swap(&mut self.found, &mut self.filtered);
        }
    }

    /// Copies the picture in `found` to the image, with 1 on the background.
    fn write(&mut self, gbuffer: &GBuffer, image: &mut AoImage) {
        let Self { window, workers, planes, found, .. } = self;
        let (width, margin) = (image.width(), window.margin());
        let row_len = window.buffer_size().width() * *planes;
        workers.for_each_band(image.visibility_mut(), width, |band| {
            for (i, line) in band.values.chunks_exact_mut(width).enumerate() {
                let y = band.first + i;
                let found = &found[(margin.y + y) * row_len + margin.x..][..width];
                for ((to, found), depth) in line.iter_mut().zip(found).zip(window.row(gbuffer.depth(), y)) {
                    *to = if *depth == f32::INFINITY { 1.0 } else { found.clamp(0.0, 1.0) };
                }
            }
        });
    }
}

/// Writes the values that a method reports for each pixel: row by row, value by value.
fn find<const N: usize>(
    workers: &mut Workers,
    isa: Isa,
    screen: &Screen<'_>,
    method: &impl PixelShares<N>,
    numbers: &mut [f32],
) {
    workers.for_each_band_of(numbers, BAND, screen.size().width() * N, |band| {
        isa.run_on_chains(Rows { screen, method, first: band.first, rows: band.values });
    });
}

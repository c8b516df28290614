//! Classic methods of screen-space ambient occlusion: what networks have to beat.
//!
//! All take the same frame and the same AO radius as the networks. Each has a plain params struct whose defaults are
//! those of its source; [`Classic`] names them and sets them by name. A [`Session`] runs one at one size, with threads
//! and without allocating.

pub(crate) mod agtao;
pub(crate) mod arcs;
pub(crate) mod bent;
mod cubic;
mod denoise;
pub mod gpu;
pub(crate) mod gtao;
pub(crate) mod hbao;
mod hemisphere;
pub(crate) mod nnao;
pub(crate) mod nnao_taps;
pub(crate) mod nnao_weights;
mod noise;
pub(crate) mod params;
mod presets;
mod pyramid;
mod screen;
mod session;
pub(crate) mod shares;
pub(crate) mod side;
mod slice;
pub(crate) mod ssao;
pub(crate) mod ssdo;
mod stride;
pub(crate) mod surfels;
pub(crate) mod survey;
#[cfg(test)]
mod tests;
pub(crate) mod vbao;

use crate::error::{Error, Result};
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::gbuffer::GBuffer;
use crate::simd::lanes::F;
use crate::simd::{Isa, Kernel, Simd};
use crate::threads::Band;
pub(crate) use bent::{BEND, BENT_PLANES, BENT_SHARES};
#[doc(hidden)]
pub use denoise::Pass;
pub(crate) use denoise::{Denoise, Filter, Input, KEEP};
pub(crate) use noise::noise_of;
use params::Parameters;
use screen::Pixels;
pub(crate) use screen::Screen;
use serde::{Deserialize, Serialize};
pub(crate) use shares::PLANES;

pub use agtao::AgtaoParams;
pub use arcs::ArcsParams;
pub use gtao::GtaoParams;
pub use hbao::HbaoParams;
pub use nnao_taps::NnaoParams;
pub use session::{Options, Session};
pub use shares::{Share, Shares};
pub use ssao::SsaoParams;
pub use ssdo::SsdoParams;
pub use vbao::VbaoParams;

/// Weights of NNAO that come with the crate, as bytes for [`nnao_weights::NnaoWeights::from_bytes`].
const NNAO_WEIGHTS: &[u8] = include_bytes!("../../models/nnao.safetensors");

/// A method and its parameters. As JSON: `{"gtao": {"slices": 3, ...}}`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Classic {
    /// Screen-space ambient occlusion. Mittring 2007.
    Ssao(SsaoParams),
    /// Horizon-based ambient occlusion. Bavoil et al. 2008.
    Hbao(HbaoParams),
    /// The occlusion of screen-space directional occlusion. Ritschel et al. 2009.
    Ssdo(SsdoParams),
    /// Neural network ambient occlusion: a small network for every pixel. Holden et al. 2016.
    Nnao(NnaoParams),
    /// Ground-truth ambient occlusion. Jimenez et al. 2016.
    Gtao(GtaoParams),
    /// Visibility bitmask, which reads the second layer. Therrien et al. 2023.
    Vbao(VbaoParams),
    /// GTAO that attenuates every occluder by its own distance: ours.
    Agtao(AgtaoParams),
    /// Connected arcs, which read the second layer: ours.
    Arcs(ArcsParams),
}

/// Runs `$body` with `$params` bound to whatever parameters `$method` has.
macro_rules! each {
    ($method:expr, $params:ident => $body:expr) => {
        match $method {
            Classic::Ssao($params) => $body,
            Classic::Hbao($params) => $body,
            Classic::Ssdo($params) => $body,
            Classic::Nnao($params) => $body,
            Classic::Gtao($params) => $body,
            Classic::Vbao($params) => $body,
            Classic::Agtao($params) => $body,
            Classic::Arcs($params) => $body,
        }
    };
}

impl Classic {
    /// Every method with its defaults.
    pub fn all() -> Vec<Self> {
        vec![
            Self::Ssao(SsaoParams::default()),
            Self::Hbao(HbaoParams::default()),
            Self::Ssdo(SsdoParams::default()),
            Self::Nnao(NnaoParams::default()),
            Self::Gtao(GtaoParams::default()),
            Self::Vbao(VbaoParams::default()),
            Self::Agtao(AgtaoParams::default()),
            Self::Arcs(ArcsParams::default()),
        ]
    }

    /// The method of this name with its defaults; `gtao:tuned` with parameters that were found on training frames, and
    /// `gtao:low` to `gtao:ultra` (also of vbao) with another number of slices and steps; `arcs:deep` and `vbao:deep` with parameters for
    /// frames with a second layer.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<Self> {
        let (method, preset) = name.split_once(':').map_or((name, None), |(m, p)| (m, Some(p)));
        let mut found = Self::all().into_iter().find(|m| m.name() == method).ok_or_else(|| {
            let names: Vec<_> = Self::all().iter().map(Self::name).collect();
            Error::value("method", format!("one of {}", names.join(", ")), name)
        })?;
        match preset {
            None => Ok(found),
            Some(preset) => found.choose(preset).then_some(found).ok_or_else(|| {
                Error::value(
                    "preset",
                    "tuned; of gtao and vbao also low, medium, high or ultra; of vbao and arcs also deep",
                    name,
                )
            }),
        }
    }

    /// Takes a preset's parameters; false where the method has no such preset.
    fn choose(&mut self, preset: &str) -> bool {
        let wanted = format!("{}:{preset}", self.name());
        if let Some((_, json)) = presets::TUNED.iter().find(|(name, _)| *name == wanted) {
            *self = presets::method(json);
            return true;
        }
        let quality = |all: &[(&str, u32, u32)]| {
            all.iter().find(|(name, ..)| *name == preset).map(|(_, s, k)| (*s, *k))
        };
        match self {
            Self::Gtao(p) => quality(&GtaoParams::QUALITY).map(|cost| (p.slices, p.steps) = cost).is_some(),
            Self::Vbao(p) => quality(&VbaoParams::QUALITY).map(|cost| (p.slices, p.steps) = cost).is_some(),
            Self::Ssao(_)
            | Self::Hbao(_)
            | Self::Ssdo(_)
            | Self::Nnao(_)
            | Self::Agtao(_)
            | Self::Arcs(_) => false,
        }
    }

    /// Its name in files and on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ssao(_) => "ssao",
            Self::Hbao(_) => "hbao",
            Self::Ssdo(_) => "ssdo",
            Self::Nnao(_) => "nnao",
            Self::Gtao(_) => "gtao",
            Self::Vbao(_) => "vbao",
            Self::Agtao(_) => "agtao",
            Self::Arcs(_) => "arcs",
        }
    }

    /// Sets a parameter by name.
    ///
    /// # Errors
    /// When there is no such parameter or the value is out of its range.
    pub fn set(&mut self, name: &str, value: f32) -> Result<()> {
        each!(self, params => params.set(name, value))
    }

    /// The method after a check of every parameter.
    ///
    /// # Errors
    /// Names the parameter, its range and what was found.
    pub fn checked(self) -> Result<Self> {
        each!(&self, params => params.checked().map(|_| self))
    }

    /// Its parameters: name, what it does, range and value.
    pub fn parameters(&self) -> Vec<ParameterValue> {
        fn of<P: Parameters>(params: &P) -> Vec<ParameterValue> {
            let one = |parameter: &params::Parameter<P>| ParameterValue {
                name: parameter.name,
                doc: parameter.doc.trim(),
                low: parameter.low,
                high: parameter.high,
                whole: parameter.whole,
                value: (parameter.get)(params),
            };
            P::PARAMETERS.iter().map(one).collect()
        }
        each!(self, params => of(params))
    }

    /// Taps on the depth buffer for each pixel, the filter's not included.
    pub fn taps(&self) -> u32 {
        match self {
            Self::Ssao(p) => p.samples,
            Self::Ssdo(p) => p.samples,
            Self::Nnao(p) => p.samples,
            Self::Hbao(p) => p.slices * p.steps * 2,
            Self::Gtao(p) => p.slices * p.steps * 2,
            Self::Vbao(p) => p.slices * p.steps * 2,
            Self::Agtao(p) => p.slices * p.steps * 2,
            Self::Arcs(p) => p.slices * p.steps * 2,
        }
    }

    /// Whether it can report bent normals: the methods with horizons and connected arcs do.
    pub fn has_bent_normals(&self) -> bool {
        match self {
            Self::Gtao(_) | Self::Agtao(_) | Self::Arcs(_) => true,
            Self::Ssao(_) | Self::Hbao(_) | Self::Ssdo(_) | Self::Nnao(_) | Self::Vbao(_) => false,
        }
    }

    /// Values that it reports for a pixel, without bent normals: the visibility, and the shares of connected arcs.
    pub(crate) fn planes(&self) -> usize {
        if matches!(self, Self::Arcs(_)) { PLANES } else { 1 }
    }

    /// # Errors
    /// When the method does not report bent normals.
    pub(crate) fn check_bent_normals(&self) -> Result<()> {
        match self.has_bent_normals() {
            true => Ok(()),
            false => Err(Error::value("method with bent normals", "gtao, agtao or arcs", self.name())),
        }
    }

    /// The filter after it.
    pub(crate) fn denoise(&self) -> Denoise {
        each!(self, params => params.denoise())
    }

    /// The visibility of a frame's picture: in [0, 1], 1 on the background. Runs on the calling thread; a [`Session`] has more
    /// threads, and memory of its own.
    ///
    /// # Errors
    /// When a parameter is out of its range; it is named.
    pub fn run(&self, gbuffer: &GBuffer, params: AoParams) -> Result<AoImage> {
        let window = gbuffer.window();
        let mut image = AoImage::open(window.size());
        Session::new(self, window, Options::default())?.run(gbuffer, params, &mut image)?;
        Ok(image)
    }
}

/// A parameter of a method, as [`Classic::parameters`] lists it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ParameterValue {
    /// Its name.
    pub name: &'static str,
    /// What it does, and its unit.
    pub doc: &'static str,
    /// Least value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
    /// Whether it counts something.
    pub whole: bool,
    /// Its value.
    pub value: f32,
}

/// Writes a band of attenuated GTAO before the filter. The background is 1. Allocates nothing.
pub(crate) fn agtao_band(isa: Isa, params: AgtaoParams, screen: &Screen<'_>, band: Band<'_>) {
    write_band::<1>(isa, screen, &agtao::Agtao::new(screen, params), band);
}

/// Writes a band of attenuated GTAO with bent normals before the filter: visibility and bend, row by row, plane by plane. The
/// background is 1 and 0. Allocates nothing.
pub(crate) fn bent_agtao_band(isa: Isa, params: AgtaoParams, screen: &Screen<'_>, band: Band<'_>) {
    write_band::<BENT_PLANES>(isa, screen, &agtao::Agtao::new(screen, params), band);
}

/// Writes a band of connected arcs before the filter: visibility and shares, row by row, plane by plane. The background is 1 and
/// 0. `surfels` are those of [`surfels::pack`]. Allocates nothing.
pub(crate) fn arcs_band(
    isa: Isa,
    (params, surfels): (ArcsParams, [&[f32]; 2]),
    screen: &Screen<'_>,
    band: Band<'_>,
) {
    write_band::<PLANES>(isa, screen, &arcs::Arcs::new(screen, params, surfels), band);
}

/// Writes a band of connected arcs with bent normals before the filter: visibility, shares and bend. Otherwise as [`arcs_band`].
pub(crate) fn bent_arcs_band(
    isa: Isa,
    (params, surfels): (ArcsParams, [&[f32]; 2]),
    screen: &Screen<'_>,
    band: Band<'_>,
) {
    write_band::<BENT_SHARES>(isa, screen, &arcs::Arcs::new(screen, params, surfels), band);
}

/// Writes the values that a method reports for each pixel of a band. The background is 1, and 0 after the first plane.
fn write_band<const N: usize>(isa: Isa, screen: &Screen<'_>, method: &impl PixelShares<N>, band: Band<'_>) {
    isa.run_on_chains(Rows { screen, method, first: band.first, rows: &mut *band.values });
    open_background(screen.gbuffer(), N, band);
}

/// Sets a band of so many planes to 1 on the background, and to 0 after the first plane.
fn open_background(gbuffer: &GBuffer, planes: usize, band: Band<'_>) {
    let width = gbuffer.width();
    for (i, line) in band.values.chunks_exact_mut(width).enumerate() {
        let depth = &gbuffer.depth()[(band.first + i / planes) * width..][..width];
        let open = if i % planes == 0 { 1.0 } else { 0.0 };
        line.iter_mut().zip(depth).filter(|(_, d)| **d == f32::INFINITY).for_each(|(v, _)| *v = open);
    }
}

/// What a method does for neighbouring pixels. All it calls must be `#[inline(always)]`.
trait PixelMethod: Sync {
    /// Visibility of the pixels from (`x`, `y`) on; what it says of the background does not matter.
    fn visibility<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> F<S>;
}

/// The same for a method that reports several values for a pixel; every other method reports its visibility.
trait PixelShares<const N: usize>: Sync {
    /// The numbers of the pixels from (`x`, `y`) on.
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; N];
}

impl<M: PixelMethod> PixelShares<1> for M {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; 1] {
        [self.visibility(p, at)]
    }
}

/// Columns that are worked on together: what far taps of a row looked at is still in the cache for those of the next.
// Measured at 1280x720: 64, 128 and 256 alike, 4 ms less than whole rows.
const TILE: usize = 64;

struct Rows<'a, M, const N: usize> {
    screen: &'a Screen<'a>,
    method: &'a M,
    /// Number of the first row.
    first: usize,
    /// Row by row, number by number.
    rows: &'a mut [f32],
}

impl<M: PixelShares<N>, const N: usize> Kernel for Rows<'_, M, N> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let width = self.screen.size().width();
        for left in (0..width).step_by(TILE) {
            let right = width.min(left + TILE);
            for (i, row) in self.rows.chunks_exact_mut(width * N).enumerate() {
                for from in (left..right).step_by(S::LANES) {
                    let to = right.min(from + S::LANES);
                    let at = (from, self.first + i);
                    let p = self.screen.pixels(simd, at.0, at.1);
                    let shares = self.method.shares(&p, at);
                    for c in 0..N {
                        shares[c].store(&mut row[c * width + from..c * width + to]);
                    }
                }
            }
        }
    }
}

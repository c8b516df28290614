//! Input channels of the network from a G-buffer. AO-Net §3.1.

use crate::error::Result;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::net::config::{Channel, Features, SearchConfig};
use crate::search::survey::{Cells, SURVEYED, survey_band};
use crate::search::{self, ArcsParams, Filter, Input, Screen};
use crate::simd::{Isa, Level};
use crate::threads::{Band, Workers};

/// Range of the projected radius that the network tells apart, log2 (px): 1/16 px to 65536 px.
/// Background is infinitely far and gets the lower end.
pub(crate) const LOG2_PX_RANGE: (f32, f32) = (-4.0, 16.0);

/// The projected radius is shown as (log2(px) - 5) / 4: near zero mean, near unit spread for radii of 2 to
/// 512 px. guess: the first convolution can rescale it.
pub(crate) const LOG2_PX_MEAN: f32 = 5.0;
pub(crate) const LOG2_PX_SCALE: f32 = 0.25;

/// Writes CxHxW features. [`Channel`] describes the channels. `search` is what the network's search found, as
/// [`search_planes`] returns it; it may be empty where no channel shows it.
///
/// # Panics
/// When `out` has another number of values, or `search` is too short for the frame.
pub fn write_features(
    features: &Features,
    gbuffer: &GBuffer,
    params: AoParams,
    search: &[f32],
    out: &mut [f32],
) {
    let pixels = gbuffer.size().pixels();
    assert_eq!(out.len(), features.channels().len() * pixels, "values of the features");
    let rows = FeatureRows::new(features, gbuffer, params, search);
    for (c, plane) in out.chunks_exact_mut(pixels).enumerate() {
        for (y, line) in plane.chunks_exact_mut(gbuffer.width()).enumerate() {
            rows.write(c, y, line);
        }
    }
}

/// What a search finds on a frame, its guard band included, as a session's search finds it: row by row the visibility and then each
/// share that it reports, W values each.
///
/// # Errors
/// When a parameter is out of its range.
pub fn search_planes(search: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> Result<Vec<f32>> {
    let (search, isa, screen) = (search.checked()?, Isa::new(Level::best())?, Screen::new(gbuffer, params));
    let pixels = gbuffer.depth().len();
    let mut found = vec![0.0; search.planes() * pixels];
    match search {
        SearchConfig::Agtao(of) => search::agtao_band(isa, of, &screen, Band::whole(&mut found)),
        SearchConfig::Arcs(of) => {
            let (mut first, mut second) = (vec![0.0; pixels], vec![0.0; pixels]);
            search::surfels::pack((isa, &mut Workers::new(1, 0)?), &screen, [&mut first, &mut second]);
            search::arcs_band(isa, (of, [&first, &second]), &screen, Band::whole(&mut found));
        }
    }
    for pass in search.filter().passes() {
        let mut filtered = vec![0.0; found.len()];
        let filter = Filter::new(&screen, search.filter(), pass, Input::Planes(&found));
        filter.run(isa, 0, &mut filtered);
        found = filtered;
    }
    Ok(found)
}

/// What a survey finds on so many columns and rows of patches, which may reach beyond the frame: row by row each share of light and
/// whether there is a second layer, a value for each column. The first patch begins at the pixel `origin` (column and row); a session's at
/// the first one. See [`Op::Survey`](super::graph::Op::Survey).
///
/// # Errors
/// When a parameter is out of its range.
pub fn survey_planes(
    arcs: &ArcsParams,
    gbuffer: &GBuffer,
    params: AoParams,
    origin: [usize; 2],
    (cells, patch): (Size, usize),
) -> Result<Vec<f32>> {
    SearchConfig::Arcs(*arcs).checked()?;
    let (isa, screen) = (Isa::new(Level::best())?, Screen::new(gbuffer, params));
    let pixels = gbuffer.depth().len();
    let (mut first, mut second) = (vec![0.0; pixels], vec![0.0; pixels]);
    search::surfels::pack((isa, &mut Workers::new(1, 0)?), &screen, [&mut first, &mut second]);
    let mut found = vec![0.0; SURVEYED * cells.pixels()];
    let layout = Cells { origin, patch, columns: cells.width(), halo: 0 };
    survey_band(isa, (*arcs, [&first, &second]), &screen, (layout, Band::whole(&mut found)));
    Ok(found)
}

/// The features of a frame, row by row.
pub(crate) struct FeatureRows<'a> {
    gbuffer: &'a GBuffer<'a>,
    channels: &'a [Channel],
    /// Nearest depth, and one over the range of depths; of the foreground.
    depth_range: (f32, f32),
    /// log2 of the radius (px) at depth 1.
    log2_radius_px: f32,
    /// What the search found, if a channel shows it.
    search: &'a [f32],
}

impl<'a> FeatureRows<'a> {
    pub(crate) fn new(
        features: &'a Features,
        gbuffer: &'a GBuffer<'a>,
        params: AoParams,
        search: &'a [f32],
    ) -> Self {
        let channels = features.channels();
        let depth_range = match channels.contains(&Channel::DepthNormalized) {
            true => depth_range(gbuffer),
            false => (0.0, 1.0),
        };
        let log2_radius_px = gbuffer.camera().projected_px(params.radius(), 1.0).log2();
        Self { gbuffer, channels, depth_range, log2_radius_px, search }
    }

    /// Writes row `y` of channel `c`: as many values as `line` has, at most the frame's width.
    #[inline(always)]
    pub(crate) fn write(&self, c: usize, y: usize, line: &mut [f32]) {
        let first = y * self.gbuffer.width();
        let pixels = line.iter_mut().zip(&self.gbuffer.depth()[first..]);
        match self.channels[c] {
            Channel::Normal(axis) => {
                let normals = &self.gbuffer.normal()[first..];
                line.iter_mut().zip(normals).for_each(|(value, n)| *value = n[axis.index()]);
            }
            Channel::NormalEncoded(axis) => {
                let normals = &self.gbuffer.normal()[first..];
                pixels.zip(normals).for_each(|((value, &depth), n)| {
                    *value = if depth == f32::INFINITY { 0.0 } else { 0.5 * n[axis.index()] + 0.5 };
                });
            }
            Channel::Position(axis) => {
                let camera = self.gbuffer.camera();
                pixels.enumerate().for_each(|(x, (value, &depth))| {
                    let position = || camera.position_view(x, y, depth)[axis.index()];
                    *value = if depth == f32::INFINITY { 0.0 } else { position() };
                });
            }
            Channel::Depth => pixels.for_each(|(value, &depth)| {
                *value = if depth == f32::INFINITY { 0.0 } else { depth };
            }),
            Channel::DepthNormalized => {
                let (near, inverse_range) = self.depth_range;
                pixels.for_each(|(value, &depth)| {
                    *value = if depth == f32::INFINITY { 1.0 } else { (depth - near) * inverse_range };
                });
            }
            Channel::ProjectedRadius => {
                for (value, &depth) in pixels {
                    *value = self.projected_radius(depth);
                }
            }
            Channel::HorizonOcclusion => {
                for (value, visibility) in line.iter_mut().zip(self.search_line(0, y)) {
                    *value = 1.0 - visibility;
                }
            }
            Channel::Light(share) => {
                let found = self.search_line(share.search_plane(), y);
                line.iter_mut().zip(found).for_each(|(value, v)| *value = *v);
            }
            Channel::SecondLayer => line.fill(f32::from(self.gbuffer.second().is_some())),
        }
    }

    /// Row `y` of a plane of what the search found.
    #[inline(always)]
    fn search_line(&self, plane: usize, y: usize) -> &'a [f32] {
        let width = self.gbuffer.width();
        let planes = self.search.len() / self.gbuffer.size().pixels();
        &self.search[(y * planes + plane) * width..][..width]
    }

    #[inline(always)]
    fn projected_radius(&self, depth: f32) -> f32 {
        let perspective = self.gbuffer.camera().is_perspective();
        let log2_depth = if perspective || depth == f32::INFINITY { log2(depth) } else { 0.0 };
        let (low, high) = LOG2_PX_RANGE;
        ((self.log2_radius_px - log2_depth).clamp(low, high) - LOG2_PX_MEAN) * LOG2_PX_SCALE
    }
}

/// Logarithm to base two of a normal number above 0; 128 for infinity. The error is below 2e-7, or 2e-7 of the result if that is more.
// Loops over it become vectors, which calls of the C library do not.
#[inline(always)]
fn log2(x: f32) -> f32 {
    // The exponent, and a mantissa in [sqrt(1/2), sqrt(2)).
    const HALF_ROOT: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let bits = x.to_bits().wrapping_sub(HALF_ROOT);
    let exponent = (bits as i32 >> 23) as f32;
    let mantissa = f32::from_bits((bits & 0x007f_ffff).wrapping_add(HALF_ROOT));
    // 2 atanh s is the logarithm of (1 + s) / (1 - s); its series, |s| < 0.172.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    let series =
        1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0 + square * (1.0 / 9.0))));
    exponent + 2.0 * std::f32::consts::LOG2_E * s * series
}

fn depth_range(gbuffer: &GBuffer) -> (f32, f32) {
    let finite = gbuffer.depth().iter().copied().filter(|d| d.is_finite());
    let (near, far) = finite.fold((f32::INFINITY, 0f32), |(a, b), d| (a.min(d), b.max(d)));
    (near, 1.0 / (far - near).max(f32::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Projection, Size};

    fn frame(projection: Projection, depth: Vec<f32>) -> GBuffer<'static> {
        let size = Size::px(depth.len(), 1);
        let camera = Camera::new(projection, size).unwrap();
        let normal = vec![[0.0, 0.0, 1.0]; depth.len()];
        GBuffer::new(camera, depth, normal).unwrap()
    }

    fn fourth(features: &Features, gbuffer: &GBuffer, radius: f32) -> Vec<f32> {
        let n = gbuffer.width();
        let mut out = vec![9.0; 4 * n];
        write_features(features, gbuffer, AoParams::new(radius).unwrap(), &[], &mut out);
        out.split_off(3 * n)
    }

    #[test]
    fn logarithms_are_as_exact_as_they_say() {
        for i in 0..100_000 {
            let x = f64::from(i) * 0.0025 - 125.0;
            let number = x.exp2() as f32;
            let (found, exact) = (f64::from(log2(number)), f64::from(number).log2());
            assert!(
                (found - exact).abs() < 2e-7 * exact.abs().max(1.0),
                "{number}: {found}, expected {exact}"
            );
        }
        assert_eq!([log2(1.0), log2(0.5), log2(1024.0), log2(f32::INFINITY)], [0.0, -1.0, 10.0, 128.0]);
    }

    #[test]
    fn projected_radius_does_not_depend_on_the_unit() {
        let radius_px = Features::normal_projected_radius();
        let fov = Projection::Perspective { fov_y: 1.0 };
        let metres = fourth(&radius_px, &frame(fov, vec![1.0, 2.0, f32::INFINITY]), 0.5);
        let inches = fourth(&radius_px, &frame(fov, vec![39.37, 78.74, f32::INFINITY]), 0.5 * 39.37);
        for (a, b) in metres.iter().zip(&inches) {
            assert!((a - b).abs() < 1e-5, "{metres:?} {inches:?}");
        }
        assert!((metres[0] - metres[1] - 0.25).abs() < 1e-6, "doubling the depth halves the radius");
        assert_eq!(metres[2], -2.25);
        let flat = fourth(&radius_px, &frame(Projection::Orthographic { height: 1.0 }, vec![1.0, 9.0]), 0.5);
        assert_eq!(flat[0], flat[1]);
    }

    #[test]
    fn normalised_depth_spans_zero_to_one() {
        let g = frame(Projection::Perspective { fov_y: 1.0 }, vec![3.0, 5.0, 4.0, f32::INFINITY]);
        assert_eq!(fourth(&Features::normal_depth_normalized(), &g, 1.0), [0.0, 1.0, 0.5, 1.0]);
        assert_eq!(fourth(&Features::normal_depth(), &g, 1.0), [3.0, 5.0, 4.0, 0.0]);
    }
}

//! Input channels of the network from a G-buffer. AO-Net §3.1.

use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::{Channel, Features};
use crate::search;
use crate::simd::{Isa, Level};
use std::borrow::Cow;

/// Range of the projected radius that the network tells apart, log2 [px]: 1/16 px to 65536 px.
/// Background is infinitely far and gets the lower end.
pub(crate) const LOG2_PX_RANGE: (f32, f32) = (-4.0, 16.0);

/// The projected radius is shown as (log2(px) - 5) / 4: near zero mean, near unit spread for radii of 2 to
/// 512 px. guess: the first convolution can rescale it.
pub(crate) const LOG2_PX_MEAN: f32 = 5.0;
pub(crate) const LOG2_PX_SCALE: f32 = 0.25;

/// Writes CxHxW features, rows of length `row` >= width, planes of `plane` values; the rest of `out` is left alone.
/// What the channels hold: [`Channel`].
///
/// # Panics
/// When `out` is too short for the planes.
pub fn write_features(
    features: Features,
    (gbuffer, params): (&GBuffer, AoParams),
    out: &mut [f32],
    (row, plane): (usize, usize),
) {
    let horizon = match features.horizon() {
        Some(_) => Cow::Owned(horizon_visibility(gbuffer, params)),
        None => Cow::Borrowed(&[][..]),
    };
    let rows = FeatureRows::new(features, gbuffer, params, &horizon);
    for c in 0..features.channels().len() {
        for y in 0..gbuffer.height() {
            rows.write((c, y), &mut out[c * plane + y * row..][..gbuffer.width()]);
        }
    }
}

/// The features of a frame, row by row.
pub(crate) struct FeatureRows<'a> {
    gbuffer: &'a GBuffer<'a>,
    channels: &'static [Channel],
    /// Nearest depth, and one over the range of depths; of the foreground.
    depth_range: (f32, f32),
    /// log2 of the radius [px] at depth 1.
    log2_radius_px: f32,
    /// HxW, if it is a feature.
    horizon_visibility: &'a [f32],
}

impl<'a> FeatureRows<'a> {
    pub(crate) fn new(
        features: Features,
        gbuffer: &'a GBuffer<'a>,
        params: AoParams,
        horizon_visibility: &'a [f32],
    ) -> Self {
        let channels = features.channels();
        let depth_range = match channels.contains(&Channel::DepthNormalized) {
            true => depth_range(gbuffer),
            false => (0.0, 1.0),
        };
        let log2_radius_px = gbuffer.camera().projected_px(params.radius(), 1.0).log2();
        Self { gbuffer, channels, depth_range, log2_radius_px, horizon_visibility }
    }

    /// Writes row `y` of channel `c`: as many values as `line` has, at most the frame's width.
    #[inline(always)]
    pub(crate) fn write(&self, (c, y): (usize, usize), line: &mut [f32]) {
        let first = y * self.gbuffer.width();
        let pixels = line.iter_mut().zip(&self.gbuffer.depth()[first..]);
        match self.channels[c] {
            Channel::Normal(k) => {
                let normals = &self.gbuffer.normal()[first..];
                line.iter_mut().zip(normals).for_each(|(value, n)| *value = n[usize::from(k)]);
            }
            Channel::NormalEncoded(k) => {
                let normals = &self.gbuffer.normal()[first..];
                pixels.zip(normals).for_each(|((value, &depth), n)| {
                    *value = if depth == f32::INFINITY { 0.0 } else { 0.5 * n[usize::from(k)] + 0.5 };
                });
            }
            Channel::Position(k) => {
                let camera = self.gbuffer.camera();
                pixels.enumerate().for_each(|(x, (value, &depth))| {
                    let position = || camera.position_view(x, y, depth)[usize::from(k)];
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
            Channel::ProjectedRadius => pixels.for_each(|(value, &depth)| {
                *value = self.projected_radius(depth);
            }),
            Channel::HorizonOcclusion => {
                let visibility = &self.horizon_visibility[first..];
                line.iter_mut().zip(visibility).for_each(|(value, v)| *value = 1.0 - v);
            }
        }
    }

    fn projected_radius(&self, depth: f32) -> f32 {
        let perspective = self.gbuffer.camera().is_perspective();
        let log2_depth = if perspective || depth == f32::INFINITY { depth.log2() } else { 0.0 };
        let (low, high) = LOG2_PX_RANGE;
        ((self.log2_radius_px - log2_depth).clamp(low, high) - LOG2_PX_MEAN) * LOG2_PX_SCALE
    }
}

/// HxW visibility of the horizon search that networks correct; 1 on the background.
pub fn horizon_visibility(gbuffer: &GBuffer, params: AoParams) -> Vec<f32> {
    let isa = Isa::new(Level::best()).expect("the best level of this machine");
    let pixels = gbuffer.depth().len();
    let (mut found, mut filtered) = (vec![0.0; pixels], vec![0.0; pixels]);
    search::horizon_rows(isa, (gbuffer, params), (0, &mut found));
    search::filtered_rows(isa, (gbuffer, params), &found, (0, &mut filtered));
    filtered
}

fn depth_range(gbuffer: &GBuffer) -> (f32, f32) {
    let finite = gbuffer.depth().iter().copied().filter(|d| d.is_finite());
    let (near, far) = finite.fold((f32::INFINITY, 0f32), |(a, b), d| (a.min(d), b.max(d)));
    (near, 1.0 / (far - near).max(f32::MIN_POSITIVE))
}

/// Repeats the last column and row of every `height` x `width` plane up to `plane / row` x `row`.
pub(crate) fn repeat_edge(planes: &mut [f32], (width, height): (usize, usize), (row, plane): (usize, usize)) {
    for image in planes.chunks_exact_mut(plane) {
        for line in image.chunks_exact_mut(row).take(height) {
            let last = line[width - 1];
            line[width..].fill(last);
        }
        let (done, rest) = image.split_at_mut(height * row);
        let last = &done[(height - 1) * row..];
        for line in rest.chunks_exact_mut(row) {
            line.copy_from_slice(last);
        }
    }
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

    fn fourth(features: Features, gbuffer: &GBuffer, radius: f32) -> Vec<f32> {
        let n = gbuffer.width();
        let mut out = vec![9.0; 4 * n];
        write_features(features, (gbuffer, AoParams::new(radius).unwrap()), &mut out, (n, n));
        out.split_off(3 * n)
    }

    #[test]
    fn projected_radius_does_not_depend_on_the_unit() {
        let fov = Projection::Perspective { fov_y: 1.0 };
        let metres = fourth(Features::NormalProjectedRadius, &frame(fov, vec![1.0, 2.0, f32::INFINITY]), 0.5);
        let inches = fourth(
            Features::NormalProjectedRadius,
            &frame(fov, vec![39.37, 78.74, f32::INFINITY]),
            0.5 * 39.37,
        );
        for (a, b) in metres.iter().zip(&inches) {
            assert!((a - b).abs() < 1e-5, "{metres:?} {inches:?}");
        }
        assert!((metres[0] - metres[1] - 0.25).abs() < 1e-6, "doubling the depth halves the radius");
        assert_eq!(metres[2], -2.25);
        let flat = fourth(
            Features::NormalProjectedRadius,
            &frame(Projection::Orthographic { height: 1.0 }, vec![1.0, 9.0]),
            0.5,
        );
        assert_eq!(flat[0], flat[1]);
    }

    #[test]
    fn normalised_depth_spans_zero_to_one() {
        let g = frame(Projection::Perspective { fov_y: 1.0 }, vec![3.0, 5.0, 4.0, f32::INFINITY]);
        assert_eq!(fourth(Features::NormalDepthNormalized, &g, 1.0), [0.0, 1.0, 0.5, 1.0]);
        assert_eq!(fourth(Features::NormalDepth, &g, 1.0), [3.0, 5.0, 4.0, 0.0]);
    }

    #[test]
    fn edges_repeat() {
        let mut plane = vec![1.0, 2.0, 0.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0];
        repeat_edge(&mut plane, (2, 2), (3, 9));
        assert_eq!(plane, [1.0, 2.0, 2.0, 3.0, 4.0, 4.0, 3.0, 4.0, 4.0]);
    }
}

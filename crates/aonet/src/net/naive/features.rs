//! The features of a frame, channel by channel as [`Channel`] defines them. AO-Net §3.1.

use super::Planes;
use super::lens::Lens;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::{Channel, Features};

/// The CxHxW features of a frame; `search` is what the search found, where a channel shows it.
///
/// # Panics
/// When a channel shows a search and `search` is none.
pub fn features(features: &Features, gbuffer: &GBuffer, params: AoParams, search: Option<&Planes>) -> Planes {
    let lens = Lens::new(gbuffer);
    let foreground = || gbuffer.depth().iter().filter(|depth| depth.is_finite());
    let nearest = foreground().copied().fold(f32::INFINITY, f32::min);
    let farthest = foreground().copied().fold(0.0, f32::max);
    let (width, height) = (gbuffer.width(), gbuffer.height());
    Planes::from_fn((features.channels().len(), height, width), |c, y, x| {
        let i = y * width + x;
        let (depth, normal) = (f64::from(gbuffer.depth()[i]), gbuffer.normal()[i]);
        let shows_geometry = gbuffer.is_foreground(i);
        let value = match features.channels()[c] {
            Channel::Normal(axis) if shows_geometry => f64::from(normal[axis.index()]),
            Channel::NormalEncoded(axis) if shows_geometry => 0.5 * f64::from(normal[axis.index()]) + 0.5,
            Channel::Position(axis) if shows_geometry => lens.position(x, y, depth)[axis.index()],
            Channel::Depth if shows_geometry => depth,
            Channel::Normal(_) | Channel::NormalEncoded(_) | Channel::Position(_) | Channel::Depth => 0.0,
            Channel::DepthNormalized if shows_geometry => {
                let range = f64::from(farthest) - f64::from(nearest);
                (depth - f64::from(nearest)) / range.max(f64::from(f32::MIN_POSITIVE))
            }
            Channel::DepthNormalized => 1.0,
            Channel::ProjectedRadius => {
                let radius_px = lens.projected_px(f64::from(params.radius()), depth);
                let log2_px = if shows_geometry { radius_px.log2() } else { f64::NEG_INFINITY };
                (log2_px.clamp(-4.0, 16.0) - 5.0) / 4.0
            }
            Channel::HorizonOcclusion => {
                let found = search.expect("what the search found");
                1.0 - f64::from(found.at(0, y as isize, x as isize))
            }
            Channel::Light(share) => {
                let found = search.expect("what the search found");
                f64::from(found.at(share.search_plane(), y as isize, x as isize))
            }
            Channel::SecondLayer => f64::from(u8::from(gbuffer.second().is_some())),
        };
        value as f32
    })
}

//! Attenuated GTAO of a frame, pixel by pixel in f64.
//!
//! In a slice, a plane through the pixel and the viewer, the visible sky between the viewer and a horizon at an angle t gives the
//! light of Jimenez et al. 2016, Eq. 7. Where a tap raises the horizon, the light of that rise is lost, the less of it the
//! farther away the tap is.

use super::screen::Screen;
use super::{Planes, arcs, filter};
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::SearchConfig;
use crate::search::{AgtaoParams, BENT_PLANES, Pass, noise_of};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Least cosine between normal and view that the tangent plane is followed at.
const MOST_GRAZING: f64 = 0.1;
/// Shortest sum of open directions, where the longest is 1, that has a direction.
const SHORTEST: f64 = 1e-4;
/// Least cosine between the projected normal and the viewer that the open sky is counted for.
const MOST_AVERTED: f64 = -0.25;

/// What a search finds, its filter included: the visibility, and the shares that it reports.
pub(super) fn search(config: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let found = bent_search(config, gbuffer, params);
    Planes::from_fn((config.planes(), found.height, found.width), |c, y, x| {
        found.at(c, y as isize, x as isize)
    })
}

/// One pass of the filter of a search over the part of an image that the frame covers.
pub(super) fn filter(
    (config, pass): (&SearchConfig, Pass),
    gbuffer: &GBuffer,
    params: AoParams,
    image: &Planes,
) -> Planes {
    let covered = Planes::from_fn((image.channels, gbuffer.height(), gbuffer.width()), |c, y, x| {
        image.at(c, y as isize, x as isize)
    });
    filter::filter(&Screen::new(gbuffer, params), (config.filter(), pass), &covered)
}

/// The bent normals of a search, its filter included. The frame has no guard band.
pub(super) fn bent_normals(config: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> Vec<[f32; 3]> {
    let found = bent_search(config, gbuffer, params);
    let (pixels, bend) = (gbuffer.depth().len(), config.planes());
    let one = |i: usize| {
        let normal = DVec3::from(gbuffer.normal()[i].map(f64::from));
        let [v, x, y, z] = [0, bend, bend + 1, bend + 2].map(|c| f64::from(found.values[c * pixels + i]));
        let sum = normal * v + DVec3::new(x, y, z);
        let bent = if sum.length() > SHORTEST { sum.normalize() } else { normal };
        if gbuffer.is_foreground(i) { bent.to_array().map(|c| c as f32) } else { [0.0; 3] }
    };
    (0..pixels).map(one).collect()
}

/// The visibility, the shares that the search reports, and the bend.
fn bent_search(config: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let screen = Screen::new(gbuffer, params);
    let mut found = match config {
        SearchConfig::Agtao(agtao) => {
            Planes::from_fn((BENT_PLANES, gbuffer.height(), gbuffer.width()), |c, y, x| {
                match gbuffer.is_foreground(y * gbuffer.width() + x) {
                    true => screen.visibility(agtao, x, y)[c] as f32,
                    false => [1.0, 0.0, 0.0, 0.0][c],
                }
            })
        }
        SearchConfig::Arcs(arcs) => arcs::planes(arcs, gbuffer, params),
    };
    for pass in config.filter().passes() {
        found = filter::filter(&screen, (config.filter(), pass), &found);
    }
    found
}

/// Light, and the integral of direction times light.
struct Light {
    light: f64,
    beam: DVec3,
}

/// Integrals of direction times light, sums over slices: what is lost, and the open sky of these slices.
#[derive(Default)]
pub(super) struct Beams {
    pub(super) lost: DVec3,
    pub(super) open: DVec3,
}

impl Beams {
    /// The bend by the share of light that is not lost, and that share with its power.
    pub(super) fn bend(&self, normal: DVec3, slices: u32, [share, powered]: [f64; 2]) -> DVec3 {
        // What is open, plus the share of what an open sky of all slices has more than one of these; in lengths of the former.
        let whole = normal * (2.0 / 3.0 * f64::from(slices));
        let bent = (self.open - self.lost + share * (whole - self.open)) / whole.length();
        (bent - share * normal) * (powered / share.max(1e-6))
    }
}

/// A plane through a pixel and the viewer.
pub(super) struct Slice {
    /// Direction on the screen, y up.
    pub(super) direction: [f64; 2],
    /// Unit vector in the slice, across the viewer.
    pub(super) along: DVec3,
    /// How far a vector goes towards the viewer once it is moved into the slice along the tangent plane.
    pub(super) towards: DVec3,
    /// Length of the normal's projection into the slice.
    pub(super) normal_length: f64,
    /// Angle of the projection from the viewer, positive along the slice (rad).
    pub(super) normal_angle: f64,
}

impl Slice {
    pub(super) fn new(normal: DVec3, viewer: DVec3, angle: f64) -> Self {
        let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let along = (direction - viewer * direction.dot(viewer)).normalize();
        let axis = direction.cross(viewer).normalize();
        let facing = normal.dot(viewer);
        let slide = normal.dot(axis) / facing.max(MOST_GRAZING);
        let leaning = normal.dot(along);
        Self {
            direction: [direction.x, direction.y],
            along,
            towards: viewer + axis * slide,
            normal_length: facing.hypot(leaning).max(1e-6),
            normal_angle: leaning.atan2(facing),
        }
    }

    /// Light between the viewer and a horizon with this cosine on the side of `sign`.
    pub(super) fn light_above(&self, cosine: f64, sign: f64) -> f64 {
        let (t, n) = (cosine.clamp(-1.0, 1.0).acos(), sign * self.normal_angle);
        0.5 * (t.sin().powi(2) * n.cos() + (t - t.sin() * t.cos()) * n.sin())
    }

    /// The integral of direction times light between the viewer and a horizon, in view space.
    pub(super) fn beam_above(&self, viewer: DVec3, cosine: f64, sign: f64) -> DVec3 {
        let (t, n) = (cosine.clamp(-1.0, 1.0).acos(), sign * self.normal_angle);
        let (sin, cos) = t.sin_cos();
        let towards = (n.cos() * (1.0 - cos.powi(3)) + n.sin() * sin.powi(3)) / 3.0;
        let along = (n.cos() * sin.powi(3) + n.sin() * (2.0 - 3.0 * cos + cos.powi(3))) / 3.0;
        viewer * towards + self.along * (sign * along)
    }

    /// The integral of direction times light on the side of `sign` when nothing occludes.
    pub(super) fn sky(&self, viewer: DVec3, sign: f64) -> DVec3 {
        self.beam_above(viewer, self.lowest(0.0, sign), sign)
    }

    /// Light of the slice when nothing occludes.
    pub(super) fn open(&self) -> f64 {
        let n = self.normal_angle.cos().max(MOST_AVERTED).acos();
        n.cos() + n * n.sin()
    }

    /// Cosine between the viewer and a horizon so low that coarse meshes do not rise above it.
    pub(super) fn lowest(&self, bias: f64, sign: f64) -> f64 {
        let n = self.normal_angle;
        n.cos().max(0.0) * bias.sin() - sign * n.sin() * bias.cos()
    }
}

/// Where the surface from `next` to `here`, which lies outside the radius, goes on into it, but not beyond `before`: cosine to the viewer, and
/// least distance. Half as far if `before` lies deeper than this surface and so cannot be on it.
fn entrance([before, here, next]: [DVec2; 3], radius: f64) -> Option<(f64, f64)> {
    let way = here - next;
    let (a, b, outside) = (way.length_squared(), here.dot(way), here.length_squared() - radius * radius);
    let root = b * b - a * outside;
    if outside <= 0.0 || b >= 0.0 || root < 0.0 {
        return None;
    }
    let (steps, gap) = ((-b - root.sqrt()) / a, (before.y - here.y) / way.y);
    let joined = here.x + gap * way.x <= before.x;
    let nearest = here + (-b / a).min(gap) * way;
    let enters = steps <= if joined { gap } else { 0.5 * gap };
    enters.then(|| ((here.x + steps * way.x) / radius, nearest.length().min(radius)))
}

impl Screen<'_> {
    /// Visibility and bend of a pixel before the filter.
    fn visibility(&self, params: &AgtaoParams, x: usize, y: usize) -> [f64; BENT_PLANES] {
        let (normal, viewer) = (self.normal(x, y), self.lens.to_viewer(x, y));
        let [turn, jitter] = noise_of(x, y).map(f64::from);
        let (mut lost, mut open, mut beams) = (0.0, 0.0, Beams::default());
        for s in 0..params.slices {
            let angle = (turn + f64::from(s)) * PI / f64::from(params.slices);
            let slice = Slice::new(normal, viewer, angle);
            let jitter = (jitter + f64::from(s) * 0.618_034).fract();
            let gone = self.lost(params, [x, y], &slice, jitter);
            lost += slice.normal_length * gone.light;
            open += slice.normal_length * slice.open();
            beams.lost += slice.normal_length * gone.beam;
            for sign in [1.0, -1.0] {
                beams.open += slice.normal_length * slice.sky(viewer, sign);
            }
        }
        let share = (1.0 - lost / open.max(1e-6)).clamp(0.0, 1.0);
        let powered = share.powf(f64::from(params.power));
        let bend = beams.bend(normal, params.slices, [share, powered]);
        [powered, bend.x, bend.y, bend.z]
    }

    /// Light of a slice that occluders on both sides take.
    fn lost(&self, params: &AgtaoParams, pixel: [usize; 2], slice: &Slice, jitter: f64) -> Light {
        let viewer = self.lens.to_viewer(pixel[0], pixel[1]);
        let radius = self.radius * f64::from(params.radius_scale);
        let reach_px = self.lens.projected_px(radius, self.depth(pixel[0], pixel[1]));
        let bias = f64::from(params.angle_bias).to_radians();
        let mut horizons = [1.0, -1.0].map(|sign| (sign, slice.lowest(bias, sign)));
        let mut lost = Light { light: 0.0, beam: DVec3::ZERO };
        // The last two places on each side, at first the pixel.
        let mut places = [[Some((DVec2::ZERO, 0.0)); 2]; 2];
        for step in 0..params.steps {
            let share = (jitter + f64::from(step)) / f64::from(params.steps);
            let pixels = (share.powf(f64::from(params.distribution)) * reach_px).max(1.0 + f64::from(step));
            for ((sign, horizon), places) in horizons.iter_mut().zip(&mut places) {
                let mut occludes = |cosine: f64, distance: f64| {
                    if cosine > *horizon {
                        let weight = 1.0 - f64::from(params.attenuation) * (distance / radius).powi(2);
                        let light = [*horizon, cosine].map(|cosine| slice.light_above(cosine, *sign));
                        let beam = [*horizon, cosine].map(|cosine| slice.beam_above(viewer, cosine, *sign));
                        lost.light += (light[0] - light[1]) * weight;
                        lost.beam += (beam[0] - beam[1]) * weight;
                        *horizon = cosine;
                    }
                };
                let [tap, _] = self.fronts(pixel, slice, *sign * pixels);
                // Towards the viewer, and along the slice.
                let now = tap.map(|tap| (DVec2::new(tap.dot(slice.towards), tap.dot(slice.along)), pixels));
                let [before, here] = *places;
                if let (Some((before, _)), Some((here, near)), Some((now, far))) = (before, here, now)
                    && params.follow > 0.0
                    && far - near <= (reach_px * f64::from(params.follow)).max(2.0)
                    && let Some((cosine, distance)) = entrance([before, here, now], radius)
                {
                    occludes(cosine, distance);
                }
                *places = [here, now];
                if let Some((now, _)) = now
                    && now.length() <= radius
                {
                    occludes(now.x / now.length(), now.length());
                }
            }
        }
        lost
    }

    /// The way from the pixel to each layer's surface at a tap, which is the pixel nearest to a point of the slice that is `pixels` heights
    /// of a pixel away. None outside the frame, on the background and where there is no second layer.
    pub(super) fn fronts(&self, pixel: [usize; 2], slice: &Slice, pixels: f64) -> [Option<DVec3>; 2] {
        let Some([column, row]) = self.tap_pixel(pixel, slice, pixels) else { return [None; 2] };
        let at = row * self.gbuffer.width() + column;
        let second = self.gbuffer.second().map(|second| f64::from(second.depth[at]));
        let from = self.lens.position(pixel[0], pixel[1], self.depth(pixel[0], pixel[1]));
        [Some(self.depth(column, row)), second].map(|depth| {
            let depth = depth.filter(|depth| depth.is_finite())?;
            Some(self.lens.position(column, row, depth) - from)
        })
    }

    /// The pixel of a tap, if it lies in the frame.
    fn tap_pixel(&self, [x, y]: [usize; 2], slice: &Slice, pixels: f64) -> Option<[usize; 2]> {
        let [right, up] = [slice.direction[0] * self.lens.columns_for_a_row(), slice.direction[1]]
            .map(|d| (d * pixels).round_ties_even());
        let (column, row) = (x as f64 + right, y as f64 - up);
        let (width, height) = (self.gbuffer.width() as f64, self.gbuffer.height() as f64);
        let inside = (0.0..width).contains(&column) && (0.0..height).contains(&row);
        inside.then_some([column as usize, row as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_light_of_a_slice_is_its_integral() {
        let normal = DVec3::new(0.3, 0.2, 0.9).normalize();
        let slice = Slice::new(normal, DVec3::Z, 0.7);
        // Sum of cos(t - n) sin t over thin arcs.
        let sum = |end: f64, sign: f64| {
            let arcs = 10_000;
            let width = end / f64::from(arcs);
            let light = |i| {
                let t = (f64::from(i) + 0.5) * width;
                (t - sign * slice.normal_angle).cos() * t.sin() * width
            };
            (0..arcs).map(light).sum::<f64>()
        };
        let beam = |end: f64, sign: f64| {
            let width = end / 1e4;
            let arc = |i| {
                let t = (f64::from(i) + 0.5) * width;
                let light = (t - sign * slice.normal_angle).cos() * t.sin() * width;
                (DVec3::Z * t.cos() + slice.along * (sign * t.sin())) * light
            };
            (0..10_000).map(arc).sum::<DVec3>()
        };
        for sign in [1.0, -1.0] {
            for end in [0.3, 1.0, FRAC_PI_2] {
                let off = slice.light_above(end.cos(), sign) - sum(end, sign);
                assert!(off.abs() < 1e-7, "{end} {sign}: {off}");
                let off = slice.beam_above(DVec3::Z, end.cos(), sign) - beam(end, sign);
                assert!(off.length() < 1e-7, "{end} {sign}: {off}");
            }
            // The tangent plane is the horizon of an open sky.
            let tangent = slice.lowest(0.0, sign);
            assert!((tangent.acos() - (FRAC_PI_2 + sign * slice.normal_angle)).abs() < 1e-12);
        }
        let both: f64 = [1.0, -1.0].iter().map(|s| slice.light_above(slice.lowest(0.0, *s), *s)).sum();
        assert!((both - slice.open()).abs() < 1e-12, "{both} {}", slice.open());
    }
}

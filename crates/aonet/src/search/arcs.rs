//! Connected arcs: what is seen to block light, apart from what may lie behind it.
// Ours: from the visibility bitmask (Therrien et al. 2023) the sectors of a slice. Two taps of a slice that lie on one
// surface block the sectors between them, whatever is in front of them. A tap also hides what is behind it: light that
// passes there is blocked with a probability. A second layer adds arcs of its own and hides only what is behind it.

use super::PixelMethod;
use super::cubic::Cubic;
use super::gtao::power;
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use super::surfels::{LENGTH, Surfels, unpacked};
use super::vbao::{SECTORS, sectors};
use crate::frame::BACKGROUND;
use crate::simd::Simd;
use crate::simd::integers::{Integer, U};
use crate::simd::lanes::{F, Mask};
use std::f32::consts::PI;

/// Taps on each side of a slice at most.
const MOST_STEPS: usize = 64;
/// Two taps are on one surface if the plane of either misses the other by less than this share of the step on the plane.
pub(crate) const CONNECTED: f32 = 0.7;
/// Least cosine between a tap's normal and its ray that its plane is followed at. guess
pub(crate) const MOST_GRAZING: f32 = 0.05;
/// Occluders nearer than this share of the AO radius are near ones.
pub(crate) const NEAR: f32 = 0.4;

/// How many steps back a tap looks for its surface. With two layers it may have been hidden in between.
pub(crate) const fn earlier_steps(layers: usize) -> usize {
    if layers == 1 { 1 } else { 2 }
}

filtered_params! {
    /// Parameters of connected arcs.
    ArcsParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 8 in 1..=64,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 1.4 in 1.0..=4.0,
        /// Occluders lower than so many degrees above the tangent plane do not count: hides coarse meshes.
        angle_bias: f32 = 3.0 in 0.0..=60.0,
        /// How far behind an occluder light may be blocked (share of the AO radius).
        thickness: f32 = 0.3 in 0.01..=4.0,
        /// Light lost for each share that a surface is seen to block: above 1 makes up for surfaces between taps.
        hit: f32 = 1.1 in 0.5..=2.0,
        /// Light lost for each share that passes behind occluders nearer than 0.4 of the AO radius.
        hidden_near: f32 = 0.5 in 0.0..=2.0,
        /// Light lost for each share that passes behind farther ones: above 1 for what is farther behind.
        hidden_far: f32 = 1.0 in 0.0..=2.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl ArcsParams {
    /// Distance of a step's taps by jitter, as a share of the AO radius.
    pub(crate) fn share(&self, step: usize) -> Cubic {
        let (steps, exponent) = (f64::from(self.steps), f64::from(self.distribution));
        Cubic::near(|jitter| ((jitter + step as f64) / steps).powf(exponent))
    }
}

/// Connected arcs of one frame.
pub(crate) struct Arcs<'a> {
    screen: &'a Screen<'a>,
    params: ArcsParams,
    /// Depth and packed normals of each layer; empty where there is none.
    layers: [(&'a [f32], &'a [f32]); 2],
    /// Of the angle bias.
    cos_sin_bias: [f32; 2],
    /// Distance of each step's taps by jitter, as a share of the AO radius.
    shares: [Cubic; MOST_STEPS],
}

/// A vector in the plane of a slice: along it, and towards the viewer.
#[derive(Clone, Copy)]
struct V2<S: Simd> {
    along: F<S>,
    towards: F<S>,
}

impl<S: Simd> V2<S> {
    #[inline(always)]
    fn dot(self, other: Self) -> F<S> {
        self.along.mul_add(other.along, self.towards * other.towards)
    }

    /// This times `by` plus `plus`.
    #[inline(always)]
    fn mul_add(self, by: F<S>, plus: Self) -> Self {
        Self { along: self.along.mul_add(by, plus.along), towards: self.towards.mul_add(by, plus.towards) }
    }
}

/// One side of a slice.
#[derive(Clone, Copy)]
struct Side<'s, S: Simd> {
    p: &'s Pixels<S>,
    slice: &'s Slice<S>,
    /// 1 along the slice, -1 against it.
    sign: f32,
    /// Where a step on the screen goes, for each world unit.
    across: V2<S>,
    /// Height of a pixel (world units): the first times the depth plus the second.
    pixel_size: [f32; 2],
    /// Cosine between the viewer and the lowest occluder that counts.
    lowest: F<S>,
    /// Sectors for each share of light.
    scale: F<S>,
    /// What is added before rounding to whole sectors: in [-0.5, 0.5).
    dither: F<S>,
}

/// A place on a surface that a tap sees.
#[derive(Clone, Copy)]
struct Seen<S: Simd> {
    /// Whether there is a surface.
    valid: Mask<S>,
    /// Signed distance on the screen (px), and depth (world units).
    pixels: F<S>,
    depth: F<S>,
    /// Its normal in the plane of the slice, of any length.
    normal: V2<S>,
    /// Sectors between the viewer and it: a whole number.
    sector: F<S>,
}

/// What a tap reads, and where.
struct Tap<S: Simd> {
    /// Row-major index of the pixel, and whether it lies in the frame.
    index: U<S>,
    inside: Mask<S>,
    /// Signed distance on the screen (px).
    pixels: F<S>,
    /// Where its ray goes for each unit of depth.
    ray: V2<S>,
    /// From the centre of the pixel to the tap's place: right and up (px, by their height).
    right: F<S>,
    up: F<S>,
}

/// Sectors of one side.
#[derive(Clone, Copy)]
struct Blocked<S: Simd> {
    hit: U<S>,
    near: U<S>,
    far: U<S>,
}

impl<S: Simd> Side<'_, S> {
    /// Where the ray of a place goes, so many pixels along: for each unit of depth.
    #[inline(always)]
    fn ray(&self, pixels: F<S>) -> V2<S> {
        let step = pixels * self.pixel_size[0];
        V2 { along: step * self.across.along, towards: step.mul_add(self.across.towards, -self.p.ray_length) }
    }

    /// From the pixel to a place so many pixels along, at a depth.
    #[inline(always)]
    fn offset(&self, pixels: F<S>, depth: F<S>) -> V2<S> {
        let step = pixels * depth.mul_add(self.pixel_size[0], self.pixel_size[1]);
        let farther = depth + self.p.position.z;
        let towards = step.mul_add(self.across.towards, -(farther * self.p.ray_length));
        V2 { along: step * self.across.along, towards }
    }

    /// Sectors between the viewer and an offset: a whole number.
    #[inline(always)]
    fn sector(&self, offset: V2<S>) -> F<S> {
        let cosine = offset.towards * offset.dot(offset).max(1e-36).rough_inverse_sqrt();
        let light = self.slice.light_above(cosine.max(self.lowest).min(1.0), self.sign);
        light.mul_add(self.scale, self.dither).max(0.0).min(SECTORS).round().float()
    }

    /// The pixel itself: arcs begin at the tangent plane.
    #[inline(always)]
    fn origin(&self) -> Seen<S> {
        let (simd, slice) = (self.p.x.simd(), self.slice);
        let zero = F::new(simd, 0.0);
        Seen {
            valid: zero.le(0.0),
            pixels: zero,
            depth: -self.p.position.z,
            normal: V2 { along: slice.sin_n, towards: slice.cos_n },
            sector: F::new(simd, SECTORS),
        }
    }

    /// Whether the plane of one place predicts the depth of another, whose ray is given.
    #[inline(always)]
    fn predicts(&self, from: &Seen<S>, to: &Seen<S>, ray: V2<S>) -> Mask<S> {
        // The ray meets the plane `fall / facing` nearer than `from`.
        let size = from.depth.mul_add(self.pixel_size[0], self.pixel_size[1]);
        let step = (to.pixels - from.pixels) * size;
        let facing = ray.dot(from.normal);
        let fall = step * self.across.dot(from.normal);
        let miss = (to.depth - from.depth).mul_add(facing, fall);
        // From `from` to there, times `facing`.
        let across = step * facing;
        let way = V2 {
            along: across.mul_add(self.across.along, -(fall * ray.along)),
            towards: across.mul_add(self.across.towards, -(fall * ray.towards)),
        };
        let in_front = F::new(fall.simd(), 0.0).lt(from.depth.mul_add(facing, -fall) * facing);
        in_front & (miss * miss * ray.dot(ray)).lt(way.dot(way) * (CONNECTED * CONNECTED))
    }
}

/// Sectors from `low` up to, not including, `high`, where `felt`.
#[inline(always)]
fn within<S: Simd>(low: F<S>, high: F<S>, felt: Mask<S>) -> U<S> {
    felt.select(sectors(low.round(), high.round()).float_of_bits(), 0.0).bits()
}

impl<'a> Arcs<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: ArcsParams, surfels: &'a Surfels) -> Self {
        let (sin, cos) = params.angle_bias.to_radians().sin_cos();
        let mut shares = [Cubic::ZERO; MOST_STEPS];
        for (k, share) in shares[..params.steps as usize].iter_mut().enumerate() {
            *share = params.share(k);
        }
        let first = (screen.gbuffer().depth(), surfels.layer(0));
        let second = screen.gbuffer().second().map(|second| (&*second.depth, surfels.layer(1)));
        Self {
            screen,
            params,
            layers: [first, second.unwrap_or((&[], &[]))],
            cos_sin_bias: [cos, sin],
            shares,
        }
    }

    /// One side of a slice, and its light when nothing occludes.
    #[inline(always)]
    fn side<'s, S: Simd>(
        &self,
        p: &'s Pixels<S>,
        slice: &'s Slice<S>,
        sign: f32,
        dither: F<S>,
    ) -> (Side<'s, S>, F<S>) {
        let view_slope = slice.dx.mul_add(p.to_viewer.x, slice.dy * p.to_viewer.y);
        let across = V2 { along: (1.0 - view_slope * view_slope).sqrt(), towards: view_slope };
        let [cos_bias, sin_bias] = self.cos_sin_bias;
        let light = slice.light_above((slice.sin_n * -sign).max(-1.0).min(1.0), sign).max(1e-6);
        let lowest = slice.cos_n.max(0.0).mul_add(sin_bias, slice.sin_n * (-sign * cos_bias));
        let pixel_size = self.screen.pixel_size_line();
        let scale = SECTORS / light;
        (Side { p, slice, sign, across, pixel_size, lowest, scale, dither: dither - 0.5 }, light)
    }

    /// Share of its light that one side of a slice loses.
    #[inline(always)]
    fn lost<S: Simd, const LAYERS: usize>(&self, side: &Side<'_, S>, jitter: F<S>) -> F<S> {
        let simd = jitter.simd();
        let none = 0u32.integer_lanes(simd);
        let mut blocked = Blocked { hit: none, near: none, far: none };
        let nothing = Seen { valid: F::new(simd, 1.0).le(0.0), ..side.origin() };
        // The tap before, and the one before that.
        let mut before = [[nothing; LAYERS]; 2];
        before[0][0] = side.origin();
        for (k, share) in self.shares[..self.params.steps as usize].iter().enumerate() {
            let pixels = (share.at(jitter) * side.p.radius_px).max(1.0 + k as f32).min(65_536.0);
            let tap = self.tap(side, pixels * side.sign);
            let mut now = [nothing; LAYERS];
            for (layer, now) in now.iter_mut().enumerate() {
                *now = self.look(side, &tap, layer, &before, &mut blocked);
            }
            before = [now, before[0]];
        }
        let Blocked { hit, near, far } = blocked;
        let near = near & (near - (near & hit));
        let far = far & (far - (far & (hit | near)));
        let (hit, near, far) = (hit.count_ones(), near.count_ones(), far.count_ones());
        let hidden = near.float().mul_add(self.params.hidden_near, far.float() * self.params.hidden_far);
        hit.float().mul_add(self.params.hit, hidden) * (1.0 / SECTORS)
    }

    /// Where a tap so many pixels along reads the frame.
    #[inline(always)]
    fn tap<S: Simd>(&self, side: &Side<'_, S>, pixels: F<S>) -> Tap<S> {
        let (screen, p, size) = (self.screen, side.p, self.screen.size());
        let (right, up) = (side.slice.dx * pixels, side.slice.dy * pixels);
        let (columns, rows) = ((right * (1.0 / screen.aspect)).round(), (-up).round());
        let inside = (p.column + columns).lt(size.width() as u32) & (p.row + rows).lt(size.height() as u32);
        Tap {
            index: p.index + rows * size.width() as u32 + columns,
            inside,
            pixels,
            ray: side.ray(pixels),
            right: columns.float().mul_add(-screen.aspect, right),
            up: up + rows.float(),
        }
    }

    /// What a tap sees in a layer, and where from the pixel: the surface's place in the slice.
    #[inline(always)]
    fn seen<S: Simd>(&self, side: &Side<'_, S>, tap: &Tap<S>, layer: usize) -> (Seen<S>, V2<S>) {
        let (depths, normals) = self.layers[layer];
        let depth = tap.index.gather(depths);
        let valid = tap.inside & depth.lt(BACKGROUND);
        let depth = valid.select(depth, 1.0);
        let normal = unpacked(tap.index.gather(normals).bits());
        let turned = V2 { along: normal.dot(side.slice.along), towards: normal.dot(side.p.to_viewer) };
        // The pixel's plane at the tap's place.
        let facing = tap.ray.dot(turned).min(-MOST_GRAZING * LENGTH);
        let beside = tap.right.mul_add(normal.x, tap.up * normal.y);
        let depth = depth - self.screen.pixel_size(depth) * beside / facing;
        let offset = side.offset(tap.pixels, depth);
        (Seen { valid, pixels: tap.pixels, depth, normal: turned, sector: side.sector(offset) }, offset)
    }

    /// What a tap sees in a layer; blocks the arcs that end there, and hides what is behind the last layer.
    #[inline(always)]
    fn look<S: Simd, const LAYERS: usize>(
        &self,
        side: &Side<'_, S>,
        tap: &Tap<S>,
        layer: usize,
        before: &[[Seen<S>; LAYERS]; 2],
        blocked: &mut Blocked<S>,
    ) -> Seen<S> {
        let (now, offset) = self.seen(side, tap, layer);
        let radius = self.screen.radius;
        let squared = offset.dot(offset);
        let felt = now.valid & squared.le(radius * radius);
        let (mut low, mut high) = (now.sector, now.sector);
        for step in &before[..earlier_steps(LAYERS)] {
            for earlier in step {
                // Mostly both lie below the tangent plane: there is no sector between them.
                let between = earlier.sector.lt(now.sector) | now.sector.lt(earlier.sector);
                let between = between & felt & earlier.valid;
                if !between.any() {
                    continue;
                }
                let joined = side.predicts(earlier, &now, tap.ray)
                    | side.predicts(&now, earlier, side.ray(earlier.pixels));
                let joined = joined & between;
                low = joined.select(low.min(earlier.sector), low);
                high = joined.select(high.max(earlier.sector), high);
            }
        }
        blocked.hit = blocked.hit | within(low, high, felt);
        let hides = felt & now.sector.lt(SECTORS - 0.5);
        if layer + 1 == LAYERS && hides.any() {
            let end = side.sector(tap.ray.mul_add(self.behind(tap.ray, offset, squared), offset));
            let hidden = within(now.sector.min(end), now.sector.max(end), hides).float_of_bits();
            let near = squared.le((NEAR * radius) * (NEAR * radius));
            blocked.near = blocked.near | near.select(hidden, 0.0).bits();
            blocked.far = blocked.far | near.select(0.0, hidden).bits();
        }
        now
    }

    /// How much deeper along its ray a place hides light: within the thickness, and the AO radius.
    #[inline(always)]
    fn behind<S: Simd>(&self, ray: V2<S>, offset: V2<S>, squared: F<S>) -> F<S> {
        let radius = self.screen.radius;
        let (a, b, c) = (ray.dot(ray), ray.dot(offset), squared - radius * radius);
        let leaves = (b.mul_add(b, -(a * c)).sqrt() - b) / a;
        leaves.min(a.rough_inverse_sqrt() * (self.params.thickness * radius))
    }

    /// Share of a pixel's light that is lost.
    #[inline(always)]
    fn lost_share<S: Simd, const LAYERS: usize>(&self, p: &Pixels<S>, [turn, jitter]: [F<S>; 2]) -> F<S> {
        let simd = p.x.simd();
        let inverse = 1.0 / self.params.slices as f32;
        let (mut lost, mut open) = (F::new(simd, 0.0), F::new(simd, 0.0));
        for s in 0..self.params.slices {
            let slice = Slice::towards(p, ((turn + s as f32) * (PI * inverse)).cos_sin_of_half_turn());
            let dither = jitter.mul_add(7.0, s as f32 * 0.414_214).fract();
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            for sign in [1.0, -1.0] {
                let (side, light) = self.side(p, &slice, sign, dither);
                let light = light * slice.normal_length;
                lost = self.lost::<S, LAYERS>(&side, jitter).mul_add(light, lost);
                open += light;
            }
        }
        lost / open.max(1e-6)
    }
}

impl PixelMethod for Arcs<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let noise = noise_at(p.x.simd(), x, y);
        let lost = if self.layers[1].0.is_empty() {
            self.lost_share::<S, 1>(p, noise)
        } else {
            self.lost_share::<S, 2>(p, noise)
        };
        power((1.0 - lost).saturate(), self.params.power)
    }
}

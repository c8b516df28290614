//! Connected arcs: what is seen to block light, apart from what may lie behind it.
// Ours: from the visibility bitmask (Therrien et al. 2023) the sectors of a slice. Two taps of a slice that lie on one
// surface block the sectors between them, whatever is in front of them. A tap also hides what is behind it: light that
// passes there is blocked with a probability. A second layer adds arcs of its own and hides what is behind it. Then the first layer
// hides only light that passes close behind it, where no second layer shows anything.

use super::PixelShares;
use super::bent::{BENT_SHARES, Beams};
use super::cubic::Spacing;
use super::gtao::power;
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use super::shares::{GAPS, PLANES, SHARES};
use super::side::{Seen, Side, Tap, V2};
use super::slice::Slice;
use super::surfels::{LENGTH, unpacked};
use super::vbao::{SECTORS, sectors};
use crate::frame::BACKGROUND;
use crate::simd::Simd;
use crate::simd::integers::{Integer, U};
use crate::simd::lanes::{F, Mask};
use std::f32::consts::PI;

/// Least cosine between a tap's normal and its ray that its plane is followed at.
pub const MOST_GRAZING: f32 = 0.2;

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
        /// Light lost for each share that a surface is seen to block: above 1 makes up for surfaces between taps.
        hit: f32 = 1.0 in 0.5..=2.0,
        /// Light lost for each share that passes behind an occluder by less than 0.1 of the AO radius.
        hidden_close: f32 = 0.6 in 0.0..=2.0,
        /// The same by 0.1 to 0.3 of the AO radius.
        hidden_middle: f32 = 0.4 in 0.0..=2.0,
        /// The same by more.
        hidden_deep: f32 = 0.2 in 0.0..=2.0,
        /// Light lost for each share that leaves the frame.
        off: f32 = 0.0 in 0.0..=2.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
        /// Taps that may lie between two taps of one surface, in a frame with one layer. With two layers it is always one.
        #[serde(default)]
        between: u32 = 0 in 0..=1,
    }
}

impl ArcsParams {
    /// How many steps back a tap looks for its surface. With two layers it may have been hidden in between.
    pub(crate) fn earlier_steps(&self, layers: usize) -> usize {
        if layers == 1 { self.between as usize + 1 } else { MOST_EARLIER }
    }

    pub(crate) fn spacing(&self) -> Spacing {
        Spacing::new(self.steps, self.distribution)
    }

    /// Light lost for each share, in the order of [`Share::ALL`](super::Share::ALL), without the open one.
    pub fn lost(&self) -> [f32; SHARES] {
        [self.hit, self.hidden_close, self.hidden_middle, self.hidden_deep, self.off]
    }
}

/// Most steps back that a tap looks for its surface.
const MOST_EARLIER: usize = 2;

/// Connected arcs of one frame.
pub(crate) struct Arcs<'a> {
    screen: &'a Screen<'a>,
    params: ArcsParams,
    /// Depth and packed normals of each layer; empty where there is none.
    layers: [(&'a [f32], &'a [f32]); 2],
    /// Of the angle bias.
    cos_sin_bias: [f32; 2],
    spacing: Spacing,
    /// Light lost for each share.
    lost: [f32; SHARES],
}

/// Sectors of one side.
#[derive(Clone, Copy)]
struct Blocked<S: Simd> {
    hit: U<S>,
    /// Behind something seen by less than each of the gaps.
    hidden: [U<S>; GAPS.len()],
    off: U<S>,
}

impl<S: Simd> Blocked<S> {
    /// Sectors of each share: what is hit is not hidden, and what is hidden is not off.
    #[inline(always)]
    fn shares(&self) -> [U<S>; SHARES] {
        let mut seen = self.hit;
        let [close, middle, deep] = self.hidden;
        let mut shares = [self.hit, close, middle, deep, self.off];
        for share in &mut shares[1..] {
            let all = seen | *share;
            *share = all - seen;
            seen = all;
        }
        shares
    }
}

/// Sectors from `low` up to, not including, `high`, where `felt`.
#[inline(always)]
fn within<S: Simd>(low: F<S>, high: F<S>, felt: Mask<S>) -> U<S> {
    felt.select(sectors(low.round(), high.round()).float_of_bits(), 0.0).bits()
}

impl<'a> Arcs<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: ArcsParams, surfels: [&'a [f32]; 2]) -> Self {
        let (sin, cos) = params.angle_bias.to_radians().sin_cos();
        let first = (screen.gbuffer().depth(), surfels[0]);
        let second = screen.gbuffer().second().map(|second| (&*second.depth, surfels[1]));
        Self {
            screen,
            params,
            layers: [first, second.unwrap_or((&[], &[]))],
            cos_sin_bias: [cos, sin],
            spacing: params.spacing(),
            lost: params.lost(),
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

    /// What becomes of the light on one side of a slice.
    #[inline(always)]
    fn blocked<S: Simd, const LAYERS: usize, const EARLIER: usize>(
        &self,
        side: &Side<'_, S>,
        jitter: F<S>,
    ) -> Blocked<S> {
        let simd = jitter.simd();
        let none = 0u32.integer_lanes(simd);
        let mut blocked = Blocked { hit: none, hidden: [none; GAPS.len()], off: none };
        let nothing = Seen { valid: F::new(simd, 1.0).le(0.0), ..side.origin() };
        // What the tap before saw, and with EARLIER 2 the one before that.
        let mut before = [[nothing; LAYERS]; EARLIER];
        before[0][0] = side.origin();
        for (k, share) in self.spacing.steps().iter().enumerate() {
            let pixels = (share.at(jitter) * side.p.radius_px).max(1.0 + k as f32).min(65_536.0);
            let tap = self.tap(side, pixels * side.sign);
            if (!tap.inside).any() {
                blocked.off = blocked.off | self.off(side, &tap);
            }
            let mut now = [nothing; LAYERS];
            for (layer, now) in now.iter_mut().enumerate() {
                *now = self.look(side, &tap, layer, &before, &mut blocked);
            }
            before.copy_within(..EARLIER - 1, 1);
            before[0] = now;
        }
        blocked
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

    /// What a tap sees in a layer: the surface's place in the slice.
    #[inline(always)]
    fn seen<S: Simd>(&self, side: &Side<'_, S>, tap: &Tap<S>, layer: usize) -> Seen<S> {
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
        let near = valid & offset.dot(offset).le(self.screen.radius * self.screen.radius);
        Seen { valid, pixels: tap.pixels, depth, normal: turned, offset, near, sector: side.sector(offset) }
    }

    /// What a tap sees in a layer. Blocks the arcs that end there, as far as they lie within the AO radius. Hides what is behind the last
    /// layer, and close behind the first one.
    #[inline(always)]
    fn look<S: Simd, const LAYERS: usize, const EARLIER: usize>(
        &self,
        side: &Side<'_, S>,
        tap: &Tap<S>,
        layer: usize,
        before: &[[Seen<S>; LAYERS]; EARLIER],
        blocked: &mut Blocked<S>,
    ) -> Seen<S> {
        let now = self.seen(side, tap, layer);
        for (i, earlier) in before.as_flattened().iter().enumerate() {
            // Mostly both lie below the tangent plane: there is no sector between them.
            let between = earlier.sector.lt(now.sector) | now.sector.lt(earlier.sector);
            let between = between & now.valid & earlier.valid & (now.near | earlier.near);
            if !between.any() {
                continue;
            }
            let forth = side.predicts(earlier, &now, tap.ray);
            let back = side.predicts(&now, earlier, side.ray(earlier.pixels));
            let whole = now.near & earlier.near;
            let joined = between & (forth | back);
            // With two layers, arcs between layers and over the border of the AO radius need both planes: one alone is wrong too often.
            let joined = match LAYERS {
                1 => joined,
                _ if i % LAYERS == layer => joined & (whole | (forth & back)),
                _ => joined & forth & back,
            };
            let [mut from, mut to] = [earlier.sector, now.sector];
            if (joined & !whole).any() {
                let border = self.border(side, [earlier, &now]);
                from = earlier.near.select(from, border);
                to = now.near.select(to, border);
            }
            blocked.hit = blocked.hit | within(from.min(to), from.max(to), joined);
        }
        // What a second layer shows lies farther behind the first.
        let gaps = if layer + 1 == LAYERS { &GAPS[..] } else { &GAPS[..1] };
        self.hide(side, tap, &now, gaps, blocked);
        now
    }

    /// Hides the sectors that pass behind what a tap sees, by less than each of the `gaps`.
    #[inline(always)]
    fn hide<S: Simd>(
        &self,
        side: &Side<'_, S>,
        tap: &Tap<S>,
        seen: &Seen<S>,
        gaps: &[f32],
        blocked: &mut Blocked<S>,
    ) {
        let hides = seen.near & seen.sector.lt(SECTORS - 0.5);
        if !hides.any() {
            return;
        }
        let (a, b) = (tap.ray.dot(tap.ray), tap.ray.dot(seen.offset));
        let leaves = self.crossing(a, b, seen.offset.dot(seen.offset))[1];
        let along_ray = a.rough_inverse_sqrt() * self.screen.radius;
        for (hidden, gap) in blocked.hidden.iter_mut().zip(gaps) {
            let end = side.sector(tap.ray.mul_add(leaves.min(along_ray * *gap), seen.offset));
            *hidden = *hidden | within(seen.sector.min(end), seen.sector.max(end), hides);
        }
    }

    /// Sectors between the viewer and where the way from one place to another leaves the AO radius, or enters it.
    #[inline(always)]
    fn border<S: Simd>(&self, side: &Side<'_, S>, [earlier, now]: [&Seen<S>; 2]) -> F<S> {
        let inside = V2::choose(now.near, [now.offset, earlier.offset]);
        let outside = V2::choose(now.near, [earlier.offset, now.offset]);
        let way = outside.minus(inside);
        let leaves = self.crossing(way.dot(way), way.dot(inside), inside.dot(inside))[1];
        side.sector(way.mul_add(leaves, inside))
    }

    /// Shares of a pixel's light; the vectors of what is lost only with BENT.
    #[inline(always)]
    fn shares_of<S: Simd, const LAYERS: usize, const EARLIER: usize, const BENT: bool>(
        &self,
        p: &Pixels<S>,
        [turn, jitter]: [F<S>; 2],
    ) -> ([F<S>; SHARES], Beams<S>) {
        let simd = p.x.simd();
        let inverse = 1.0 / self.params.slices as f32;
        let zero = F::new(simd, 0.0);
        let (mut shares, mut open, mut beams) = ([zero; SHARES], zero, Beams::new(simd));
        for s in 0..self.params.slices {
            let slice = Slice::towards(p, ((turn + s as f32) * (PI * inverse)).cos_sin_of_half_turn());
            let dither = jitter.mul_add(7.0, s as f32 * 0.414_214).fract();
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            let mut lost = [zero; 2];
            for sign in [1.0, -1.0] {
                let (side, light) = self.side(p, &slice, sign, dither);
                let light = light * slice.normal_length;
                let found = self.blocked::<S, LAYERS, EARLIER>(&side, jitter).shares();
                for c in 0..SHARES {
                    shares[c] = found[c].count_ones().float().mul_add(light, shares[c]);
                }
                open += light;
                if BENT {
                    let [towards, along] = side.lost_beam(&found, &self.lost);
                    lost = [lost[0] + towards, lost[1] + along];
                }
            }
            if BENT {
                beams.add(p, &slice, lost);
            }
        }
        let inverse = (1.0 / SECTORS) / open.max(1e-6);
        for share in &mut shares {
            *share *= inverse;
        }
        (shares, beams)
    }

    /// Visibility and shares of the pixels from a place on, then, with BENT, the bend.
    #[inline(always)]
    fn planes<S: Simd, const BENT: bool, const N: usize>(
        &self,
        p: &Pixels<S>,
        (x, y): (usize, usize),
    ) -> [F<S>; N] {
        let noise = noise_at(p.x.simd(), x, y);
        let layers = if self.layers[1].0.is_empty() { 1 } else { 2 };
        let (shares, beams) = match (layers, self.params.earlier_steps(layers)) {
            (1, 1) => self.shares_of::<S, 1, 1, BENT>(p, noise),
            (1, _) => self.shares_of::<S, 1, MOST_EARLIER, BENT>(p, noise),
            _ => self.shares_of::<S, 2, MOST_EARLIER, BENT>(p, noise),
        };
        let mut planes = [F::new(p.x.simd(), 1.0); N];
        for c in 0..SHARES {
            planes[0] = shares[c].mul_add(-self.lost[c], planes[0]);
            planes[c + 1] = shares[c];
        }
        let share = planes[0].saturate();
        planes[0] = power(share, self.params.power);
        if BENT {
            let bend = beams.bend(p, self.params.slices, [share, planes[0]]);
            planes[PLANES..].copy_from_slice(&[bend.x, bend.y, bend.z]);
        }
        planes
    }

    /// How much deeper along a ray it enters the sphere of the AO radius, and leaves it. The ray starts at an offset from the
    /// pixel; `a` is its squared length, `b` its product with the offset, and `squared` the offset's squared length.
    #[inline(always)]
    fn crossing<S: Simd>(&self, a: F<S>, b: F<S>, squared: F<S>) -> [F<S>; 2] {
        let c = squared - self.screen.radius * self.screen.radius;
        let half = b.mul_add(b, -(a * c)).max(0.0).sqrt();
        let inverse = 1.0 / a;
        [(-half - b) * inverse, (half - b) * inverse]
    }

    /// Sectors of light that leaves the frame within the AO radius, for a tap outside of it.
    #[inline(always)]
    fn off<S: Simd>(&self, side: &Side<'_, S>, tap: &Tap<S>) -> U<S> {
        let offset = side.offset(tap.pixels, -side.p.position.z);
        let (a, b) = (tap.ray.dot(tap.ray), tap.ray.dot(offset));
        let [enters, leaves] = self.crossing(a, b, offset.dot(offset));
        let high = side.sector(tap.ray.mul_add(enters, offset));
        let low = side.sector(tap.ray.mul_add(leaves, offset));
        within(high.min(low), high.max(low), !tap.inside & enters.lt(leaves))
    }
}

impl PixelShares<PLANES> for Arcs<'_> {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; PLANES] {
        self.planes::<S, false, PLANES>(p, at)
    }
}

impl PixelShares<BENT_SHARES> for Arcs<'_> {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; BENT_SHARES] {
        self.planes::<S, true, BENT_SHARES>(p, at)
    }
}

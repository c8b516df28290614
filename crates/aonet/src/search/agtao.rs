//! GTAO that fades every occluder by its own distance instead of one horizon.
// Ours: from GTAO (Jimenez et al. 2016) the light between two angles of a slice, from HBAO (Bavoil et al. 2008) the walk
// along it. Where the horizon rises, the light of that rise is lost, the less of it the farther away the occluder is:
// a distant wall no longer hides what a near edge takes, as the highest horizon alone would have it.

use super::bent::{BEAM, BENT_PLANES, Sums};
use super::cubic::Spacing;
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use super::stride::{Seen, Stride};
use super::{PixelMethod, PixelShares};
use crate::frame::BACKGROUND;
use crate::simd::Simd;
use crate::simd::lanes::{F, Mask};
use std::f32::consts::PI;

filtered_params! {
    /// Parameters of attenuated GTAO.
    AgtaoParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 6 in 1..=64,
        /// The radius of the search, as a factor on the AO radius: makes up for the attenuation.
        radius_scale: f32 = 1.4 in 0.1..=4.0,
        /// Surfaces are followed to where they enter the search's radius, between taps that are no farther apart than this share of it, or than
        /// 2 px; 0 turns it off. Finds walls and floors that taps step over.
        #[serde(default)]
        follow: f32 = 0.0 in 0.0..=1.0,
        /// How much occluders fade with their squared distance: 1 fades them out at the radius of the search, 0 turns it off.
        attenuation: f32 = 0.8 in 0.0..=1.0,
        /// Occluders lower than so many degrees above the tangent plane do not count: hides coarse meshes.
        angle_bias: f32 = 3.0 in 0.0..=60.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 2.0 in 1.0..=4.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl AgtaoParams {
    pub(crate) fn spacing(&self) -> Spacing {
        Spacing::new(self.steps, self.distribution)
    }
}

/// Attenuated GTAO of one frame.
pub(crate) struct Agtao<'a> {
    screen: &'a Screen<'a>,
    params: AgtaoParams,
    /// Of the search, squared (square world units).
    squared_radius: f32,
    /// Of the angle bias.
    cos_sin_bias: [f32; 2],
    /// From slice to slice.
    cos_sin_turn: [f32; 2],
    spacing: Spacing,
}

/// Surfaces are followed between taps up to so many pixels apart at any radius.
pub(crate) const NEAR: f32 = 2.0;

/// The highest occluder so far on one side of a slice.
struct Horizon<S: Simd, const N: usize> {
    /// 1 along the slice, -1 against it.
    sign: f32,
    /// Of the angle to the viewer.
    cosine: F<S>,
    /// Light between the viewer and it. See [`Slice::beam_above`].
    beam: [F<S>; N],
    /// The last two places that were looked at; at first the pixel itself.
    places: [Place<S>; 2],
}

/// What a tap sees.
#[derive(Clone, Copy)]
struct Place<S: Simd> {
    at: Seen<S>,
    /// Distance on the screen (px).
    pixels: F<S>,
    /// Whether it is a surface in the frame.
    known: Mask<S>,
}

impl<S: Simd, const N: usize> Horizon<S, N> {
    #[inline(always)]
    fn new(slice: &Slice<S>, sign: f32, cosine: F<S>) -> Self {
        let zero = F::new(cosine.simd(), 0.0);
        let pixel = Place {
            at: Seen { towards: zero, along: zero, squared: zero },
            pixels: zero,
            known: zero.le(0.0),
        };
        Self { sign, cosine, beam: slice.beam_above(cosine, sign), places: [pixel; 2] }
    }
}

impl<'a> Agtao<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: AgtaoParams) -> Self {
        let (sin, cos) = params.angle_bias.to_radians().sin_cos();
        let radius = screen.radius * params.radius_scale;
        let (turn_sin, turn_cos) = (PI / params.slices as f32).sin_cos();
        Self {
            screen,
            params,
            squared_radius: radius * radius,
            cos_sin_bias: [cos, sin],
            cos_sin_turn: [turn_cos, turn_sin],
            spacing: params.spacing(),
        }
    }

    /// Light that occluders on both sides of a slice take. `FOLLOW`: whether surfaces are followed between taps.
    #[inline(always)]
    fn lost<S: Simd, const N: usize, const FOLLOW: bool>(
        &self,
        p: &Pixels<S>,
        slice: &Slice<S>,
        jitter: F<S>,
    ) -> [F<S>; N] {
        // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
        let [cos_bias, sin_bias] = self.cos_sin_bias;
        let (across, up) = (slice.sin_n * cos_bias, slice.cos_n.max(0.0) * sin_bias);
        let mut ahead = Horizon::new(slice, 1.0, up - across);
        let mut behind = Horizon::new(slice, -1.0, up + across);
        let mut lost = [F::new(up.simd(), 0.0); N];
        let reach = p.radius_px * self.params.radius_scale;
        for (k, share) in self.spacing.steps().iter().enumerate() {
            let pixels = (share.at(jitter) * reach).max(1.0 + k as f32);
            let stride = Stride::new(self.screen, slice, pixels);
            self.look::<S, N, FOLLOW>((p, slice), (&stride, pixels), &mut ahead, &mut lost);
            self.look::<S, N, FOLLOW>((p, slice), (&stride.reversed(), pixels), &mut behind, &mut lost);
        }
        lost
    }

    /// Adds the light that is lost to a tap, and to the surface before it.
    #[inline(always)]
    fn look<S: Simd, const N: usize, const FOLLOW: bool>(
        &self,
        (p, slice): (&Pixels<S>, &Slice<S>),
        (stride, pixels): (&Stride<S>, F<S>),
        horizon: &mut Horizon<S, N>,
        lost: &mut [F<S>; N],
    ) {
        let at = stride.look(self.screen, p);
        if FOLLOW {
            // The background is far behind the pixel.
            let known = stride.inside(self.screen, p) & (-at.towards).lt(0.1 * BACKGROUND);
            let now = Place { at, pixels, known };
            let [before, here] = horizon.places;
            let farthest = (p.radius_px * (self.params.radius_scale * self.params.follow)).max(NEAR);
            let near = before.known & here.known & known & (pixels - here.pixels).le(farthest);
            self.enter((slice, near), [&before, &here, &now], horizon, lost);
            horizon.places = [here, now];
        }
        self.rise((p, slice), (stride, &at), horizon, lost);
    }

    /// Adds the light that is lost where a surface enters the search's radius between the tap before and this one, `here`, which lies
    /// outside. The surface goes on as from the next tap to this one: as far as the tap before, or half as far if that one lies deeper
    /// than it and so cannot be on it.
    #[inline(always)]
    fn enter<S: Simd, const N: usize>(
        &self,
        (slice, near): (&Slice<S>, Mask<S>),
        [before, here, next]: [&Place<S>; 3],
        horizon: &mut Horizon<S, N>,
        lost: &mut [F<S>; N],
    ) {
        let (towards, along) = (here.at.towards - next.at.towards, here.at.along - next.at.along);
        let a = towards.mul_add(towards, along * along).max(1e-36);
        let b = here.at.towards.mul_add(towards, here.at.along * along);
        let outside = here.at.squared - self.squared_radius;
        let root = b.mul_add(b, -(a * outside));
        let enters = near & !outside.le(0.0) & b.lt(0.0) & !root.lt(0.0);
        if !enters.any() {
            return;
        }
        let inverse = 1.0 / a;
        let way = (-b - root.max(0.0).sqrt()) * inverse;
        let gap = (before.at.along - here.at.along) / along;
        let joined = gap.mul_add(towards, here.at.towards).le(before.at.towards);
        let cosine = way.mul_add(towards, here.at.towards) * (1.0 / self.squared_radius.sqrt());
        let rises = enters & way.le(joined.select(gap, gap * 0.5)) & horizon.cosine.lt(cosine);
        // It fades by its least distance.
        let nearest = (-b * inverse).min(gap);
        let (towards, along) =
            (nearest.mul_add(towards, here.at.towards), nearest.mul_add(along, here.at.along));
        let squared = towards.mul_add(towards, along * along).min(self.squared_radius);
        self.lose(slice, (rises, cosine, squared), horizon, lost);
    }

    /// Adds the light that is lost where the horizon rises to a tap.
    #[inline(always)]
    fn rise<S: Simd, const N: usize>(
        &self,
        (p, slice): (&Pixels<S>, &Slice<S>),
        (stride, at): (&Stride<S>, &Seen<S>),
        horizon: &mut Horizon<S, N>,
        lost: &mut [F<S>; N],
    ) {
        let cosine = at.towards * at.squared.rough_inverse_sqrt();
        let rises = at.squared.le(self.squared_radius) & horizon.cosine.lt(cosine);
        if !rises.any() {
            return;
        }
        let rises = rises & stride.inside(self.screen, p);
        self.lose(slice, (rises, cosine, at.squared), horizon, lost);
    }

    /// Raises the horizon to an occluder, by the cosine to it and its squared distance, and adds the light that is lost.
    #[inline(always)]
    fn lose<S: Simd, const N: usize>(
        &self,
        slice: &Slice<S>,
        (rises, cosine, squared): (Mask<S>, F<S>, F<S>),
        horizon: &mut Horizon<S, N>,
        lost: &mut [F<S>; N],
    ) {
        let weight = 1.0 - squared * (self.params.attenuation / self.squared_radius);
        let beam = slice.beam_above::<N>(cosine, horizon.sign);
        for c in 0..N {
            lost[c] += rises.select((horizon.beam[c] - beam[c]) * weight, 0.0);
            horizon.beam[c] = rises.select(beam[c], horizon.beam[c]);
        }
        horizon.cosine = rises.select(cosine, horizon.cosine);
    }

    /// Sums over the slices of the pixels from (`x`, `y`) on.
    #[inline(always)]
    fn sums<S: Simd, const N: usize>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> Sums<S, N> {
        let simd = p.x.simd();
        let [turn, jitter] = noise_at(simd, x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let mut sums = Sums::new(simd);
        let mut direction = (turn * (PI * inverse)).cos_sin_of_half_turn();
        for s in 0..self.params.slices {
            let slice = Slice::towards(p, direction);
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            let lost = match self.params.follow > 0.0 {
                true => self.lost::<S, N, true>(p, &slice, jitter),
                false => self.lost::<S, N, false>(p, &slice, jitter),
            };
            sums.add(p, &slice, lost);
            direction = turned(direction, self.cos_sin_turn);
        }
        sums
    }
}

impl PixelMethod for Agtao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> F<S> {
        self.sums::<S, 1>(p, at).visibility(self.params.power)
    }
}

impl PixelShares<BENT_PLANES> for Agtao<'_> {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; BENT_PLANES] {
        self.sums::<S, BEAM>(p, at).planes(p, self.params.slices, self.params.power)
    }
}

/// A direction after a turn with a cosine and a sine.
#[inline(always)]
fn turned<S: Simd>((x, y): (F<S>, F<S>), [cos, sin]: [f32; 2]) -> (F<S>, F<S>) {
    (x.mul_add(cos, y * -sin), y.mul_add(cos, x * sin))
}

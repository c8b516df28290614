//! One side of a slice: places in the plane of the slice, and whether two of them lie on one surface.

use super::bent::BEAM;
use super::screen::Pixels;
use super::shares::SHARES;
use super::slice::Slice;
use super::vbao::{SECTORS, sectors};
use crate::simd::Simd;
use crate::simd::integers::U;
use crate::simd::lanes::{F, Mask};

/// Two taps are on one surface if the plane of either misses the other by less than this share of the step on the plane.
pub const CONNECTED: f32 = 0.7;

/// Where the parts of a side end whose lost light has one direction: shares of the way from the viewer's cosine to the tangent plane's.
/// Above a plane that faces the viewer they hold an eighth of its light each.
// With four of them, bent normals beside a wall are 2.8 degrees off, with eight 1.0.
pub(crate) const PARTS: [f32; 8] =
    [0.064_585_65, 0.133_974_6, 0.209_430_58, 0.292_893_2, 0.387_627_57, 0.5, 0.646_446_6, 1.0];

/// A vector in the plane of a slice: along it, and towards the viewer.
#[derive(Clone, Copy)]
pub(crate) struct V2<S: Simd> {
    pub(crate) along: F<S>,
    pub(crate) towards: F<S>,
}

impl<S: Simd> V2<S> {
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F<S> {
        self.along.mul_add(other.along, self.towards * other.towards)
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { along: self.along - other.along, towards: self.towards - other.towards }
    }

    /// One of two, lane by lane.
    #[inline(always)]
    pub(crate) fn choose(first: Mask<S>, [a, b]: [Self; 2]) -> Self {
        Self { along: first.select(a.along, b.along), towards: first.select(a.towards, b.towards) }
    }

    /// This times `by` plus `plus`.
    #[inline(always)]
    pub(crate) fn mul_add(self, by: F<S>, plus: Self) -> Self {
        Self { along: self.along.mul_add(by, plus.along), towards: self.towards.mul_add(by, plus.towards) }
    }
}

/// One side of a slice.
#[derive(Clone, Copy)]
pub(crate) struct Side<'s, S: Simd> {
    pub(crate) p: &'s Pixels<S>,
    pub(crate) slice: &'s Slice<S>,
    /// 1 along the slice, -1 against it.
    pub(crate) sign: f32,
    /// Where a step on the screen goes, for each world unit.
    pub(crate) across: V2<S>,
    /// Height of a pixel (world units): the first times the depth plus the second.
    pub(crate) pixel_size: [f32; 2],
    /// Cosine between the viewer and the lowest occluder that counts.
    pub(crate) lowest: F<S>,
    /// Sectors for each share of light.
    pub(crate) scale: F<S>,
    /// What is added before rounding to whole sectors: in [-0.5, 0.5).
    pub(crate) dither: F<S>,
}

/// A place on a surface that a tap sees.
#[derive(Clone, Copy)]
pub(crate) struct Seen<S: Simd> {
    /// Whether there is a surface.
    pub(crate) valid: Mask<S>,
    /// Signed distance on the screen (px), and depth (world units).
    pub(crate) pixels: F<S>,
    pub(crate) depth: F<S>,
    /// Its normal in the plane of the slice, of any length.
    pub(crate) normal: V2<S>,
    /// From the pixel to it, and whether that is within the AO radius.
    pub(crate) offset: V2<S>,
    pub(crate) near: Mask<S>,
    /// Sectors between the viewer and it: a whole number.
    pub(crate) sector: F<S>,
}

/// What a tap reads, and where.
pub(crate) struct Tap<S: Simd> {
    /// Row-major index of the pixel, and whether it lies in the frame.
    pub(crate) index: U<S>,
    pub(crate) inside: Mask<S>,
    /// Signed distance on the screen (px).
    pub(crate) pixels: F<S>,
    /// Where its ray goes for each unit of depth.
    pub(crate) ray: V2<S>,
    /// From the centre of the pixel to the tap's place: right and up (px, by their height).
    pub(crate) right: F<S>,
    pub(crate) up: F<S>,
}

impl<S: Simd> Side<'_, S> {
    /// Where the ray of a place goes, so many pixels along: for each unit of depth.
    #[inline(always)]
    pub(crate) fn ray(&self, pixels: F<S>) -> V2<S> {
        let step = pixels * self.pixel_size[0];
        V2 { along: step * self.across.along, towards: step.mul_add(self.across.towards, -self.p.ray_length) }
    }

    /// From the pixel to a place so many pixels along, at a depth.
    #[inline(always)]
    pub(crate) fn offset(&self, pixels: F<S>, depth: F<S>) -> V2<S> {
        let step = pixels * depth.mul_add(self.pixel_size[0], self.pixel_size[1]);
        let farther = depth + self.p.position.z;
        let towards = step.mul_add(self.across.towards, -(farther * self.p.ray_length));
        V2 { along: step * self.across.along, towards }
    }

    /// Sectors between the viewer and an offset: a whole number.
    #[inline(always)]
    pub(crate) fn sector(&self, offset: V2<S>) -> F<S> {
        let cosine = offset.towards * offset.dot(offset).max(1e-36).rough_inverse_sqrt();
        self.sector_below(self.slice.light_above(cosine.max(self.lowest).min(1.0), self.sign))
    }

    /// Sectors that hold so much light below the viewer: a whole number.
    #[inline(always)]
    pub(crate) fn sector_below(&self, light: F<S>) -> F<S> {
        light.mul_add(self.scale, self.dither).max(0.0).min(SECTORS).round().float()
    }

    /// The pixel itself: arcs begin at the tangent plane.
    #[inline(always)]
    pub(crate) fn origin(&self) -> Seen<S> {
        let (simd, slice) = (self.p.x.simd(), self.slice);
        let zero = F::new(simd, 0.0);
        Seen {
            valid: zero.le(0.0),
            pixels: zero,
            depth: -self.p.position.z,
            normal: V2 { along: slice.sin_n, towards: slice.cos_n },
            offset: V2 { along: zero, towards: zero },
            near: zero.le(0.0),
            sector: F::new(simd, SECTORS),
        }
    }

    /// Whether the plane of one place predicts the depth of another, whose ray is given.
    #[inline(always)]
    pub(crate) fn predicts(&self, from: &Seen<S>, to: &Seen<S>, ray: V2<S>) -> Mask<S> {
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

    /// The vector of the light that the side loses, towards the viewer and along, by the weights of its shares: what is lost in each of its
    /// parts has the mean direction of the part's light.
    #[inline(always)]
    pub(crate) fn lost_beam(&self, shares: &[U<S>; SHARES], weights: &[f32; SHARES]) -> [F<S>; 2] {
        let simd = self.dither.simd();
        let zero = F::new(simd, 0.0);
        let tangent = (self.slice.sin_n * -self.sign).max(-1.0).min(1.0);
        let (mut lost, mut begin, mut above) = ([zero; 2], zero, [zero; BEAM]);
        for part in PARTS {
            let cosine = (tangent - 1.0).mul_add(part, 1.0);
            let beam = self.slice.beam_above::<BEAM>(cosine, self.sign);
            let end = match part < 1.0 {
                true => self.sector_below(beam[0]),
                false => F::new(simd, SECTORS),
            };
            let bits = sectors(begin.round(), end.round());
            let mut count = zero;
            for (share, weight) in shares.iter().zip(weights) {
                count = (*share & bits).count_ones().float().mul_add(*weight, count);
            }
            let share = count / (end - begin).max(1.0);
            for c in 0..2 {
                lost[c] = (beam[c + 1] - above[c + 1]).mul_add(share, lost[c]);
            }
            (begin, above) = (end, beam);
        }
        lost
    }
}

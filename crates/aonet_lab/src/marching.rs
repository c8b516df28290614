//! Rays marched through a frame, pixel by pixel: the rival of connected arcs, for `aonet ladder`.
// Places are connected by the test of arcs. The two differ in how they sample, and here normals of both layers are those of the frame.

use aonet::glam::{Mat3A, Vec2, Vec3A};
use aonet::internals::random::SplitMix64;
use aonet::internals::shares::{CONNECTED, GAPS, MOST_GRAZING, SHARES};
use aonet::{Camera, GBuffer};
use rayon::prelude::*;

/// Most steps of a ray; longer ones take longer steps.
const MOST_STEPS: f32 = 512.0;

/// Shares of light that `rays` cosine-weighted rays find at each of `pixels` (row-major indices in the picture): hit, hidden by more and
/// more, off. The rest is open. `radius` is that of the AO (world units). A second layer without normals is not read.
pub(crate) fn shares(gbuffer: &GBuffer<'_>, radius: f32, pixels: &[usize], rays: u32) -> [Vec<f32>; SHARES] {
    let frame = Frame::new(gbuffer, radius);
    let found: Vec<_> = pixels.par_iter().map(|pixel| frame.shares(*pixel, rays)).collect();
    std::array::from_fn(|c| found.iter().map(|shares| shares[c]).collect())
}

/// A frame that rays march through.
struct Frame<'a> {
    gbuffer: &'a GBuffer<'a>,
    camera: Camera,
    radius: f32,
}

/// A place on a surface that the frame shows (view space).
#[derive(Clone, Copy)]
struct Spot {
    place: Vec3A,
    normal: Vec3A,
    /// Where the ray of the viewer goes for each unit of depth.
    ray: Vec3A,
    /// How much deeper the marched ray lies.
    behind: f32,
}

/// What one step sees in each layer.
type Seen = [Option<Spot>; 2];

/// Hit comes first among the shares, hidden by less than each of [`GAPS`] next, off last.
const HIT: usize = 0;
const OFF: usize = SHARES - 1;

impl Frame<'_> {
    fn new<'a>(gbuffer: &'a GBuffer<'a>, radius: f32) -> Frame<'a> {
        Frame { gbuffer, camera: *gbuffer.camera(), radius }
    }

    /// Shares of a pixel's light.
    fn shares(&self, pixel: usize, rays: u32) -> [f32; SHARES] {
        let window = self.gbuffer.window();
        let (width, margin) = (window.size().width(), window.margin());
        let (x, y) = (pixel % width + margin.x, pixel / width + margin.y);
        let i = y * self.gbuffer.width() + x;
        let mut shares = [0.0; SHARES];
        if !self.gbuffer.is_foreground(i) {
            return shares;
        }
        let from = self.camera.position_view(x, y, self.gbuffer.depth()[i]);
        let normal = Vec3A::from(self.gbuffer.normal()[i]);
        let (side, up) = normal.any_orthonormal_pair();
        let frame = Mat3A::from_cols(side, up, normal);
        let mut random = SplitMix64::new(pixel as u64);
        let (turn, shift) = (random.unit() * std::f32::consts::TAU, random.unit());
        for ray in 0..rays {
            let area = (ray as f32 + shift) / rays as f32;
            let (sin, cos) = (ray as f32 * 2.399_963_2 + turn).sin_cos();
            let direction = frame * Vec3A::new(area.sqrt() * cos, area.sqrt() * sin, (1.0 - area).sqrt());
            if let Some(share) = self.march((from, normal), direction) {
                shares[share] += 1.0 / rays as f32;
            }
        }
        shares
    }

    /// Which share a ray counts to, or none if it is open.
    fn march(&self, (from, normal): (Vec3A, Vec3A), direction: Vec3A) -> Option<usize> {
        let near = self.camera.near();
        let mut reach = self.radius;
        if -(from.z + direction.z * reach) < near {
            reach = (-from.z - near) / direction.z;
        }
        let to = from + direction * reach;
        let [start, end] = [from, to].map(|place| self.projected(place));
        let steps = (end - start).abs().max_element().ceil().min(MOST_STEPS);
        let behind = -1e-6 * from.z.abs();
        let origin = Spot { place: from, normal, ray: self.ray(start), behind };
        let mut before: [Seen; 2] = [[Some(origin), None], [None, None]];
        let layers = 1 + usize::from(self.gbuffer.second().is_some_and(|second| second.normal.is_some()));
        let mut share = None;
        for step in 1..=steps as usize {
            let part = step as f32 / steps;
            let at = start + (end - start) * part;
            if at.cmplt(Vec2::ZERO).any() || at.cmpge(self.size()).any() {
                return share.or(Some(OFF));
            }
            // The inverse of depth is linear on the screen of a perspective camera.
            let way = match self.camera.is_perspective() {
                true => part * from.z / ((1.0 - part) * to.z + part * from.z),
                false => part,
            };
            let place = from + direction * (reach * way);
            let mut now: Seen = [None; 2];
            for (layer, now) in now[..layers].iter_mut().enumerate() {
                *now = self.spot(layer, at, -place.z);
                let Some(spot) = *now else { continue };
                if hits(&before[..layers], (layer, &spot)) {
                    return Some(HIT);
                }
                let gap = spot.behind * spot.ray.length() / self.radius;
                let last = layer + 1 == layers;
                if gap > 0.0 && (last || gap < GAPS[0]) && spot.place.distance(from) < self.radius {
                    let class = HIT + 1 + GAPS.iter().position(|most| gap < *most).unwrap_or(GAPS.len() - 1);
                    share = Some(share.map_or(class, |least: usize| least.min(class)));
                }
            }
            before = [now, before[0]];
        }
        share
    }

    /// Of the frame with its guard band (px).
    fn size(&self) -> Vec2 {
        Vec2::new(self.gbuffer.width() as f32, self.gbuffer.height() as f32)
    }

    /// Where a place is seen (px).
    fn projected(&self, place: Vec3A) -> Vec2 {
        let ([cx, cy], [fx, fy]) = (self.camera.centre_px(), self.camera.focal_px());
        let px = self.camera.projected_px(1.0, -place.z);
        Vec2::new(cx + place.x * px * (fx / fy), cy - place.y * px)
    }

    /// The place that is seen at a point of the screen (px), at a depth.
    fn place(&self, at: Vec2, depth: f32) -> Vec3A {
        let ([cx, cy], [fx, fy]) = (self.camera.centre_px(), self.camera.focal_px());
        let px = self.camera.projected_px(1.0, depth);
        Vec3A::new((at.x - cx) / px * (fy / fx), (cy - at.y) / px, -depth)
    }

    /// Where the viewer's ray goes for each unit of depth.
    fn ray(&self, at: Vec2) -> Vec3A {
        self.place(at, 2.0) - self.place(at, 1.0)
    }

    /// What a layer shows at a point of the screen: the pixel's plane there, in front of or behind a ray of the given depth.
    fn spot(&self, layer: usize, at: Vec2, depth_of_ray: f32) -> Option<Spot> {
        let (x, y) = (at.x as usize, at.y as usize);
        let i = y * self.gbuffer.width() + x;
        let (depth, normal) = match layer {
            0 => (self.gbuffer.depth()[i], self.gbuffer.normal()[i]),
            _ => {
                let second = self.gbuffer.second()?;
                (second.depth[i], second.normal.as_ref()?[i])
            }
        };
        if !depth.is_finite() {
            return None;
        }
        let (pixel, normal) = (self.camera.position_view(x, y, depth), Vec3A::from(normal));
        let normal = if normal.dot(pixel) > 0.0 { -normal } else { normal };
        let (ray, place) = (self.ray(at), self.place(at, depth));
        let facing = normal.dot(ray).min(-MOST_GRAZING * ray.length());
        let place = place + ray * (normal.dot(pixel - place) / facing);
        Some(Spot { place, normal, ray, behind: depth_of_ray + place.z })
    }
}

/// Whether a ray goes through the surface between a place in a layer and one that earlier steps saw, from either side. Places of different
/// layers need both planes.
fn hits(before: &[Seen], (layer, spot): (usize, &Spot)) -> bool {
    before.iter().any(|seen| {
        seen.iter().enumerate().filter_map(|(other, seen)| Some((other, seen.as_ref()?))).any(
            |(other, seen)| {
                (seen.behind < 0.0) != (spot.behind < 0.0) && connected(seen, spot, other != layer)
            },
        )
    })
}

/// Whether two places lie on one surface: `both` planes, or one of them, must say so.
fn connected(a: &Spot, b: &Spot, both: bool) -> bool {
    let [forth, back] = [predicts(a, b), predicts(b, a)];
    if both { forth && back } else { forth || back }
}

/// Whether the plane of one place predicts another.
fn predicts(from: &Spot, to: &Spot) -> bool {
    let facing = from.normal.dot(to.ray);
    if facing >= -1e-6 {
        return false;
    }
    let met = to.place + to.ray * (from.normal.dot(from.place - to.place) / facing);
    met.z < 0.0 && met.distance(to.place) < CONNECTED * met.distance(from.place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{SecondLayer, Size};

    const SIZE: [usize; 2] = [64, 48];

    /// A frame of what depth and normal a pixel has, by its column's distance from the middle, in widths of a pixel at unit depth.
    fn frame(surface: impl Fn(f32) -> (f32, [f32; 3])) -> GBuffer<'static> {
        let size = Size::new(SIZE[0], SIZE[1]).unwrap();
        let camera = Camera::perspective(1.0, size).unwrap();
        let column = |i: usize| ((i % SIZE[0]) as f32 + 0.5 - camera.centre_px()[0]) / camera.focal_px()[0];
        let (depth, normal): (Vec<_>, Vec<_>) = (0..size.pixels()).map(|i| surface(column(i))).unzip();
        GBuffer::new(camera, depth, normal).unwrap()
    }

    /// Shares of the pixel in a column of the middle row.
    fn at(gbuffer: &GBuffer<'_>, radius: f32, column: usize) -> [f32; SHARES] {
        shares(gbuffer, radius, &[SIZE[1] / 2 * SIZE[0] + column], 512).map(|share| share[0])
    }

    #[test]
    fn a_plane_is_open_and_light_leaves_the_frame_at_its_border() {
        let plane = frame(|_| (3.0, [0.0, 0.0, 1.0]));
        assert_eq!(at(&plane, 0.3, 32), [0.0; SHARES]);
        let [others @ .., off] = at(&plane, 0.3, 0);
        assert_eq!(others, [0.0; SHARES - 1]);
        // The border of the view leans outwards by an angle whose tangent is 0.73: (1 + sin) / 2 of the light leaves there.
        assert!((0.7..0.8).contains(&off), "{off}");
    }

    #[test]
    fn a_wall_that_is_seen_blocks_half_of_the_light_beside_it() {
        // Two planes that meet at a right angle in the middle column, at a depth of 3: depth + |x| = 3.
        let side = std::f32::consts::FRAC_1_SQRT_2;
        let corner = frame(|column| (3.0 / (1.0 + column.abs()), [-side * column.signum(), 0.0, side]));
        let [hit, others @ ..] = at(&corner, 0.6, 32);
        assert!(others.iter().sum::<f32>() < 0.01, "but for a grazing ray: {others:?}");
        assert!((0.42..0.5).contains(&hit), "{hit}");
        let farther = at(&corner, 0.6, 35)[HIT];
        assert!(farther < hit && farther > 0.1, "{farther}");
    }

    #[test]
    fn light_behind_a_thing_is_hidden_until_a_second_layer_shows_what_is_there() {
        let (front, back) = (2.5, 3.0);
        let thing = frame(|column| (if column < 0.0 { front } else { back }, [0.0, 0.0, 1.0]));
        let [hit, close, middle, deep, off] = at(&thing, 0.55, 33);
        assert!(
            hit < 0.1 && off == 0.0,
            "the silhouette is no surface, only the thing's front is: {hit} {off}"
        );
        assert!(close + middle + deep > 2.0 * hit, "{hit} {close} {middle} {deep}");
        let second = SecondLayer {
            depth: vec![back; thing.size().pixels()].into(),
            normal: Some(vec![[0.0, 0.0, 1.0]; thing.size().pixels()].into()),
        };
        let now = at(&thing.with_second(second).unwrap(), 0.55, 33);
        assert_eq!(now[2..], [0.0; SHARES - 2], "the wall behind it goes on");
        assert!((now[HIT] - hit).abs() < 0.01 && (now[1] - close).abs() < 0.01, "{now:?} {hit} {close}");
    }
}

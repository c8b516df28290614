//! The frame as the methods see it: positions and depths of a vector of pixels at once.

use crate::frame::BACKGROUND;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::simd::integers::{Integer, U};
use crate::simd::lanes::{F, Mask};
use crate::simd::vector::V3;
use crate::simd::{MAX_LANES, Simd};
use std::ops::Range;

/// A frame, its camera and the AO radius.
#[derive(Debug)]
pub(crate) struct Screen<'a> {
    gbuffer: &'a GBuffer<'a>,
    /// AO radius (world units).
    pub(crate) radius: f32,
    /// Height of a pixel (world units): the first times the depth plus the second. One of them is 0.
    pixel_size: [f32; 2],
    /// Width of a pixel over its height.
    pub(crate) aspect: f32,
    /// The place (x, y) that the camera's axis meets (px); whole numbers are centres of pixels.
    centre: [f32; 2],
}

/// Neighbouring pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixels<S: Simd> {
    /// Pixel coordinates; whole numbers are the centres.
    pub(crate) x: F<S>,
    pub(crate) y: F<S>,
    /// The same as whole numbers, and row-major.
    pub(crate) column: U<S>,
    pub(crate) row: U<S>,
    pub(crate) index: U<S>,
    /// View space.
    pub(crate) position: V3<S>,
    pub(crate) normal: V3<S>,
    /// Unit vector towards the camera.
    pub(crate) to_viewer: V3<S>,
    /// Length of the pixel's ray for each unit of depth.
    pub(crate) ray_length: F<S>,
    /// The AO radius on the screen, along y (px).
    pub(crate) radius_px: F<S>,
    /// Height of a pixel over its width.
    pub(crate) inverse_aspect: f32,
}

/// What a place on the screen shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tap<S: Simd> {
    /// View-space position; far away on the background.
    pub(crate) position: V3<S>,
    /// Column and row of the pixel.
    pub(crate) place: (F<S>, F<S>),
    /// Row-major index of the pixel.
    pub(crate) index: U<S>,
    /// Whether the place lies in the frame.
    pub(crate) inside: Mask<S>,
}

impl<'a> Screen<'a> {
    pub(crate) fn new(gbuffer: &'a GBuffer<'a>, params: AoParams) -> Self {
        let camera = gbuffer.camera();
        let [focal_x, focal_y] = camera.focal_px();
        let pixel_size = if camera.is_perspective() { [1.0 / focal_y, 0.0] } else { [0.0, 1.0 / focal_y] };
        let centre = camera.centre_px().map(|c| c - 0.5);
        Self { gbuffer, radius: params.radius(), pixel_size, aspect: focal_y / focal_x, centre }
    }

    pub(crate) fn gbuffer(&self) -> &'a GBuffer<'a> {
        self.gbuffer
    }

    /// Size of the frame (px).
    pub(crate) fn size(&self) -> Size {
        self.gbuffer.size()
    }

    /// Row `y` of an image of the frame's size.
    #[inline(always)]
    pub(crate) fn row<'v, T>(&self, image: &'v [T], y: usize) -> &'v [T] {
        &image[y * self.gbuffer.width()..][..self.gbuffer.width()]
    }

    /// The pixels from (`x`, `y`) on; beyond the row, its last pixel again.
    #[inline(always)]
    pub(crate) fn pixels<S: Simd>(&self, simd: S, x: usize, y: usize) -> Pixels<S> {
        let columns = x..x + S::LANES;
        let mut edge = [0.0; MAX_LANES];
        let found = F::load(simd, neighbours(self.row(self.gbuffer.depth(), y), columns.clone(), &mut edge));
        let mut edge = [[0.0; 3]; MAX_LANES];
        let normals = neighbours(self.row(self.gbuffer.normal(), y), columns, &mut edge);
        self.seen_pixels((F::counting_from(simd, x as f32), y), (found, normals))
    }

    /// The pixels of row `y` in these columns.
    #[inline(always)]
    pub(crate) fn pixels_in<S: Simd>(&self, simd: S, columns: [usize; MAX_LANES], y: usize) -> Pixels<S> {
        let (depths, normals) = (self.row(self.gbuffer.depth(), y), self.row(self.gbuffer.normal(), y));
        let found = F::load(simd, &columns.map(|x| depths[x]));
        self.seen_pixels(
            (F::load(simd, &columns.map(|x| x as f32)), y),
            (found, &columns.map(|x| normals[x])),
        )
    }

    /// Pixels of row `y` with what is found there.
    #[inline(always)]
    fn seen_pixels<S: Simd>(
        &self,
        (px, y): (F<S>, usize),
        (found, normals): (F<S>, &[[f32; 3]]),
    ) -> Pixels<S> {
        let simd = px.simd();
        // Any finite depth will do where there is none.
        let depth = found.lt(BACKGROUND).select(found, 1.0);
        let py = F::new(simd, y as f32);
        let (column, row) = (px.round(), (y as u32).integer_lanes(simd));
        // Where the ray through the pixel is one unit of depth farther.
        let ([cx, cy], slope) = (self.centre, self.pixel_size[0]);
        let ray = V3 { x: (px - cx) * (slope * self.aspect), y: (cy - py) * slope, z: F::new(simd, -1.0) };
        let squared = ray.dot(ray);
        let inverse = squared.inverse_sqrt();
        Pixels {
            x: px,
            y: py,
            column,
            row,
            index: row * self.gbuffer.width() as u32 + column,
            position: self.position(px, py, depth),
            normal: V3::from_triples(simd, normals),
            to_viewer: ray * -inverse,
            ray_length: squared * inverse,
            radius_px: self.radius / self.pixel_size(depth),
            inverse_aspect: 1.0 / self.aspect,
        }
    }

    /// View-space position of a place on the screen at a depth.
    #[inline(always)]
    pub(crate) fn position<S: Simd>(&self, x: F<S>, y: F<S>, depth: F<S>) -> V3<S> {
        let ([cx, cy], scale) = (self.centre, self.pixel_size(depth));
        V3 { x: (x - cx) * (scale * self.aspect), y: (cy - y) * scale, z: -depth }
    }

    /// The place on the screen (x, y) (px) of a view-space position in front of the camera.
    #[inline(always)]
    pub(crate) fn place<S: Simd>(&self, position: V3<S>) -> (F<S>, F<S>) {
        let ([cx, cy], scale) = (self.centre, 1.0 / self.pixel_size(-position.z));
        (position.x.mul_add(scale * (1.0 / self.aspect), cx), (-position.y).mul_add(scale, cy))
    }

    /// Height of a pixel at a depth (world units).
    #[inline(always)]
    pub(crate) fn pixel_size<S: Simd>(&self, depth: F<S>) -> F<S> {
        depth.mul_add(self.pixel_size[0], self.pixel_size[1])
    }

    /// The same as a linear function of the depth: slope and value at 0, one of which is 0.
    #[inline(always)]
    pub(crate) fn pixel_size_line(&self) -> [f32; 2] {
        self.pixel_size
    }

    /// How fast positions along each pixel's ray leave its plane: world units for each of depth.
    #[inline(always)]
    pub(crate) fn along_ray<S: Simd>(&self, p: &Pixels<S>) -> F<S> {
        let ([cx, cy], slope) = (self.centre, self.pixel_size[0]);
        let (x, y) = ((p.x - cx) * (slope * self.aspect), (cy - p.y) * slope);
        x.mul_add(p.normal.x, y.mul_add(p.normal.y, -p.normal.z))
    }

    /// Column and row of the pixel nearest to a place on the screen, the edge's where it is outside; whether it is inside.
    #[inline(always)]
    pub(crate) fn nearest<S: Simd>(&self, (x, y): (F<S>, F<S>)) -> ([U<S>; 2], Mask<S>) {
        let (width, height) = (self.size().width(), self.size().height());
        let (right, bottom) = (width as f32 - 0.5, height as f32 - 0.5);
        let inside = x.le(right) & y.le(bottom) & !x.lt(-0.5) & !y.lt(-0.5);
        ([x.index(width - 1), y.index(height - 1)], inside)
    }

    /// The pixel nearest to a place on the screen: the edge's where it is outside.
    #[inline(always)]
    pub(crate) fn tap<S: Simd>(&self, place: (F<S>, F<S>)) -> Tap<S> {
        let ([column, row], inside) = self.nearest(place);
        let index = row * self.gbuffer.width() as u32 + column;
        let depth = index.gather(self.gbuffer.depth()).min(BACKGROUND);
        let place = (column.float(), row.float());
        Tap { position: self.position(place.0, place.1, depth), place, index, inside }
    }

    /// View-space position of what another layer, of these HxW depths, shows there; far away where it shows nothing.
    #[inline(always)]
    pub(crate) fn behind<S: Simd>(&self, tap: &Tap<S>, depths: &[f32]) -> V3<S> {
        self.position(tap.place.0, tap.place.1, tap.index.gather(depths).min(BACKGROUND))
    }

    /// View-space normal of a pixel; zero on the background.
    #[inline(always)]
    pub(crate) fn normal<S: Simd>(&self, index: U<S>) -> V3<S> {
        let (first, normals) = (index * 3, self.gbuffer.normal().as_flattened());
        V3 { x: first.gather(normals), y: (first + 1).gather(normals), z: (first + 2).gather(normals) }
    }
}

/// The values of a row in `columns`; beyond its end the last one again, in the memory that `edge` has for them.
#[inline(always)]
pub(crate) fn neighbours<'v, T: Copy>(
    row: &'v [T],
    columns: Range<usize>,
    edge: &'v mut [T; MAX_LANES],
) -> &'v [T] {
    row.get(columns.clone()).unwrap_or_else(|| {
        let values = &mut edge[..columns.len()];
        values.iter_mut().zip(columns).for_each(|(value, x)| *value = row[x.min(row.len() - 1)]);
        values
    })
}

//! Primary rays through pixel centres: the G-buffer of a view.

use crate::trace::{Hit, Tracer};
use crate::{Error, Result, Scene, View};
use aonet::{Camera, GBuffer, SecondLayer};
use glam::{Affine3A, DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::borrow::Cow;

/// The result of primary rays: the G-buffer, and data that only the reference may use.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Depth and shading normals, view space.
    pub gbuffer: GBuffer<'static>,
    /// HxW geometric normals, view space, towards the viewer; zero on the background.
    pub geo_normal: Vec<[f32; 3]>,
    /// HxW: true where the visible side is the back of its triangle by winding; false on the background.
    pub backface: Vec<bool>,
    /// HxW index of the visible triangle in [`Scene::triangle`]; [`NO_TRIANGLE`] on the background.
    pub triangle: Vec<u32>,
}

/// Value of [`Surface::triangle`] on the background.
pub const NO_TRIANGLE: u32 = u32::MAX;

impl Surface {
    /// The picture without its guard band; without a guard band nothing is copied.
    pub fn without_margin(&self) -> Cow<'_, Self> {
        let window = self.gbuffer.window();
        if !window.has_margin() {
            return Cow::Borrowed(self);
        }
        Cow::Owned(Self {
            gbuffer: self.gbuffer.without_margin().into_owned(),
            geo_normal: window.cropped(self.geo_normal.clone()),
            backface: window.cropped(self.backface.clone()),
            triangle: window.cropped(self.triangle.clone()),
        })
    }

    /// # Errors
    /// When an array's length is not the number of pixels, or a pixel of the foreground shows no triangle of `scene`.
    pub(crate) fn check_of(&self, scene: &Scene) -> Result<()> {
        let (pixels, triangles) = (self.gbuffer.depth().len(), scene.triangle.len());
        let found = (self.triangle.len(), self.geo_normal.len());
        if found != (pixels, pixels) {
            let found = format!("{} and {}", found.0, found.1);
            let expected = format!("{pixels} triangles and normals");
            return Err(aonet::Error::size("surface", expected, found).into());
        }
        let wrong = |i: &usize| self.gbuffer.is_foreground(*i) && self.triangle[*i] as usize >= triangles;
        match (0..pixels).find(wrong) {
            Some(i) => {
                let expected = format!("one of {triangles} triangles at pixel {i}");
                Err(Error::request("surface", expected, self.triangle[i]))
            }
            None => Ok(()),
        }
    }
}

/// One pixel of a surface.
struct Pixel {
    depth: f32,
    normal: [f32; 3],
    geo_normal: [f32; 3],
    backface: bool,
    triangle: u32,
}

const BACKGROUND: Pixel = Pixel {
    depth: f32::INFINITY,
    normal: [0.0; 3],
    geo_normal: [0.0; 3],
    backface: false,
    triangle: NO_TRIANGLE,
};

/// Casts one ray through each pixel of the view's picture and guard band, on all cores. If the view has a separation,
/// a second ray finds what lies behind the first surface.
///
/// # Errors
/// When the view's camera, radius, margin or separation is out of range, or most shading normals of the scene
/// contradict the winding of its triangles.
pub fn render(tracer: &Tracer, view: &View) -> Result<Surface> {
    view.params()?;
    let margin = view.margin_px()?;
    let camera = view.camera()?.with_margin(margin)?;
    let eye = Eye::new(tracer, &camera, view.far);
    let pixels = each_pixel(&camera, |x, y| eye.look(x, y, camera.near()));
    let depth = pixels.iter().map(|p| p.depth).collect::<Vec<_>>();
    let normal = pixels.iter().map(|p| p.normal).collect::<Vec<_>>();
    let mut gbuffer = GBuffer::new(camera, depth, normal)?.with_margin(margin)?;
    if let Some(gap) = view.separation_units() {
        let width = camera.width();
        let behind = each_pixel(&camera, |x, y| eye.look(x, y, beyond(pixels[y * width + x].depth, gap)));
        gbuffer = gbuffer.with_second(SecondLayer {
            depth: behind.iter().map(|p| p.depth).collect(),
            normal: Some(behind.iter().map(|p| p.normal).collect()),
        })?;
    }
    Ok(Surface {
        gbuffer,
        geo_normal: pixels.iter().map(|p| p.geo_normal).collect(),
        backface: pixels.iter().map(|p| p.backface).collect(),
        triangle: pixels.iter().map(|p| p.triangle).collect(),
    })
}

/// A value for each pixel of a camera, row by row, on all cores.
fn each_pixel(camera: &Camera, pixel: impl Fn(usize, usize) -> Pixel + Sync) -> Vec<Pixel> {
    (0..camera.height())
        .into_par_iter()
        .flat_map_iter(|y| (0..camera.width()).map(move |x| (x, y)))
        .map(|(x, y)| pixel(x, y))
        .collect()
}

/// The depth at which the search for a second layer starts: `gap` behind `depth`, and always behind its rounding error.
fn beyond(depth: f32, gap: f32) -> f32 {
    // guess: a few times the error of a ray's hit.
    depth + gap.max(1e-5 * depth)
}

/// A camera in a scene.
struct Eye<'a> {
    tracer: &'a Tracer,
    camera: &'a Camera,
    far: f32,
    world_from_view: Affine3A,
}

impl<'a> Eye<'a> {
    fn new(tracer: &'a Tracer, camera: &'a Camera, far: f32) -> Self {
        Self { tracer, camera, far, world_from_view: camera.view_from_world().inverse() }
    }

    /// The nearest surface from a `depth` on. The ray advances one unit of depth for each unit of `t`.
    fn look(&self, x: usize, y: usize, depth: f32) -> Pixel {
        if depth >= self.far {
            return BACKGROUND;
        }
        let camera = self.camera;
        let origin_view = camera.position_view(x, y, depth);
        let direction_view = match camera.is_perspective() {
            true => camera.position_view(x, y, 1.0),
            false => -Vec3A::Z,
        };
        let origin_world = self.world_from_view.transform_point3a(origin_view);
        let direction_world = self.world_from_view.transform_vector3a(direction_view);
        match self.tracer.closest(origin_world, direction_world, self.far - depth) {
            Some(hit) => self.pixel(&hit, direction_world, depth + hit.t),
            None => BACKGROUND,
        }
    }

    fn pixel(&self, hit: &Hit, direction_world: Vec3A, depth: f32) -> Pixel {
        let scene = self.tracer.scene();
        let front_world = geometric_normal(scene, hit.triangle).as_vec3a();
        let backface = front_world.dot(direction_world) > 0.0;
        let towards_viewer = if backface { -1.0 } else { 1.0 };
        let geo_world = match front_world.try_normalize() {
            Some(normal) => towards_viewer * normal,
            None => -direction_world.normalize(),
        };
        let normal_world = match shading_normal(scene, hit).try_normalize() {
            Some(normal) => towards_viewer * normal,
            None => geo_world,
        };
        let to_view = |v: Vec3A| self.camera.view_from_world().transform_vector3a(v).normalize().to_array();
        Pixel {
            depth,
            normal: to_view(normal_world),
            geo_normal: to_view(geo_world),
            backface,
            triangle: hit.triangle,
        }
    }
}

/// World-space unit normal on the side from which `triangle` is counter-clockwise; zero if it has no area.
pub(crate) fn geometric_normal(scene: &Scene, triangle: u32) -> DVec3 {
    let [a, b, c] = corners(scene, triangle).map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// World-space positions of a triangle's vertices.
pub(crate) fn corners(scene: &Scene, triangle: u32) -> [Vec3; 3] {
    scene.triangle[triangle as usize].map(|i| scene.position[i as usize])
}

/// The vertex normals' weighted mean, not normalised; zero where they cancel.
fn shading_normal(scene: &Scene, hit: &Hit) -> Vec3A {
    let [a, b, c] = scene.triangle[hit.triangle as usize].map(|i| Vec3A::from(scene.normal[i as usize]));
    let sum = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    // guess: below this the direction is rounding noise.
    if sum.length_squared() > 1e-8 { sum } else { Vec3A::ZERO }
}

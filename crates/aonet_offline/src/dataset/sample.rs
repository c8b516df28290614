//! Where a person would put the camera: proposals of views, and the first good one of them.

use super::judge::{Flaw, Subject, Taste, judge};
use super::plan::{RadiusRule, Recipe};
use super::random::Random;
use super::scenes::{Candidate, SceneSpec};
use crate::error::{Error, Result};
use crate::gbuffer;
use crate::scene::Bounds;
use crate::trace::Tracer;
use crate::view::View;
use glam::{Quat, Vec3};

/// Proposals for one frame before the scene counts as hopeless.
const MAX_TRIES: usize = 400;

/// Pixels of the small image that a proposal is judged by: 96x54 of a wide one.
const PROBE_PIXELS: f32 = 5184.0;

/// A scene that is ready to be looked at.
pub(super) struct Stage<'a> {
    spec: &'a SceneSpec,
    tracer: &'a Tracer,
    /// Box around the scene, without the ground.
    content: Bounds,
    /// Running sum of the areas of the triangles, without the ground.
    area: Vec<f32>,
    /// Whether most of the scene can be seen from above.
    open: bool,
}

/// Eye, point looked at and vertical field of view [degrees].
#[derive(Debug, Clone, Copy)]
struct Pose {
    eye: Vec3,
    target: Vec3,
    fov_y_deg: f32,
}

/// How a view is arrived at.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    /// From outside, all around.
    Around,
    /// At eye height above something that bears.
    Standing,
    /// Anywhere within the scene.
    Flying,
    /// Near one of the cameras that came with the scene.
    Given(Candidate),
}

impl<'a> Stage<'a> {
    /// A scene whose first `content_triangles` triangles are its own and the others ground.
    pub(super) fn new(spec: &'a SceneSpec, tracer: &'a Tracer, content_triangles: usize) -> Self {
        let scene = tracer.scene();
        let own = &scene.triangle[..content_triangles];
        let mut content = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
        let mut total = 0.0;
        let area = own
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| scene.position[i as usize]);
                content.min = content.min.min(a).min(b).min(c);
                content.max = content.max.max(a).max(b).max(c);
                total += 0.5 * f64::from((b - a).cross(c - a).length());
                total as f32
            })
            .collect();
        let mut stage = Self { spec, tracer, content, area, open: true };
        stage.open = stage.sky_share() > 0.5;
        stage
    }

    /// Radius of the sphere around the scene's box, without the ground [world units].
    pub(super) fn radius(&self) -> f32 {
        self.content.radius()
    }

    /// The view of a frame and how often each flaw was met on the way.
    ///
    /// # Errors
    /// When no proposal is good enough.
    pub(super) fn view(&self, recipe: &Recipe, random: &mut Random) -> Result<(View, Vec<Flaw>)> {
        let mut flaws = Vec::new();
        for _ in 0..MAX_TRIES {
            match self.attempt(recipe, random) {
                Ok(view) => return Ok((view, flaws)),
                Err(flaw) => flaws.push(flaw),
            }
        }
        let counted =
            Flaw::ALL.map(|f| format!("{} {}", flaws.iter().filter(|g| **g == f).count(), f.name()));
        let what = format!("views of scene {}", self.spec.name);
        Err(Error::request(what, format!("one worth keeping in {MAX_TRIES}"), counted.join(", ")))
    }

    fn attempt(&self, recipe: &Recipe, random: &mut Random) -> std::result::Result<View, Flaw> {
        let manner = self.manner(random);
        let pose = self.propose(manner, random).ok_or(Flaw::Nowhere)?;
        let screen = match recipe.radius {
            RadiusRule::SceneFraction(_) => 0.0,
            RadiusRule::ImageFraction { min, max } => random.log_range(min, max),
        };
        let (width, height) = probe_size(recipe);
        let mut view = View {
            eye: pose.eye.into(),
            target: pose.target.into(),
            up: [0.0, 1.0, 0.0],
            fov_y_deg: pose.fov_y_deg,
            ortho_height: None,
            width,
            height,
            near: 1e-3 * self.radius(),
            far: f32::INFINITY,
            radius: self.radius(),
        };
        let surface = gbuffer::render(self.tracer, &view).map_err(|_| Flaw::Nowhere)?;
        let subject = Subject { radius: self.radius(), ground_from: self.area.len() as u32 };
        let median = judge(&surface, subject, &self.taste(manner))?;
        view.radius = match recipe.radius {
            RadiusRule::SceneFraction(fraction) => fraction * self.radius(),
            RadiusRule::ImageFraction { .. } => {
                screen * 2.0 * (0.5 * pose.fov_y_deg.to_radians()).tan() * median
            }
        };
        (view.width, view.height) = (recipe.width, recipe.height);
        Ok(view)
    }

    fn taste(&self, manner: Manner) -> Taste {
        let outside = manner == Manner::Around;
        Taste {
            background: if outside || self.open { 0.6 } else { 0.4 },
            content: 0.1,
            backface: 0.7,
            median_depth: if outside { 0.2 } else { 0.08 },
            near: 0.2,
            near_share: 0.25,
            edges: 0.08,
        }
    }

    fn manner(&self, random: &mut Random) -> Manner {
        let (draw, given) = (random.unit(), random.unit());
        if !self.spec.environment || (self.open && draw < 0.2) {
            return Manner::Around;
        }
        if draw < 0.45 && !self.spec.cameras.is_empty() {
            return Manner::Given(self.spec.cameras[(given * self.spec.cameras.len() as f32) as usize]);
        }
        if draw < 0.8 { Manner::Standing } else { Manner::Flying }
    }

    fn propose(&self, manner: Manner, random: &mut Random) -> Option<Pose> {
        let fov_y_deg = random.range(35.0, 90.0);
        let (eye, target) = match manner {
            Manner::Around => self.around(fov_y_deg, random)?,
            Manner::Standing => {
                let eye = self.standing(random)?;
                (eye, self.look(eye, (-50.0, 25.0), random)?)
            }
            Manner::Flying => {
                let eye = random.within(self.content.min, self.content.max);
                (eye, self.look(eye, (-70.0, 40.0), random)?)
            }
            Manner::Given(camera) => self.given(camera, random),
        };
        Some(Pose { eye, target, fov_y_deg })
    }

    /// From outside: overviews look at the middle, close-ups at a point of the surface.
    fn around(&self, fov_y_deg: f32, random: &mut Random) -> Option<(Vec3, Vec3)> {
        let radius = self.radius();
        // Diameter of the bounding sphere, in image heights.
        let fill = random.log_range(0.9, 4.0);
        let distance = radius / (0.5 * fov_y_deg.to_radians()).tan() / fill;
        let closeness = ((fill - 0.9) / 1.3).clamp(0.0, 1.0);
        let target = self.content.centre().lerp(self.surface_point(random), closeness);
        let azimuth = random.range(0.0, std::f32::consts::TAU);
        let elevation = random.range(3f32.to_radians().sin(), 65f32.to_radians().sin()).asin();
        let (sin, cos) = elevation.sin_cos();
        let towards = Vec3::new(cos * azimuth.sin(), sin, cos * azimuth.cos());
        let eye = target + distance * towards;
        let seen = closeness < 1.0 || self.sees(eye, target);
        (eye.y > self.content.min.y + 0.02 * radius && seen).then_some((eye, target))
    }

    /// Above a floor: a share of the room's height under a ceiling, of the scene's height under the sky.
    fn standing(&self, random: &mut Random) -> Option<Vec3> {
        let start = random.within(self.content.min, self.content.max);
        let (share, open_share) = (random.range(0.25, 0.75), random.log_range(0.04, 0.5));
        let floor = start - self.reach(start, Vec3::NEG_Y)? * Vec3::Y;
        let lifted = floor + 1e-3 * self.radius() * Vec3::Y;
        let height = match self.reach(lifted, Vec3::Y) {
            Some(headroom) => share * headroom,
            None => open_share * (self.content.max.y - self.content.min.y),
        };
        Some(floor + height * Vec3::Y)
    }

    /// Near a camera that came with the scene, turned a little.
    fn given(&self, camera: Candidate, random: &mut Random) -> (Vec3, Vec3) {
        let (eye, target) = (Vec3::from(camera.eye), Vec3::from(camera.target));
        let reach = 0.03 * self.radius();
        let moved = eye + random.within(Vec3::splat(-reach), Vec3::splat(reach));
        let forward = target - eye;
        let side = forward.cross(Vec3::Y).normalize_or(Vec3::X);
        let yaw = Quat::from_rotation_y(random.range(-30f32, 30.0).to_radians());
        let pitch = Quat::from_axis_angle(side, random.range(-12f32, 12.0).to_radians());
        (moved, moved + yaw * (pitch * forward))
    }

    /// A point of the scene that `eye` sees within a range of pitch [degrees].
    fn look(&self, eye: Vec3, pitch_deg: (f32, f32), random: &mut Random) -> Option<Vec3> {
        (0..8).map(|_| self.surface_point(random)).find(|&p| {
            let pitch = (p - eye).normalize_or_zero().y.asin().to_degrees();
            (pitch_deg.0..pitch_deg.1).contains(&pitch) && self.sees(eye, p)
        })
    }

    /// A point of the scene: half of the draws favour large triangles, half the places with many.
    fn surface_point(&self, random: &mut Random) -> Vec3 {
        let total = self.area[self.area.len() - 1];
        let by_area = self.area.partition_point(|&a| a < random.unit() * total);
        let by_count = random.below(self.area.len());
        let triangle = if random.unit() < 0.5 { by_area.min(self.area.len() - 1) } else { by_count };
        let scene = self.tracer.scene();
        let [a, b, c] = scene.triangle[triangle].map(|i| scene.position[i as usize]);
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + u * (b - a) + v * (c - a)
    }

    fn sees(&self, eye: Vec3, point: Vec3) -> bool {
        let way = point - eye;
        way != Vec3::ZERO && !self.tracer.occluded(eye.into(), way.into(), 0.99)
    }

    fn reach(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        self.tracer.closest(origin.into(), direction.into(), f32::INFINITY).map(|hit| hit.t)
    }

    /// Share of the surface that sees the sky straight above.
    fn sky_share(&self) -> f32 {
        let mut random = Random::of_frame(0, &self.spec.name, u32::MAX);
        let tries = 256;
        let lift = 1e-3 * self.radius() * Vec3::Y;
        let open =
            (0..tries).filter(|_| self.reach(self.surface_point(&mut random) + lift, Vec3::Y).is_none());
        open.count() as f32 / tries as f32
    }
}

/// Width and height of the small image that a proposal is judged by [px].
fn probe_size(recipe: &Recipe) -> (usize, usize) {
    let (width, height) = (recipe.width as f32, recipe.height as f32);
    let scale = (PROBE_PIXELS / (width * height)).sqrt();
    let side = |length: f32| (scale * length).round().max(8.0) as usize;
    (side(width), side(height))
}

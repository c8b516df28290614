//! Proposes cameras as a person would place them, and takes the first good view.

use super::judge::{Flaw, Subject, ViewCriteria, judge};
use super::radius::RadiusRule;
use super::spec::{Candidate, SceneSpec};
use crate::error::{Error, Result};
use crate::gbuffer;
use crate::random::Random;
use crate::scene::Bounds;
use crate::trace::Tracer;
use crate::view::View;
use glam::{Quat, Vec3};

/// Most proposals for one frame; then the scene is refused.
const MAX_TRIES: usize = 1000;

/// Proposals that decide whether a scene's winding is reliable.
const WINDING_PROBES: usize = 64;

/// Pixels of the small image that a proposal is judged by: 96x54 of a wide one.
const PROBE_PIXELS: f32 = 5184.0;

/// Size and AO radius of the wanted views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// Image width (px).
    pub width: usize,
    /// Image height (px).
    pub height: usize,
    /// Rule for the radius.
    pub radius: RadiusRule,
}

/// A scene that is prepared for choosing views.
#[derive(Debug)]
pub struct Stage<'a> {
    spec: &'a SceneSpec,
    tracer: &'a Tracer,
    /// Box around the scene, without the ground.
    content: Bounds,
    /// Running sum of the areas of the triangles, without the ground.
    area: Vec<f32>,
    /// Whether most of the scene has no roof.
    open: bool,
    /// Whether the winding distinguishes inside and outside.
    wound: bool,
}

/// How a view is proposed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    /// From outside, all around.
    Around,
    /// At eye height above a floor.
    Standing,
    /// Anywhere within the scene.
    Flying,
    /// Near one of the cameras that came with the scene.
    Given(Candidate),
}

impl<'a> Stage<'a> {
    /// A scene whose first `content_triangles` triangles are its own and the others ground.
    pub fn new(spec: &'a SceneSpec, tracer: &'a Tracer, content_triangles: usize) -> Self {
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
        let mut stage = Self { spec, tracer, content, area, open: true, wound: true };
        stage.open = stage.sky_share() > 0.5;
        stage.wound = stage.is_wound();
        stage
    }

    /// Radius of the sphere around the scene's box, without the ground (world units).
    pub fn radius(&self) -> f32 {
        self.content.radius()
    }

    /// The view of a frame, and the number of proposals with each flaw.
    ///
    /// # Errors
    /// When no proposal is good enough.
    pub fn view(&self, framing: &Framing, random: &mut Random) -> Result<(View, Vec<Flaw>)> {
        let mut flaws = Vec::new();
        for _ in 0..MAX_TRIES {
            match self.attempt(framing, random) {
                Ok(view) => return Ok((view, flaws)),
                Err(flaw) => flaws.push(flaw),
            }
        }
        let counted =
            Flaw::ALL.map(|f| format!("{} {}", flaws.iter().filter(|g| **g == f).count(), f.name()));
        let what = format!("views of scene {}", self.spec.name);
        Err(Error::request(what, format!("one worth keeping in {MAX_TRIES}"), counted.join(", ")))
    }

    fn attempt(&self, framing: &Framing, random: &mut Random) -> std::result::Result<View, Flaw> {
        let manner = self.manner(random);
        let mut view = self.propose(manner, probe_size(framing), random).ok_or(Flaw::Nowhere)?;
        let surface = gbuffer::render(self.tracer, &view).map_err(|_| Flaw::Nowhere)?;
        let median = judge(&surface, self.subject(), &self.criteria(manner))?;
        view.radius = match framing.radius {
            RadiusRule::SceneFraction(fraction) => fraction * self.radius(),
            RadiusRule::Given(radius) => radius,
            RadiusRule::ImageFraction { min, max } => {
                let image_height = 2.0 * (0.5 * view.fov_y_deg.to_radians()).tan() * median;
                random.log_range(min, max) * image_height
            }
        };
        (view.width, view.height) = (framing.width, framing.height);
        Ok(view)
    }

    fn subject(&self) -> Subject {
        Subject { radius: self.radius(), ground_from: self.area.len() as u32 }
    }

    /// False if most otherwise good views show backs: the winding of such a scene is wrong or inconsistent.
    /// Scenes without a roof are probed from outside, so that views from below their ground do not count.
    fn is_wound(&self) -> bool {
        let mut random = Random::of_frame(1, &self.spec.name, u32::MAX);
        let (mut good, mut backs) = (0, 0);
        for _ in 0..WINDING_PROBES {
            let manner = if self.open { Manner::Around } else { self.manner(&mut random) };
            let Some(view) = self.propose(manner, (96, 54), &mut random) else { continue };
            let Ok(surface) = gbuffer::render(self.tracer, &view) else { continue };
            let criteria = self.criteria(manner);
            let verdict = |backface| judge(&surface, self.subject(), &ViewCriteria { backface, ..criteria });
            good += usize::from(verdict(1.0).is_ok());
            backs += usize::from(verdict(1.0).is_ok() && verdict(criteria.backface) == Err(Flaw::Inside));
        }
        2 * backs <= good
    }

    fn criteria(&self, manner: Manner) -> ViewCriteria {
        let outside = manner == Manner::Around;
        ViewCriteria {
            background: if outside || self.open { 0.6 } else { 0.4 },
            content: 0.1,
            backface: if self.wound { 0.3 } else { 1.0 },
            median_depth: if outside { 0.2 } else { 0.08 },
            near: 0.2,
            near_share: 0.25,
            edges: 0.05,
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

    fn propose(&self, manner: Manner, (width, height): (usize, usize), random: &mut Random) -> Option<View> {
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
        Some(View {
            eye: eye.into(),
            target: target.into(),
            up: [0.0, 1.0, 0.0],
            fov_y_deg,
            ortho_height: None,
            width,
            height,
            near: 1e-3 * self.radius(),
            far: f32::INFINITY,
            radius: self.radius(),
            margin: 0.0,
            separation: None,
        })
    }

    /// From outside: overviews target the middle, close-ups a point of the surface.
    fn around(&self, fov_y_deg: f32, random: &mut Random) -> Option<(Vec3, Vec3)> {
        let radius = self.radius();
        // Diameter of the bounding sphere, in image heights.
        let fill = random.log_range(0.9, 4.0);
        let distance = radius / (0.5 * fov_y_deg.to_radians()).tan() / fill;
        let closeness = ((fill - 0.9) / 1.3).clamp(0.0, 1.0);
        let azimuth = random.range(0.0, std::f32::consts::TAU);
        let elevation = random.range(3f32.to_radians().sin(), 65f32.to_radians().sin()).asin();
        let (sin, cos) = elevation.sin_cos();
        let towards = Vec3::new(cos * azimuth.sin(), sin, cos * azimuth.cos());
        let lowest = self.content.min.y + 0.02 * radius;
        (0..8).find_map(|_| {
            let target = self.content.centre().lerp(self.surface_point(random), closeness);
            let eye = target + distance * towards;
            (eye.y > lowest && (closeness < 1.0 || self.sees(eye, target))).then_some((eye, target))
        })
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

    /// A point of the scene that `eye` sees within a range of pitch (degrees).
    fn look(&self, eye: Vec3, pitch_deg: (f32, f32), random: &mut Random) -> Option<Vec3> {
        (0..16).map(|_| self.surface_point(random)).find(|&p| {
            let pitch = (p - eye).normalize_or_zero().y.asin().to_degrees();
            (pitch_deg.0..pitch_deg.1).contains(&pitch) && self.sees(eye, p)
        })
    }

    /// A point of the scene: half of the draws prefer large triangles, half dense regions.
    fn surface_point(&self, random: &mut Random) -> Vec3 {
        let total = self.area[self.area.len() - 1];
        let area = random.unit() * total;
        let by_area = self.area.partition_point(|&a| a < area);
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

    /// Share of the scene's box that has only sky above.
    fn sky_share(&self) -> f32 {
        let mut random = Random::of_frame(0, &self.spec.name, u32::MAX);
        let tries = 256;
        let point = |random: &mut Random| random.within(self.content.min, self.content.max);
        let open = (0..tries).filter(|_| self.reach(point(&mut random), Vec3::Y).is_none());
        open.count() as f32 / tries as f32
    }
}

/// Width and height of the small image that a proposal is judged by (px).
fn probe_size(framing: &Framing) -> (usize, usize) {
    let (width, height) = (framing.width as f32, framing.height as f32);
    let scale = (PROBE_PIXELS / (width * height)).sqrt();
    let side = |length: f32| (scale * length).round().max(8.0) as usize;
    (side(width), side(height))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{cuboid, room, stack, write_glb};
    use super::super::spec::SceneSplit;
    use super::*;
    use crate::Scene;

    fn views(scene: &Scene, environment: bool, count: u32) -> Result<Vec<View>> {
        let dir = tempfile::tempdir().unwrap();
        let file = write_glb(dir.path(), "x", scene);
        let spec = SceneSpec::from_file(&file, SceneSplit::Train)?.with_environment(environment);
        let (scene, content) = spec.load()?;
        let tracer = Tracer::new(scene);
        let stage = Stage::new(&spec, &tracer, content);
        let framing = Framing { width: 640, height: 360, radius: RadiusRule::ANY };
        let view = |i| stage.view(&framing, &mut Random::of_frame(3, "x", i));
        (0..count).map(|i| view(i).map(|(view, _)| view)).collect()
    }

    #[test]
    fn cameras_of_a_room_stand_in_its_free_space() {
        for view in views(&room(), true, 40).unwrap() {
            let eye = Vec3::from(view.eye);
            assert!(eye.abs().cmplt(Vec3::new(3.0, 3.0, 2.5)).all() && eye.y > 0.0, "{eye}");
            let in_box = |i: usize| {
                let (x, z) = (-2.5 + 1.6 * (i % 4) as f32, -2.0 + 1.8 * (i / 4) as f32);
                let (p, size) = (eye - Vec3::new(x, 0.0, z), Vec3::new(0.4, 0.3 + 0.15 * i as f32, 0.5));
                p.cmpgt(Vec3::ZERO).all() && p.cmplt(size).all()
            };
            assert!(!(0..12).any(in_box), "{eye}");
        }
    }

    #[test]
    fn cameras_of_an_object_stay_above_its_ground_and_see_it() {
        for view in views(&stack(), false, 40).unwrap() {
            let (eye, target) = (Vec3::from(view.eye), Vec3::from(view.target));
            assert!(eye.y > 0.0 && (35.0..=90.0).contains(&view.fov_y_deg));
            assert!((-0.1..1.1).contains(&target.x) && (0.0..=1.5).contains(&target.y), "{target}");
        }
    }

    #[test]
    fn cameras_never_stand_inside_closed_boxes() {
        let mut village = cuboid(Vec3::new(-6.0, -0.1, -6.0), Vec3::new(6.0, 0.0, 6.0), false);
        let corners: Vec<Vec3> =
            (0..9).map(|i| Vec3::new((i % 3 * 4 - 5) as f32, 0.0, (i / 3 * 4 - 5) as f32)).collect();
        let size = Vec3::new(2.5, 3.0, 2.5);
        corners.iter().for_each(|&c| village.append(&cuboid(c, c + size, false)));
        for view in views(&village, true, 60).unwrap() {
            let eye = Vec3::from(view.eye);
            assert!(!corners.iter().any(|&c| eye.cmpgt(c).all() && eye.cmplt(c + size).all()), "{eye}");
        }
    }

    #[test]
    fn a_scene_with_nothing_to_see_is_named_with_the_reasons() {
        let mut floor = cuboid(Vec3::new(-1.0, -0.1, -1.0), Vec3::new(1.0, 0.0, 1.0), false);
        floor.triangle.retain(|t| t.iter().all(|&i| floor.position[i as usize].y == 0.0));
        let message = views(&floor, true, 1).unwrap_err().to_string();
        assert!(message.contains("scene x") && message.contains("nothing to see"), "{message}");
    }
}

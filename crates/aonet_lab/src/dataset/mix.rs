//! New scenes made of those of a list: things of some scenes stand, lie and hang in others.
//!
//! A mixture has the shapes of real scenes in places, sizes and proportions that no scene of the list has.

use aonet_scene::Scene;
use aonet_scene::error::{Error, Result};
use aonet_scene::random::Random;
use aonet_scene::scene::procedural::{self, Kind};
use aonet_scene::scene::{Bounds, glb, ground};
use aonet_scene::staging::{Framing, RadiusRule, SceneSpec, SceneSplit, Stage};
use aonet_scene::trace::Tracer;
use glam::{Mat3, Quat, Vec3};
use rayon::prelude::*;
use std::path::Path;

// guess: the numbers of this file were chosen by eye, from contact sheets.

/// A mixture gets no more things once it has this many triangles.
const MOST_TRIANGLES: usize = 900_000;

/// Things are added in rounds; those of a later round may stand on those of an earlier one.
const ROUNDS: usize = 4;

/// Rays in search of a place for one thing.
const TRIES: usize = 16;

/// Mixtures of one seed.
const ATTEMPTS: u32 = 32;

/// Views that a mixture must have.
const VIEWS: u32 = 4;

/// Most proposals for these views that are not worth keeping.
const MOST_DROPPED: usize = 20;

/// The scenes that mixtures are made of.
#[derive(Debug)]
pub struct Stock {
    /// Scenes that a camera can stand in.
    environments: Vec<Scene>,
    /// Single objects.
    objects: Vec<Scene>,
}

struct Mixture {
    /// Without a ground plane.
    scene: Scene,
    /// Whether a camera can stand inside, instead of around things on the ground.
    environment: bool,
}

impl Stock {
    /// Loads the training scenes of a list; a mixture must not show scenes of validation or test.
    ///
    /// # Errors
    /// When a scene cannot be read, or no training scene is a single object.
    pub fn load(scenes: &[SceneSpec]) -> Result<Self> {
        let training: Vec<_> = scenes.iter().filter(|s| s.split == SceneSplit::Train).collect();
        let loaded = training.par_iter().map(|spec| {
            let (scene, content) = spec.load()?;
            let triangle = scene.triangle[..content].to_vec();
            let bare = Scene { triangle, albedo: Vec::new(), textures: Default::default(), ..scene };
            Ok((spec.environment, bare))
        });
        let (environments, objects): (Vec<_>, Vec<_>) =
            loaded.collect::<Result<Vec<_>>>()?.into_iter().partition(|(environment, _)| *environment);
        if objects.is_empty() {
            let found = format!("{} environments", environments.len());
            return Err(Error::request("mixtures", "training scenes that are single objects", found));
        }
        let scenes = |parts: Vec<(bool, Scene)>| parts.into_iter().map(|(_, scene)| scene).collect();
        Ok(Self { environments: scenes(environments), objects: scenes(objects) })
    }

    /// Writes the mixture of a seed as mix_SEED.glb; the same scenes in the same order give the same one. A mixture in which
    /// cameras find little to see is made anew.
    ///
    /// # Errors
    /// When the file cannot be written, or 32 mixtures in a row show too little.
    pub fn save(&self, seed: u64, dir: &Path) -> Result<SceneSpec> {
        let name = format!("mix_{seed}");
        let mixtures = (0..ATTEMPTS).map(|attempt| self.mix(&mut Random::of_frame(seed, "mixture", attempt)));
        let Some(mixture) = mixtures.into_iter().find(|mixture| mixture.has_views(&name)) else {
            let expected = format!("one in {ATTEMPTS} with something to see");
            return Err(Error::request(format!("mixture of seed {seed}"), expected, "none"));
        };
        let path = dir.join(format!("{name}.glb"));
        glb::save(&mixture.scene, &path)?;
        Ok(SceneSpec::from_file(&path, SceneSplit::Train)?.with_environment(mixture.environment))
    }

    fn mix(&self, random: &mut Random) -> Mixture {
        match random.unit() {
            draw if draw < 0.45 && !self.environments.is_empty() => {
                let base = pick(&self.environments, random);
                self.furnished(base.clone(), random)
            }
            draw if draw < 0.7 => {
                let kind = *pick(Kind::ALL, random);
                let built = procedural::build(kind, random.bits());
                let bare = Scene { albedo: Vec::new(), textures: Default::default(), ..built };
                self.furnished(bare, random)
            }
            _ => self.heap(random),
        }
    }

    /// A scene in other proportions, with things in it.
    fn furnished(&self, base: Scene, random: &mut Random) -> Mixture {
        let stretch = Vec3::new(random.log_range(0.7, 1.4), random.log_range(0.75, 1.33), 1.0);
        let turn = Mat3::from_rotation_y(random.range(0.0, std::f32::consts::TAU));
        let mut scene = Scene::default();
        append(&mut scene, &base, turn * Mat3::from_diagonal(mirrored(stretch, random)), Vec3::ZERO);
        let count = random.log_range(4.0, 50.0) as usize;
        let bounds = scene.bounds();
        self.add_things(&mut scene, bounds, false, count, (0.02, 0.3), random);
        Mixture { scene, environment: true }
    }

    /// Things beside and on each other on open ground.
    fn heap(&self, random: &mut Random) -> Mixture {
        let half = Vec3::new(1.0, 0.6, random.range(0.4, 1.0));
        let bounds = Bounds { min: half * Vec3::new(-1.0, 0.0, -1.0), max: half };
        let mut scene = Scene::default();
        let count = random.log_range(5.0, 40.0) as usize;
        self.add_things(&mut scene, bounds, true, count, (0.1, 0.9), random);
        Mixture { scene, environment: false }
    }

    /// Adds `count` things whose diameters are between two shares of the radius of `bounds`.
    fn add_things(
        &self,
        scene: &mut Scene,
        bounds: Bounds,
        on_ground: bool,
        count: usize,
        share: (f32, f32),
        random: &mut Random,
    ) {
        for round in 0..ROUNDS {
            let mut standing = scene.clone();
            if on_ground {
                standing.append(&floor(bounds));
            }
            let tracer = Tracer::new(standing);
            for _ in 0..count.div_ceil(ROUNDS) {
                if scene.triangle.len() > MOST_TRIANGLES {
                    return;
                }
                let wanted = random.log_range(share.0, share.1) * bounds.radius();
                let Some(place) = (0..TRIES).find_map(|_| Place::find(&tracer, bounds, random)) else {
                    continue;
                };
                let size = wanted.min(0.9 * place.room);
                // A first thing always stands; a heap needs one.
                if size > 0.1 * wanted || (scene.triangle.is_empty() && round == 0) {
                    place.put(scene, self.thing(random), size, random);
                }
            }
        }
    }

    /// An object, or seldom a whole scene as a model of itself.
    fn thing(&self, random: &mut Random) -> &Scene {
        let model = random.unit() < 0.12 && !self.environments.is_empty();
        pick(if model { &self.environments } else { &self.objects }, random)
    }
}

/// A point of a surface, with room for a thing.
struct Place {
    point: Vec3,
    /// Away from the surface; up on floors.
    normal: Vec3,
    /// Free way in front of the surface (world units), infinite under the sky.
    room: f32,
}

impl Place {
    /// Where a ray from a random point meets something: mostly straight down.
    fn find(tracer: &Tracer, bounds: Bounds, random: &mut Random) -> Option<Self> {
        let mut origin = random.within(bounds.min, bounds.max);
        let down = random.unit() < 0.85;
        let direction = if down { Vec3::NEG_Y } else { direction(random) };
        if random.unit() < 0.3 {
            origin.y = bounds.max.y + bounds.radius();
        }
        let hit = tracer.closest(origin.into(), direction.into(), f32::INFINITY)?;
        let point = origin + hit.t * direction;
        let inside =
            point.cmpge(bounds.min - 0.1 * bounds.radius()) & point.cmple(bounds.max + 0.1 * bounds.radius());
        if !inside.all() {
            return None;
        }
        let [a, b, c] =
            tracer.scene().triangle[hit.triangle as usize].map(|i| tracer.scene().position[i as usize]);
        let facing = (b - a).cross(c - a).normalize_or_zero();
        let facing = if facing.dot(direction) > 0.0 { -facing } else { facing };
        let normal = if down && facing.y > 0.7 { Vec3::Y } else { facing };
        if facing == Vec3::ZERO || (down && facing.y <= 0.7) {
            return None;
        }
        let lifted = point + 1e-3 * bounds.radius() * facing;
        let way =
            |d: Vec3| tracer.closest(lifted.into(), d.into(), f32::INFINITY).map_or(f32::INFINITY, |h| h.t);
        let side = normal.any_orthonormal_vector();
        let around = [side, -side, normal.cross(side), -normal.cross(side)].map(way);
        // guess: a thing may touch what is beside it, not fill it.
        let beside = 1.5 * around.iter().copied().sum::<f32>() / 4.0;
        Some(Self { point, normal, room: way(normal).min(beside) })
    }

    /// Puts a thing of a diameter here, turned at random: upright on most floors.
    fn put(&self, scene: &mut Scene, thing: &Scene, size: f32, random: &mut Random) {
        let bounds = thing.bounds();
        let stretch = Vec3::new(random.log_range(0.75, 1.33), random.log_range(0.75, 1.33), 1.0);
        let upright = self.normal == Vec3::Y && random.unit() < 0.75;
        let yaw = Quat::from_rotation_y(random.range(0.0, std::f32::consts::TAU));
        let turn = if upright { yaw } else { Quat::from_rotation_arc(Vec3::Y, direction(random)) * yaw };
        let scale = size / (2.0 * bounds.radius()).max(f32::MIN_POSITIVE);
        let linear = Mat3::from_quat(turn) * Mat3::from_diagonal(scale * mirrored(stretch, random));
        let lowest =
            thing.position.iter().map(|p| self.normal.dot(linear * *p)).fold(f32::INFINITY, f32::min);
        let middle = linear * bounds.centre();
        // A little sunk, as things are that were placed by hand.
        let rise = self.normal.dot(middle) - lowest - random.range(0.0, 0.03) * size;
        append(scene, thing, linear, self.point + rise * self.normal - middle);
    }
}

impl Mixture {
    /// Whether a dataset would find views of it, without dropping many.
    fn has_views(&self, name: &str) -> bool {
        if self.scene.triangle.is_empty() {
            return false;
        }
        let spec = SceneSpec::imported(name.to_owned(), SceneSplit::Train).with_environment(self.environment);
        let mut scene = self.scene.clone();
        if spec.ground {
            ground::add_ground(&mut scene);
        }
        let tracer = Tracer::new(scene);
        let stage = Stage::new(&spec, &tracer, self.scene.triangle.len());
        let framing = Framing { width: 640, height: 360, radius: RadiusRule::ANY };
        let dropped = |i| Some(stage.view(&framing, &mut Random::of_frame(0, name, i)).ok()?.1.len());
        (0..VIEWS).map(dropped).sum::<Option<usize>>().is_some_and(|dropped| dropped <= MOST_DROPPED)
    }
}

/// The ground of a heap.
fn floor(bounds: Bounds) -> Scene {
    let [a, b, c] = [bounds.min, bounds.min.with_x(bounds.max.x), bounds.min.with_z(bounds.max.z)];
    let mut scene = Scene {
        position: vec![a, b, c],
        normal: vec![Vec3::Y; 3],
        triangle: vec![[0, 2, 1]],
        ..Scene::default()
    };
    ground::add_ground(&mut scene);
    scene
}

/// Appends the triangles of `part`, each vertex p at `linear` p + `offset`.
fn append(scene: &mut Scene, part: &Scene, linear: Mat3, offset: Vec3) {
    let of_normals = linear.inverse().transpose();
    let mirrors = linear.determinant() < 0.0;
    scene.append(&Scene {
        position: part.position.iter().map(|p| linear * *p + offset).collect(),
        normal: part.normal.iter().map(|n| (of_normals * *n).normalize_or(*n)).collect(),
        triangle: part
            .triangle
            .iter()
            .map(|&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] })
            .collect(),
        ..Scene::default()
    });
}

/// Half of the draws exchange left and right.
fn mirrored(stretch: Vec3, random: &mut Random) -> Vec3 {
    if random.unit() < 0.5 { stretch * Vec3::new(-1.0, 1.0, 1.0) } else { stretch }
}

/// Uniform on the sphere.
fn direction(random: &mut Random) -> Vec3 {
    Vec3::new(random.normal(), random.normal(), random.normal()).normalize_or(Vec3::Y)
}

fn pick<'a, T>(items: &'a [T], random: &mut Random) -> &'a T {
    &items[random.below(items.len())]
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{room, stack, write_glb};
    use super::*;

    fn stock(dir: &Path) -> Vec<SceneSpec> {
        let spec = |name, scene: &Scene, split, environment| {
            let file = write_glb(dir, name, scene);
            SceneSpec::from_file(&file, split).unwrap().with_environment(environment)
        };
        vec![
            spec("room", &room(), SceneSplit::Train, true),
            spec("stack", &stack(), SceneSplit::Train, false),
            spec("held_out", &room(), SceneSplit::Test, true),
        ]
    }

    #[test]
    fn a_seed_makes_one_scene_and_every_scene_has_views() {
        let dir = tempfile::tempdir().unwrap();
        let stock = Stock::load(&stock(dir.path())).unwrap();
        assert_eq!((stock.environments.len(), stock.objects.len()), (1, 1), "only training scenes");
        let kinds = (0..16).map(|seed| stock.mix(&mut Random::new(seed)).environment);
        let inside = kinds.filter(|environment| *environment).count();
        assert!((1..16).contains(&inside), "{inside} of 16 are environments");
        let mut sums = Vec::new();
        for seed in 0..4 {
            let [first, second] = [(); 2].map(|()| stock.save(seed, dir.path()).unwrap());
            assert_eq!(first, second);
            let (scene, content) = first.load().unwrap();
            let own = Scene { triangle: scene.triangle[..content].to_vec(), ..scene }.checked().unwrap();
            assert!(own.triangle.len() > 60, "{seed}: {} triangles", own.triangle.len());
            sums.push(first.sha256);
        }
        sums.sort();
        sums.dedup();
        assert_eq!(sums.len(), 4);
    }

    #[test]
    fn things_stand_within_the_scene_and_on_it() {
        let dir = tempfile::tempdir().unwrap();
        let stock = Stock::load(&stock(dir.path())).unwrap();
        for seed in 0..6 {
            let bounds = stock.heap(&mut Random::new(seed)).scene.bounds();
            assert!(bounds.min.y > -0.1 && bounds.radius() < 4.0, "{seed}: {bounds:?}");
            let room = stock.furnished(room(), &mut Random::new(seed)).scene.bounds();
            // The room is 6x3x5; a thing may pass through a wall by half of its size.
            assert!(room.min.y > -1.5 && room.radius() < 10.0, "{seed}: {room:?}");
        }
    }

    #[test]
    fn a_list_without_objects_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let error = Stock::load(&stock(dir.path())[..1]).unwrap_err().to_string();
        assert!(error.contains("single objects") && error.contains("1 environments"), "{error}");
    }
}

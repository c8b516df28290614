use super::*;
use glam::Vec3;

/// Small deterministic random numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vec(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Scene {
    let position: Vec<Vec3> = triangles.into_iter().flatten().collect();
    let n = position.len() as u32;
    let triangle = (0..n / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Scene {
        name: "soup".into(),
        normal: vec![Vec3::Y; position.len()],
        position,
        triangle,
        ..Scene::default()
    }
}

/// `n` triangles of edge length about `size` in the cube around `centre`.
fn random_scene(n: usize, (centre, size): (Vec3, f32), random: &mut Random) -> Scene {
    soup((0..n).map(|_| {
        let at = centre + random.vec();
        [at, at + size * random.vec(), at + size * random.vec()]
    }))
}

/// Möller and Trumbore in f64, no hierarchy. Returns t and the distance of the hit to the triangle's rim.
fn intersect_f64(scene: &Scene, triangle: usize, (origin, direction): (Vec3A, Vec3A)) -> Option<(f64, f64)> {
    let [a, b, c] = scene.triangle[triangle].map(|i| scene.position[i as usize].as_dvec3());
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    let s = o - a;
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
    (t.is_finite()).then(|| (t, u.min(v).min(1.0 - u - v)))
}

fn rays(n: usize, centre: Vec3, random: &mut Random) -> Vec<(Vec3A, Vec3A, f32)> {
    (0..n)
        .map(|i| {
            let mut direction = random.vec();
            if i % 7 == 0 {
                direction[i % 3] = 0.0;
            }
            if i % 21 == 0 {
                direction[(i + 1) % 3] = -0.0;
            }
            let t_max = if i % 2 == 0 { f32::INFINITY } else { random.next() };
            ((centre + 1.5 * random.vec()).into(), direction.into(), t_max)
        })
        .collect()
}

#[test]
fn rays_find_what_brute_force_in_f64_finds() {
    let mut random = Random(1);
    for (n, size, centre) in [(1, 1.0, 0.0), (9, 1.0, 0.0), (500, 0.3, 0.0), (3000, 0.1, 30.0)] {
        let centre = Vec3::splat(centre);
        let tracer = Tracer::new(random_scene(n, (centre, size), &mut random));
        let mut found = 0;
        for (origin, direction, t_max) in rays(500, centre, &mut random) {
            let all: Vec<(f64, f64)> =
                (0..n).filter_map(|i| intersect_f64(tracer.scene(), i, (origin, direction))).collect();
            let at = |&&(t, rim): &&(f64, f64)| t > 0.0 && t <= f64::from(t_max) && rim >= 0.0;
            let nearest = all.iter().filter(at).map(|h| h.0).min_by(f64::total_cmp);
            // Rays within rounding of a rim or of an end of the ray may go either way.
            let close = |&&(t, rim): &&(f64, f64)| {
                rim.abs() < 1e-3 || t.abs() < 1e-4 || (t - f64::from(t_max)).abs() < 1e-4
            };
            if all.iter().any(|h| close(&h)) {
                continue;
            }
            let hit = tracer.closest(origin, direction, t_max);
            assert_eq!(hit.is_some(), nearest.is_some(), "{n} triangles, {origin} {direction}");
            assert_eq!(tracer.occluded(origin, direction, t_max), nearest.is_some());
            if let (Some(hit), Some(t)) = (hit, nearest) {
                found += 1;
                assert!((f64::from(hit.t) - t).abs() < 1e-4 * (1.0 + t), "{} and {t}", hit.t);
            }
        }
        assert!(n < 500 || found > 50, "{found} hits of {n} triangles");
    }
}

#[test]
fn instruction_sets_agree_bit_for_bit() {
    let mut random = Random(2);
    for (n, size, centre) in [(7, 1.0, 0.0), (2000, 0.2, 0.0), (5000, 0.05, 1000.0)] {
        let centre = Vec3::splat(centre);
        let fast = Tracer::new(random_scene(n, (centre, size), &mut random));
        let mut slow = Tracer::new(fast.scene().clone());
        slow.level = Level::Scalar;
        let bits = |h: Option<Hit>| h.map(|h| (h.t.to_bits(), h.triangle, h.u.to_bits(), h.v.to_bits()));
        for (origin, direction, t_max) in rays(3000, centre, &mut random) {
            let hit = fast.closest(origin, direction, t_max);
            assert_eq!(bits(hit), bits(slow.closest(origin, direction, t_max)));
            assert_eq!(fast.occluded(origin, direction, t_max), slow.occluded(origin, direction, t_max));
            assert_eq!(fast.occluded(origin, direction, t_max), hit.is_some());
        }
    }
}

#[test]
fn useless_triangles_are_never_hit_and_do_no_harm() {
    let nan = Vec3::new(0.0, f32::NAN, 0.0);
    let huge = Vec3::splat(3e38);
    let scene = soup([
        [Vec3::ZERO; 3],
        [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X],
        [nan, Vec3::X, Vec3::Z],
        [huge, -huge, Vec3::new(3e38, -3e38, 0.0)],
        [Vec3::splat(1e-40), Vec3::splat(1e-41), Vec3::new(0.0, 1e-40, 0.0)],
    ]);
    let tracer = Tracer::new(scene);
    let mut random = Random(3);
    for (origin, direction, t_max) in rays(300, Vec3::ZERO, &mut random) {
        let hit = tracer.closest(origin, direction, t_max);
        assert!(hit.is_none_or(|h| h.triangle == 3), "{hit:?}");
    }
    let none = Tracer::new(Scene::default());
    assert!(!none.occluded(Vec3A::ZERO, Vec3A::Y, 1.0));
    assert_eq!(none.closest(Vec3A::ZERO, Vec3A::ZERO, f32::NAN), None);
    assert!(!tracer.occluded(Vec3A::NAN, Vec3A::NAN, f32::NAN));
}

#[test]
fn equal_and_nested_triangles_stay_within_the_stack() {
    let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Z];
    let tracer = Tracer::new(soup((0..100_000).map(|_| [a, b, c])));
    let hit = tracer.closest(Vec3A::new(0.2, 1.0, 0.2), -Vec3A::Y, 2.0).unwrap();
    assert_eq!(hit.t, 1.0);
    assert!(!tracer.occluded(Vec3A::new(0.8, 1.0, 0.8), -Vec3A::Y, 2.0));
    let nested = soup((0..100_000).map(|i| {
        let s = 1.0 + i as f32 * 1e-5;
        [Vec3::new(-s, -s, -s), Vec3::new(s, -s, s), Vec3::new(-s, s, s)]
    }));
    assert!(Tracer::new(nested).occluded(Vec3A::new(-0.9, -0.9, -5.0), Vec3A::Z, 9.0));
}

#[test]
fn triangles_of_all_sizes_stay_within_the_stack() {
    // Each one is a little farther away and larger than the one before it, over 240 powers of two.
    let chain = soup((0..20_000).map(|i| {
        let s = 2f32.powf(-120.0 + 240.0 * (i as f32) / 20_000.0);
        [Vec3::new(s, 0.0, 0.0), Vec3::new(s, 0.1 * s, 0.0), Vec3::new(s, 0.0, 0.1 * s)]
    }));
    let tracer = Tracer::new(chain);
    let origin = Vec3A::new(0.0, 0.01, 0.01);
    assert!(tracer.occluded(origin, Vec3A::X, f32::INFINITY));
    assert!(!tracer.occluded(origin, -Vec3A::X, f32::INFINITY));
}

/// Fans of random rays above random planes through points near `centre`.
fn fans(n: usize, centre: Vec3, random: &mut Random) -> Vec<Fan> {
    (0..n)
        .map(|i| {
            let length = if i % 2 == 0 { f32::INFINITY } else { 2.0 * random.next() };
            let mut fan = Fan::new((centre + random.vec()).into(), random.vec().normalize().into(), length);
            // Narrow fans stay together deep into the hierarchy.
            let (axis, spread) = (random.vec(), random.next());
            for ray in 0..FAN {
                fan.set(ray, (axis + spread * random.vec()).into());
            }
            fan
        })
        .collect()
}

#[test]
fn fans_find_what_single_rays_find() {
    let mut random = Random(5);
    let (mut asked, mut blocked) = (0, 0);
    for (n, size, centre) in [(3, 1.0, 0.0), (400, 0.4, 0.0), (4000, 0.1, 30.0)] {
        let centre = Vec3::splat(centre);
        let tracer = Tracer::new(random_scene(n, (centre, size), &mut random));
        for fan in fans(200, centre, &mut random) {
            let found = tracer.blocked(&fan);
            assert_eq!(found & !fan.rays, 0, "rays that nobody asked for");
            (asked, blocked) = (asked + fan.rays.count_ones(), blocked + found.count_ones());
            for ray in (0..FAN).filter(|ray| fan.rays >> ray & 1 == 1) {
                let (origin, direction, length) = fan.single(ray);
                if tracer.occluded(origin, direction, length) != (found >> ray & 1 == 1) {
                    let mut all =
                        (0..n).filter_map(|i| intersect_f64(tracer.scene(), i, (origin, direction)));
                    assert!(all.any(|(t, rim)| rim.abs() < 1e-3 || (t - f64::from(length)).abs() < 1e-4));
                }
            }
        }
    }
    assert!(asked > 15_000 && blocked > asked / 10 && blocked < asked, "{blocked} of {asked}");
}

#[test]
fn instruction_sets_agree_on_fans() {
    let mut random = Random(6);
    for (n, size, centre) in [(7, 1.0, 0.0), (2000, 0.2, 0.0), (5000, 0.05, 1000.0)] {
        let centre = Vec3::splat(centre);
        let fast = Tracer::new(random_scene(n, (centre, size), &mut random));
        let mut slow = Tracer::new(fast.scene().clone());
        slow.level = Level::Scalar;
        for fan in fans(500, centre, &mut random) {
            assert_eq!(fast.blocked(&fan), slow.blocked(&fan));
        }
    }
}

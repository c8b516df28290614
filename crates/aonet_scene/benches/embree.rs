//! Occlusion rays per second and core, beside Embree in the same run.
//!
//!     EMBREE_DIR=folder AONET_DATA=folder cargo bench -p aonet_scene --bench embree
//!
//! `EMBREE_DIR` has `libembree4*` and the `libtbb*` it needs (the Python wheel `embreex` bundles them); without it
//! only our own rates are measured. `AONET_DATA` adds scenes of that folder.
#![allow(unsafe_code, reason = "calls a C library")]

mod embree {
    pub(crate) mod library;
}

use aonet::AoParams;
use aonet_scene::gbuffer::{Surface, render};
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::scene::gltf::{self, MissingNormals};
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use embree::library::Embree;
use glam::{Vec3, Vec3A};
use std::path::PathBuf;

const SPP: u32 = 256;
const ROUNDS: usize = 7;

/// One thread's processor time (s): other programs on the machine do not count.
fn processor_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    stat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).expect("nanoseconds") * 1e-9
}

/// Rays with a common length; those of one pixel are neighbours.
struct Rays {
    origin: Vec<Vec3A>,
    direction: Vec<Vec3A>,
    length: f32,
}

/// Cosine-weighted rays from every pixel of `surface`.
fn rays(surface: &Surface, length: f32) -> Rays {
    let gbuffer = &surface.gbuffer;
    let camera = gbuffer.camera();
    let world_from_view = camera.view_from_world().inverse();
    let mut random = 1u64;
    let mut next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 40) as f32 / (1u64 << 24) as f32
    };
    let (mut origin, mut direction) = (vec![], vec![]);
    for i in (0..gbuffer.depth().len()).filter(|&i| gbuffer.is_foreground(i)) {
        let at = camera.position_view(i % camera.width(), i / camera.width(), gbuffer.depth()[i]);
        let geo = world_from_view.transform_vector3a(surface.geo_normal[i].into());
        let start = world_from_view.transform_point3a(at) + geo * 1e-4 * gbuffer.depth()[i];
        let normal = world_from_view.transform_vector3a(gbuffer.normal()[i].into());
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        // Ordered by angle, so that the sixteen rays of a packet are neighbours.
        for k in 0..SPP {
            let (area, phi) = (next(), std::f32::consts::TAU * (k as f32 + next()) / SPP as f32);
            let (x, y) = (area.sqrt() * phi.cos(), area.sqrt() * phi.sin());
            origin.push(start);
            direction.push(tangent * x + bitangent * y + normal * (1.0 - area).sqrt());
        }
    }
    Rays { origin, direction, length }
}

/// Hills with spheres and cubes on them: about half a million triangles.
fn hills() -> Scene {
    let mut scene = Scene { name: "hills".into(), ..Scene::default() };
    let height =
        |x: f32, z: f32| 0.5 * (1.3 * x).sin() + 0.5 * (1.7 * z).cos() + 0.08 * (7.1 * x + 5.3 * z).sin();
    let at = |x: f32, z: f32| {
        Vec3::new(20.0 * x - 10.0, height(20.0 * x - 10.0, 20.0 * z - 10.0), 20.0 * z - 10.0)
    };
    grid(&mut scene, 300, at);
    let mut random = 7u32;
    let mut next = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as f32 / 16_777_216.0
    };
    for k in 0..400 {
        let centre = Vec3::new(18.0 * next() - 9.0, 1.5 * next(), 18.0 * next() - 9.0);
        let radius = 0.15 + 0.5 * next();
        grid(&mut scene, 20, |u, v| {
            let (theta, phi) = (std::f32::consts::PI * u, std::f32::consts::TAU * v);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            centre + radius * if k % 2 == 0 { d } else { d / d.abs().max_element() }
        });
    }
    scene
}

/// Appends `n` x `n` quads of the surface `at(u, v)`.
fn grid(scene: &mut Scene, n: u32, at: impl Fn(f32, f32) -> Vec3) {
    let base = scene.position.len() as u32;
    for k in 0..(n + 1) * (n + 1) {
        scene.position.push(at((k % (n + 1)) as f32 / n as f32, (k / (n + 1)) as f32 / n as f32));
        scene.normal.push(Vec3::ZERO);
    }
    for k in 0..n * n {
        let a = base + k / n * (n + 1) + k % n;
        let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
        scene.triangle.extend([[a, c, b], [a, d, c]]);
    }
    for t in &scene.triangle[scene.triangle.len() - 2 * (n * n) as usize..] {
        let [a, b, c] = t.map(|i| scene.position[i as usize]);
        t.iter().for_each(|&i| scene.normal[i as usize] += (b - a).cross(c - a).normalize_or_zero());
    }
    for normal in &mut scene.normal[base as usize..] {
        *normal = normal.normalize_or(Vec3::Y);
    }
}

/// A way to count the blocked rays among some.
type Contender<'a> = (&'static str, Box<dyn Fn(&Rays) -> usize + 'a>);

fn measure(scene: Scene, view: &View, lengths: [f32; 2]) {
    let embree = std::env::var_os("EMBREE_DIR").map(|dir| Embree::load(&PathBuf::from(dir), &scene));
    println!("{}: {} triangles", scene.name, scene.triangle.len());
    let start = processor_time();
    let tracer = Tracer::new(scene);
    println!("  built in {:.2} s", processor_time() - start);
    let surface = render(&tracer, view).expect("a view of the scene");
    for length in lengths {
        let rays = rays(&surface, length);
        let whole = |_: &Rays| {
            let sampling = Sampling { spp: SPP, seed: 1 };
            let ao = reference_ao(&tracer, &surface, AoParams::new(length).unwrap(), sampling, &|_| ());
            ao.expect("rays").visibility().iter().map(|v| ((1.0 - v) * SPP as f32).round() as usize).sum()
        };
        let one = |rays: &Rays| {
            let all = rays.origin.iter().zip(&rays.direction);
            all.filter(|(o, d)| tracer.occluded(**o, **d, length)).count()
        };
        let mut contenders: Vec<Contender> =
            vec![("ours, ray by ray", Box::new(one)), ("ours, reference_ao", Box::new(whole))];
        if let Some(embree) = &embree {
            contenders.insert(
                0,
                ("rtcOccluded1", Box::new(|r| embree.occluded1(&r.origin, &r.direction, r.length))),
            );
            contenders.insert(
                1,
                ("rtcOccluded16", Box::new(|r| embree.occluded16(&r.origin, &r.direction, r.length))),
            );
        }
        report(&contenders, &rays);
    }
}

/// Rates and, round by round, ratios to the first contender; medians.
fn report(contenders: &[Contender], rays: &Rays) {
    let n = rays.origin.len();
    let mut rates = vec![vec![]; contenders.len()];
    let mut blocked = vec![0; contenders.len()];
    for _ in 0..ROUNDS {
        for (i, (_, count)) in contenders.iter().enumerate() {
            let start = processor_time();
            blocked[i] = count(rays);
            rates[i].push(n as f64 / (processor_time() - start) * 1e-6);
        }
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!("  {n} rays of length {}", rays.length);
    for (i, (name, _)) in contenders.iter().enumerate() {
        let ratio = rates[i].iter().zip(&rates[0]).map(|(a, b)| a / b).collect();
        let open = 1.0 - blocked[i] as f64 / n as f64;
        println!(
            "    {name:20} {:6.2} Mray/s  {:5.2} x  open {open:.4}",
            median(rates[i].clone()),
            median(ratio)
        );
    }
}

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().expect("first pool");
    let view = View {
        eye: [0.0, 6.0, 13.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: 40.0,
        ortho_height: None,
        width: 80,
        height: 45,
        near: 0.0,
        far: f32::INFINITY,
        radius: 1.0,
        margin: 0.0,
        separation: None,
    };
    measure(hills(), &view, [1.0, 1e30]);
    if let Some(data) = std::env::var_os("AONET_DATA").map(PathBuf::from) {
        for name in ["living_modern_3", "feast_1", "graveyard_2"] {
            let frames = data.join("reference-frames");
            let view = View::load(&frames.join(format!("{name}.json"))).expect("a view");
            let stem = name.split_at(name.len() - 2).0;
            let glb = [frames.join(format!("{stem}.glb")), data.join(format!("scenes/{stem}.glb"))];
            let glb = glb.iter().find(|p| p.exists()).expect("its scene");
            let scene = gltf::load(glb, MissingNormals::Flat).expect("a scene");
            let radius = view.radius;
            measure(scene, &View { width: 80, height: 45, ..view }, [radius, 1e30]);
        }
    }
}

//! Agreement with frames that an Embree-based tracer made by the same definition.
//!
//! The frames are not part of the project; `AONET_DATA` names the folder that has `reference-frames` and `scenes`.

use aonet::metrics::{compare, psnr};
use aonet::{AoImage, GBuffer};
use aonet_lab::frame::{Frame, FrameHints};
use aonet_scene::View;
use aonet_scene::gbuffer::{Surface, render};
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::scene::gltf::{self, MissingNormals};
use aonet_scene::trace::Tracer;
use glam::Vec3A;
use std::path::{Path, PathBuf};

const NAMES: [&str; 7] =
    ["room", "arena_pandora_1", "feast_1", "graveyard_2", "koala_2", "living_modern_3", "three_graces_2"];

const SAMPLING: Sampling = Sampling { spp: 512, seed: 1 };

/// A frame of the other program, and our tracer over its scene.
struct Case {
    name: &'static str,
    view: View,
    frame: Frame,
    tracer: Tracer,
    surface: Surface,
}

impl Case {
    fn load(folder: &Path, name: &'static str) -> Self {
        let view_path = folder.join(format!("{name}.json"));
        let view = View::load(&view_path).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&view_path).unwrap()).unwrap();
        let scene = gltf::load(&folder.join(json["glb"].as_str().unwrap()), MissingNormals::Flat).unwrap();
        let hints = FrameHints { view: Some(view.clone()), ..FrameHints::default() };
        let frame = Frame::load(&folder.join(format!("{name}.exr")), &hints).unwrap();
        let tracer = Tracer::new(scene);
        let surface = render(&tracer, &view).unwrap();
        Self { name, view, frame, tracer, surface }
    }

    /// Share of the foreground of either program whose normals are within 2 degrees; where triangles coincide,
    /// the normal of any of them counts.
    fn normals(&self) -> f64 {
        let (ours, theirs) = (self.surface.gbuffer.normal(), self.frame.gbuffer.normal());
        self.share(|i| within_2_deg(ours[i].into(), theirs[i].into()) || self.coincides(i, theirs[i].into()))
    }

    /// The same with the normal of the triangle that our ray found first and no other.
    fn plain_normals(&self) -> f64 {
        let (ours, theirs) = (self.surface.gbuffer.normal(), self.frame.gbuffer.normal());
        self.share(|i| within_2_deg(ours[i].into(), theirs[i].into()))
    }

    /// Whether a triangle that is as far away at pixel `i` as the nearest one has the normal `theirs`.
    fn coincides(&self, i: usize, theirs: Vec3A) -> bool {
        let (gbuffer, scene) = (&self.surface.gbuffer, self.tracer.scene());
        let camera = gbuffer.camera();
        let (x, y) = (i % camera.width(), i / camera.width());
        let direction = camera.view_from_world().matrix3.transpose() * camera.position_view(x, y, 1.0);
        let eye = Vec3A::from(self.view.eye);
        scene.triangle.iter().any(|t| {
            let [a, b, c] = t.map(|i| Vec3A::from(scene.position[i as usize]));
            let (e1, e2, p) = (b - a, c - a, direction.cross(c - a));
            let q = (eye - a).cross(e1) / e1.dot(p);
            let (u, v, depth) = ((eye - a).dot(p) / e1.dot(p), direction.dot(q), e2.dot(q));
            let inside = u.min(v).min(1.0 - u - v) > -1e-4;
            let [n0, n1, n2] = t.map(|i| Vec3A::from(scene.normal[i as usize]));
            let world = (n0 * (1.0 - u - v) + n1 * u + n2 * v).normalize_or_zero();
            let normal = camera.view_from_world().matrix3 * world * -e1.cross(e2).dot(direction).signum();
            inside && (depth - gbuffer.depth()[i]).abs() < 1e-4 * depth && within_2_deg(normal, theirs)
        })
    }

    /// Share of the foreground of either program whose depths are within 0.1 %.
    fn depths(&self) -> f64 {
        let (ours, theirs) = (self.surface.gbuffer.depth(), self.frame.gbuffer.depth());
        self.share(|i| (ours[i] - theirs[i]).abs() <= 1e-3 * theirs[i])
    }

    fn share(&self, agrees: impl Fn(usize) -> bool) -> f64 {
        let (ours, theirs) = (&self.surface.gbuffer, &self.frame.gbuffer);
        let seen: Vec<usize> =
            (0..ours.depth().len()).filter(|&i| ours.is_foreground(i) || theirs.is_foreground(i)).collect();
        seen.iter().filter(|&&i| agrees(i)).count() as f64 / seen.len() as f64
    }

    fn trace(&self, surface: &Surface) -> AoImage {
        reference_ao(&self.tracer, surface, self.view.params().unwrap(), SAMPLING, &|_| ()).unwrap()
    }

    /// The surface with only every 67th pixel left: enough for an error, and quickly traced.
    fn sparse(&self) -> Surface {
        let gbuffer = &self.surface.gbuffer;
        let depth =
            gbuffer.depth().iter().enumerate().map(|(i, d)| if i % 67 == 0 { *d } else { f32::INFINITY });
        let gbuffer =
            GBuffer::new(*gbuffer.camera(), depth.collect::<Vec<_>>(), gbuffer.normal().to_vec()).unwrap();
        Surface { gbuffer, ..self.surface.clone() }
    }
}

fn within_2_deg(a: Vec3A, b: Vec3A) -> bool {
    a.dot(b) >= 2f32.to_radians().cos()
}

fn cases() -> Option<impl Iterator<Item = Case>> {
    let Some(folder) = std::env::var_os("AONET_DATA").map(|d| PathBuf::from(d).join("reference-frames"))
    else {
        println!("skipped: AONET_DATA is not set");
        return None;
    };
    Some(NAMES.into_iter().map(move |name| Case::load(&folder, name)))
}

#[test]
fn gbuffers_and_a_sample_of_the_ao_agree() {
    for case in cases().into_iter().flatten() {
        let surface = case.sparse();
        let (ours, theirs) = (case.trace(&surface), case.frame.ao.as_ref().unwrap());
        let (mut sum, mut n) = (0.0, 0.0);
        for i in (0..theirs.visibility().len()).filter(|&i| surface.gbuffer.is_foreground(i)) {
            sum += f64::from(ours.visibility()[i] - theirs.visibility()[i]).powi(2);
            n += 1.0;
        }
        let (psnr, normals, depths) = (psnr(sum / n), case.normals(), case.depths());
        println!(
            "{:16} foreground {psnr:5.2} dB  {:7.3} %  {:7.3} %",
            case.name,
            100.0 * normals,
            100.0 * depths
        );
        assert!(psnr >= 45.0 && normals >= 0.999 && depths >= 0.999);
    }
}

#[test]
#[ignore = "traces 3.3 billion rays"]
fn whole_frames_agree() {
    println!("frame             SSIM    PSNR [dB]  normals < 2 deg  (plain)  depth < 0.1 %");
    for case in cases().into_iter().flatten() {
        let scores = compare(case.frame.ao.as_ref().unwrap(), &case.trace(&case.surface), None).unwrap().full;
        let (ssim, psnr, normals, depths) = (scores.ssim, scores.psnr, case.normals(), case.depths());
        println!(
            "{:16}  {ssim:.4}  {psnr:9.2}  {:13.3} %  {:7.3}  {:11.3} %",
            case.name,
            100.0 * normals,
            100.0 * case.plain_normals(),
            100.0 * depths
        );
        assert!(ssim >= 0.97 && psnr >= 45.0 && normals >= 0.999 && depths >= 0.999);
    }
}

//! Reads scenes from files on a separate thread.

use crate::Result;
use aonet_scene::scene::MissingNormals;
use aonet_scene::scene::colours;
use aonet_scene::scene::gltf;
use aonet_scene::staging::{SceneSpec, SceneSplit, propose_view};
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// A scene with a camera in it.
pub(super) type Loaded = (Tracer, View);

/// A file that is being read.
#[derive(Debug)]
pub(super) struct Loading {
    pub(super) path: PathBuf,
    done: Receiver<Result<Loaded>>,
}

impl Loading {
    /// Starts reading a glTF file. The view takes size and field of view from `like`.
    pub(super) fn start(path: PathBuf, like: &View) -> Self {
        let (sender, done) = channel();
        let (from, like) = (path.clone(), like.clone());
        // Sending fails if another file was dropped meanwhile.
        std::thread::spawn(move || drop(sender.send(load(&from, &like))));
        Self { path, done }
    }

    /// The result, once it is available.
    pub(super) fn poll(&self) -> Option<Result<Loaded>> {
        match self.done.try_recv() {
            Ok(loaded) => Some(loaded),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err(crate::Error::file(&self.path, "a scene", "a file that makes its reader panic")))
            }
        }
    }
}

fn load(path: &Path, like: &View) -> Result<Loaded> {
    let size = like.size()?;
    let proposed =
        SceneSpec::from_file(path, SceneSplit::Train).and_then(|spec| propose_view(&spec, size, 0));
    match proposed {
        Ok((tracer, view)) => Ok((coloured(tracer.scene().clone()), view)),
        // Some scenes have no view that suits training; they can still be shown from outside.
        Err(_) => {
            let scene = gltf::load(path, MissingNormals::CREASE)?;
            let view = from_outside(&scene, like);
            Ok((coloured(scene), view))
        }
    }
}

/// The scene with its hierarchy and with colours.
pub(super) fn coloured(mut scene: Scene) -> Tracer {
    colours::add_plain(&mut scene);
    Tracer::new(scene)
}

/// A camera that sees all of a scene.
fn from_outside(scene: &Scene, like: &View) -> View {
    let bounds = scene.bounds();
    let radius = bounds.radius().max(f32::MIN_POSITIVE);
    // The sphere around the scene touches the upper and the lower edge.
    let distance = radius / (0.5 * like.fov_y_deg.to_radians()).sin();
    let eye = bounds.centre() + distance * glam::Vec3::new(0.5, 0.4, 0.77).normalize();
    View {
        eye: eye.to_array(),
        target: bounds.centre().to_array(),
        up: [0.0, 1.0, 0.0],
        near: 1e-3 * distance,
        // guess: a fifth of the visible height.
        radius: 0.2 * radius,
        ..like.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet_scene::scene::procedural;
    use std::time::Duration;

    #[test]
    fn a_missing_file_is_named() {
        let (_, view) = procedural::demo();
        let loading = Loading::start("no/such.glb".into(), &view);
        let error = loading.done.recv_timeout(Duration::from_secs(60)).unwrap().unwrap_err();
        assert!(error.to_string().contains("such.glb"), "{error}");
    }

    #[test]
    fn a_camera_outside_sees_every_corner_of_the_box() {
        let (scene, like) = procedural::demo();
        let view = from_outside(&scene, &View { width: 64, height: 64, ..like });
        let camera = view.camera().unwrap();
        let bounds = scene.bounds();
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            let p = camera.view_from_world().transform_point3(glam::Vec3::new(pick(0), pick(1), pick(2)));
            let edge = -p.z * 32.0 / camera.focal_px()[1];
            assert!(p.z < -view.near && p.x.abs() <= edge && p.y.abs() <= edge, "{p}");
        }
    }
}

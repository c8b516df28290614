//! The scene of the command line and how to show it, checked.

use super::Args;
use crate::radius;
use crate::setup::StageArgs;
use anyhow::{Context, Result};
use aonet_scene::View;
use aonet_scene::trace::Tracer;
use aonet_view::renderer::CameraPath;
use aonet_view::{Method, Show};

/// A scene, its camera and what is seen of it.
pub(super) struct Stage {
    pub(super) tracer: Tracer,
    pub(super) view: View,
    pub(super) methods: [Method; 2],
    pub(super) split: f32,
    pub(super) show: Show,
    pub(super) bent_normals: bool,
    pub(super) way: Option<CameraPath>,
}

impl Stage {
    pub(super) fn new(args: &Args) -> Result<Self> {
        let first = args.method.parse()?;
        let second = args.against.as_deref().map(str::parse).transpose()?;
        let show = args.show.parse()?;
        let way = args.camera_path.as_ref().map(|path| {
            let text = std::fs::read(path).map_err(aonet_scene::Error::io(path))?;
            CameraPath::from_json(&text).with_context(|| path.display().to_string())
        });
        let way = way.transpose()?;
        let (tracer, mut view) = StageArgs {
            scene: args.scene.clone(),
            view: args.view.clone(),
            environment: args.environment,
            size: args.size,
            seed: 0,
        }
        .load()?;
        view.radius = radius::given_or(args.radius, view.radius)?;
        view.params()?;
        let view = args.surround.applied(view)?;
        let split = if second.is_some() { args.split } else { 1.0 };
        let (methods, bent_normals) = ([first, second.unwrap_or(first)], args.bent_normals);
        Ok(Self { tracer, view, methods, split, show, bent_normals, way })
    }

    /// The start of a window.
    pub(super) fn into_start(self) -> aonet_view::window::Start {
        let Self { tracer, view, methods, split, show, bent_normals, way } = self;
        aonet_view::window::Start { tracer, view, methods, split, show, bent_normals, way }
    }
}

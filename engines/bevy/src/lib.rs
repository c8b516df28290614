//! Ambient occlusion learned from traced rays for Bevy, in one noise-free frame: no temporal anti-aliasing needed.
//!
//! The plugin replaces the texture of Bevy's own screen-space ambient occlusion, so that indirect light of the standard
//! materials uses it, forward and deferred. Bevy's own search does not run on such cameras.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_aonet::{AonetAmbientOcclusion, AonetPlugin};
//!
//! fn main() {
//!     App::new().add_plugins((DefaultPlugins, AonetPlugin)).add_systems(Startup, start).run();
//! }
//!
//! fn start(mut commands: Commands) {
//!     commands.spawn((Camera3d::default(), AonetAmbientOcclusion { radius: 1.0, ..default() }));
//! }
//! ```

mod behind;
mod engine;
mod followers;
mod frame;
mod passes;
mod settings;
mod view;

pub use followers::{AonetBehind, AonetSurround};
pub use settings::{AonetAmbientOcclusion, AonetMethod};
pub use view::AonetVisibility;

use bevy::asset::embedded_asset;
use bevy::camera::CameraUpdateSystems;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::pbr::prepare_mesh_view_bind_groups;
use bevy::prelude::*;
use bevy::render::extract_component::ExtractComponentPlugin;
use bevy::render::renderer::RenderDevice;
use bevy::render::{ExtractSchedule, Render, RenderApp, RenderSystems};

/// Adds ambient occlusion to every camera with an [`AonetAmbientOcclusion`]. Add it after `DefaultPlugins`.
///
/// Its GPU time is the diagnostic `render/aonet/elapsed_gpu` where `RenderDiagnosticsPlugin` is added.
#[derive(Debug, Clone, Copy, Default)]
pub struct AonetPlugin;

/// Storage textures of a shader that Bevy's own plugin needs. On devices with fewer it makes no texture to replace.
const STORAGE_TEXTURES: u32 = 5;

impl Plugin for AonetPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "behind.wesl");
        app.register_type::<AonetAmbientOcclusion>()
            .add_plugins(ExtractComponentPlugin::<AonetAmbientOcclusion>::default())
            .register_type::<AonetSurround>()
            .register_type::<AonetBehind>()
            .add_systems(
                PostUpdate,
                (
                    settings::refuse_multisampling,
                    (followers::forget, followers::follow)
                        .before(CameraUpdateSystems)
                        .before(TransformSystems::Propagate),
                ),
            );
    }

    fn finish(&self, app: &mut App) {
        let Some(render) = app.get_sub_app_mut(RenderApp) else {
            return warn!("aonet: expected a renderer, found none; cameras have no ambient occlusion");
        };
        let limits = render.world().resource::<RenderDevice>().limits();
        let found = limits.max_storage_textures_per_shader_stage;
        if found < STORAGE_TEXTURES {
            return warn!(
                "aonet: expected a device with {STORAGE_TEXTURES} storage textures for a shader, found {found}; \
                cameras have no ambient occlusion"
            );
        }
        let found = limits.max_bind_groups;
        let pipelines = match found > behind::GROUP {
            true => Some(behind::Pipelines::new(app.world().resource::<AssetServer>())),
            false => {
                let expected = behind::GROUP + 1;
                warn!(
                    "aonet: expected a device with {expected} bind groups, found {found}; there is no second layer"
                );
                None
            }
        };
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        if let Some(pipelines) = pipelines {
            render.insert_resource(pipelines).add_systems(
                Render,
                behind::replace.after(RenderSystems::PrepareMeshes).before(RenderSystems::QueueMeshes),
            );
        }
        render
            .init_resource::<engine::Engines>()
            .init_resource::<passes::Passes>()
            .add_systems(ExtractSchedule, followers::extract)
            .add_systems(
                Render,
                (
                    (view::forget, view::prepare)
                        .chain()
                        .in_set(RenderSystems::PrepareBindGroups)
                        .before(prepare_mesh_view_bind_groups),
                    (view::silence, behind::silence)
                        .after(RenderSystems::PrepareBindGroups)
                        .before(RenderSystems::Render),
                    followers::jitter.in_set(RenderSystems::Queue),
                ),
            )
            .add_systems(Core3d, view::occlude.after(Core3dSystems::Prepass).before(Core3dSystems::MainPass));
    }
}

/// The README's program compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

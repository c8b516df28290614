//! What users set on a camera.

use crate::view::{AonetVisibility, Serves, ViewState};
use bevy::ecs::lifecycle::HookContext;
use bevy::ecs::world::DeferredWorld;
use bevy::pbr::ScreenSpaceAmbientOcclusion;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::extract_component::ExtractComponent;

/// Ambient occlusion by aonet for a 3D camera. It darkens indirect light; direct light stays.
///
/// It requires Bevy's [`ScreenSpaceAmbientOcclusion`], whose texture it replaces and whose settings have no effect. When it is
/// removed, both go. Prepasses of Bevy's ambient occlusion have one sample a pixel, so the camera is set to `Msaa::Off`.
#[derive(Component, Reflect, ExtractComponent, Debug, Clone, Copy, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(ScreenSpaceAmbientOcclusion)]
#[component(on_remove = remove_stock)]
#[extract_app(RenderApp)]
#[extract_component_sync_target((Self, ViewState, AonetVisibility, Serves))]
pub struct AonetAmbientOcclusion {
    /// What computes it.
    pub method: AonetMethod,
    /// How far away a surface may be to occlude (world units), > 0 and finite.
    pub radius: f32,
    /// Power of visibility: 0 is no occlusion, 1 is what rays would find, more is darker. At least 0 and finite.
    pub intensity: f32,
    /// Share of the picture's width and height that is seen beyond each of its edges, from 0 to 1, so that what lies outside of the
    /// picture occludes, too; 0.15 is a good one. Above 0, a second camera ([`AonetSurround`](crate::AonetSurround)) draws depth
    /// and normals of the larger picture.
    pub margin: f32,
    /// Whether surfaces behind the visible ones occlude, too. A second camera ([`AonetBehind`](crate::AonetBehind)) draws depth of the
    /// nearest ones that lie at least a tenth of the radius behind. [`AonetMethod::reads_second_layer`] tells which methods look at it;
    /// for the others, nothing more is drawn.
    pub second_layer: bool,
}

/// What computes ambient occlusion, in the order of its time.
#[derive(Reflect, Debug, Default, Clone, Copy, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum AonetMethod {
    /// Ground-truth AO with 3 slices and a filter, as XeGTAO. No network.
    Gtao,
    /// Adaptive GTAO: heights of horizons weighted by distance and connected surfaces. The best of the searches for its time.
    Agtao,
    /// The small network: more exact than any search at about the time of `Agtao`.
    Fast,
    /// The middle network.
    #[default]
    Balanced,
    /// The large network, for pictures rather than for games.
    High,
}

impl AonetMethod {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Gtao, Self::Agtao, Self::Fast, Self::Balanced, Self::High];

    /// Whether a second layer of depth changes what it finds.
    pub fn reads_second_layer(self) -> bool {
        match self {
            Self::Gtao | Self::Agtao | Self::Fast => false,
            Self::Balanced | Self::High => true,
        }
    }
}

impl Default for AonetAmbientOcclusion {
    /// The middle network, 1 world unit, as dark as it is, no margin, one layer.
    fn default() -> Self {
        Self { method: AonetMethod::default(), radius: 1.0, intensity: 1.0, margin: 0.0, second_layer: false }
    }
}

impl AonetAmbientOcclusion {
    /// Whether a second layer is asked for and looked at.
    pub(crate) fn draws_second_layer(&self) -> bool {
        self.second_layer && self.method.reads_second_layer()
    }
}

/// Bevy's component came as a requirement; left behind, its own search would begin to run.
fn remove_stock(mut world: DeferredWorld, context: HookContext) {
    world.commands().entity(context.entity).try_remove::<ScreenSpaceAmbientOcclusion>();
}

/// Sets cameras to `Msaa::Off`: those that get ambient occlusion, and those whose multisampling changes later.
pub fn refuse_multisampling(
    mut cameras: Query<
        &mut Msaa,
        (With<AonetAmbientOcclusion>, Or<(Changed<Msaa>, Added<AonetAmbientOcclusion>)>),
    >,
) {
    for mut msaa in &mut cameras {
        if *msaa != Msaa::Off {
            info_once!("aonet: a camera with ambient occlusion is set from {:?} to Msaa::Off", *msaa);
            *msaa = Msaa::Off;
        }
    }
}

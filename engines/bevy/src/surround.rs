//! The guard band: a camera that draws nothing but prepasses of a larger picture.

use crate::settings::AonetAmbientOcclusion;
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{CameraProjection, RenderTarget, SubCameraView};
use bevy::core_pipeline::prepass::{DepthPrepass, NormalPrepass};
use bevy::math::Vec3A;
use bevy::prelude::*;
use bevy::render::Extract;
use bevy::render::sync_world::RenderEntity;

/// Marks the camera that the plugin makes for a margin: a child of the camera that asked for it. It draws prepasses, no picture.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Eq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct AonetSurround {
    /// The camera that shows the picture.
    pub of: Entity,
}

/// The camera's child, on the camera.
#[derive(Component)]
pub struct Surround(Entity);

/// In the render world, on the surround: the camera that shows the picture.
#[derive(Component)]
pub struct Surrounds(pub Entity);

/// A projection that sees more of the same plane.
#[derive(Debug, Clone)]
struct Wide {
    projection: Projection,
    part: Option<SubCameraView>,
    /// The picture (logical px).
    size: Vec2,
    /// The picture's sides as shares of the buffer's.
    share: Vec2,
}

impl CameraProjection for Wide {
    fn get_clip_from_view(&self) -> Mat4 {
        let inner = match &self.part {
            Some(part) => self.projection.get_clip_from_view_for_sub(part),
            None => self.projection.get_clip_from_view(),
        };
        Mat4::from_scale(self.share.extend(1.0)) * inner
    }

    fn get_clip_from_view_for_sub(&self, _: &SubCameraView) -> Mat4 {
        self.get_clip_from_view()
    }

    /// The picture's size counts, not the buffer's.
    fn update(&mut self, _: f32, _: f32) {
        self.projection.update(self.size.x, self.size.y);
    }

    fn far(&self) -> f32 {
        self.projection.far()
    }

    fn get_frustum_corners(&self, near: f32, far: f32) -> [Vec3A; 8] {
        let wider = Vec3A::from((1.0 / self.share).extend(1.0));
        self.projection.get_frustum_corners(near, far).map(|corner| corner * wider)
    }
}

/// Size of a buffer with a margin (share of the picture on each side) around a picture (px).
fn buffer(picture: UVec2, margin: f32) -> UVec2 {
    picture + 2 * (picture.as_vec2() * margin).round().as_uvec2()
}

/// The largest margin: three times the picture's width and height.
pub const MOST: f32 = 1.0;

/// Whether a margin asks for a camera of its own.
fn is_margin(margin: f32) -> bool {
    margin > 0.0 && margin <= MOST
}

type Shown = (
    Entity,
    &'static AonetAmbientOcclusion,
    &'static Camera,
    &'static Projection,
    Option<&'static RenderLayers>,
    Option<&'static Surround>,
);

/// Makes, updates and removes the cameras of margins.
pub fn surround(mut commands: Commands, cameras: Query<Shown>) {
    for (entity, settings, camera, projection, layers, surround) in &cameras {
        let size = camera.physical_viewport_size().zip(camera.logical_viewport_size());
        let size = size.filter(|_| camera.is_active && is_margin(settings.margin));
        let Some((picture, logical)) = size.filter(|(picture, _)| picture.min_element() > 0) else {
            if let Some(Surround(child)) = surround {
                commands.entity(*child).try_despawn();
                commands.entity(entity).remove::<Surround>();
            }
            continue;
        };
        let size = buffer(picture, settings.margin);
        let wide = Wide {
            projection: projection.clone(),
            part: camera.sub_camera_view,
            size: logical,
            share: picture.as_vec2() / size.as_vec2(),
        };
        let lens =
            (RenderTarget::None { size }, Projection::custom(wide), layers.cloned().unwrap_or_default());
        // Before the camera that reads its prepass.
        let order = camera.order.saturating_sub(1);
        match surround {
            Some(Surround(child)) => {
                commands.entity(*child).try_insert(lens);
                commands.entity(*child).entry::<Camera>().and_modify(move |mut camera| camera.order = order);
            }
            None => {
                let prepasses =
                    (Camera3d::default(), Camera { order, ..default() }, DepthPrepass, NormalPrepass);
                let marks = (AonetSurround { of: entity }, ChildOf(entity), Msaa::Off);
                let child = commands.spawn((prepasses, lens, marks)).id();
                commands.entity(entity).insert(Surround(child));
            }
        }
    }
}

/// Removes the margin's camera of a camera without ambient occlusion.
pub fn forget(mut commands: Commands, cameras: Query<(Entity, &Surround), Without<AonetAmbientOcclusion>>) {
    for (entity, Surround(child)) in &cameras {
        commands.entity(*child).try_despawn();
        commands.entity(entity).remove::<Surround>();
    }
}

/// Tells the render world which camera a surround belongs to.
pub fn extract(
    mut commands: Commands,
    surrounds: Extract<Query<(RenderEntity, &AonetSurround)>>,
    cameras: Extract<Query<RenderEntity>>,
) {
    for (entity, AonetSurround { of }) in &surrounds {
        if let Ok(of) = cameras.get(*of) {
            commands.entity(entity).insert(Surrounds(of));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_projections_see_the_picture_in_their_middle() {
        let size = Vec2::new(160.0, 90.0);
        let share = Vec2::new(160.0 / 208.0, 90.0 / 118.0);
        for mut projection in [
            Projection::Perspective(PerspectiveProjection::default()),
            Projection::Orthographic(OrthographicProjection::default_3d()),
        ] {
            let part = SubCameraView {
                full_size: UVec2::new(320, 180),
                offset: Vec2::new(40.0, 30.0),
                size: UVec2::new(160, 90),
            };
            for part in [None, Some(part)] {
                let mut wide = Wide { projection: projection.clone(), part, size, share };
                wide.update(1.0, 1.0);
                projection.update(size.x, size.y);
                let narrow = match &part {
                    Some(part) => projection.get_clip_from_view_for_sub(part),
                    None => projection.get_clip_from_view(),
                };
                let corner = Vec3::new(1.0, -1.0, 0.5);
                let seen = narrow.inverse().project_point3(corner);
                let found = wide.get_clip_from_view().project_point3(seen);
                let expected = Vec3::new(share.x, -share.y, 0.5);
                assert!(found.distance(expected) < 1e-4, "{found} and {expected}");
            }
        }
        assert_eq!(buffer(UVec2::new(160, 90), 0.15), UVec2::new(208, 118));
    }
}

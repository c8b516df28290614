//! Child cameras with the pose of the camera that asked for them. They collect what it may show and draw no picture.

use crate::settings::AonetAmbientOcclusion;
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{CameraProjection, MainPassResolutionOverride, RenderTarget, SubCameraView};
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass, NormalPrepass};
use bevy::ecs::query::QueryData;
use bevy::math::Vec3A;
use bevy::prelude::*;
use bevy::render::Extract;
use bevy::render::camera::TemporalJitter;
use bevy::render::sync_world::RenderEntity;
use bevy::render::view::NoIndirectDrawing;

/// Marks the camera that the plugin makes for a margin: a child of the camera that asked for it. It draws depth and normals of the
/// larger picture.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Eq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct AonetSurround {
    /// The camera that shows the picture.
    pub of: Entity,
}

/// Marks the camera that the plugin makes for a second layer: a child of the camera that asked for it. It draws depth of what lies
/// behind the visible surfaces.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Eq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct AonetBehind {
    /// The camera that shows the picture.
    pub of: Entity,
}

/// A camera's children, on the camera.
#[derive(Component, Debug, Default, Clone, Copy, PartialEq)]
pub struct Followers {
    surround: Option<Entity>,
    behind: Option<Entity>,
}

/// In the render world, on the camera of a margin: the camera that shows the picture.
#[derive(Component)]
pub struct Surrounds(pub Entity);

/// In the render world, on the camera of a second layer: the camera that shows the picture.
#[derive(Component)]
pub struct Behind(pub Entity);

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

/// Added to the order of a camera, for that of its second layer: before all that draw.
const FIRST: isize = isize::MIN / 2;

/// Whether a margin asks for a camera of its own.
fn is_margin(margin: f32) -> bool {
    margin > 0.0 && margin <= MOST
}

/// What a camera sees, and how a follower sees it.
#[derive(Clone)]
struct Lens {
    target: RenderTarget,
    projection: Wide,
    layers: RenderLayers,
    is_deferred: bool,
}

#[derive(QueryData)]
pub struct Followed {
    entity: Entity,
    settings: &'static AonetAmbientOcclusion,
    camera: &'static Camera,
    projection: &'static Projection,
    layers: Option<&'static RenderLayers>,
    is_deferred: Has<DeferredPrepass>,
    followers: Option<&'static Followers>,
}

impl FollowedItem<'_, '_> {
    /// The lens with the margin. None: nothing is drawn.
    fn lens(&self) -> Option<Lens> {
        let picture = self.camera.physical_viewport_size().filter(|size| size.min_element() > 0)?;
        let margin = self.settings.margin;
        let size = if is_margin(margin) { buffer(picture, margin) } else { picture };
        let projection = Wide {
            projection: self.projection.clone(),
            part: self.camera.sub_camera_view,
            size: self.camera.logical_viewport_size()?,
            share: picture.as_vec2() / size.as_vec2(),
        };
        let layers = self.layers.cloned().unwrap_or_default();
        let lens =
            Lens { target: RenderTarget::None { size }, projection, layers, is_deferred: self.is_deferred };
        self.camera.is_active.then_some(lens)
    }
}

/// Makes, updates and removes the followers of cameras.
pub fn follow(mut commands: Commands, cameras: Query<Followed>) {
    for camera in &cameras {
        let (of, lens) = (camera.entity, camera.lens());
        let before = camera.followers.copied().unwrap_or_default();
        // The camera of a margin draws before the one that reads it. That of a second layer draws nothing in its turn.
        let order = camera.camera.order;
        let (of_margin_order, of_layer_order) = (order.saturating_sub(1), order.saturating_add(FIRST));
        let of_margin = lens.clone().filter(|_| is_margin(camera.settings.margin));
        let of_layer = lens.filter(|_| camera.settings.draws_second_layer());
        let surround = (AonetSurround { of }, NormalPrepass);
        // Bevy's indirect draws of a camera are empty after its turn.
        let behind = (AonetBehind { of }, NoIndirectDrawing);
        let followers = Followers {
            surround: update(&mut commands, of, before.surround, (of_margin, of_margin_order), surround),
            behind: update(&mut commands, of, before.behind, (of_layer, of_layer_order), behind),
        };
        if followers != before {
            commands.entity(of).insert(followers);
        }
    }
}

/// A follower with the lens, or none.
fn update(
    commands: &mut Commands,
    of: Entity,
    before: Option<Entity>,
    (lens, order): (Option<Lens>, isize),
    marks: impl Bundle,
) -> Option<Entity> {
    let Some(Lens { target, projection, layers, is_deferred }) = lens else {
        before.into_iter().for_each(|child| commands.entity(child).try_despawn());
        return None;
    };
    let mut child = match before {
        Some(child) => commands.entity(child),
        None => {
            let camera = (Camera3d::default(), DepthPrepass, Msaa::Off);
            commands.spawn((camera, marks, ChildOf(of)))
        }
    };
    child.try_insert((target, Projection::custom(projection), layers));
    child.entry::<Camera>().and_modify(move |mut camera| camera.order = order);
    // Bevy puts deferred materials into a prepass of their own, and every camera must have it.
    match is_deferred {
        true => child.try_insert(DeferredPrepass),
        false => child.try_remove::<DeferredPrepass>(),
    };
    Some(child.id())
}

/// Removes the followers of a camera without ambient occlusion.
pub fn forget(mut commands: Commands, cameras: Query<(Entity, &Followers), Without<AonetAmbientOcclusion>>) {
    for (entity, Followers { surround, behind }) in &cameras {
        [surround, behind].into_iter().flatten().for_each(|child| commands.entity(*child).try_despawn());
        commands.entity(entity).remove::<Followers>();
    }
}

/// Tells the render world which camera a follower belongs to.
pub fn extract(
    mut commands: Commands,
    surrounds: Extract<Query<(RenderEntity, &AonetSurround)>>,
    behinds: Extract<Query<(RenderEntity, &AonetBehind)>>,
    cameras: Extract<Query<RenderEntity>>,
) {
    for (entity, AonetSurround { of }) in &surrounds {
        if let Ok(of) = cameras.get(*of) {
            commands.entity(entity).insert(Surrounds(of));
        }
    }
    for (entity, AonetBehind { of }) in &behinds {
        if let Ok(of) = cameras.get(*of) {
            commands.entity(entity).insert(Behind(of));
        }
    }
}

/// Gives a camera's jitter to the one of its second layer. The first layer of a margin has none.
pub fn jitter(
    mut commands: Commands,
    behinds: Query<(Entity, &Behind)>,
    cameras: Query<(&AonetAmbientOcclusion, Option<&TemporalJitter>, Option<&MainPassResolutionOverride>)>,
) {
    for (entity, Behind(of)) in &behinds {
        let mut behind = commands.entity(entity);
        behind.remove::<(TemporalJitter, MainPassResolutionOverride)>();
        let Ok((settings, jitter, less)) = cameras.get(*of) else { continue };
        if let Some(jitter) = jitter.filter(|_| !is_margin(settings.margin)) {
            behind.insert(jitter.clone());
            less.into_iter().for_each(|less| _ = behind.insert(MainPassResolutionOverride(less.0)));
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

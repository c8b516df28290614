//! What a camera with ambient occlusion has in the render world, and the systems that fill it.

use crate::behind;
use crate::engine::{Engine, Engines, Key};
use crate::followers::{Behind, MOST, Surrounds};
use crate::frame::numbers;
use crate::passes::{DEPTH, NORMALS, Passes, Strengthen, encode_open};
use crate::settings::AonetAmbientOcclusion;
use aonet::gpu::{FrameViews, wgpu};
use bevy::camera::MainPassResolutionOverride;
use bevy::core_pipeline::prepass::ViewPrepassTextures;
use bevy::ecs::query::QueryData;
use bevy::pbr::{ScreenSpaceAmbientOcclusionResources, SsaoPipelineId};
use bevy::platform::collections::HashSet;
use bevy::prelude::*;
use bevy::render::camera::{ExtractedCamera, TemporalJitter};
use bevy::render::diagnostic::RecordDiagnostics;
use bevy::render::render_resource::{
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureViewDescriptor,
};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::texture::CachedTexture;
use bevy::render::view::{ExtractedView, RetainedViewEntity};
use std::sync::Arc;

/// Visibility of a camera, in the render world: 1 is open, 0 is closed; of the viewport's size, the intensity applied. It is
/// complete when `Core3dSystems::MainPass` begins, for effects of your own. Usages: `TEXTURE_BINDING` and `COPY_SRC`.
#[derive(Component, Clone)]
pub struct AonetVisibility(pub CachedTexture);

/// Session and textures of a camera that shows a picture.
#[derive(Component)]
pub struct ViewState {
    key: Key,
    /// Size of the picture (px).
    picture: UVec2,
    engine: Arc<Engine>,
    viewport: Option<Viewport>,
    stronger: Option<Stronger>,
    second: Option<CachedTexture>,
}

/// On the view whose prepass a session reads: the view that shows the picture, itself or another.
#[derive(Component)]
pub struct Serves(Entity);

/// Normals and depth of a viewport that is smaller than its target.
struct Viewport {
    normal: CachedTexture,
    depth: CachedTexture,
}

/// Visibility before it is raised to a power.
struct Stronger {
    found: CachedTexture,
    pass: Strengthen,
}

/// The part of the target that a camera draws (px).
struct Part {
    corner: UVec2,
    size: UVec2,
    is_all: bool,
}

impl Part {
    /// # Errors
    /// When the camera has no target yet.
    fn of(
        camera: &ExtractedCamera,
        prepass: &ViewPrepassTextures,
        less: Option<&MainPassResolutionOverride>,
    ) -> Option<Self> {
        let size = less.map(|less| less.0).or(camera.physical_viewport_size)?;
        let corner = camera.viewport.as_ref().map_or(UVec2::ZERO, |viewport| viewport.physical_position);
        let target = UVec2::new(prepass.size.width, prepass.size.height);
        // A viewport of a target that was resized a moment ago may reach beyond it.
        (size.min_element() > 0 && (corner + size).cmple(target).all()).then(|| Self {
            corner,
            size,
            is_all: size == target,
        })
    }
}

fn texture(
    device: &RenderDevice,
    label: &'static str,
    (size, format): (UVec2, TextureFormat),
    usage: TextureUsages,
) -> CachedTexture {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: usage | TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let default_view = texture.create_view(&TextureViewDescriptor::default());
    CachedTexture { texture, default_view }
}

impl ViewState {
    fn fits(&self, key: Key, picture: &Part, intensity: f32) -> bool {
        let viewport = key.size == picture.size && !picture.is_all;
        self.key == key
            && self.picture == picture.size
            && self.viewport.is_some() == viewport
            && self.stronger.is_none() == (intensity == 1.0)
    }

    fn new(
        device: &RenderDevice,
        passes: &Passes,
        (key, engine): (Key, Arc<Engine>),
        picture: &Part,
        intensity: f32,
    ) -> (Self, AonetVisibility) {
        let (size, format) = (picture.size, key.format);
        // Bevy binds it for writing to its own pass, which does not run.
        let usage = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        let none = TextureUsages::empty();
        let visibility = texture(device, "aonet visibility", (size, format), usage);
        let viewport = (key.size == size && !picture.is_all).then(|| Viewport {
            normal: texture(device, "aonet viewport normals", (size, NORMALS), none),
            depth: texture(device, "aonet viewport depth", (size, DEPTH), none),
        });
        let stronger = (intensity != 1.0).then(|| Stronger {
            found: texture(device, "aonet found", (size, format), none),
            pass: passes.strengthen(format),
        });
        let second =
            key.is_deep.then(|| texture(device, "aonet second layer", (key.size, behind::FORMAT), none));
        (Self { key, engine, picture: size, viewport, stronger, second }, AonetVisibility(visibility))
    }
}

/// Frees what cameras hold that do not render, and sessions that nothing holds.
pub fn forget(
    mut commands: Commands,
    idle: Query<Entity, (With<ViewState>, Without<ExtractedCamera>)>,
    mut engines: ResMut<Engines>,
) {
    for entity in &idle {
        commands.entity(entity).remove::<(ViewState, AonetVisibility, Serves)>();
    }
    engines.forget_unused();
}

#[derive(QueryData)]
#[query_data(mutable)]
pub struct Prepared {
    entity: Entity,
    settings: &'static AonetAmbientOcclusion,
    camera: &'static ExtractedCamera,
    prepass: &'static ViewPrepassTextures,
    less: Option<&'static MainPassResolutionOverride>,
    stock: &'static mut ScreenSpaceAmbientOcclusionResources,
    state: Option<(&'static ViewState, &'static AonetVisibility)>,
}

/// Makes sessions and textures, and gives the texture to Bevy's materials.
pub fn prepare(
    mut commands: Commands,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    passes: Res<Passes>,
    behind: Option<Res<behind::Pipelines>>,
    mut engines: ResMut<Engines>,
    mut views: Query<Prepared>,
    surrounds: Query<(Entity, &Surrounds, &ViewPrepassTextures)>,
) {
    for view in &mut views {
        let (mut stock, intensity) = (view.stock, view.settings.intensity);
        let format = stock.screen_space_ambient_occlusion_texture.texture.format();
        let made = Part::of(view.camera, view.prepass, view.less).and_then(|picture| {
            let mut wide = None;
            for (entity, _, prepass) in surrounds.iter().filter(|(_, of, _)| of.0 == view.entity) {
                let size = UVec2::new(prepass.size.width, prepass.size.height);
                match contains(size, picture.size) {
                    true => wide = Some((entity, size)),
                    false => _ = commands.entity(entity).remove::<Serves>(),
                }
            }
            let (source, size) = wide.unwrap_or((view.entity, picture.size));
            let is_deep = behind.is_some() && view.settings.draws_second_layer();
            let key = Key { method: view.settings.method, size, format, is_deep };
            if let Some((state, visibility)) = view.state
                && state.fits(key, &picture, intensity)
            {
                return Some((source, None, visibility.clone()));
            }
            let engine = engines.get((device.wgpu_device(), &queue), key)?;
            let (state, visibility) = ViewState::new(&device, &passes, (key, engine), &picture, intensity);
            Some((source, Some(state), visibility))
        });
        match made {
            None => {
                commands.entity(view.entity).remove::<(ViewState, AonetVisibility, Serves)>();
            }
            Some((source, state, visibility)) => {
                if source != view.entity {
                    commands.entity(view.entity).remove::<Serves>();
                }
                stock.screen_space_ambient_occlusion_texture = visibility.0.clone();
                if let Some(state) = state {
                    commands.entity(view.entity).insert((state, visibility));
                }
                commands.entity(source).insert(Serves(view.entity));
            }
        }
    }
}

/// Whether a picture fits into the middle of a buffer (px): not so for a moment after the picture was resized.
fn contains(buffer: UVec2, picture: UVec2) -> bool {
    buffer.cmpge(picture).all() && (buffer - picture) % 2 == UVec2::ZERO
}

/// Keeps Bevy's own search from running on cameras that have ours.
pub fn silence(mut commands: Commands, views: Query<Entity, (With<ViewState>, With<SsaoPipelineId>)>) {
    for entity in &views {
        commands.entity(entity).remove::<SsaoPipelineId>();
    }
}

/// A view whose prepass a session reads.
#[derive(QueryData)]
pub struct Source {
    serves: &'static Serves,
    view: &'static ExtractedView,
    camera: &'static ExtractedCamera,
    prepass: &'static ViewPrepassTextures,
    less: Option<&'static MainPassResolutionOverride>,
    jitter: Option<&'static TemporalJitter>,
}

/// A view that shows a picture.
#[derive(QueryData)]
pub struct Shown {
    state: &'static ViewState,
    visibility: &'static AonetVisibility,
    settings: &'static AonetAmbientOcclusion,
}

/// Errors that are reported: each once.
const REPORTED: usize = 16;

/// Encodes the passes of a camera after the prepass that they read.
pub fn occlude(
    world: &World,
    source: ViewQuery<Source>,
    shown: Query<Shown>,
    behinds: Query<(Entity, &ExtractedView, &Behind)>,
    passes: Res<Passes>,
    mut ctx: RenderContext,
    mut reported: Local<HashSet<String>>,
) {
    let source = source.into_inner();
    let Ok(shown) = shown.get(source.serves.0) else { return };
    let behind = behinds.iter().find(|(_, _, of)| of.0 == source.serves.0);
    let behind = behind.map(|(entity, view, _)| (entity, view.retained_view_entity));
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let span = recorder.time_span(ctx.command_encoder(), "aonet");
    let encoded = encode(&source, &shown, (world, behind), &passes, &mut ctx);
    span.end(ctx.command_encoder());
    if let Err(error) = encoded {
        let text = error.to_string();
        if reported.len() < REPORTED && !reported.contains(&text) {
            error!("aonet: {text}; the camera has no ambient occlusion");
            reported.insert(text);
        }
        encode_open(ctx.command_encoder(), &shown.visibility.0.default_view);
    }
}

fn encode(
    source: &SourceItem<'_, '_>,
    shown: &ShownItem<'_, '_>,
    (world, behind): (&World, Option<(Entity, RetainedViewEntity)>),
    passes: &Passes,
    ctx: &mut RenderContext,
) -> aonet::Result<()> {
    let missing = |what: &str| aonet::Error::value(what, "one that the prepass wrote", "none");
    let normal = source.prepass.normal_view().ok_or_else(|| missing("normal texture"))?;
    let depth = source.prepass.depth_only_view().ok_or_else(|| missing("depth texture"))?;
    let part = Part::of(source.camera, source.prepass, source.less).ok_or_else(|| missing("viewport"))?;
    let AonetAmbientOcclusion { radius, intensity, margin, .. } = *shown.settings;
    if !(intensity >= 0.0 && intensity.is_finite()) {
        return Err(aonet::Error::value("intensity", "a finite number >= 0", intensity));
    }
    if !(0.0..=MOST).contains(&margin) {
        return Err(aonet::Error::value("margin", "a share of the picture from 0 to 1", margin));
    }
    let mut clip_from_view = source.view.clip_from_view;
    if let Some(jitter) = source.jitter {
        jitter.jitter_projection(&mut clip_from_view, part.size.as_vec2());
    }
    let world_from_view = source.view.world_from_view.affine();
    let frame = numbers(clip_from_view, world_from_view, part.size, radius)?;

    let ViewState { engine, viewport, stronger, second, .. } = shown.state;
    let (mut normal, mut depth): (&wgpu::TextureView, &wgpu::TextureView) = (normal, depth);
    if let Some(viewport) = viewport {
        let own = [&*viewport.normal.default_view, &*viewport.depth.default_view];
        passes.encode_crop(ctx.command_encoder(), part.corner, [normal, depth], own);
        [normal, depth] = own;
    }
    let second = second.as_ref().map(|second| &second.default_view);
    if let Some(second) = second {
        let first = behind::First { depth, clip_from_view, radius };
        behind::encode(ctx, world, behind, &first, second)?;
    }
    let picture = &shown.visibility.0.default_view;
    let visibility = stronger.as_ref().map_or(picture, |stronger| &stronger.found.default_view);
    let views = FrameViews { normal, depth, second: second.map(|second| &**second), visibility };
    engine.encode(ctx.command_encoder(), views, &frame)?;
    if let Some(Stronger { found, pass }) = stronger {
        passes.encode_strengthen(ctx.command_encoder(), pass, intensity, &found.default_view, picture);
    }
    Ok(())
}

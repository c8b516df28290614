//! The second layer: depth of the nearest surfaces that lie far enough behind the visible ones.
//!
//! Bevy collects, sorts and batches what a child camera with a prepass may show. Here its pipelines get another fragment stage, and
//! its prepass is drawn once the first layer is complete.

use crate::followers::Behind;
use crate::passes::numbers_buffer;
use aonet::gpu::wgpu;
use bevy::asset::{AssetServer, load_embedded_asset};
use bevy::core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT;
use bevy::core_pipeline::deferred::{AlphaMask3dDeferred, Opaque3dDeferred};
use bevy::core_pipeline::prepass::{AlphaMask3dPrepass, Opaque3dPrepass};
use bevy::pbr::{SpecializedPrepassMaterialPipelineCache, ViewLightEntities};
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::render::diagnostic::RecordDiagnostics;
use bevy::render::render_phase::{BinnedPhaseItem, DrawError, TrackedRenderPass, ViewBinnedRenderPhases};
use bevy::render::render_resource::binding_types::{texture_2d, uniform_buffer_sized};
use bevy::render::render_resource::{
    BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
    FragmentState, LoadOp, Operations, PipelineCache, RenderPassDepthStencilAttachment, RenderPassDescriptor,
    RenderPipelineDescriptor, ShaderStages, StoreOp, TextureFormat, TextureSampleType,
};
use bevy::render::renderer::{RenderContext, RenderDevice};
use bevy::render::view::{ExtractedView, RetainedViewEntity, ViewDepthStencilTexture};
use bevy::shader::{Shader, ShaderRef};
use std::num::NonZero;

/// Least distance between the layers, as a share of the radius: the best for exact rays, as in `aonet_scene::view`.
const SEPARATION: f32 = 0.1;
/// Format of the second layer.
pub const FORMAT: TextureFormat = CORE_3D_DEPTH_FORMAT;
/// Bind group of the first layer. Bevy's prepasses have those before it.
pub const GROUP: u32 = 4;

/// Bytes of `Numbers` in the shader.
const BYTES: u64 = 24;

/// Bevy's pipelines with another fragment stage.
#[derive(Resource)]
pub struct Pipelines {
    shader: Handle<Shader>,
    /// Fragment stages of standard materials, in the prepass and in the deferred one.
    standard: [Handle<Shader>; 2],
    layout: BindGroupLayoutDescriptor,
    ours_of_bevys: HashMap<CachedRenderPipelineId, CachedRenderPipelineId>,
    ours: HashSet<CachedRenderPipelineId>,
}

impl Pipelines {
    pub fn new(assets: &AssetServer) -> Self {
        let shader_of = |shader| match shader {
            ShaderRef::Default => Handle::default(),
            ShaderRef::Handle(handle) => handle,
            ShaderRef::Path(path) => assets.load(path),
        };
        let sample_type = TextureSampleType::Float { filterable: false };
        let entries = (uniform_buffer_sized(false, NonZero::new(BYTES)), texture_2d(sample_type));
        let entries = BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries);
        Self {
            shader: load_embedded_asset!(assets, "behind.wesl"),
            standard: [
                StandardMaterial::prepass_fragment_shader(),
                StandardMaterial::deferred_fragment_shader(),
            ]
            .map(shader_of),
            layout: BindGroupLayoutDescriptor::new("aonet first layer", &entries),
            ours_of_bevys: HashMap::default(),
            ours: HashSet::default(),
        }
    }

    fn descriptor(&self, bevys: &RenderPipelineDescriptor) -> RenderPipelineDescriptor {
        let mut ours = bevys.clone();
        let mut shader_defs = ours.vertex.shader_defs.clone();
        if let Some(fragment) = ours.fragment.take().filter(|found| self.standard.contains(&found.shader)) {
            shader_defs = fragment.shader_defs;
            if shader_defs.contains(&"MAY_DISCARD".into()) {
                shader_defs.push("ALPHA_MASK".into());
            }
        }
        ours.label = Some("aonet second layer".into());
        ours.layout.push(self.layout.clone());
        // Surfaces behind the first layer may look away.
        ours.primitive.cull_mode = None;
        ours.fragment = Some(FragmentState { shader: self.shader.clone(), shader_defs, ..default() });
        ours
    }
}

/// Replaces Bevy's pipelines for cameras of second layers.
pub fn replace(
    views: Query<&ExtractedView, With<Behind>>,
    mut specialized: ResMut<SpecializedPrepassMaterialPipelineCache>,
    mut cache: ResMut<PipelineCache>,
    mut pipelines: ResMut<Pipelines>,
) {
    let pipelines = &mut *pipelines;
    for view in &views {
        let Some(meshes) = specialized.get_mut(&view.retained_view_entity) else { continue };
        if meshes.values().all(|(_, pipeline, _)| pipelines.ours.contains(pipeline)) {
            continue;
        }
        // Pipelines have no descriptor before.
        cache.process_queue();
        for (_, pipeline, _) in meshes.values_mut().filter(|(_, found, _)| !pipelines.ours.contains(found)) {
            let ours = match pipelines.ours_of_bevys.get(pipeline) {
                Some(ours) => *ours,
                None => {
                    let descriptor = pipelines.descriptor(cache.get_render_pipeline_descriptor(*pipeline));
                    cache.queue_render_pipeline(descriptor)
                }
            };
            pipelines.ours_of_bevys.insert(*pipeline, ours);
            *pipeline = ours;
        }
        pipelines.ours.extend(meshes.values().map(|(_, pipeline, _)| *pipeline));
    }
}

/// Keeps Bevy from drawing on cameras of second layers: its prepasses have no first layer, and nobody sees shadows.
pub fn silence(mut commands: Commands, views: Query<Entity, With<Behind>>) {
    for entity in &views {
        commands.entity(entity).remove::<(ViewDepthStencilTexture, ViewLightEntities)>();
    }
}

/// What a second layer is compared with.
pub struct First<'a> {
    pub depth: &'a wgpu::TextureView,
    pub clip_from_view: Mat4,
    pub radius: f32,
}

/// Encodes a second layer of what a view may show. Without a view it is empty.
///
/// # Errors
/// When Bevy cannot draw the view.
pub fn encode(
    ctx: &mut RenderContext,
    world: &World,
    view: Option<(Entity, RetainedViewEntity)>,
    first: &First<'_>,
    to: &bevy::render::render_resource::TextureView,
) -> aonet::Result<()> {
    let First { depth, clip_from_view, radius } = first;
    let (z, w) = (clip_from_view.row(2), clip_from_view.row(3));
    let numbers = [-z.z, z.w, -w.z, w.w, SEPARATION * radius, 0.0].map(f32::to_bits);
    let device = world.resource::<RenderDevice>();
    let layout = &world.resource::<Pipelines>().layout;
    let group = device.create_bind_group(
        "aonet first layer",
        &world.resource::<PipelineCache>().get_bind_group_layout(layout),
        &BindGroupEntries::sequential((
            numbers_buffer(device.wgpu_device(), &numbers).as_entire_binding(),
            wgpu::BindingResource::TextureView(depth),
        )),
    );
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("aonet second layer"),
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: to,
            depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
            stencil_ops: None,
        }),
        ..default()
    });
    let span = recorder.pass_span(&mut pass, "second_layer");
    pass.set_bind_group(GROUP as usize, &group, &[]);
    let drawn = view.map_or(Ok(()), |view| {
        draw::<Opaque3dPrepass>(&mut pass, world, view)?;
        draw::<AlphaMask3dPrepass>(&mut pass, world, view)?;
        draw::<Opaque3dDeferred>(&mut pass, world, view)?;
        draw::<AlphaMask3dDeferred>(&mut pass, world, view)
    });
    span.end(&mut pass);
    drawn.map_err(|error| aonet::Error::value("second layer", "one that Bevy draws", error))
}

fn draw<'w, P: BinnedPhaseItem>(
    pass: &mut TrackedRenderPass<'w>,
    world: &'w World,
    (entity, view): (Entity, RetainedViewEntity),
) -> Result<(), DrawError> {
    let phase = world.resource::<ViewBinnedRenderPhases<P>>().get(&view);
    phase.map_or(Ok(()), |phase| phase.render(pass, world, entity))
}

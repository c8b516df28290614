//! Bevy without a window, and a look at the textures of its cameras.
#![allow(dead_code, reason = "every test uses a part of it")]

pub mod boxes;

use aonet::gpu::wgpu;
use aonet::{AoImage, AoParams, Camera as Lens, GBuffer, Size};
use bevy::app::PluginsState;
use bevy::camera::RenderTarget;
use bevy::pbr::SsaoPipelineId;
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::sync_world::MainEntity;
use bevy::render::texture::GpuImage;
use bevy::render::{Render, RenderApp, RenderPlugin, RenderSystems};
use bevy::window::{ExitCondition, WindowPlugin};
use bevy_aonet::{AonetMethod, AonetPlugin, AonetVisibility};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// What the last frame left behind.
#[derive(Default)]
pub struct Seen {
    /// Visibility of cameras: size and values.
    pub visibility: HashMap<Entity, (UVec2, Vec<f32>)>,
    /// Cameras on which Bevy's own search runs.
    pub stock: Vec<Entity>,
    /// First channel of the pictures of image targets, 0 to 255.
    pub pictures: HashMap<AssetId<Image>, Vec<u8>>,
}

#[derive(Resource, Clone, Default)]
struct Probe(Arc<Mutex<Seen>>);

/// Bevy with the plugin, the boxes and white ambient light.
pub struct Running {
    pub app: App,
    probe: Probe,
}

impl Running {
    pub fn new() -> Self {
        Self::with(|_| ())
    }

    /// The same with more plugins.
    pub fn with(more: impl FnOnce(&mut App)) -> Self {
        let probe = Probe::default();
        let mut app = App::new();
        let windows =
            WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
        let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
        app.add_plugins((
            DefaultPlugins
                .set(windows)
                .set(render)
                .disable::<PipelinedRenderingPlugin>()
                .disable::<bevy::winit::WinitPlugin>(),
            AonetPlugin,
        ))
        .insert_resource(GlobalAmbientLight { brightness: 1000.0, ..default() })
        .insert_resource(ClearColor(Color::WHITE));
        more(&mut app);
        app.sub_app_mut(RenderApp)
            .insert_resource(probe.clone())
            .add_systems(Render, look.after(RenderSystems::Render).before(RenderSystems::Cleanup));
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let mut running = Self { app, probe };
        let material = StandardMaterial {
            base_color: Color::srgb(0.8, 0.8, 0.8),
            perceptual_roughness: 1.0,
            reflectance: 0.0,
            ..default()
        };
        for extents in boxes::BOXES {
            running.add_box(extents, material.clone());
        }
        running
    }

    /// An image to draw on.
    pub fn target(&mut self, size: UVec2) -> Handle<Image> {
        let mut image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        self.app.world_mut().resource_mut::<Assets<Image>>().add(image)
    }

    /// A camera that draws on a target.
    pub fn camera(&mut self, target: &Handle<Image>, bundle: impl Bundle) -> Entity {
        let target = RenderTarget::Image(target.clone().into());
        self.app.world_mut().spawn((Camera3d::default(), target, bundle)).id()
    }

    /// A box more: centre and half of the sides (world units).
    pub fn add_box(&mut self, (centre, half): boxes::Extents, material: StandardMaterial) -> Entity {
        let world = self.app.world_mut();
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid { half_size: Vec3::from(half) });
        let at = Transform::from_translation(Vec3::from(centre));
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), at)).id()
    }

    /// Draws some frames and returns what the last one left.
    pub fn frames(&mut self, count: usize) -> std::sync::MutexGuard<'_, Seen> {
        for _ in 0..count {
            self.app.update();
        }
        self.probe.0.lock().unwrap()
    }
}

fn look(
    probe: Res<Probe>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    cameras: Query<(&MainEntity, Option<&AonetVisibility>, Has<SsaoPipelineId>), With<ExtractedCamera>>,
    images: Res<RenderAssets<GpuImage>>,
) {
    let mut seen = probe.0.lock().unwrap();
    *seen = Seen::default();
    for (entity, visibility, is_stock) in &cameras {
        if is_stock {
            seen.stock.push(entity.id());
        }
        let Some(AonetVisibility(texture)) = visibility else { continue };
        let half = matches!(texture.texture.format(), TextureFormat::R16Float);
        let bytes = read(&device, &queue, &texture.texture, if half { 2 } else { 4 });
        let values = match half {
            true => bytes.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32()).collect(),
            false => bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
        };
        let size = UVec2::new(texture.texture.width(), texture.texture.height());
        seen.visibility.insert(entity.id(), (size, values));
    }
    for (id, image) in images.iter() {
        if image.texture.usage().contains(TextureUsages::COPY_SRC | TextureUsages::RENDER_ATTACHMENT) {
            let bytes = read(&device, &queue, &image.texture, 4);
            seen.pictures.insert(id, bytes.chunks_exact(4).map(|b| b[0]).collect());
        }
    }
}

/// The texels of a texture, row by row.
fn read(device: &RenderDevice, queue: &RenderQueue, texture: &wgpu::Texture, texel: u32) -> Vec<u8> {
    let (width, height) = (texture.width() * texel, texture.height());
    let pitch = width.next_multiple_of(256);
    let buffer = device.wgpu_device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(pitch * height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let mapped = buffer.get_mapped_range(..).unwrap();
    mapped.chunks_exact(pitch as usize).flat_map(|row| &row[..width as usize]).copied().collect()
}

pub const EYE: [f32; 3] = [1.6, 2.2, 3.4];
pub const TARGET: [f32; 3] = [0.0, 0.5, -1.0];
pub const FOV_Y: f32 = 0.9;

/// Where Bevy's camera stands.
pub fn pose() -> Transform {
    Transform::from_translation(EYE.into()).looking_at(TARGET.into(), Vec3::Y)
}

/// What it sees.
pub fn projection() -> Projection {
    Projection::Perspective(PerspectiveProjection { fov: FOV_Y, ..default() })
}

/// The same camera for the crate.
pub fn lens(size: UVec2) -> Lens {
    let size = Size::new(size.x as usize, size.y as usize).unwrap();
    Lens::perspective(FOV_Y, size).unwrap().looking_at(EYE, TARGET, [0.0, 1.0, 0.0]).unwrap()
}

/// What a method finds on the CPU in the exact frame of a camera.
pub fn expected(method: AonetMethod, lens: Lens, radius: f32) -> Vec<f32> {
    expected_in(method, &boxes::frame(lens), radius)
}

/// What a method finds on the CPU.
pub fn expected_in(method: AonetMethod, gbuffer: &GBuffer, radius: f32) -> Vec<f32> {
    use aonet::net::{Model, cpu::Session, shipped};
    use aonet::search::Classic;
    let params = AoParams::new(radius).unwrap();
    let network = |bytes| {
        let mut image = AoImage::open(gbuffer.window().size());
        let mut session = Session::new(&Model::from_bytes(bytes).unwrap(), gbuffer.window(), 1).unwrap();
        session.run(gbuffer, params, &mut image).unwrap();
        image
    };
    let image = match method {
        AonetMethod::Gtao => Classic::named("gtao:tuned").unwrap().run(gbuffer, params).unwrap(),
        AonetMethod::Agtao => Classic::named("agtao:tuned").unwrap().run(gbuffer, params).unwrap(),
        AonetMethod::Fast => network(shipped::FAST),
        AonetMethod::Balanced => network(shipped::BALANCED),
        AonetMethod::High => network(shipped::HIGH),
    };
    image.visibility().to_vec()
}

/// Mean difference and the share of pixels that differ by more than 0.03.
pub fn difference(found: &[f32], expected: &[f32]) -> (f32, f32) {
    assert_eq!(found.len(), expected.len());
    let differences: Vec<_> = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).collect();
    let count = found.len() as f32;
    let far = differences.iter().filter(|d| **d >= 0.03 || d.is_nan()).count() as f32;
    (differences.iter().sum::<f32>() / count, far / count)
}

/// Fails where visibility is not what the CPU finds. Bevy's rasteriser decides otherwise on single pixels of edges, whose neighbours
/// a network changes as well.
#[track_caller]
pub fn assert_agrees(what: &str, found: &[f32], expected: &[f32]) {
    let (mean, far) = difference(found, expected);
    println!("{what}: mean difference {mean:.5}, {:.2} % of the pixels by more than 0.03", 100.0 * far);
    assert!(
        mean < 2e-3 && far < 0.01,
        "{what}: mean difference {mean}, {far} of the pixels by more than 0.03"
    );
    let mean = expected.iter().sum::<f32>() / expected.len() as f32;
    assert!(mean < 0.95, "{what}: the frame has too little occlusion to compare, mean {mean}");
}

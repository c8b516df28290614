//! One scene three times: without ambient occlusion, with Bevy's own, with aonet.
//!
//! Keys 1 to 5 choose the method, up and down the radius, left and right the intensity; M adds a margin, L a second layer; space
//! stops the turning.
//! `--screenshot FILE.png` draws one picture without a window.

use bevy::app::ScheduleRunnerPlugin;
use bevy::camera::{RenderTarget, Viewport};
use bevy::pbr::ScreenSpaceAmbientOcclusion;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::window::{ExitCondition, PrimaryWindow};
use bevy_aonet::{AonetAmbientOcclusion, AonetMethod, AonetPlugin};
use std::time::Duration;

/// Size of the picture (px).
const SIZE: UVec2 = UVec2::new(1440, 480);
const RADIUS: f32 = 1.0;
/// Where a picture without a window goes, and what it is drawn on.
#[derive(Resource)]
struct Headless {
    path: String,
    target: Handle<Image>,
}

/// The third of the picture that a camera draws, from the left.
#[derive(Component)]
struct Third(u32);

/// Angle of the cameras around the scene (rad).
#[derive(Resource)]
struct Turn {
    angle: f32,
    is_turning: bool,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = match (arguments.next().as_deref(), arguments.next()) {
        (None, _) => None,
        (Some("--screenshot"), Some(path)) => Some(path),
        _ => {
            eprintln!("usage: compare [--screenshot FILE.png]");
            std::process::exit(2);
        }
    };
    let mut app = App::new();
    let window = path.is_none().then(|| Window {
        title: "none, Bevy, aonet".into(),
        resolution: (SIZE.x, SIZE.y).into(),
        ..default()
    });
    let exit_condition = if path.is_none() { ExitCondition::OnAllClosed } else { ExitCondition::DontExit };
    let plugins = DefaultPlugins
        .set(WindowPlugin { primary_window: window, exit_condition, ..default() })
        .set(RenderPlugin { synchronous_pipeline_compilation: path.is_some(), ..default() });
    match path {
        None => {
            app.add_plugins(plugins).add_systems(Update, (keys, turn, place).chain());
        }
        Some(path) => {
            app.add_plugins(plugins.disable::<bevy::winit::WinitPlugin>())
                .add_plugins(ScheduleRunnerPlugin::run_loop(Duration::ZERO))
                .add_systems(Update, (place, shoot));
            let mut image = Image::new_target_texture(SIZE.x, SIZE.y, TextureFormat::Rgba8UnormSrgb, None);
            image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
            let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
            app.insert_resource(Headless { path, target });
        }
    }
    app.add_plugins(AonetPlugin)
        .insert_resource(ClearColor(Color::srgb(0.75, 0.82, 0.9)))
        .insert_resource(GlobalAmbientLight { brightness: 1000.0, ..default() })
        .insert_resource(Turn { angle: 0.45, is_turning: true })
        .add_systems(Startup, (start, room))
        .run();
}

fn start(mut commands: Commands, turn: Res<Turn>, headless: Option<Res<Headless>>) {
    for third in 0..3 {
        let mut camera = commands.spawn((
            Camera3d::default(),
            Camera {
                order: third as isize,
                clear_color: if third == 0 { default() } else { ClearColorConfig::None },
                ..default()
            },
            Msaa::Off,
            pose(turn.angle),
            Third(third),
        ));
        match third {
            1 => {
                camera.insert(ScreenSpaceAmbientOcclusion { radius: RADIUS, ..default() });
            }
            2 => {
                camera.insert(AonetAmbientOcclusion { radius: RADIUS, ..default() });
            }
            _ => {}
        }
        if let Some(headless) = &headless {
            camera.insert(RenderTarget::Image(headless.target.clone().into()));
        }
    }
    commands.spawn((
        DirectionalLight { illuminance: 1300.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(2.0, 6.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}

fn pose(angle: f32) -> Transform {
    Transform::from_xyz(5.4 * angle.sin(), 2.3, 5.4 * angle.cos())
        .looking_at(Vec3::new(0.0, 0.75, 0.0), Vec3::Y)
}

/// A corner with stairs, columns, a shelf with balls, rings.
fn room(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mut paint = |r, g, b| {
        let base_color = Color::srgb(r, g, b);
        materials.add(StandardMaterial {
            base_color,
            perceptual_roughness: 0.9,
            reflectance: 0.2,
            ..default()
        })
    };
    let (chalk, clay, sea) = (paint(0.86, 0.84, 0.8), paint(0.8, 0.55, 0.42), paint(0.45, 0.62, 0.66));
    let mut put = |mesh: Mesh, material: &Handle<StandardMaterial>, at: Transform| {
        commands.spawn((Mesh3d(meshes.add(mesh)), MeshMaterial3d(material.clone()), at));
    };
    let cuboid = |x, y, z| Cuboid::new(x, y, z).mesh().build();
    let at = Transform::from_xyz;
    put(cuboid(9.0, 0.2, 9.0), &chalk, at(0.0, -0.1, 0.0));
    put(cuboid(9.0, 4.0, 0.2), &chalk, at(0.0, 2.0, -2.4));
    put(cuboid(0.2, 4.0, 9.0), &chalk, at(-3.2, 2.0, 0.0));
    for i in 0..6 {
        let height = 0.22 * (i + 1) as f32;
        put(cuboid(0.34, height, 1.5), &chalk, at(2.9 - 0.34 * (5 - i) as f32, height / 2.0, -1.5));
    }
    for x in [-2.6, -1.7] {
        put(Cylinder::new(0.22, 3.0).mesh().resolution(48).build(), &clay, at(x, 1.5, -1.8));
        put(cuboid(0.62, 0.16, 0.62), &clay, at(x, 0.08, -1.8));
    }
    for (i, y) in [0.0, 0.55, 1.1].into_iter().enumerate() {
        put(cuboid(1.5, 0.06, 0.5), &sea, at(-0.35, y + 0.5, -2.05));
        for j in 0..4 {
            let ball = Sphere::new(0.11 + 0.03 * ((i + j) % 3) as f32).mesh().uv(32, 20);
            put(
                ball,
                if (i + j) % 2 == 0 { &clay } else { &chalk },
                at(-0.9 + 0.36 * j as f32, y + 0.66, -2.05),
            );
        }
    }
    for x in [-1.1, 0.4] {
        put(cuboid(0.06, 1.7, 0.5), &sea, at(x, 0.85, -2.05));
    }
    for i in 0..5 {
        let leaning = at(-0.9 + 0.42 * i as f32, 0.3, 0.3 + 0.1 * (i % 2) as f32);
        let ring = Torus::new(0.16, 0.3).mesh().build();
        put(ring, &clay, leaning.with_rotation(Quat::from_rotation_x(1.2 + 0.1 * i as f32)));
    }
    put(Sphere::new(0.5).mesh().uv(64, 40), &chalk, at(1.3, 0.5, -0.7));
    put(cuboid(0.9, 0.9, 0.9), &sea, at(-2.0, 0.45, 0.5).with_rotation(Quat::from_rotation_y(0.5)));
}

/// Every camera draws a third of the window or image.
fn place(mut cameras: Query<(&mut Camera, &Third)>, window: Query<&Window, With<PrimaryWindow>>) {
    let size = window.single().map_or(SIZE, Window::physical_size);
    let third = UVec2::new(size.x / 3, size.y);
    if third.min_element() == 0 {
        return;
    }
    for (mut camera, Third(i)) in &mut cameras {
        let physical_position = UVec2::new(i * third.x, 0);
        camera.viewport = Some(Viewport { physical_position, physical_size: third, ..default() });
    }
}

fn turn(time: Res<Time>, mut turn: ResMut<Turn>, mut cameras: Query<&mut Transform, With<Third>>) {
    if turn.is_turning {
        turn.angle += 0.1 * time.delta_secs();
    }
    for mut transform in &mut cameras {
        *transform = pose(0.45 + 0.5 * (turn.angle - 0.45).sin());
    }
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut turn: ResMut<Turn>,
    mut aonet: Single<&mut AonetAmbientOcclusion>,
    mut stock: Query<&mut ScreenSpaceAmbientOcclusion, Without<AonetAmbientOcclusion>>,
) {
    turn.is_turning ^= keys.just_pressed(KeyCode::Space);
    let digits = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4, KeyCode::Digit5];
    for (method, key) in AonetMethod::ALL.into_iter().zip(digits) {
        if keys.just_pressed(key) {
            aonet.method = method;
            info!("method: {method:?}");
        }
    }
    if keys.just_pressed(KeyCode::KeyM) {
        aonet.margin = 0.15 - aonet.margin;
        info!("margin: {:.2}", aonet.margin);
    }
    if keys.just_pressed(KeyCode::KeyL) {
        aonet.second_layer = !aonet.second_layer;
        info!("second layer: {}", aonet.second_layer);
    }
    for (key, factor) in [(KeyCode::ArrowUp, 1.25), (KeyCode::ArrowDown, 0.8)] {
        if keys.just_pressed(key) {
            aonet.radius *= factor;
            stock.iter_mut().for_each(|mut stock| stock.radius = aonet.radius);
            info!("radius: {:.2}", aonet.radius);
        }
    }
    for (key, change) in [(KeyCode::ArrowRight, 0.1), (KeyCode::ArrowLeft, -0.1)] {
        if keys.just_pressed(key) {
            aonet.intensity = (aonet.intensity + change).max(0.0);
            info!("intensity: {:.1}", aonet.intensity);
        }
    }
}

/// Draws until pipelines and textures are ready, then saves the picture.
fn shoot(mut commands: Commands, headless: Res<Headless>, mut frame: Local<u32>) {
    *frame += 1;
    if *frame == 8 {
        commands
            .spawn(Screenshot::image(headless.target.clone()))
            .observe(save_to_disk(headless.path.clone()))
            .observe(|_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
                exit.write(AppExit::Success);
            });
    }
}

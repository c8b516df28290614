//! Visibility in Bevy against the CPU's, on a frame whose depth and normals rays know exactly.

mod common;

use bevy::camera::{ScalingMode, SubCameraView, Viewport};
use bevy::core_pipeline::prepass::DeferredPrepass;
use bevy::material::OpaqueRendererMethod;
use bevy::prelude::*;
use bevy::render::camera::TemporalJitter;
use bevy_aonet::{AonetAmbientOcclusion, AonetBehind, AonetMethod, AonetSurround};
use common::*;

const SIZE: UVec2 = UVec2::new(160, 90);
/// A method that reads the second layer.
const DEEP: AonetMethod = AonetMethod::Balanced;

fn ao(method: AonetMethod) -> AonetAmbientOcclusion {
    AonetAmbientOcclusion { method, radius: 1.0, ..default() }
}

/// What an orthographic camera sees.
fn parallel() -> Projection {
    Projection::Orthographic(OrthographicProjection {
        scaling_mode: ScalingMode::FixedVertical { viewport_height: 5.0 },
        near: 0.0,
        far: 30.0,
        ..OrthographicProjection::default_3d()
    })
}

/// The same camera for the crate.
fn parallel_lens() -> aonet::Camera {
    let camera = aonet::Camera::orthographic(5.0, lens(SIZE).size()).unwrap();
    camera.looking_at(EYE, TARGET, [0.0, 1.0, 0.0]).unwrap()
}

/// The exact frame of a camera with a margin (share of the picture) and a second layer for a radius (world units).
fn deep(lens: aonet::Camera, margin: f32, radius: f32) -> aonet::GBuffer<'static> {
    let margin = aonet::Margin::share(lens.size(), margin);
    boxes::deep_frame(lens.with_margin(margin).unwrap(), 0.1 * radius, &[]).with_margin(margin).unwrap()
}

#[test]
fn every_method_finds_what_it_finds_on_the_cpu() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let camera = bevy.camera(&target, (ao(AonetMethod::Gtao), pose(), projection()));
    for method in AonetMethod::ALL {
        bevy.app.world_mut().entity_mut(camera).insert(ao(method));
        let seen = bevy.frames(5);
        let (size, found) = &seen.visibility[&camera];
        assert_eq!(*size, SIZE);
        assert!(seen.stock.is_empty(), "Bevy's own search runs");
        assert_agrees(&format!("{method:?}"), found, &expected(method, lens(SIZE), 1.0));
    }
}

#[test]
fn every_kind_of_camera_agrees() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let method = AonetMethod::Agtao;
    let expected = |lens| expected(method, lens, 1.0);
    let lens = lens(SIZE);

    let camera = bevy.camera(&target, (ao(method), pose(), parallel()));
    assert_agrees("orthographic", &bevy.frames(5).visibility[&camera].1, &expected(parallel_lens()));
    bevy.app.world_mut().despawn(camera);

    // The right lower part of a picture of twice the size: the axis is at its corner.
    let part = SubCameraView { full_size: 2 * SIZE, offset: Vec2::new(100.0, 60.0), size: SIZE };
    let whole = Camera { sub_camera_view: Some(part), ..default() };
    let camera = bevy.camera(&target, (ao(method), pose(), projection(), whole));
    let of_part = common::lens(2 * SIZE).tile(100, 60, lens.size()).unwrap();
    assert_agrees("off-centre", &bevy.frames(5).visibility[&camera].1, &expected(of_part));
    bevy.app.world_mut().despawn(camera);

    let jitter = TemporalJitter { offset: Vec2::new(0.45, -0.4) };
    let camera = bevy.camera(&target, (ao(method), pose(), projection(), jitter));
    let [x, y] = lens.centre_px();
    let jittered = |sign: f32| lens.with_centre_px([x - sign * 0.45, y + sign * 0.4]).unwrap();
    let found = bevy.frames(5).visibility[&camera].1.clone();
    let [with, against] = [1.0, -1.0].map(|sign| difference(&found, &expected(jittered(sign))).0);
    let (right, wrong) = (with.min(against), with.max(against));
    println!("jitter: mean difference {right:.5}, with the other sign {wrong:.5}");
    assert!(right < 2e-3 && wrong > 2.0 * right, "{right} and {wrong}");
    bevy.app.world_mut().despawn(camera);

    let camera = bevy.camera(&target, (ao(method), pose(), projection(), bevy::camera::Hdr));
    assert_agrees("HDR", &bevy.frames(5).visibility[&camera].1, &expected(lens));
    bevy.app.world_mut().despawn(camera);

    bevy.app.insert_resource(bevy::pbr::DefaultOpaqueRendererMethod::deferred());
    let camera = bevy.camera(&target, (ao(method), pose(), projection(), DeferredPrepass));
    assert_agrees("deferred", &bevy.frames(5).visibility[&camera].1, &expected(lens));
    for (method, margin) in [(AonetMethod::Agtao, 0.15), (DEEP, 0.0), (DEEP, 0.15)] {
        let settings = AonetAmbientOcclusion { method, margin, second_layer: true, ..ao(method) };
        bevy.app.world_mut().entity_mut(camera).insert(settings);
        let expected = expected_in(method, &deep(lens, margin, 1.0), 1.0);
        let what = format!("deferred, {method:?}, margin {margin}");
        assert_agrees(&what, &bevy.frames(5).visibility[&camera].1, &expected);
    }
}

#[test]
fn cameras_share_a_target() {
    let mut bevy = Running::new();
    let target = bevy.target(UVec2::new(160, 120));
    let method = AonetMethod::Fast;
    let half = UVec2::new(80, 120);
    let viewport = |x| Camera {
        viewport: Some(Viewport { physical_position: UVec2::new(x, 0), physical_size: half, ..default() }),
        order: x as isize,
        clear_color: if x == 0 { ClearColorConfig::Default } else { ClearColorConfig::None },
        ..default()
    };
    let left = bevy.camera(&target, (ao(method), pose(), projection(), viewport(0)));
    let turned = Transform::from_xyz(-1.5, 2.0, 3.0).looking_at(TARGET.into(), Vec3::Y);
    let right = bevy.camera(&target, (ao(method), turned, projection(), viewport(80)));
    let seen = bevy.frames(5);
    let lens_of_right = lens(half).looking_at([-1.5, 2.0, 3.0], TARGET, [0.0, 1.0, 0.0]).unwrap();
    for (what, camera, lens) in [("left", left, lens(half)), ("right", right, lens_of_right)] {
        let (size, found) = &seen.visibility[&camera];
        assert_eq!(*size, half);
        assert_agrees(what, found, &expected(method, lens, 1.0));
    }
}

#[test]
fn guard_bands_agree() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    // A wide radius, so that much of what occludes is outside of the picture.
    let settings = AonetAmbientOcclusion { radius: 2.0, margin: 0.15, ..ao(AonetMethod::Agtao) };
    let camera = bevy.camera(&target, (settings, pose(), projection()));
    let margin = aonet::Margin::share(lens(SIZE).size(), 0.15);
    let wide = boxes::frame(lens(SIZE).with_margin(margin).unwrap()).with_margin(margin).unwrap();
    let narrow = expected(AonetMethod::Agtao, lens(SIZE), 2.0);
    for method in [AonetMethod::Agtao, AonetMethod::High] {
        bevy.app.world_mut().entity_mut(camera).insert(AonetAmbientOcclusion { method, ..settings });
        let seen = bevy.frames(6);
        let (size, found) = &seen.visibility[&camera];
        assert_eq!(*size, SIZE);
        assert!(seen.stock.is_empty());
        assert_agrees(&format!("{method:?} with a margin"), found, &expected_in(method, &wide, 2.0));
        if method == AonetMethod::Agtao {
            let without = difference(found, &narrow).0;
            assert!(without > 5e-3, "the margin changes nothing here: {without}");
        }
    }

    // As large as the picture after a change of size; gone with the margin.
    let larger = UVec2::new(200, 120);
    let image = bevy.target(larger);
    let of_larger = bevy::camera::RenderTarget::Image(image.into());
    bevy.app.world_mut().entity_mut(camera).insert((of_larger, settings));
    let margin = aonet::Margin::share(lens(larger).size(), 0.15);
    let wide = boxes::frame(lens(larger).with_margin(margin).unwrap()).with_margin(margin).unwrap();
    let found = bevy.frames(5).visibility[&camera].1.clone();
    assert_agrees("resized with a margin", &found, &expected_in(AonetMethod::Agtao, &wide, 2.0));
    let world = bevy.app.world_mut();
    assert_eq!(world.query::<&AonetSurround>().iter(world).count(), 1);
    bevy.app.world_mut().entity_mut(camera).insert(AonetAmbientOcclusion { margin: 0.0, ..settings });
    let found = bevy.frames(4).visibility[&camera].1.clone();
    assert_agrees("no margin again", &found, &expected(AonetMethod::Agtao, lens(larger), 2.0));
    let world = bevy.app.world_mut();
    assert_eq!(world.query::<&AonetSurround>().iter(world).count(), 0);
}

#[test]
fn cameras_with_guard_bands_share_a_target() {
    let mut bevy = Running::new();
    let target = bevy.target(UVec2::new(160, 120));
    let half = UVec2::new(80, 120);
    let settings = AonetAmbientOcclusion { radius: 2.0, margin: 0.2, ..ao(AonetMethod::Agtao) };
    let margin = aonet::Margin::share(lens(half).size(), 0.2);
    let eyes = [EYE, [-1.5, 2.0, 3.0]];
    let cameras = [0, 1].map(|i| {
        let viewport =
            Viewport { physical_position: UVec2::new(80 * i, 0), physical_size: half, ..default() };
        let clear_color = if i == 0 { ClearColorConfig::Default } else { ClearColorConfig::None };
        let part = Camera { viewport: Some(viewport), order: i as isize, clear_color, ..default() };
        let pose = Transform::from_translation(eyes[i as usize].into()).looking_at(TARGET.into(), Vec3::Y);
        bevy.camera(&target, (settings, pose, projection(), part))
    });
    let seen = bevy.frames(6);
    for (camera, eye) in cameras.into_iter().zip(eyes) {
        let lens = lens(half).looking_at(eye, TARGET, [0.0, 1.0, 0.0]).unwrap();
        let wide = boxes::frame(lens.with_margin(margin).unwrap()).with_margin(margin).unwrap();
        let found = &seen.visibility[&camera].1;
        assert_agrees(&format!("from {eye:?}"), found, &expected_in(AonetMethod::Agtao, &wide, 2.0));
    }
}

#[test]
fn second_layers_agree() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let camera = bevy.camera(&target, (ao(DEEP), pose(), projection()));
    for method in AonetMethod::ALL {
        for (kind, lens, projection) in
            [("perspective", lens(SIZE), projection()), ("orthographic", parallel_lens(), parallel())]
        {
            for margin in [0.0, 0.15] {
                let settings = AonetAmbientOcclusion { margin, second_layer: true, ..ao(method) };
                bevy.app.world_mut().entity_mut(camera).insert((settings, projection.clone()));
                let seen = bevy.frames(6);
                let found = &seen.visibility[&camera].1;
                assert!(seen.stock.is_empty());
                let frame = deep(lens, margin, 1.0);
                let expected = expected_in(method, &frame, 1.0);
                assert_agrees(&format!("{method:?}, {kind}, margin {margin}"), found, &expected);
                // The plugin has read the layer if its image is far nearer to that with it.
                let one_layer = expected_in(method, &frame.without_second(), 1.0);
                let [with, without] = [&expected, &one_layer].map(|image| difference(found, image).0);
                println!("    without the layer: {without:.5}");
                assert_eq!(
                    without > 5.0 * with,
                    method.reads_second_layer(),
                    "{method:?}: {with}, {without}"
                );
                // What asks for nothing costs nothing.
                drop(seen);
                let world = bevy.app.world_mut();
                let cameras = world.query::<&AonetBehind>().iter(world).count();
                assert_eq!(cameras, usize::from(method.reads_second_layer()));
            }
        }
    }
    bevy.app.world_mut().entity_mut(camera).insert((ao(DEEP), projection()));
    let found = bevy.frames(4).visibility[&camera].1.clone();
    assert_agrees("one layer again", &found, &expected(DEEP, lens(SIZE), 1.0));
}

#[test]
fn second_layers_of_viewports_and_jitter_agree() {
    let mut bevy = Running::new();
    let target = bevy.target(UVec2::new(160, 120));
    let half = UVec2::new(80, 120);
    let settings = AonetAmbientOcclusion { second_layer: true, ..ao(DEEP) };
    let viewport = Viewport { physical_position: UVec2::new(80, 0), physical_size: half, ..default() };
    let part = Camera { viewport: Some(viewport), ..default() };
    let camera = bevy.camera(&target, (settings, pose(), projection(), part));
    let found = bevy.frames(6).visibility[&camera].1.clone();
    assert_agrees("viewport", &found, &expected_in(DEEP, &deep(lens(half), 0.0, 1.0), 1.0));

    let offset = Vec2::new(0.45, -0.4);
    bevy.app.world_mut().entity_mut(camera).insert(TemporalJitter { offset });
    let [x, y] = lens(half).centre_px();
    let jittered = |sign: f32| lens(half).with_centre_px([x - sign * offset.x, y - sign * offset.y]).unwrap();
    let found = bevy.frames(6).visibility[&camera].1.clone();
    let [with, against] = [1.0, -1.0]
        .map(|sign| difference(&found, &expected_in(DEEP, &deep(jittered(sign), 0.0, 1.0), 1.0)).0);
    println!("jitter: mean differences {with:.5} and {against:.5}");
    assert!(with.min(against) < 2e-3, "{with} and {against}");
}

#[test]
fn second_layers_leave_out_what_alpha_masks_cut() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let settings = AonetAmbientOcclusion { second_layer: true, ..ao(AonetMethod::High) };
    let camera = bevy.camera(&target, (settings, pose(), projection()));
    // Thinner than the distance of the layers; it hides a box.
    let board = ([-0.6, 0.6, 0.2], [0.6, 0.6, 0.01]);
    let hidden = ([-0.9, 0.3, -0.3], [0.5, 0.3, 0.2]);
    bevy.add_box(board, StandardMaterial::default());
    let expected =
        |more: &[_]| expected_in(AonetMethod::High, &boxes::deep_frame(lens(SIZE), 0.1, more), 1.0);
    let (without, with) = (expected(&[board]), expected(&[board, hidden]));
    let (_, far) = difference(&without, &with);
    assert!(far > 0.012, "the box changes {far} of the pixels");
    let alpha_mode = AlphaMode::Mask(0.5);
    for opaque_render_method in [OpaqueRendererMethod::Forward, OpaqueRendererMethod::Deferred] {
        for (what, alpha, expected) in [("cut", 0.0, &without), ("whole", 1.0, &with)] {
            let base_color = Color::srgba(0.8, 0.8, 0.8, alpha);
            let material = StandardMaterial { base_color, alpha_mode, opaque_render_method, ..default() };
            let entity = bevy.add_box(hidden, material);
            let what = format!("{what}, {opaque_render_method:?}");
            assert_agrees(&what, &bevy.frames(6).visibility[&camera].1, expected);
            bevy.app.world_mut().despawn(entity);
        }
        bevy.app.world_mut().entity_mut(camera).insert(DeferredPrepass);
    }
}

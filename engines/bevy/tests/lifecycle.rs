//! Settings, sizes and cameras that change, and what is refused.

mod common;

use bevy::diagnostic::{DiagnosticPath, DiagnosticsStore};
use bevy::pbr::ScreenSpaceAmbientOcclusion;
use bevy::prelude::*;
use bevy::render::diagnostic::RenderDiagnosticsPlugin;
use bevy_aonet::{AonetAmbientOcclusion, AonetMethod};
use common::*;

const SIZE: UVec2 = UVec2::new(128, 72);
const AO: AonetAmbientOcclusion = AonetAmbientOcclusion {
    method: AonetMethod::Agtao,
    radius: 1.0,
    intensity: 1.0,
    margin: 0.0,
    second_layer: false,
};

#[test]
fn materials_see_the_visibility() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let camera = bevy.camera(&target, (pose(), projection(), Msaa::Off));
    let without = bevy.frames(5).pictures[&target.id()].clone();
    bevy.app.world_mut().entity_mut(camera).insert(AO);
    let seen = bevy.frames(5);
    let (with, visibility) = (&seen.pictures[&target.id()], &seen.visibility[&camera].1);
    // Ambient light is all the light: a pixel is darker where, and only where, visibility is low.
    for (i, visibility) in visibility.iter().enumerate() {
        match *visibility {
            v if v < 0.8 => assert!(with[i] < without[i], "pixel {i}: {v}, {} and {}", with[i], without[i]),
            v if v > 0.999 => assert!(with[i].abs_diff(without[i]) <= 1, "pixel {i}"),
            _ => {}
        }
    }
    let closed = visibility.iter().filter(|v| **v < 0.8).count();
    let open = visibility.iter().filter(|v| **v > 0.999).count();
    assert!(closed > 100 && open > 100, "{closed} and {open} pixels to compare");
}

#[test]
fn settings_and_sizes_change() {
    let mut bevy = Running::with(|app| {
        app.add_plugins(RenderDiagnosticsPlugin);
    });
    let target = bevy.target(SIZE);
    let camera = bevy.camera(&target, (AO, pose(), projection()));
    let plain = bevy.frames(5).visibility[&camera].1.clone();

    // The power of visibility.
    bevy.app.world_mut().entity_mut(camera).insert(AonetAmbientOcclusion { intensity: 2.0, ..AO });
    let squared = bevy.frames(3).visibility[&camera].1.clone();
    for (plain, squared) in plain.iter().zip(&squared) {
        assert!((plain * plain - squared).abs() < 2e-3, "{plain} and {squared}");
    }

    // A radius, without a new session.
    bevy.app.world_mut().entity_mut(camera).insert(AonetAmbientOcclusion { radius: 0.2, ..AO });
    let near = bevy.frames(3).visibility[&camera].1.clone();
    assert!(near.iter().sum::<f32>() > plain.iter().sum::<f32>());

    // A target of another size.
    let larger = UVec2::new(150, 100);
    let image = bevy.target(larger);
    let of_larger = bevy::camera::RenderTarget::Image(image.clone().into());
    bevy.app.world_mut().entity_mut(camera).insert((of_larger, AO));
    let seen = bevy.frames(4);
    assert_eq!(seen.visibility[&camera].0, larger);
    assert_agrees("resized", &seen.visibility[&camera].1, &expected(AO.method, lens(larger), AO.radius));
    drop(seen);

    // GPU times; Bevy's own pass has none, nor has a layer that nobody asked for.
    let has = |bevy: &Running, name: &str| {
        let store = bevy.app.world().resource::<DiagnosticsStore>();
        let times = |unit| DiagnosticPath::new(format!("render/{name}/elapsed_{unit}"));
        ["cpu", "gpu"].iter().any(|unit| store.get_measurement(&times(unit)).is_some())
    };
    assert!(has(&bevy, "aonet") && !has(&bevy, "ssao") && !has(&bevy, "aonet/second_layer"));
    let deep = AonetAmbientOcclusion { method: AonetMethod::Balanced, second_layer: true, ..AO };
    bevy.app.world_mut().entity_mut(camera).insert(deep);
    drop(bevy.frames(4));
    assert!(has(&bevy, "aonet/second_layer"));

    // A camera that rests holds nothing.
    bevy.app.world_mut().get_mut::<Camera>(camera).unwrap().is_active = false;
    assert!(bevy.frames(3).visibility.is_empty());
    bevy.app.world_mut().get_mut::<Camera>(camera).unwrap().is_active = true;
    assert_eq!(bevy.frames(3).visibility[&camera].0, larger);

    // Removed: Bevy's own search does not take over.
    bevy.app.world_mut().entity_mut(camera).remove::<AonetAmbientOcclusion>();
    let seen = bevy.frames(3);
    assert!(seen.visibility.is_empty() && seen.stock.is_empty());
    drop(seen);
    assert!(bevy.app.world().get::<ScreenSpaceAmbientOcclusion>(camera).is_none());

    // Bevy's own search alone does run: the assertions above can fail.
    bevy.app.world_mut().entity_mut(camera).insert(ScreenSpaceAmbientOcclusion::default());
    assert_eq!(bevy.frames(3).stock, [camera]);
}

#[test]
fn senseless_cameras_are_drawn_without_occlusion() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    for (what, settings, scale) in [
        ("radius", AonetAmbientOcclusion { radius: f32::NAN, ..AO }, 1.0),
        ("radius", AonetAmbientOcclusion { radius: -1.0, ..AO }, 1.0),
        ("intensity", AonetAmbientOcclusion { intensity: f32::NAN, ..AO }, 1.0),
        ("margin", AonetAmbientOcclusion { margin: f32::NAN, ..AO }, 1.0),
        ("margin", AonetAmbientOcclusion { margin: 1e9, ..AO }, 1.0),
        ("scale", AO, 3.0),
    ] {
        let pose = pose().with_scale(Vec3::splat(scale));
        let camera = bevy.camera(&target, (settings, pose, projection()));
        let seen = bevy.frames(3);
        assert!(seen.visibility[&camera].1.iter().all(|v| *v == 1.0), "{what}");
        drop(seen);
        bevy.app.world_mut().despawn(camera);
    }
}

#[test]
fn multisampling_is_turned_off() {
    let mut bevy = Running::new();
    let target = bevy.target(SIZE);
    let camera = bevy.camera(&target, (AO, pose(), projection(), Msaa::Sample4));
    for _ in 0..2 {
        assert!(bevy.frames(3).visibility.contains_key(&camera));
        assert_eq!(bevy.app.world().get::<Msaa>(camera), Some(&Msaa::Off));
        bevy.app.world_mut().entity_mut(camera).insert(Msaa::Sample8);
    }
}

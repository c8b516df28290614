//! Scene files, with and without normals to invent.
#![no_main]

use aonet_scene::scene::{MissingNormals, gltf};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(scene) = gltf::from_bytes(bytes, None, "fuzz", MissingNormals::CREASE) {
        scene.checked().expect("a loaded scene is sound");
    }
});

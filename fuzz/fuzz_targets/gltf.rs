//! Scene files, with and without normals to invent.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::gltf(bytes);
});

//! Images of scenes (PNG, JPEG), and AO images (PNG).
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::image(bytes);
});

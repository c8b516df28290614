//! Presets of classic methods.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::preset(bytes);
});

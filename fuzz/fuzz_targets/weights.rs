//! Weights files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::weights(bytes);
});

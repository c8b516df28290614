//! Views, and the cameras they make.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::view(bytes);
});

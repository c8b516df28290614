//! Camera paths, replayed from before their start until after their end.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::path(bytes);
});

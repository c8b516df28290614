//! Program files of one size and of every size: JSON, a zero, and the block of bytes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    aonet_fuzz::program(bytes);
});

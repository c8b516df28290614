//! Frame files.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: {
        // The reader turns panics of the EXR decoder into errors: only a panic that comes out of it counts, and that
        // one still aborts.
        std::panic::set_hook(Box::new(|_| ()));
    },
    |bytes: &[u8]| {
        aonet_fuzz::frame(bytes);
    }
);

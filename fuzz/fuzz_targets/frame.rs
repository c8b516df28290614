//! Frame files.
#![no_main]

use aonet_lab::frame::{Frame, FrameHints};

libfuzzer_sys::fuzz_target!(
    init: {
        // The reader turns panics of the EXR decoder into errors: only a panic that comes out of it counts, and that
        // one still aborts.
        std::panic::set_hook(Box::new(|_| ()));
    },
    |bytes: &[u8]| {
        let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
        let _ = Frame::from_bytes(bytes, &hints);
    }
);

//! Frame files.
#![no_main]

use aonet_offline::frame::{Frame, FrameHints};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
    let _ = Frame::from_bytes(bytes, &hints);
});

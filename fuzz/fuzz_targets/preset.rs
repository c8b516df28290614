//! Presets of classic methods.
#![no_main]

use aonet_lab::preset::Preset;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("fuzz/preset.json");
    if let Ok(preset) = Preset::from_bytes(bytes, path) {
        let again = serde_json::to_vec(&preset).expect("a sound preset is JSON");
        assert_eq!(Preset::from_bytes(&again, path).expect("and reads back"), preset);
    }
});

//! Dataset manifests.
#![no_main]

use aonet_lab::dataset::Manifest;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("fuzz/manifest.json");
    if let Ok(manifest) = Manifest::from_bytes(bytes, path) {
        let again = serde_json::to_vec(&manifest).expect("a sound manifest is JSON");
        assert_eq!(Manifest::from_bytes(&again, path).expect("and reads back"), manifest);
    }
});

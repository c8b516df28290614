//! Weights files.
#![no_main]

use aonet::net::{Model, WeightFormat};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(model) = Model::from_bytes(bytes) {
        let again = model.to_bytes(WeightFormat::F32).expect("a loaded model can be written");
        assert_eq!(Model::from_bytes(&again).expect("and read back"), model);
    }
});

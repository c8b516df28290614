//! Configurations of networks.
#![no_main]

use aonet::net::ModelConfig;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(config) = serde_json::from_slice::<ModelConfig>(bytes) {
        let again = serde_json::to_vec(&config).expect("a sound configuration is JSON");
        assert_eq!(serde_json::from_slice::<ModelConfig>(&again).expect("and reads back"), config);
    }
});

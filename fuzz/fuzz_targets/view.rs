//! Views, and the cameras they make.
#![no_main]

use aonet_scene::View;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(view) = serde_json::from_slice::<View>(bytes) else { return };
    let _ = view.params();
    if view.camera().is_ok() {
        let again = serde_json::to_vec(&view).expect("a sound view is JSON");
        assert_eq!(serde_json::from_slice::<View>(&again).expect("and reads back"), view);
    }
});

//! Parameters found by `aonet tune` on training frames; each file names its command.

use super::Classic;

/// Method and file.
pub(super) const TUNED: [(&str, &str); 6] = [
    ("ssao", include_str!("../../presets/ssao.json")),
    ("hbao", include_str!("../../presets/hbao.json")),
    ("ssdo", include_str!("../../presets/ssdo.json")),
    ("gtao", include_str!("../../presets/gtao.json")),
    ("vbao", include_str!("../../presets/vbao.json")),
    ("agtao", include_str!("../../presets/agtao.json")),
];

/// The method in a preset file of this crate.
pub(super) fn method(json: &str) -> Classic {
    #[derive(serde::Deserialize)]
    struct Preset {
        method: Classic,
    }
    serde_json::from_str::<Preset>(json).expect("a preset of this crate").method
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_of_their_method_and_in_range() {
        for (name, json) in TUNED {
            let method = method(json).checked().unwrap();
            assert_eq!(method.name(), name);
            assert_eq!(Classic::named(&format!("{name}:tuned")).unwrap(), method);
            assert_ne!(method, Classic::named(name).unwrap());
        }
        let [low, high] = ["gtao:low", "gtao:high"].map(|name| Classic::named(name).unwrap());
        assert_eq!((low.taps(), high.taps()), (4, 18));
        assert_eq!(high, Classic::named("gtao").unwrap());
        assert!(Classic::named("gtao:huge").is_err() && Classic::named("ssao:low").is_err());
    }
}

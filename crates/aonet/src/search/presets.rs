//! Parameters found by `aonet tune` on training frames; each file names its command.

use super::Classic;

/// Name and file.
pub(super) const TUNED: [(&str, &str); 9] = [
    ("ssao:tuned", include_str!("../../presets/ssao.json")),
    ("hbao:tuned", include_str!("../../presets/hbao.json")),
    ("ssdo:tuned", include_str!("../../presets/ssdo.json")),
    ("gtao:tuned", include_str!("../../presets/gtao.json")),
    ("vbao:tuned", include_str!("../../presets/vbao.json")),
    ("vbao:deep", include_str!("../../presets/vbao_deep.json")),
    ("agtao:tuned", include_str!("../../presets/agtao.json")),
    ("arcs:tuned", include_str!("../../presets/arcs.json")),
    ("arcs:deep", include_str!("../../presets/arcs_deep.json")),
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
            assert!(name.starts_with(&format!("{}:", method.name())));
            assert_eq!(Classic::named(name).unwrap(), method);
            assert_ne!(method, Classic::named(method.name()).unwrap());
        }
        let [low, high] = ["gtao:low", "gtao:high"].map(|name| Classic::named(name).unwrap());
        assert_eq!((low.taps(), high.taps()), (4, 18));
        assert_eq!(high, Classic::named("gtao").unwrap());
        assert!(
            Classic::named("gtao:huge").is_err()
                && Classic::named("ssao:low").is_err()
                && Classic::named("gtao:deep").is_err()
        );
    }
}

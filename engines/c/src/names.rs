//! What can be chosen by name.

use aonet::net::shipped;
use aonet::search::Classic;
use std::ffi::CString;
use std::sync::LazyLock;

/// 10000 * major + 100 * minor + patch.
pub(crate) const VERSION: u32 = 10_000 * number(env!("CARGO_PKG_VERSION_MAJOR"))
    + 100 * number(env!("CARGO_PKG_VERSION_MINOR"))
    + number(env!("CARGO_PKG_VERSION_PATCH"));

/// What may follow a classic method's name and a colon.
const PRESETS: [&str; 6] = ["tuned", "deep", "low", "medium", "high", "ultra"];

/// The networks that come with the library, then the classic methods, each followed by its presets.
pub(crate) fn all() -> &'static [CString] {
    static ALL: LazyLock<Vec<CString>> = LazyLock::new(|| {
        let mut names: Vec<_> = shipped::ALL.iter().map(|(name, _)| name.to_string()).collect();
        for method in Classic::all() {
            names.push(method.name().to_owned());
            let presets = PRESETS.into_iter().map(|preset| format!("{}:{preset}", method.name()));
            names.extend(presets.filter(|name| Classic::named(name).is_ok()));
        }
        names.into_iter().filter_map(|name| CString::new(name).ok()).collect()
    });
    &ALL
}

const fn number(digits: &str) -> u32 {
    let (digits, mut i, mut number) = (digits.as_bytes(), 0, 0);
    while i < digits.len() {
        number = 10 * number + (digits[i] - b'0') as u32;
        i += 1;
    }
    number
}

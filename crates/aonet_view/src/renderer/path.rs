//! A camera path through a scene: recorded in the window, replayed at any rate, stored as JSON.

use super::orbit::Orbit;
use aonet_scene::{Error, Result};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Largest number of a path, with either sign. guess: beyond any scene, and a cubic through such numbers stays finite.
const MOST: f32 = 1e15;

/// Where the viewer is at a time, world space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Time since the start of the path (s).
    pub seconds: f32,
    /// Position of the viewer (world units).
    pub eye: [f32; 3],
    /// What it looks at (world units).
    pub target: [f32; 3],
}

/// Keys in order of time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CameraPath {
    /// At least one for a path that can be replayed.
    pub keys: Vec<Key>,
}

impl CameraPath {
    /// Reads a path from JSON text: `{"keys": [{"seconds": 0, "eye": [0, 1, 3], "target": [0, 0, 0]}, ..]}`.
    ///
    /// # Errors
    /// When it is no such JSON, has no keys, a number is beyond 1e15, eye and target are equal, or times do not increase.
    pub fn from_json(text: &[u8]) -> Result<Self> {
        let expected = "a camera path (JSON with keys of seconds, eye and target)";
        let path: Self =
            serde_json::from_slice(text).map_err(|e| Error::request("camera path", expected, e))?;
        if path.keys.is_empty() {
            return Err(Error::request("camera path", "at least one key", "none"));
        }
        for (i, key) in path.keys.iter().enumerate() {
            let (eye, target) = (Vec3::from(key.eye), Vec3::from(key.target));
            let numbers = key.eye.iter().chain(&key.target).chain([&key.seconds]);
            if !numbers.into_iter().all(|number| number.abs() <= MOST) || eye == target {
                let what = format!("camera path, key {i}");
                let expected = format!("numbers up to {MOST:e} and eye != target");
                return Err(Error::request(what, expected, format!("{key:?}")));
            }
        }
        if let Some(i) = path.keys.windows(2).position(|k| k[1].seconds <= k[0].seconds) {
            let expected = format!("a time after {} s", path.keys[i].seconds);
            let what = format!("camera path, key {}", i + 1);
            return Err(Error::request(what, expected, format!("{} s", path.keys[i + 1].seconds)));
        }
        Ok(path)
    }

    /// The text that [`CameraPath::from_json`] reads.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Adds the viewer's position at a time; a time that is not later than the last key is ignored.
    pub fn record(&mut self, seconds: f32, orbit: &Orbit) {
        if self.keys.last().is_none_or(|last| seconds > last.seconds) {
            let (eye, target) = (orbit.eye().to_array(), orbit.target.to_array());
            self.keys.push(Key { seconds, eye, target });
        }
    }

    /// First and last time (s).
    pub fn span(&self) -> (f32, f32) {
        let at = |key: Option<&Key>| key.map_or(0.0, |key| key.seconds);
        (at(self.keys.first()), at(self.keys.last()))
    }

    /// Where the viewer is at a time (s): on a cubic through the keys. None where there are no keys.
    // Catmull and Rom 1974, with times that need not be evenly apart.
    pub fn at(&self, seconds: f32) -> Option<Orbit> {
        let (first, last) = (self.keys.first()?, self.keys.last()?);
        let seconds = seconds.clamp(first.seconds, last.seconds);
        let next =
            self.keys.partition_point(|key| key.seconds <= seconds).clamp(1, self.keys.len().max(2) - 1);
        let i = next - 1;
        let along = |of: fn(&Key) -> [f32; 3]| {
            let (Some(a), Some(b)) = (self.keys.get(i), self.keys.get(next)) else { return of(first).into() };
            let span = b.seconds - a.seconds;
            let t = (seconds - a.seconds) / span;
            let slopes = [i, next].map(|key| self.change(key, span, of));
            hermite([of(a), of(b)].map(Vec3::from), slopes, t)
        };
        Some(Orbit::new(along(|key| key.eye), along(|key| key.target)))
    }

    /// Change within `span` (s) at a key, as fast as from the key before to the one after.
    fn change(&self, i: usize, span: f32, of: fn(&Key) -> [f32; 3]) -> Vec3 {
        let before = &self.keys[i.saturating_sub(1)];
        let after = &self.keys[(i + 1).min(self.keys.len() - 1)];
        // A share of the time, in [0, 1]: the change a second overflows where keys are close.
        let share = span / (after.seconds - before.seconds);
        share * (Vec3::from(of(after)) - Vec3::from(of(before)))
    }
}

/// The cubic with these ends and slopes at `t` in [0, 1].
fn hermite([a, b]: [Vec3; 2], [at_a, at_b]: [Vec3; 2], t: f32) -> Vec3 {
    let (t2, t3) = (t * t, t * t * t);
    let (to_b, from_a) = (3.0 * t2 - 2.0 * t3, t3 - 2.0 * t2 + t);
    a + to_b * (b - a) + from_a * at_a + (t3 - t2) * at_b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(keys: &[(f32, f32)]) -> CameraPath {
        let key = |&(seconds, x): &(f32, f32)| Key { seconds, eye: [x, 0.0, 2.0], target: [x, 0.0, 0.0] };
        CameraPath { keys: keys.iter().map(key).collect() }
    }

    #[test]
    fn keys_are_met_and_steady_motion_stays_steady() {
        let way = path(&[(1.0, 0.0), (2.0, 1.0), (4.0, 3.0), (4.5, 3.5)]);
        for (seconds, x) in [(1.0, 0.0), (1.25, 0.25), (2.0, 1.0), (3.0, 2.0), (4.0, 3.0), (4.5, 3.5)] {
            assert!((way.at(seconds).unwrap().eye().x - x).abs() < 1e-4, "{seconds}");
        }
        let uneven = path(&[(0.0, 0.0), (1.0, 5.0), (1.5, -3.0), (9.0, 1.0)]);
        for key in &uneven.keys {
            assert!((uneven.at(key.seconds).unwrap().eye().x - key.eye[0]).abs() < 1e-4);
        }
    }

    #[test]
    fn keys_that_are_close_in_time_leave_the_viewer_somewhere() {
        let way = path(&[(0.0, 0.0), (1e-40, 5.0), (2e-40, -3.0)]);
        for seconds in [0.0, 5e-41, 1.3e-40, 2e-40] {
            let orbit = way.at(seconds).unwrap();
            assert!(orbit.eye().is_finite() && orbit.target.is_finite(), "{seconds}: {orbit:?}");
        }
    }

    #[test]
    fn before_and_after_is_the_first_and_the_last_key() {
        let way = path(&[(1.0, 0.0), (2.0, 1.0)]);
        assert!((way.at(-5.0).unwrap().eye().x).abs() < 1e-5);
        assert!((way.at(f32::MAX).unwrap().eye().x - 1.0).abs() < 1e-5);
        assert!((path(&[(3.0, 7.0)]).at(0.0).unwrap().eye().x - 7.0).abs() < 1e-5);
        assert!(CameraPath::default().at(0.0).is_none());
    }

    #[test]
    fn what_was_recorded_comes_back_from_its_text() {
        let mut way = CameraPath::default();
        let orbit = Orbit::new(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO);
        [0.0, 0.5, 0.5, 0.25, 1.0].into_iter().for_each(|seconds| way.record(seconds, &orbit));
        assert_eq!(way.keys.iter().map(|key| key.seconds).collect::<Vec<_>>(), [0.0, 0.5, 1.0]);
        assert_eq!(CameraPath::from_json(way.to_json().as_bytes()).unwrap(), way);
    }

    #[test]
    fn ways_that_cannot_be_gone_are_refused() {
        for (text, named) in [
            ("{}", "keys"),
            (r#"{"keys": []}"#, "at least one"),
            (r#"{"keys": [{"seconds": 0, "eye": [0,0,0], "target": [0,0,0]}]}"#, "eye != target"),
            (r#"{"keys": [{"seconds": 0, "eye": [0,0,1e39], "target": [0,0,0]}]}"#, "out of range"),
            (r#"{"keys": [{"seconds": 0, "eye": [0,0,-3e38], "target": [0,0,0]}]}"#, "up to 1e15"),
            (r#"{"keys": [{"seconds": -3e38, "eye": [0,0,1], "target": [0,0,0]}]}"#, "up to 1e15"),
            (
                r#"{"keys": [{"seconds": 1, "eye": [0,0,1], "target": [0,0,0]},
                {"seconds": 1, "eye": [0,0,1], "target": [0,0,0]}]}"#,
                "after 1 s",
            ),
        ] {
            let message = CameraPath::from_json(text.as_bytes()).unwrap_err().to_string();
            assert!(message.contains(named), "{text}: {message}");
        }
    }
}

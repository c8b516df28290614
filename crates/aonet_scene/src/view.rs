//! A view: where the camera of a frame stands and how long the occlusion rays are. Stored as JSON.

use crate::error::{Error, Result};
use aonet::{AoParams, Camera, Margin, Projection, Size};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A camera and an AO radius in glTF world space (right-handed, +Y up).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Camera position (world units).
    pub eye: [f32; 3],
    /// Point in the middle of the image (world units).
    pub target: [f32; 3],
    /// Direction that is up in the image.
    #[serde(default = "up")]
    pub up: [f32; 3],
    /// Vertical field of view (degrees); ignored when `ortho_height` is given.
    #[serde(default = "fov_y_deg")]
    pub fov_y_deg: f32,
    /// Height of the image plane of an orthographic camera (world units).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho_height: Option<f32>,
    /// Image width (px).
    pub width: usize,
    /// Image height (px).
    pub height: usize,
    /// Nearest visible distance along the axis (world units).
    #[serde(default)]
    pub near: f32,
    /// Farthest visible distance along the axis (world units); beyond is background.
    #[serde(default = "far", skip_serializing_if = "is_infinite", with = "far_or_infinite")]
    pub far: f32,
    /// AO radius (world units).
    pub radius: f32,
    /// Guard band on each side, as a share of the picture's width and height.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub margin: f32,
    /// Least distance of a second layer behind the first, as a share of the AO radius; without one there is no second layer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separation: Option<f32>,
}

/// The fields of a [`View`] in JSON.
const FIELDS: [&str; 12] = [
    "eye",
    "target",
    "up",
    "fov_y_deg",
    "ortho_height",
    "width",
    "height",
    "near",
    "far",
    "radius",
    "margin",
    "separation",
];

/// Fields of a view file that say nothing about the camera: they are not read.
pub const NOTES: [&str; 4] = ["name", "glb", "scene", "comment"];

fn is_known(field: &str) -> bool {
    FIELDS.contains(&field) || NOTES.contains(&field)
}

/// What frames show besides the visible surfaces of the picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Surround {
    /// [`View::margin`].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub margin: f32,
    /// [`View::separation`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separation: Option<f32>,
}

impl Surround {
    /// # Errors
    /// When the margin is not in [0, 1], or the separation not in [0, [`MAX_SEPARATION`]].
    pub fn check(&self) -> aonet::Result<()> {
        if !(0.0..=1.0).contains(&self.margin) {
            return Err(aonet::Error::value("view margin", "a share in [0, 1]", self.margin));
        }
        match self.separation {
            Some(share) if !(0.0..=MAX_SEPARATION).contains(&share) => {
                let expected = format!("a share of the radius in [0, {MAX_SEPARATION}]");
                Err(aonet::Error::value("view separation", expected, share))
            }
            _ => Ok(()),
        }
    }
}

/// Largest [`View::separation`].
pub const MAX_SEPARATION: f32 = 10.0;

/// [`View::separation`] where none is given: the best of 0, 0.05, 0.1, 0.25 and 0.5 for exact rays.
pub const DEFAULT_SEPARATION: f32 = 0.1;

fn is_zero(margin: &f32) -> bool {
    *margin == 0.0
}

fn up() -> [f32; 3] {
    [0.0, 1.0, 0.0]
}

fn fov_y_deg() -> f32 {
    60.0
}

fn far() -> f32 {
    f32::INFINITY
}

fn is_infinite(far: &f32) -> bool {
    far.is_infinite()
}

/// JSON has no infinity: an absent or null `far` is infinite.
mod far_or_infinite {
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(far: &f32, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_f32(*far)
    }

    pub(super) fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<f32, D::Error> {
        Ok(Option::<f32>::deserialize(d)?.unwrap_or(f32::INFINITY))
    }
}

impl View {
    /// Reads a view from a JSON file.
    ///
    /// # Errors
    /// When the file cannot be read or [`View::from_bytes`] refuses it.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_bytes(&std::fs::read(path).map_err(Error::io(path))?, path)
    }

    /// Reads a view from JSON text; `path` is for messages. Besides the fields of a view it may have [`NOTES`].
    ///
    /// # Errors
    /// When it is no such JSON, has a field of another name, or holds a camera or radius out of range.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let wrong = |e| Error::file(path, "a view (JSON with eye, target, width, height, radius)", e);
        let json: serde_json::Value = serde_json::from_slice(bytes).map_err(wrong)?;
        let other = json.as_object().and_then(|fields| fields.keys().find(|name| !is_known(name)).cloned());
        if let Some(name) = other {
            let expected = format!("fields of a view: {}; or notes: {}", FIELDS.join(", "), NOTES.join(", "));
            return Err(Error::file(path, expected, format!("`{name}`")));
        }
        let view: Self = serde_json::from_value(json).map_err(wrong)?;
        view.camera().map_err(Error::in_file(path))?;
        view.params().map_err(Error::in_file(path))?;
        view.margin_px().map_err(Error::in_file(path))?;
        Ok(view)
    }

    /// The size of the image.
    ///
    /// # Errors
    /// When a side is out of range.
    pub fn size(&self) -> aonet::Result<Size> {
        Size::new(self.width, self.height)
    }

    /// The camera.
    ///
    /// # Errors
    /// When a value is out of range.
    pub fn camera(&self) -> aonet::Result<Camera> {
        if self.far.is_nan() || self.far <= self.near {
            return Err(aonet::Error::value(
                "view far",
                format!("a distance above near = {}", self.near),
                self.far,
            ));
        }
        let projection = match self.ortho_height {
            Some(height) => Projection::Orthographic { height },
            None => Projection::Perspective { fov_y: self.fov_y_deg.to_radians() },
        };
        let camera = Camera::new(projection, self.size()?)?;
        camera.with_near(self.near)?.looking_at(self.eye, self.target, self.up)
    }

    /// Guard band and second layer.
    pub fn surround(&self) -> Surround {
        Surround { margin: self.margin, separation: self.separation }
    }

    /// The same view with another guard band and second layer.
    #[must_use]
    pub fn surrounded(self, Surround { margin, separation }: Surround) -> Self {
        Self { margin, separation, ..self }
    }

    /// The guard band (px).
    ///
    /// # Errors
    /// When the margin or the separation is out of range.
    pub fn margin_px(&self) -> aonet::Result<Margin> {
        self.surround().check()?;
        Ok(Margin::share(Size::new(self.width, self.height)?, self.margin))
    }

    /// Least distance of the second layer behind the first (world units); `None` without a second layer.
    pub fn separation_units(&self) -> Option<f32> {
        self.separation.map(|share| share * self.radius)
    }

    /// The AO parameters.
    ///
    /// # Errors
    /// When the radius is not finite or not above zero.
    pub fn params(&self) -> aonet::Result<AoParams> {
        AoParams::new(self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_is_optional_and_survives_a_round_trip() {
        let json = r#"{"eye":[0,0,3],"target":[0,0,0],"width":4,"height":3,"radius":0.5}"#;
        let view: View = serde_json::from_str(json).unwrap();
        assert_eq!(view.far, f32::INFINITY);
        let again: View = serde_json::from_str(&serde_json::to_string(&view).unwrap()).unwrap();
        assert_eq!(view, again);
    }

    #[test]
    fn a_radius_of_zero_is_named_with_its_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("v.json");
        std::fs::write(&path, r#"{"eye":[0,0,3],"target":[0,0,0],"width":4,"height":3,"radius":0}"#).unwrap();
        let message = View::load(&path).unwrap_err().to_string();
        assert!(message.contains("v.json") && message.contains("radius"), "{message}");
    }
}

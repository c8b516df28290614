//! Parameters of a frame.

use super::method::Method;
use crate::{Error, Result};
use aonet::{AoParams, Camera, Size};
use std::fmt;
use std::str::FromStr;

/// Which picture of a frame is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Show {
    /// The lit scene: visibility dims the ambient light only.
    #[default]
    Shaded,
    /// Visibility as grey: 1 white.
    Visibility,
    /// View-space shading normals as n/2 + 1/2.
    Normals,
    /// The method minus the ray-traced reference: white where they agree, blue where the method is too dark, red where it
    /// is too bright, full colour at [`aonet::metrics::ERROR_SCALE`].
    Error,
}

impl Show {
    /// All pictures.
    pub const ALL: [Self; 4] = [Self::Shaded, Self::Visibility, Self::Normals, Self::Error];

    /// Its name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shaded => "shaded",
            Self::Visibility => "ao",
            Self::Normals => "normals",
            Self::Error => "error",
        }
    }
}

impl fmt::Display for Show {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Show {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let names = Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|show| show.name() == name);
        found.ok_or_else(|| Error::request("picture", format!("one of {names}"), format!("{name:?}")))
    }
}

/// One frame of a [`Renderer`](super::Renderer).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameParams {
    /// The camera, of the renderer's size. A near plane at 0 is moved to a small distance from the camera.
    pub camera: Camera,
    /// Distance of the far plane (world units); infinite is allowed.
    pub far: f32,
    /// The AO radius.
    pub params: AoParams,
    /// The methods left and right of the slider.
    pub methods: [Method; 2],
    /// Place of the slider in picture widths, in [0, 1]. At 1 only the first method is shown, at 0 only the second.
    pub split: f32,
    /// What is drawn.
    pub show: Show,
    /// Rays per pixel that a frame adds to a visible reference. The reference starts over when camera, radius, size or
    /// scene change.
    pub samples: u32,
    /// Whether to trace the reference even if it is not visible.
    pub traced: bool,
}

impl FrameParams {
    /// The default network's visibility in the lit scene.
    pub fn new(camera: Camera, params: AoParams) -> Self {
        Self {
            camera,
            far: f32::INFINITY,
            params,
            methods: [Method::default(); 2],
            split: 1.0,
            show: Show::default(),
            // guess: takes about as long as the network on a card without ray tracing units.
            samples: 2,
            traced: false,
        }
    }

    /// Whether the frame needs the reference.
    pub fn traces(&self) -> bool {
        self.seen().contains(&Method::Reference)
    }

    /// Returns the frame after a check of its numbers.
    pub(super) fn checked(self, size: Size) -> Result<Self> {
        let wrong = |what: &str, expected: String, found: String| Err(Error::request(what, expected, found));
        let found = self.camera.size();
        if found != size {
            return wrong("camera of a frame", size.to_string(), found.to_string());
        }
        if !(self.far > self.camera.near()) {
            let expected = format!("a distance above near = {}", self.camera.near());
            return wrong("far plane of a frame", expected, self.far.to_string());
        }
        if !(0.0..=1.0).contains(&self.split) {
            return wrong("slider of a frame", "a place in [0, 1]".into(), self.split.to_string());
        }
        Ok(self)
    }

    /// The methods that run, without repetition.
    pub(super) fn seen(&self) -> Vec<Method> {
        let [first, second] = self.methods;
        let mut seen = Vec::new();
        let wanted = [(first, self.split > 0.0), (second, self.split < 1.0)];
        let reference = (Method::Reference, self.show == Show::Error || self.traced);
        for (method, is_seen) in wanted.into_iter().chain([reference]) {
            if is_seen && (self.show != Show::Normals || self.traced) && !seen.contains(&method) {
                seen.push(method);
            }
        }
        seen
    }
}

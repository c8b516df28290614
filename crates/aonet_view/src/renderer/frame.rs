//! Parameters of a frame.

use super::method::Method;
use crate::{Error, Result};
use aonet::{AoParams, Camera, Window};
use aonet_scene::view::{DEFAULT_SEPARATION, MAX_SEPARATION};
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
    /// View-space shading normals of the second layer as n/2 + 1/2; black where there is none.
    Second,
    /// Shares of light that connected arcs find, as [`aonet::search::Share::colour`] colours them: what a frame shows and what it
    /// hides.
    Shares,
    /// The method's bent normals as n/2 + 1/2; the normals where a method has none.
    Bent,
}

impl Show {
    /// All pictures.
    pub const ALL: [Self; 7] =
        [Self::Shaded, Self::Visibility, Self::Normals, Self::Error, Self::Second, Self::Shares, Self::Bent];

    /// Its name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shaded => "shaded",
            Self::Visibility => "ao",
            Self::Normals => "normals",
            Self::Error => "error",
            Self::Second => "second",
            Self::Shares => "shares",
            Self::Bent => "bent",
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
    /// The camera of the picture, of the renderer's size. A near plane at 0 is moved to a small distance from the camera.
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
    /// Whether ambient light comes from about the bent normal, where the method has one, instead of the normal.
    pub bent_normals: bool,
    /// Least distance of a second layer behind the first, as a share of the AO radius. Without one a second layer is drawn
    /// only for [`Show::Second`], with the default separation.
    pub separation: Option<f32>,
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
            bent_normals: false,
            separation: None,
            // guess: takes about as long as the network on a card without ray tracing units.
            samples: 2,
            traced: false,
        }
    }

    /// Whether the frame needs the reference.
    pub fn traces(&self) -> bool {
        self.seen().contains(&Method::Reference)
    }

    /// Whether the picture needs bent normals.
    pub(super) fn shows_bent_normals(&self) -> bool {
        self.show == Show::Bent || (self.show == Show::Shaded && self.bent_normals)
    }

    /// Returns the frame of a window after a check of its numbers.
    ///
    /// # Errors
    /// When a number is out of range or the camera is of another size.
    pub(super) fn checked(self, window: Window) -> Result<CheckedFrame> {
        let size = window.size();
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
        let separation = match self.show {
            Show::Second => Some(self.separation.unwrap_or(DEFAULT_SEPARATION)),
            _ => self.separation,
        };
        if let Some(share) = separation.filter(|share| !(0.0..=MAX_SEPARATION).contains(share)) {
            let expected = format!("a share of the radius in [0, {MAX_SEPARATION}]");
            return wrong("separation of a frame", expected, share.to_string());
        }
        Ok(CheckedFrame {
            params: self,
            buffer_camera: self.camera.with_margin(window.margin())?,
            separation_units: separation.map(|share| share * self.params.radius()),
        })
    }

    /// The methods that run, without repetition.
    pub(super) fn seen(&self) -> Vec<Method> {
        let [first, second] = self.methods;
        let mut seen = Vec::new();
        let wanted = [(first, self.split > 0.0), (second, self.split < 1.0)];
        let reference = (Method::Reference, self.show == Show::Error || self.traced);
        let shows_methods = matches!(self.show, Show::Shaded | Show::Visibility | Show::Error | Show::Bent);
        for (method, is_seen) in wanted.into_iter().chain([reference]) {
            if is_seen && (shows_methods || self.traced) && !seen.contains(&method) {
                seen.push(method);
            }
        }
        seen
    }
}

/// A frame whose numbers were checked, and what follows from them.
#[derive(Debug, Clone, Copy)]
pub(super) struct CheckedFrame {
    pub(super) params: FrameParams,
    /// The camera of the picture and its guard band.
    pub(super) buffer_camera: Camera,
    /// Least distance of the second layer behind the first (world units); none if no second layer is drawn.
    pub(super) separation_units: Option<f32>,
}

//! The camera of a frame: from the caller's hints, else from the file.

use super::{Frame, FrameHints};
use crate::exr_file::ExrFile;
use aonet::{Camera, Error, Projection, Result, Size};
use aonet_scene::View;
use glam::{Affine3A, Mat4};
use serde::{Deserialize, Serialize};

const VIEW: &str = "aonet:view";
const CAMERA: &str = "aonet:camera";
pub(super) const RADIUS: &str = "aonet:radius";
/// Where Blender stores the note of a render. Our script for Blender writes `aonet:camera`, a space and the camera into it.
const NOTE: &str = "Note";

/// The camera of a frame, as far as it is known.
pub(super) struct Seen {
    pub(super) camera: Camera,
    /// Whether the camera's position in the world is known, not only its projection.
    pub(super) has_pose: bool,
    pub(super) view: Option<View>,
    pub(super) radius: Option<f32>,
}

/// A camera without a view.
#[derive(Serialize, Deserialize)]
struct StoredCamera {
    view_from_world: [f32; 12],
    fov_y: Option<f32>,
    ortho_height: Option<f32>,
    near: f32,
    /// Exact numbers of the projection; older files have none and are centred.
    #[serde(default)]
    focal_px: Option<[f32; 2]>,
    #[serde(default)]
    centre_px: Option<[f32; 2]>,
    /// AO radius (world units), in notes only: frames have an attribute for it.
    #[serde(default, skip_serializing)]
    radius: Option<f32>,
}

/// The camera in an attribute of its own, else in a note.
fn stored_camera(file: &ExrFile) -> Result<Option<StoredCamera>> {
    let note = || Some(file.text(NOTE)?.strip_prefix(CAMERA)?.to_owned());
    file.text(CAMERA).or_else(note).map(|text| parse(CAMERA, &text)).transpose()
}

/// The text attribute that holds the camera of `frame`.
pub(super) fn attribute(frame: &Frame) -> Result<(&'static str, String)> {
    let camera = frame.gbuffer.without_margin();
    let camera = camera.camera();
    let (fov_y, ortho_height) = match camera.projection() {
        Projection::Perspective { fov_y } => (Some(fov_y), None),
        Projection::Orthographic { height } => (None, Some(height)),
    };
    let view_from_world = camera.view_from_world().to_cols_array();
    let stored = StoredCamera {
        view_from_world,
        fov_y,
        ortho_height,
        near: camera.near(),
        focal_px: Some(camera.focal_px()),
        centre_px: Some(camera.centre_px()),
        radius: None,
    };
    let (name, text) = match &frame.view {
        Some(view) => (VIEW, serde_json::to_string(view)),
        None => (CAMERA, serde_json::to_string(&stored)),
    };
    Ok((name, text.map_err(|e| Error::value("camera", "finite numbers", e))?))
}

/// # Errors
/// When neither the hints nor the file say what the camera was, or the camera is invalid.
pub(super) fn resolve(file: &ExrFile, hints: &FrameHints) -> Result<Seen> {
    let stored_view = match file.text(VIEW) {
        Some(text) if hints.view.is_none() => Some(parse::<View>(VIEW, &text)?),
        _ => None,
    };
    if let Some(degrees) = hints.fov_y_deg.filter(|degrees| !(*degrees > 0.0 && *degrees < 180.0)) {
        return Err(Error::value("vertical field of view", "degrees in (0, 180)", degrees));
    }
    let stored = stored_camera(file)?;
    let noted =
        stored_view.as_ref().map(|view| view.radius).or(stored.as_ref().and_then(|camera| camera.radius));
    let file_radius = file.number(RADIUS).or(noted);
    let radius = hints.radius.or(hints.view.as_ref().map(|view| view.radius)).or(file_radius);
    let Some(mut view) = hints.view.clone().or(stored_view) else {
        let (camera, has_pose) = without_view(stored, file.size(), hints)?;
        return Ok(Seen { camera, has_pose, view: None, radius });
    };
    view.fov_y_deg = hints.fov_y_deg.unwrap_or(view.fov_y_deg);
    view.radius = radius.unwrap_or(view.radius);
    let size = file.size();
    if (view.width, view.height) != (size.width(), size.height()) {
        let expected = format!("{}x{} as its view says", view.width, view.height);
        return Err(Error::size("image", expected, size.to_string()));
    }
    Ok(Seen { camera: view.camera()?, has_pose: true, view: Some(view), radius })
}

/// The camera of a file without a view, and whether its position is known.
fn without_view(stored: Option<StoredCamera>, size: Size, hints: &FrameHints) -> Result<(Camera, bool)> {
    let hinted = hints.fov_y_deg.map(|degrees| Projection::Perspective { fov_y: degrees.to_radians() });
    let Some(stored) = stored else {
        let expected = "a view or a vertical field of view, because the file has none";
        let projection = hinted.ok_or_else(|| Error::value("camera", expected, "none"))?;
        return Ok((Camera::new(projection, size)?, false));
    };
    let projection = match (stored.fov_y, stored.ortho_height) {
        (Some(fov_y), None) => Projection::Perspective { fov_y },
        (None, Some(height)) => Projection::Orthographic { height },
        (fov_y, ortho) => {
            let found = format!("{fov_y:?} and {ortho:?}");
            return Err(Error::format(CAMERA, "either fov_y or ortho_height", found));
        }
    };
    let mut camera = Camera::new(hinted.unwrap_or(projection), size)?.with_near(stored.near)?;
    if hinted.is_none() {
        camera = camera.with_focal_px(stored.focal_px.unwrap_or(camera.focal_px()))?;
    }
    camera = camera.with_centre_px(stored.centre_px.unwrap_or(camera.centre_px()))?;
    let m = Affine3A::from_cols_array(&stored.view_from_world);
    let camera = camera.with_view_from_world(Mat4::from(m).to_cols_array_2d())?;
    Ok((camera, true))
}

fn parse<'a, T: Deserialize<'a>>(name: &str, text: &'a str) -> Result<T> {
    serde_json::from_str(text).map_err(|e| Error::format(format!("attribute {name}"), "JSON of a camera", e))
}

//! Pinhole and orthographic cameras.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::frame::window::Margin;
use glam::{Affine3A, Mat3A, Mat4, Vec3, Vec3A};

/// How much of the world a centred camera sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Vertical field of view (rad), in (0, pi).
        fov_y: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the image plane (world units), > 0.
        height: f32,
    },
}

/// Which depths a clip-space matrix maps to the near and the far plane. Either plane may be the nearer one
/// (reversed depth is recognised), and the far one may be at infinity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClipDepth {
    /// Depths in [0, 1]: Direct3D, Metal, Vulkan, WebGPU.
    ZeroToOne,
    /// Depths in [-1, 1]: OpenGL, WebGL.
    MinusOneToOne,
}

/// A camera: how it projects, where it stands, how many pixels it has. Checked when it is made.
///
/// View space is right-handed: +X right, +Y up, and the camera looks along -Z, as in glTF and Bevy. A camera is
/// described by how many pixels a unit of length takes up ([`Camera::focal_px`]) and by the pixel that its axis meets
/// ([`Camera::centre_px`]). So a camera may be off-centre: an eye of a headset, a jittered frame, a tile of a large
/// picture, a frame with a guard band.
///
/// # From an engine's matrices
///
/// [`Camera::from_clip_from_view`] takes the projection matrix, column-major, for column vectors:
/// `clip = clip_from_view * view`. A matrix that multiplies row vectors is the transpose of it; stored row by row, it
/// has the same sixteen numbers in the same order. [`Camera::with_view_from_world`] takes the inverse of the camera's
/// transform in the same convention. The size is that of the depth buffer, the guard band included: an engine that
/// renders more than it shows ("overscan") uses a matrix for all of it, and that is the matrix to give.
///
/// | program | projection matrix | view space | depth |
/// |---|---|---|---|
/// | Bevy | `ExtractedView::clip_from_view`, column-major | looks along -Z | [0, 1], reversed, far plane at infinity |
/// | three.js | `camera.projectionMatrix.elements`, column-major | looks along -Z | WebGL [-1, 1], WebGPU [0, 1]; reversed with `reversedDepthBuffer` |
/// | Godot 4 | `Projection`, an array of columns | looks along -Z | see the note on depth |
/// | Unity | `Camera.projectionMatrix`, column-major | looks along -Z | [-1, 1] in that matrix, whatever the device uses |
/// | Unreal | row vectors | looks along +Z, y up | [0, 1], reversed, far plane at infinity |
/// | Blender | `Object.calc_matrix_camera`; its `Matrix` lists rows, so transpose the nested list | looks along -Z | [-1, 1] |
///
/// * **Left-handed view spaces** (Unreal): negate the third column of `clip_from_view`, and the third row of
///   `view_from_world`. What was mirrored in the world, too, must be mirrored back: [`Camera::with_view_from_world`]
///   refuses transforms that mirror.
/// * **Depth** of the matrix ([`ClipDepth`]) matters for the near plane only, and through it for sessions that read a
///   depth buffer of a graphics processor ([`DepthEncoding`](crate::gpu::DepthEncoding)). An engine may turn the matrix
///   into its device's range just before it draws; what counts is the matrix that you pass. If in doubt, set the near
///   plane with [`Camera::with_near`].
/// * **Jitter** of temporal anti-aliasing moves the centre by less than a pixel. Give the matrix that the depth buffer
///   was drawn with.
///
/// ```
/// use aonet::frame::ClipDepth;
/// use aonet::{Camera, Size};
///
/// // 90 degrees upwards, 16:9, reversed depth with the far plane at infinity, near plane at 0.1.
/// let clip_from_view =
///     [[0.5625, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.1, 0.0]];
/// let size = Size::new(1280, 720)?;
/// let camera = Camera::from_clip_from_view(clip_from_view, ClipDepth::ZeroToOne, size)?;
/// assert_eq!((camera.focal_px(), camera.centre_px()), ([360.0, 360.0], [640.0, 360.0]));
/// let camera = camera.looking_at([0.0, 1.7, 5.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0])?;
/// # Ok::<(), aonet::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    size: Size,
    is_perspective: bool,
    focal_px: [f32; 2],
    centre_px: [f32; 2],
    near: f32,
    view_from_world: Affine3A,
}

impl Camera {
    /// A camera with square pixels and its axis in the middle of the picture. It stands in the origin of the world
    /// and looks along -Z; its near plane is at 0.
    ///
    /// # Errors
    /// When the field of view or the height is out of range.
    pub fn new(projection: Projection, size: Size) -> Result<Self> {
        let height_px = size.height() as f32;
        let (is_perspective, focal) = match projection {
            Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < std::f32::consts::PI) => {
                return Err(Error::value("camera fov_y (rad)", "an angle in (0, pi)", fov_y));
            }
            Projection::Orthographic { height } if !(height > 0.0 && height.is_finite()) => {
                return Err(Error::value("camera orthographic height", "a finite length > 0", height));
            }
            Projection::Perspective { fov_y } => (true, 0.5 * height_px / (0.5 * fov_y).tan()),
            Projection::Orthographic { height } => (false, height_px / height),
        };
        let centre_px = [0.5 * size.width() as f32, 0.5 * height_px];
        let view_from_world = Affine3A::IDENTITY;
        let focal_px = [focal; 2];
        Self { size, is_perspective, focal_px, centre_px, near: 0.0, view_from_world }.checked()
    }

    /// A pinhole camera with a vertical field of view (rad), otherwise as [`Camera::new`].
    ///
    /// # Errors
    /// When the field of view is not in (0, pi).
    pub fn perspective(fov_y: f32, size: Size) -> Result<Self> {
        Self::new(Projection::Perspective { fov_y }, size)
    }

    /// An orthographic camera whose image plane has the given height (world units), otherwise as [`Camera::new`].
    ///
    /// # Errors
    /// When the height is not finite or not above zero.
    pub fn orthographic(height: f32, size: Size) -> Result<Self> {
        Self::new(Projection::Orthographic { height }, size)
    }

    /// The camera of a projection matrix.
    ///
    /// `clip_from_view` is column-major and multiplies column vectors: `clip_from_view[c][r]` is column `c`, row `r`.
    /// View space is right-handed and looks along -Z; for a view space that looks along +Z (Direct3D, Unreal), negate
    /// the third column first. X and Y of clip space lie in [-1, 1], x to the right, y up; a matrix for clip space
    /// with y down (Vulkan) has a negative `[1][1]` and is recognised by it. Off-centre projections are accepted.
    ///
    /// # Errors
    /// When the matrix is not a perspective or orthographic projection, or its near plane is behind the camera.
    pub fn from_clip_from_view(clip_from_view: [[f32; 4]; 4], depth: ClipDepth, size: Size) -> Result<Self> {
        let m = clip_from_view;
        let wrong = |expected: &str| Err(Error::value("camera clip_from_view", expected, format!("{m:?}")));
        let zero = |entries: &[(usize, usize)]| entries.iter().all(|&(c, r)| m[c][r] == 0.0);
        let is_perspective = match [m[2][3], m[3][3]] {
            [-1.0, 0.0] => true,
            [0.0, 1.0] => false,
            [1.0, 0.0] => return wrong("a view space that looks along -Z: negate the third column"),
            _ => return wrong("a last row of (0, 0, -1, 0) or (0, 0, 0, 1)"),
        };
        let shears: &[(usize, usize)] = if is_perspective { &[(3, 0), (3, 1)] } else { &[(2, 0), (2, 1)] };
        if !zero(&[(0, 1), (0, 2), (0, 3), (1, 0), (1, 2), (1, 3)]) || !zero(shears) {
            return wrong("a projection without rotation, shear or translation of the eye");
        }
        let up = if m[1][1] < 0.0 { -1.0 } else { 1.0 };
        let half = [0.5 * size.width() as f32, 0.5 * size.height() as f32];
        let axis = if is_perspective { [-m[2][0], -m[2][1]] } else { [m[3][0], m[3][1]] };
        let camera = Self {
            size,
            is_perspective,
            focal_px: [half[0] * m[0][0], half[1] * m[1][1] * up],
            centre_px: [half[0] * (1.0 + axis[0]), half[1] * (1.0 - axis[1] * up)],
            near: 0.0,
            view_from_world: Affine3A::IDENTITY,
        };
        camera.with_near(near_of(m, is_perspective, depth))
    }

    /// The same camera with its near plane at a distance along -Z (world units); nothing nearer is seen.
    ///
    /// # Errors
    /// When the distance is not finite or below 0.
    pub fn with_near(self, near: f32) -> Result<Self> {
        Self { near, ..self }.checked()
    }

    /// The same camera with other numbers of pixels for a unit of length, along x and y: at distance 1 with
    /// perspective, anywhere without.
    ///
    /// # Errors
    /// When a number is not finite or not above zero.
    pub fn with_focal_px(self, focal_px: [f32; 2]) -> Result<Self> {
        Self { focal_px, ..self }.checked()
    }

    /// The same camera with its axis through another place of the picture (px from its upper left corner); the
    /// place may lie outside.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn with_centre_px(self, centre_px: [f32; 2]) -> Result<Self> {
        Self { centre_px, ..self }.checked()
    }

    /// The same camera with a rigid transform from world to view space: column-major, for column vectors.
    ///
    /// # Errors
    /// When the transform is not rigid: a rotation and a translation, without mirroring.
    pub fn with_view_from_world(self, view_from_world: [[f32; 4]; 4]) -> Result<Self> {
        let m = Mat4::from_cols_array_2d(&view_from_world);
        if m.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(Error::value("camera view_from_world", "a last row of (0, 0, 0, 1)", m));
        }
        Self { view_from_world: Affine3A::from_mat4(m), ..self }.checked()
    }

    /// The same camera at `eye`, with `target` on its axis; all in world space.
    ///
    /// # Errors
    /// When a value is not finite, `eye` equals `target`, or `up` is parallel to the view.
    pub fn looking_at(
        self,
        eye: impl Into<[f32; 3]>,
        target: impl Into<[f32; 3]>,
        up: impl Into<[f32; 3]>,
    ) -> Result<Self> {
        let [eye, target, up] = [eye.into(), target.into(), up.into()].map(Vec3::from_array);
        let forward = (target - eye).normalize_or_zero();
        let right = forward.cross(up).normalize_or_zero();
        if !(eye.is_finite() && forward.is_finite() && right.is_finite()) || right == Vec3::ZERO {
            return Err(Error::value(
                "camera",
                "finite eye, target and up, eye != target, up not parallel to the view",
                format!("eye {eye}, target {target}, up {up}"),
            ));
        }
        let true_up = right.cross(forward);
        let world_from_view = Mat3A::from_cols(right.into(), true_up.into(), (-forward).into());
        let rotation = world_from_view.transpose();
        let view_from_world = Affine3A { matrix3: rotation, translation: -(rotation * Vec3A::from(eye)) };
        Self { view_from_world, ..self }.checked()
    }

    /// The camera of a part of the picture: of `size`, with its upper left corner at column `left` and row `top` of
    /// this picture (px). The part may reach beyond the picture.
    ///
    /// # Errors
    /// When a centre would not be a number.
    pub fn tile(self, left: isize, top: isize, size: Size) -> Result<Self> {
        let [x, y] = self.centre_px;
        Self { size, centre_px: [x - left as f32, y - top as f32], ..self }.checked()
    }

    /// The camera of the picture and a guard band around it.
    ///
    /// # Errors
    /// When the buffer would be larger than [`MAX_SIDE`](crate::frame::size::MAX_SIDE).
    pub fn with_margin(self, margin: Margin) -> Result<Self> {
        let window = crate::frame::window::Window::new(self.size, margin)?;
        self.tile(-(margin.x as isize), -(margin.y as isize), window.buffer_size())
    }

    fn checked(self) -> Result<Self> {
        let m = self.view_from_world.matrix3;
        let gram = m * m.transpose();
        let rigid = (gram - Mat3A::IDENTITY).to_cols_array().iter().all(|d| d.abs() < 1e-3);
        if !rigid || m.determinant() < 0.0 || !self.view_from_world.is_finite() {
            return Err(Error::value("camera view_from_world", "a rigid transform", self.view_from_world));
        }
        if !(self.near.is_finite() && self.near >= 0.0) {
            return Err(Error::value("camera near", "a finite distance >= 0", self.near));
        }
        if !self.focal_px.iter().all(|f| f.is_finite() && *f > 0.0) {
            let found = format!("{:?}", self.focal_px);
            return Err(Error::value("camera focal_px", "finite numbers > 0", found));
        }
        if !self.centre_px.iter().all(|c| c.is_finite()) {
            return Err(Error::value("camera centre_px", "finite numbers", format!("{:?}", self.centre_px)));
        }
        Ok(self)
    }

    /// Size of the picture (px).
    pub fn size(&self) -> Size {
        self.size
    }

    /// Width of the picture (px).
    pub fn width(&self) -> usize {
        self.size.width()
    }

    /// Height of the picture (px).
    pub fn height(&self) -> usize {
        self.size.height()
    }

    /// Whether rays meet in a point; else they are parallel.
    pub fn is_perspective(&self) -> bool {
        self.is_perspective
    }

    /// What a centred camera of the same height and vertical scale sees.
    pub fn projection(&self) -> Projection {
        let height_px = self.height() as f32;
        match self.is_perspective {
            true => Projection::Perspective { fov_y: 2.0 * (0.5 * height_px / self.focal_px[1]).atan() },
            false => Projection::Orthographic { height: height_px / self.focal_px[1] },
        }
    }

    /// Pixels for a unit of length along x and y: at distance 1 with perspective, anywhere without.
    pub fn focal_px(&self) -> [f32; 2] {
        self.focal_px
    }

    /// The place that the camera's axis meets (px from the picture's upper left corner): x to the right, y down.
    pub fn centre_px(&self) -> [f32; 2] {
        self.centre_px
    }

    /// Distance of the near plane along -Z (world units), >= 0.
    pub fn near(&self) -> f32 {
        self.near
    }

    /// Rigid transform from world to view space.
    pub fn view_from_world(&self) -> Affine3A {
        self.view_from_world
    }

    /// Length in pixels, along y, of a `length` (world units) seen at `depth` (world units along -Z).
    pub fn projected_px(&self, length: f32, depth: f32) -> f32 {
        match self.is_perspective {
            true => length * self.focal_px[1] / depth,
            false => length * self.focal_px[1],
        }
    }

    /// View-space position of the centre of pixel (`x`, `y`) at `depth` along -Z. Row 0 is the top.
    pub fn position_view(&self, x: usize, y: usize, depth: f32) -> Vec3A {
        let px = (x as f32 + 0.5 - self.centre_px[0]) / self.focal_px[0];
        let py = (self.centre_px[1] - (y as f32 + 0.5)) / self.focal_px[1];
        match self.is_perspective {
            true => Vec3A::new(px * depth, py * depth, -depth),
            false => Vec3A::new(px, py, -depth),
        }
    }

    /// View-space direction from the surface at `position_view` towards the viewer, unit length.
    pub fn to_viewer(&self, position_view: Vec3A) -> Vec3A {
        match self.is_perspective {
            true => (-position_view).normalize_or_zero(),
            false => Vec3A::Z,
        }
    }
}

/// Distance of the nearer plane that a projection matrix maps to an end of its depth range.
fn near_of(m: [[f32; 4]; 4], is_perspective: bool, depth: ClipDepth) -> f32 {
    let ends = match depth {
        ClipDepth::ZeroToOne => [0.0, 1.0],
        ClipDepth::MinusOneToOne => [-1.0, 1.0],
    };
    let (slope, offset) = (f64::from(m[2][2]), f64::from(m[3][2]));
    // Where (offset - slope * distance) / w is the end.
    let plane = |end: f64| match is_perspective {
        true => Some(offset / (slope + end)).filter(|d| *d > 0.0 && d.is_finite()).unwrap_or(f64::INFINITY),
        false => (offset - end) / slope,
    };
    let [a, b] = ends.map(plane);
    a.min(b) as f32
}

#[cfg(test)]
mod tests;

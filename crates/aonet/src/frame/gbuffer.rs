//! What screen space knows: depth and normal of every pixel, and the camera that saw them.

use crate::error::Result;
use crate::frame::camera::Camera;
use crate::frame::check::{self, Facing};
use crate::frame::size::Size;
use crate::frame::window::{Margin, Window};
use std::borrow::Cow;

/// Depth and normals of one frame. Checked once, at construction; the pixels are borrowed where they can be used as
/// they are, else copied.
#[derive(Debug, Clone, PartialEq)]
pub struct GBuffer<'a> {
    camera: Camera,
    window: Window,
    depth: Cow<'a, [f32]>,
    normal: Cow<'a, [[f32; 3]]>,
    second: Option<SecondLayer<'a>>,
}

/// What lies behind the surfaces that a frame shows: HxW, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondLayer<'a> {
    /// Distance along -Z (world units), not in front of the first layer; infinite where there is nothing.
    pub depth: Cow<'a, [f32]>,
    /// View-space normals, of unit length; ignored where there is nothing.
    pub normal: Option<Cow<'a, [[f32; 3]]>>,
}

impl<'a> GBuffer<'a> {
    /// A frame from HxW `depth` (distance along -Z (world units), > 0, infinite on the background) and
    /// HxW view-space `normal` (unit length; ignored and taken as zero on the background).
    ///
    /// Vectors are taken over. Slices are borrowed, unless a background normal is not zero or the length of a normal
    /// differs from 1 by more than rounding: then the normals are copied. Use
    /// [`FrameMemory`](crate::frame::layer::FrameMemory) to read such frames without allocating.
    ///
    /// Interpolated shading normals may look away from the viewer near silhouettes, so single pixels with
    /// dot(n, p) >= 0 are kept; a buffer in which many do is refused as not being in view space.
    ///
    /// # Errors
    /// When a length is wrong, a depth is NaN or not above zero, a normal is not finite or not of
    /// unit length, or most of the normals cannot be in view space.
    pub fn new(
        camera: Camera,
        depth: impl Into<Cow<'a, [f32]>>,
        normal: impl Into<Cow<'a, [[f32; 3]]>>,
    ) -> Result<Self> {
        let (depth, mut normal) = (depth.into(), normal.into());
        let is_tidy = check::layer("", &camera, (&depth, &normal), Facing::Viewer)?;
        if !is_tidy || matches!(normal, Cow::Owned(_)) {
            check::tidy(&depth, normal.to_mut());
        }
        Ok(Self::of_checked(camera, depth, normal))
    }

    /// A frame whose pixels were checked.
    pub(super) fn of_checked(camera: Camera, depth: Cow<'a, [f32]>, normal: Cow<'a, [[f32; 3]]>) -> Self {
        Self { camera, window: camera.size().into(), depth, normal, second: None }
    }

    /// The same frame whose outer pixels are a guard band: methods read them, results do not contain them.
    ///
    /// # Errors
    /// When the margin leaves no picture.
    pub fn with_margin(self, margin: Margin) -> Result<Self> {
        Ok(Self { window: Window::inside(self.size(), margin)?, ..self })
    }

    /// The same frame with a second layer.
    ///
    /// # Errors
    /// When the layer has another size, is in front of the first one somewhere, or its normals are not of unit length.
    pub fn with_second(self, mut second: SecondLayer<'a>) -> Result<Self> {
        check::behind(self.size(), &self.depth, &second.depth)?;
        if let Some(normal) = &mut second.normal {
            let is_tidy = check::layer("second ", &self.camera, (&second.depth, normal), Facing::Any)?;
            if !is_tidy {
                check::tidy(&second.depth, normal.to_mut());
            }
        }
        Ok(Self { second: Some(second), ..self })
    }

    /// The same frame without its second layer.
    pub fn without_second(self) -> Self {
        Self { second: None, ..self }
    }

    /// The picture without its guard band; without one nothing is copied.
    pub fn without_margin(&self) -> GBuffer<'_> {
        let (window, margin) = (self.window, self.window.margin());
        let [x, y] = [margin.x, margin.y].map(|m| m as isize);
        let camera = self.camera.tile(x, y, window.size()).expect("the camera of a part of a checked buffer");
        let second = self.second.as_ref().map(|second| SecondLayer {
            depth: picture(window, &second.depth),
            normal: second.normal.as_deref().map(|normal| picture(window, normal)),
        });
        let frame = GBuffer::of_checked(camera, picture(window, &self.depth), picture(window, &self.normal));
        GBuffer { second, ..frame }
    }

    /// The same frame with pixels of its own.
    pub fn into_owned(self) -> GBuffer<'static> {
        let second = self.second.map(|s| SecondLayer {
            depth: Cow::Owned(s.depth.into_owned()),
            normal: s.normal.map(|normal| Cow::Owned(normal.into_owned())),
        });
        let (depth, normal) = (Cow::Owned(self.depth.into_owned()), Cow::Owned(self.normal.into_owned()));
        GBuffer { camera: self.camera, window: self.window, depth, normal, second }
    }

    /// The camera that saw the frame, its guard band included.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Which part of the frame is the picture, and which its guard band.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Size (px), the guard band included.
    pub fn size(&self) -> Size {
        self.camera.size()
    }

    /// Width (px), the guard band included.
    pub fn width(&self) -> usize {
        self.camera.width()
    }

    /// Height (px), the guard band included.
    pub fn height(&self) -> usize {
        self.camera.height()
    }

    /// HxW distances along -Z (world units), row by row from the top; infinite on the background.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// HxW view-space normals, row by row from the top; zero on the background.
    pub fn normal(&self) -> &[[f32; 3]] {
        &self.normal
    }

    /// The second layer, if the frame has one. [`Classic::Arcs`](crate::search::Classic::Arcs),
    /// [`Classic::Vbao`](crate::search::Classic::Vbao) and the networks `balanced` and `high` read it.
    pub fn second(&self) -> Option<&SecondLayer<'a>> {
        self.second.as_ref()
    }

    /// HxW of the picture: whether a pixel shows geometry.
    pub fn foreground(&self) -> Vec<bool> {
        self.window.cropped(self.depth.iter().map(|d| *d != f32::INFINITY).collect())
    }

    /// Whether pixel `i` (row-major, the guard band included) shows geometry.
    pub fn is_foreground(&self, i: usize) -> bool {
        self.depth[i] != f32::INFINITY
    }
}

/// Pixels of the picture in a layer of the buffer; they are copied only if there is a guard band.
fn picture<T: Copy>(window: Window, layer: &[T]) -> Cow<'_, [T]> {
    match window.has_margin() {
        true => window.cropped(layer.to_vec()).into(),
        false => layer.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    fn camera() -> Camera {
        Camera::perspective(1.0, Size::px(2, 1)).unwrap()
    }

    #[test]
    fn background_normals_become_zero() {
        let g = GBuffer::new(camera(), vec![1.0, f32::INFINITY], vec![[0.0, 0.0, 1.0]; 2]).unwrap();
        assert_eq!(g.normal()[1], [0.0; 3]);
        assert!(g.is_foreground(0) && !g.is_foreground(1));
    }

    #[test]
    fn bad_buffers_are_refused_with_the_pixel() {
        let up = [0.0, 0.0, 1.0];
        let error = |d: [f32; 2], n: [[f32; 3]; 2]| {
            GBuffer::new(camera(), d.to_vec(), n.to_vec()).unwrap_err().to_string()
        };
        assert!(error([1.0, f32::NAN], [up, up]).contains("depth at (1, 0)"));
        assert!(error([0.0, 1.0], [up, up]).contains("depth at (0, 0)"));
        assert!(error([1.0, 1.0], [up, [0.0, 0.0, 2.0]]).contains("normal at (1, 0)"));
        assert!(error([1.0, 1.0], [up, [f32::NAN, 0.0, 1.0]]).contains("normal at (1, 0)"));
        assert!(error([1.0, 1.0], [[0.0, 0.0, -1.0]; 2]).contains("face away"));
        assert!(GBuffer::new(camera(), vec![1.0], vec![up; 2]).is_err());
    }

    #[test]
    fn tidy_slices_are_borrowed_and_others_copied() {
        let up = [0.0, 0.0, 1.0];
        let (depth, normal) = ([1.0, f32::INFINITY], [up, [0.0; 3]]);
        let g = GBuffer::new(camera(), &depth[..], &normal[..]).unwrap();
        assert!(matches!((&g.depth, &g.normal), (Cow::Borrowed(_), Cow::Borrowed(_))));
        for untidy in [[up, up], [[0.0, 0.0, 1.01], [0.0; 3]], [up, [f32::NAN; 3]]] {
            let copied = GBuffer::new(camera(), &depth[..], &untidy[..]).unwrap();
            assert!(matches!(copied.normal, Cow::Owned(_)));
            assert_eq!(copied, g);
        }
    }

    #[test]
    fn a_margin_must_leave_a_picture() {
        let camera = Camera::perspective(1.0, Size::px(4, 3)).unwrap();
        let up = [0.0, 0.0, 1.0];
        let depth: Vec<f32> = (1..13).map(|i| i as f32).collect();
        let g =
            GBuffer::new(camera, depth, vec![up; 12]).unwrap().with_margin(Margin { x: 1, y: 1 }).unwrap();
        let picture = g.without_margin();
        assert_eq!((picture.depth(), picture.size()), (&[6.0, 7.0][..], Size::px(2, 1)));
        assert_eq!(picture.camera().position_view(0, 0, 2.0), g.camera().position_view(1, 1, 2.0));
        for margin in [Margin { x: 2, y: 0 }, Margin { x: 0, y: 2 }, Margin { x: usize::MAX, y: 0 }] {
            let said = g.clone().with_margin(margin).unwrap_err().to_string();
            assert!(said.contains("margin") && said.contains("4x3"), "{said}");
        }
    }

    #[test]
    fn a_bad_pixel_in_the_guard_band_is_refused_like_one_of_the_picture() {
        let camera = Camera::perspective(1.0, Size::px(4, 3)).unwrap();
        let frame = |depth: f32, normal: [f32; 3]| {
            let (mut depths, mut normals) = (vec![1.0; 12], vec![[0.0, 0.0, 1.0]; 12]);
            (depths[3], normals[3]) = (depth, normal);
            GBuffer::new(camera, depths, normals)?.with_margin(Margin { x: 1, y: 1 })
        };
        let up = [0.0, 0.0, 1.0];
        assert!(frame(1.0, up).is_ok());
        for (depth, normal, what) in [(f32::NAN, up, "depth"), (1.0, [f32::NAN, 0.0, 1.0], "normal")] {
            let said = frame(depth, normal).unwrap_err().to_string();
            assert!(said.contains(&format!("{what} at (3, 0)")), "{said}");
        }
    }

    #[test]
    fn a_second_layer_is_behind_the_first() {
        let up = [0.0, 0.0, 1.0];
        let first = || GBuffer::new(camera(), vec![1.0, 2.0], vec![up; 2]).unwrap();
        let second = |depth: [f32; 2], normal: Option<[[f32; 3]; 2]>| {
            let normal = normal.map(|n| n.to_vec().into());
            first().with_second(SecondLayer { depth: depth.to_vec().into(), normal })
        };
        let away = [[0.0, 0.0, -1.0], [0.5; 3]];
        let found = second([1.0, f32::INFINITY], Some(away)).unwrap();
        assert_eq!(found.second().unwrap().normal.as_ref().unwrap()[1], [0.0; 3]);
        for (depth, what) in [([0.5, 3.0], "(0, 0)"), ([1.0, f32::NAN], "(1, 0)")] {
            assert!(second(depth, None).unwrap_err().to_string().contains(what));
        }
        assert!(second([1.0, 3.0], Some(away)).unwrap_err().to_string().contains("second normal at (1, 0)"));
        assert!(first().with_second(SecondLayer { depth: vec![3.0].into(), normal: None }).is_err());
    }
}

//! Enlarged parts of a view, chosen by a rule.

use aonet::{AoImage, GBuffer, metrics};
use image::{Rgb, RgbImage, imageops};

/// Side of a window, as a fraction of the frame's. guess: enlarged, its pixels are distinguishable in a panel.
const FRACTION: usize = 6;

/// Share of a window that must show geometry. Silhouettes against the sky have the largest variance and no AO.
const FOREGROUND: f64 = 0.95;

/// Steps in which windows are tried, as a fraction of their side.
const STEPS: usize = 8;

/// Colour of the outline of a window.
const OUTLINE: [u8; 3] = [230, 80, 0];

/// A rectangle of a frame (px).
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub(super) struct Window {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Window {
    /// Indices of its pixels in a frame with rows of `row` pixels.
    fn pixels(self, row: usize) -> impl Iterator<Item = usize> {
        (self.top..self.top + self.height)
            .flat_map(move |y| (self.left..self.left + self.width).map(move |x| y * row + x))
    }
}

/// The window, a sixth of the frame across and down, where the reference has the largest variance over the foreground;
/// the first of equals, row by row. Windows that are nearly all foreground take precedence.
pub(super) fn busiest(reference: &AoImage, gbuffer: &GBuffer) -> Window {
    let (frame_width, frame_height) = (reference.width(), reference.height());
    let (width, height) = ((frame_width / FRACTION).max(1), (frame_height / FRACTION).max(1));
    let starts = |frame: usize, side: usize| (0..=frame - side).step_by((side / STEPS).max(1));
    let mut best = (Window { left: 0, top: 0, width, height }, (false, -1.0));
    for top in starts(frame_height, height) {
        for left in starts(frame_width, width) {
            let window = Window { left, top, width, height };
            let rank = rank(window, reference, gbuffer);
            if rank > best.1 {
                best = (window, rank);
            }
        }
    }
    best.0
}

/// Whether a window is nearly all foreground, then the variance of its foreground.
fn rank(window: Window, reference: &AoImage, gbuffer: &GBuffer) -> (bool, f64) {
    let (mut count, mut sums) = (0.0, [0.0; 2]);
    for i in window.pixels(reference.width()).filter(|&i| gbuffer.is_foreground(i)) {
        let v = f64::from(reference.visibility()[i]);
        count += 1.0;
        sums = [sums[0] + v, sums[1] + v * v];
    }
    let variance = if count > 0.0 { sums[1] / count - (sums[0] / count).powi(2) } else { 0.0 };
    (count >= FOREGROUND * (window.width * window.height) as f64, variance)
}

/// The part of a picture in a window.
pub(super) fn cut(picture: &RgbImage, w: Window) -> RgbImage {
    imageops::crop_imm(picture, w.left as u32, w.top as u32, w.width as u32, w.height as u32).to_image()
}

/// The picture with the window's outline.
pub(super) fn outlined(mut picture: RgbImage, w: Window) -> RgbImage {
    let thick = (picture.width() / 240).max(1) as i64;
    let (left, top) = (w.left as i64, w.top as i64);
    let (right, bottom) = (left + w.width as i64, top + w.height as i64);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let (x, y) = (i64::from(x), i64::from(y));
        let near = (left - thick..right + thick).contains(&x) && (top - thick..bottom + thick).contains(&y);
        if near && !((left..right).contains(&x) && (top..bottom).contains(&y)) {
            *pixel = Rgb(OUTLINE);
        }
    }
    picture
}

/// PSNR inside a window (dB).
pub(super) fn psnr(reference: &AoImage, image: &AoImage, window: Window) -> f64 {
    let squared = |i: usize| f64::from(reference.visibility()[i] - image.visibility()[i]).powi(2);
    let sum: f64 = window.pixels(reference.width()).map(squared).sum();
    metrics::psnr(sum / (window.width * window.height) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Projection, Size};

    /// 60x60; the right half is sky.
    fn half_sky() -> GBuffer<'static> {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(projection, Size::px(60, 60)).unwrap();
        let depth = (0..3600).map(|i| if i % 60 < 30 { 1.0 } else { f32::INFINITY }).collect::<Vec<_>>();
        GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; 3600]).unwrap()
    }

    #[test]
    fn the_window_covers_the_edge_and_not_the_silhouette() {
        // Dark from row 37 on; the sky beside it is open.
        let value = |i: usize| if i % 60 < 30 && i / 60 >= 37 { 0.2 } else { 1.0 };
        let reference = AoImage::new(Size::px(60, 60), (0..3600).map(value).collect()).unwrap();
        let window = busiest(&reference, &half_sky());
        // Half of the ten rows are dark.
        assert_eq!(window, Window { left: 0, top: 32, width: 10, height: 10 });
        let mut image = AoImage::open(Size::px(60, 60));
        image.visibility_mut()[37 * 60..].iter_mut().for_each(|v| *v = 0.2);
        assert_eq!(psnr(&reference, &image, window), f64::INFINITY);
        image.visibility_mut()[33 * 60] = 0.0;
        assert!((psnr(&reference, &image, window) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn outlines_stay_outside_the_window() {
        let window = Window { left: 0, top: 3, width: 4, height: 2 };
        let picture = outlined(RgbImage::new(9, 9), window);
        assert!(cut(&picture, window).pixels().all(|p| p.0 == [0; 3]));
        let lit = picture.pixels().filter(|p| p.0 == OUTLINE).count();
        // Above, below and at the right; the left side is the picture's.
        assert_eq!(lit, 5 + 5 + 2);
    }
}

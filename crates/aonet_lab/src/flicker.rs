//! Temporal stability: how much a method's image changes along a camera path beyond the reference's change.

use aonet::{AoImage, Camera, GBuffer};
use aonet_scene::error::{Error, Result};
use glam::Vec3A;

/// Largest relative difference of depths at which two frames count as seeing the same point.
const SAME_DEPTH: f32 = 0.01;

/// Mean changes of visibility from frame to frame, of points that both frames see.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flicker {
    /// Mean of |change of the method - change of the reference|.
    pub excess: f64,
    /// Mean of |change of the method|.
    pub change: f64,
    /// Mean of |change of the reference|.
    pub reference_change: f64,
    /// Number of pairs of pixels.
    pub pairs: u64,
}

/// The flicker of `images` along the frames of a path; `references` are the ray-traced images of the same frames.
///
/// # Errors
/// When the numbers or sizes of the images differ, or no two frames share a point.
pub fn flicker(gbuffers: &[GBuffer], references: &[AoImage], images: &[AoImage]) -> Result<Flicker> {
    if references.len() != gbuffers.len() || images.len() != gbuffers.len() {
        let found = format!("{} references and {} images", references.len(), images.len());
        return Err(Error::request("flicker", format!("{} of each", gbuffers.len()), found));
    }
    let size = |g: &GBuffer| (g.width(), g.height());
    for (gbuffer, image) in gbuffers.iter().zip(references).chain(gbuffers.iter().zip(images)) {
        if size(gbuffer) != size(&gbuffers[0]) || (image.width(), image.height()) != size(gbuffer) {
            let found = format!("{}x{}", image.width(), image.height());
            return Err(
                aonet::Error::size("image of a path", format!("{:?}", size(&gbuffers[0])), found).into()
            );
        }
    }
    let mut sums = Flicker::default();
    for t in 1..gbuffers.len() {
        let changes = |images: &[AoImage], (i, j): (usize, usize)| {
            f64::from(images[t].visibility()[j] - images[t - 1].visibility()[i])
        };
        for pair in pairs(&gbuffers[t - 1], &gbuffers[t]) {
            let (method, reference) = (changes(images, pair), changes(references, pair));
            sums.excess += (method - reference).abs();
            sums.change += method.abs();
            sums.reference_change += reference.abs();
            sums.pairs += 1;
        }
    }
    match sums.pairs {
        0 => Err(Error::request("flicker", "two frames that see the same points", "none")),
        n => Ok(Flicker {
            excess: sums.excess / n as f64,
            change: sums.change / n as f64,
            reference_change: sums.reference_change / n as f64,
            pairs: n,
        }),
    }
}

/// Pixels of `from` and of `to` that see the same point.
fn pairs(from: &GBuffer, to: &GBuffer) -> impl Iterator<Item = (usize, usize)> {
    let to_from = to.camera().view_from_world() * from.camera().view_from_world().inverse();
    (0..from.width() * from.height()).filter_map(move |i| {
        if !from.is_foreground(i) {
            return None;
        }
        let (x, y) = (i % from.width(), i / from.width());
        let position = to_from.transform_point3a(from.camera().position_view(x, y, from.depth()[i]));
        let j = pixel(to.camera(), position)?;
        let same = (to.depth()[j] + position.z).abs() <= SAME_DEPTH * to.depth()[j];
        (same && to.is_foreground(j)).then_some((i, j))
    })
}

/// The pixel whose centre is nearest to a point's image.
fn pixel(camera: &Camera, position_view: Vec3A) -> Option<usize> {
    let ([cx, cy], [focal_x, focal_y]) = (camera.centre_px(), camera.focal_px());
    let px = camera.projected_px(1.0, -position_view.z);
    let x = (cx + position_view.x * px * (focal_x / focal_y)).floor();
    let y = (cy - position_view.y * px).floor();
    let inside = position_view.z < 0.0
        && (0.0..camera.width() as f32).contains(&x)
        && (0.0..camera.height() as f32).contains(&y);
    inside.then(|| y as usize * camera.width() + x as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::Size;

    const SIZE: Size = Size::px(32, 16);

    /// A wall three units away, seen by a camera that went to the right by so many pixels.
    fn wall(step_px: f32) -> GBuffer<'static> {
        let camera = Camera::perspective(1.0, SIZE).unwrap();
        let at = |x: f32| camera.looking_at([x, 0.0, 0.0], [x, 0.0, -1.0], [0.0, 1.0, 0.0]);
        let px = at(0.0).unwrap().projected_px(1.0, 3.0);
        GBuffer::new(at(step_px / px).unwrap(), vec![3.0; 512], vec![[0.0, 0.0, 1.0]; 512]).unwrap()
    }

    /// Stripes that are fixed to the wall, or to the screen.
    fn stripes(shift: usize) -> AoImage {
        AoImage::new(SIZE, (0..512).map(|i| if (i % 32 + shift) % 4 < 2 { 0.25 } else { 0.75 }).collect())
            .unwrap()
    }

    #[test]
    fn what_is_fixed_to_the_scene_does_not_flicker_and_what_is_fixed_to_the_screen_does() {
        let gbuffers = [wall(0.0), wall(1.0), wall(2.0)];
        let truth = [stripes(0), stripes(1), stripes(2)];
        let of = |images: &[AoImage]| flicker(&gbuffers, &truth, images).unwrap();
        let still = of(&truth);
        assert_eq!((still.excess, still.reference_change), (0.0, 0.0));
        assert_eq!(still.pairs, 2 * 31 * 16);
        // Every other pair of columns changes by one half.
        let screen = of(&[stripes(0), stripes(0), stripes(0)]);
        assert!((screen.excess - 0.25).abs() < 0.01, "{screen:?}");
    }

    #[test]
    fn paths_that_do_not_fit_are_refused() {
        let gbuffers = [wall(0.0), wall(1.0)];
        let images = [stripes(0), stripes(1)];
        assert!(flicker(&gbuffers, &images, &images[..1]).is_err());
        assert!(flicker(&gbuffers, &images, &[stripes(0), AoImage::open(Size::px(3, 3))]).is_err());
        assert!(flicker(&[wall(0.0), wall(1e4)], &images, &images).is_err());
    }
}

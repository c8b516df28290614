//! What methods are shown of frames with a guard band and a second layer: less than there is, to measure what each part adds.

use crate::dataset::Split;
use aonet::{CoarseDepth, GBuffer, Margin, SecondLayer, Size};
use aonet_scene::error::{Error, Result};

/// Frames to score methods on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    /// Their split.
    pub split: Split,
    /// Whether guard bands are shown.
    pub margin: bool,
    /// Whether second layers are shown.
    pub second: bool,
    /// Guard band and second layer are known at every so many pixels of every so many rows; 1: at all.
    pub scale: usize,
}

impl From<Split> for Seen {
    /// All of it.
    fn from(split: Split) -> Self {
        Self { split, margin: true, second: true, scale: 1 }
    }
}

/// Largest [`Seen::scale`].
pub const MAX_SCALE: usize = 16;

impl Seen {
    /// The part of a frame that is shown.
    ///
    /// # Errors
    /// When the scale is 0 or too large.
    pub(crate) fn part(self, gbuffer: GBuffer<'static>) -> Result<GBuffer<'static>> {
        if !(1..=MAX_SCALE).contains(&self.scale) {
            return Err(Error::request("scale of the surround", format!("1 to {MAX_SCALE}"), self.scale));
        }
        let gbuffer = if self.second { gbuffer } else { gbuffer.without_second() };
        let gbuffer = if self.margin { gbuffer } else { gbuffer.without_margin().into_owned() };
        if self.scale == 1 { Ok(gbuffer) } else { coarse(&gbuffer, self.scale) }
    }
}

/// The frame with the guard band's depth and normals, and the second layer's depth, from every `scale`-th pixel.
fn coarse(gbuffer: &GBuffer, scale: usize) -> Result<GBuffer<'static>> {
    let (size, window) = (gbuffer.size(), gbuffer.window());
    let Margin { x: left, y: top } = window.margin();
    let in_picture = |i: usize| {
        let (x, y) = (i % size.width(), i / size.width());
        (left..size.width() - left).contains(&x) && (top..size.height() - top).contains(&y)
    };
    let grid = Size::new(size.width().div_ceil(scale), size.height().div_ceil(scale))?;
    // The pixel of the frame that a column or row of the grid shows.
    let shown = |i: usize, side: usize| (i * scale + scale / 2).min(side - 1);
    let source = |x: usize, y: usize| shown(y, size.height()) * size.width() + shown(x, size.width());
    let upscaled = |depth: &[f32]| {
        let values = (0..grid.pixels()).map(|i| depth[source(i % grid.width(), i / grid.width())]);
        let values: Vec<_> = values.collect();
        CoarseDepth { depth: &values, size: grid, scale, first: (scale / 2) as f32 }.upscaled(size)
    };
    let mut depth = upscaled(gbuffer.depth());
    let mut normal: Vec<[f32; 3]> = (0..size.pixels())
        .map(|i| gbuffer.normal()[source(i % size.width() / scale, i / size.width() / scale)])
        .collect();
    for i in 0..size.pixels() {
        if in_picture(i) {
            (depth[i], normal[i]) = (gbuffer.depth()[i], gbuffer.normal()[i]);
        } else if normal[i] == [0.0; 3] {
            // Nothing is seen where the normal would come from.
            depth[i] = f32::INFINITY;
        }
    }
    let second = gbuffer.second().map(|second| {
        let behind = upscaled(&second.depth).into_iter().zip(&depth);
        // What is in front of the first layer is not behind it.
        let behind = behind.map(|(behind, first)| if behind >= *first { behind } else { f32::INFINITY });
        SecondLayer { depth: behind.collect(), normal: None }
    });
    let coarse = GBuffer::new(*gbuffer.camera(), depth, normal)?.with_margin(window.margin())?;
    Ok(match second {
        Some(second) => coarse.with_second(second)?,
        None => coarse,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::Camera;

    fn plane() -> GBuffer<'static> {
        let size = Size::new(40, 24).unwrap();
        let camera = Camera::perspective(1.0, size).unwrap();
        let depth = |i: usize| 2.0 + 0.01 * (i % 40) as f32;
        let first: Vec<_> = (0..size.pixels()).map(depth).collect();
        let behind = first.iter().map(|depth| depth + 1.0).collect::<Vec<_>>();
        let frame = GBuffer::new(camera, first, vec![[0.0, 0.0, 1.0]; size.pixels()]).unwrap();
        let second = SecondLayer { depth: behind.into(), normal: None };
        frame.with_margin(Margin { x: 4, y: 4 }).unwrap().with_second(second).unwrap()
    }

    #[test]
    fn parts_are_left_out_or_coarse() {
        let all = Seen::from(Split::Test);
        let none = Seen { margin: false, second: false, ..all }.part(plane()).unwrap();
        assert!(!none.window().has_margin() && none.second().is_none());
        let coarse = Seen { scale: 2, ..all }.part(plane()).unwrap();
        let second = |frame: &GBuffer| frame.second().unwrap().depth.to_vec();
        let picture = |frame: &GBuffer| frame.window().cropped(frame.depth().to_vec());
        assert_eq!(picture(&coarse), picture(&plane()));
        assert!(coarse.depth() != plane().depth() && second(&coarse) != second(&plane()));
        for (a, b) in
            coarse.depth().iter().zip(plane().depth()).chain(second(&coarse).iter().zip(&second(&plane())))
        {
            assert!((a - b).abs() < 0.03, "{a}, {b}");
        }
        assert_eq!(Seen { scale: 1, ..all }.part(plane()).unwrap(), plane());
        assert!(Seen { scale: 0, ..all }.part(plane()).unwrap_err().to_string().contains("surround"));
    }
}

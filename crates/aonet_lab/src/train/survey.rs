//! What the survey of a network finds in a training frame.

use super::samples::{Plane, Square, Symmetry};
use aonet::internals::features::survey_planes;
use aonet::internals::graph::SURVEYED;
use aonet::internals::naive::Planes;
use aonet::search::ArcsParams;
use aonet::{AoParams, GBuffer, Size};

/// What a survey finds in the picture of a frame.
pub(super) struct Survey {
    /// Side (px).
    patch: usize,
    /// Columns of whole patches.
    columns: usize,
    planes: Vec<Plane>,
}

/// The cells of a crop, value by value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CropSurvey {
    /// Side (px).
    pub(crate) patch: usize,
    pub(crate) values: Vec<f32>,
}

impl Survey {
    /// # Errors
    /// When a parameter is out of its range, or the picture is smaller than a patch.
    pub(super) fn new(
        arcs: &ArcsParams,
        (gbuffer, params): (&GBuffer, AoParams),
        patch: usize,
    ) -> aonet::Result<Self> {
        let (size, margin) = (gbuffer.window().size(), gbuffer.window().margin());
        let cells = Size::new(size.width() / patch, size.height() / patch)?;
        let found = survey_planes(arcs, gbuffer, params, [margin.x, margin.y], (cells, patch))?;
        let plane = |c: usize| {
            let lines = found.chunks_exact(cells.width()).skip(c).step_by(SURVEYED);
            Plane::bytes(&lines.flatten().copied().collect::<Vec<_>>())
        };
        Ok(Self { patch, columns: cells.width(), planes: (0..SURVEYED).map(plane).collect() })
    }

    /// One that has found these planes.
    pub(super) fn exact(planes: &Planes, patch: usize) -> Self {
        let found = planes.values.chunks_exact(planes.width * planes.height);
        Self { patch, columns: planes.width, planes: found.map(Plane::bytes).collect() }
    }

    /// Side of its patches (px).
    pub(super) fn patch(&self) -> usize {
        self.patch
    }

    /// The cells of a square whose edges lie on those of patches, turned by `symmetry`.
    pub(super) fn crop(&self, Square { x, y, side }: Square, symmetry: Symmetry) -> CropSurvey {
        let Self { patch, columns, planes } = self;
        let side = side / patch;
        let value = |i: usize| {
            let (plane, to) = (&planes[i / (side * side)], i % (side * side));
            let (row, column) = symmetry.source(to / side, to % side, side);
            plane.value((y / patch + row) * columns + x / patch + column)
        };
        CropSurvey { patch: *patch, values: (0..SURVEYED * side * side).map(value).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Projection};

    /// A wall that blocks the right half of the picture's light: cells of a crop, also of a turned one, are those beside its pixels.
    #[test]
    fn cells_lie_where_their_pixels_do() {
        let camera = Camera::new(Projection::Perspective { fov_y: 1.0 }, Size::px(64, 64)).unwrap();
        let depth = |i: usize| if i % 64 < 32 { 4.0 } else { 3.0 + (i / 64) as f32 * 0.01 };
        let gbuffer =
            GBuffer::new(camera, (0..4096).map(depth).collect::<Vec<_>>(), vec![[0.0, 0.0, 1.0]; 4096])
                .unwrap();
        let params = AoParams::new(2.0).unwrap();
        let arcs = ArcsParams { denoise_passes: 0, ..ArcsParams::default() };
        let whole = survey_planes(&arcs, &gbuffer, params, [0, 0], (Size::px(16, 16), 4)).unwrap();
        let survey = Survey::new(&arcs, (&gbuffer, params), 4).unwrap();
        let square = Square { x: 16, y: 8, side: 32 };
        let of = |mirror, quarter_turns| survey.crop(square, Symmetry { mirror, quarter_turns }).values;
        let (plain, mirrored, turned) = (of(false, 0), of(true, 0), of(false, 1));
        assert!(plain.iter().any(|value| *value > 0.2), "something is hidden or hit");
        for (i, value) in plain.iter().enumerate() {
            let (c, y, x) = (i / 64, i / 8 % 8, i % 8);
            let expected = whole[((y + 2) * SURVEYED + c) * 16 + x + 4];
            assert!((value - expected).abs() <= 0.5 / 255.0 + 1e-6, "{c} {y} {x}: {value}, not {expected}");
            assert_eq!(mirrored[(c * 8 + y) * 8 + 7 - x], *value);
            // The top right corner comes to the top left.
            assert_eq!(turned[(c * 8 + 7 - x) * 8 + y], *value);
        }
    }
}

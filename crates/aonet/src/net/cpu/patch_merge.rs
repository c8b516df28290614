//! From the pixels of patches to rows of the image. See [`crate::net::Op::PatchMerge`].

/// Writes a few cells of one row of cells into the image: [0, 1], 1 where the depth is infinite.
///
/// `image`, `depth` and `base`, to which the values are added, are the rows of pixels of the row of cells, `width`
/// wide; `visibility` holds, for each
/// pixel of a patch, the values of `cells` cells, of which the first is cell `x`.
#[inline(always)]
pub(super) fn write(
    (image, depth, base): (&mut [f32], &[f32], Option<&[f32]>),
    (visibility, cells): (&[f32], usize),
    (patch, width, x): (usize, usize, usize),
) {
    let first = x * patch;
    let last = width.min(first + cells * patch);
    for (dy, (line, depth)) in image.chunks_exact_mut(width).zip(depth.chunks_exact(width)).enumerate() {
        let (line, depth) = (&mut line[first..last], &depth[first..last]);
        let phases = &visibility[dy * patch * cells..][..patch * cells];
        match patch {
            1 => interleave::<1>((phases, cells), line),
            2 => interleave::<2>((phases, cells), line),
            4 => interleave::<4>((phases, cells), line),
            8 => interleave::<8>((phases, cells), line),
            _ => unreachable!("patches of {patch}"),
        }
        if let Some(base) = base {
            let base = &base[dy * width..][first..last];
            line.iter_mut().zip(base).for_each(|(value, base)| *value += base);
        }
        for (value, depth) in line.iter_mut().zip(depth) {
            // NaN, from weights so large that sums overflow, becomes 0.
            let visibility = if *value > 0.0 { value.min(1.0) } else { 0.0 };
            *value = if *depth == f32::INFINITY { 1.0 } else { visibility };
        }
    }
}

/// Value `cell` of phase `dx` becomes pixel `cell * PATCH + dx`.
#[inline(always)]
fn interleave<const PATCH: usize>((phases, cells): (&[f32], usize), line: &mut [f32]) {
    let mut phase = [&[][..]; PATCH];
    phase.iter_mut().zip(phases.chunks_exact(cells)).for_each(|(phase, values)| *phase = values);
    let (whole, rest) = line.as_chunks_mut::<PATCH>();
    assert!(whole.len() <= cells);
    for (cell, pixels) in whole.iter_mut().enumerate() {
        for (pixel, values) in pixels.iter_mut().zip(&phase) {
            *pixel = values[cell];
        }
    }
    rest.iter_mut().zip(&phase).for_each(|(pixel, values)| *pixel = values[whole.len()]);
}

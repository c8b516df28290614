//! Averages of 2x2 pixels and bilinear interpolation to twice the size, and their transposes.

/// A change of an image's size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Resample {
    /// Means of 2x2 pixels.
    Pool,
    /// Twice the size.
    Upsample,
}

impl Resample {
    pub(super) fn size_of(self, [b, c, h, w]: [usize; 4]) -> [usize; 4] {
        match self {
            Self::Pool => [b, c, h / 2, w / 2],
            Self::Upsample => [b, c, 2 * h, 2 * w],
        }
    }

    /// Resamples an image of these sizes.
    pub(super) fn forward(self, x: &[f32], dims: [usize; 4]) -> Vec<f32> {
        let mut out = vec![0.0; self.size_of(dims).iter().product()];
        let [_, _, h, w] = dims;
        match self {
            Self::Pool => pool(x, w, &mut out),
            Self::Upsample => {
                let planes = x.chunks_exact(h * w).zip(out.chunks_exact_mut(4 * h * w));
                planes.for_each(|(x, out)| upsample(x, w, out));
            }
        }
        out
    }

    /// The gradient of an image of these sizes.
    pub(super) fn backward(self, slope: &[f32], dims: [usize; 4]) -> Vec<f32> {
        let mut out = vec![0.0; dims.iter().product()];
        let [_, _, h, w] = dims;
        match self {
            Self::Pool => pool_back(slope, w, &mut out),
            Self::Upsample => {
                let planes = slope.chunks_exact(4 * h * w).zip(out.chunks_exact_mut(h * w));
                planes.for_each(|(slope, out)| upsample_back(slope, w, out));
            }
        }
        out
    }
}

/// Means of 2x2 pixels of planes `width` wide, each of an even number of rows.
fn pool(x: &[f32], width: usize, out: &mut [f32]) {
    for (rows, out) in x.chunks_exact(2 * width).zip(out.chunks_exact_mut(width / 2)) {
        let (upper, lower) = rows.split_at(width);
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        out.iter_mut().zip(pairs).for_each(|(o, (u, l))| *o = 0.25 * (u[0] + u[1] + l[0] + l[1]));
    }
}

/// The transpose of [`pool`].
fn pool_back(slope: &[f32], width: usize, out: &mut [f32]) {
    for (slope, rows) in slope.chunks_exact(width / 2).zip(out.chunks_exact_mut(2 * width)) {
        let (upper, lower) = rows.split_at_mut(width);
        upper.as_chunks_mut::<2>().0.iter_mut().zip(slope).for_each(|(u, s)| *u = [0.25 * s; 2]);
        lower.copy_from_slice(upper);
    }
}

/// One plane `width` wide to twice the size; beyond its border it repeats its edge.
fn upsample(x: &[f32], width: usize, out: &mut [f32]) {
    let height = x.len() / width;
    // The row with a pixel of the edge on either side.
    let mut line = vec![0.0; width + 2];
    for (i, out) in out.chunks_exact_mut(2 * width).enumerate() {
        let (near, far) = (i / 2, neighbour(i, height));
        let (near, far) = (&x[near * width..][..width], &x[far * width..][..width]);
        let pairs = near.iter().zip(far);
        line[1..=width].iter_mut().zip(pairs).for_each(|(l, (n, f))| *l = 0.75 * n + 0.25 * f);
        (line[0], line[width + 1]) = (line[1], line[width]);
        let pixels = line.iter().zip(&line[1..]).zip(&line[2..]);
        for (out, ((before, at), after)) in out.as_chunks_mut::<2>().0.iter_mut().zip(pixels) {
            *out = [0.75 * at + 0.25 * before, 0.75 * at + 0.25 * after];
        }
    }
}

/// The transpose of [`upsample`], added to `out`.
fn upsample_back(slope: &[f32], width: usize, out: &mut [f32]) {
    let height = out.len() / width;
    let mut line = vec![0.0; width];
    for (i, slope) in slope.chunks_exact(2 * width).enumerate() {
        let pairs = slope.as_chunks::<2>().0;
        line.iter_mut().zip(pairs).for_each(|(l, s)| *l = 0.75 * (s[0] + s[1]));
        line[1..].iter_mut().zip(pairs).for_each(|(l, s)| *l += 0.25 * s[1]);
        line.iter_mut().zip(&pairs[1..]).for_each(|(l, s)| *l += 0.25 * s[0]);
        line[0] += 0.25 * slope[0];
        line[width - 1] += 0.25 * slope[2 * width - 1];
        for (y, share) in [(i / 2, 0.75), (neighbour(i, height), 0.25)] {
            out[y * width..][..width].iter_mut().zip(&line).for_each(|(o, l)| *o += share * l);
        }
    }
}

/// The other row that row `i` of the larger plane lies between.
fn neighbour(i: usize, height: usize) -> usize {
    if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(height - 1) }
}

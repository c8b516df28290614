//! Ray-traced ambient occlusion: the truth that everything else is measured against.

use crate::Result;
use crate::gbuffer::Surface;
use crate::trace::Tracer;
use aonet::{AoImage, AoParams};

/// How finely the reference is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// Rays per pixel, > 0.
    pub spp: u32,
    /// Seed of the sequence; equal seeds give identical images whatever the number of threads.
    pub seed: u64,
}

/// AO(p) = 1/N sum V(p, w_i), cosine-weighted about the shading normal, on all cores.
/// `progress` is called now and then with the number of rays traced since its last call.
///
/// # Errors
/// When `spp` is 0.
pub fn reference_ao(
    _tracer: &Tracer,
    _surface: &Surface,
    _params: AoParams,
    _sampling: Sampling,
    _progress: &(dyn Fn(u64) + Sync),
) -> Result<AoImage> {
    unimplemented!()
}

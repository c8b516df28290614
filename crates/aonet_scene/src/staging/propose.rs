//! Proposes a view of a scene, for commands without a given view.

use super::radius::RadiusRule;
use super::spec::SceneSpec;
use super::stage::{Framing, Stage};
use crate::error::Result;
use crate::random::Random;
use crate::trace::Tracer;
use crate::view::View;
use aonet::Size;

/// Loads a scene (with its ground) and finds a view of `size` with a fitting AO radius.
/// Equal seeds give equal views.
///
/// # Errors
/// When the scene cannot be read, or no view of it is good enough.
pub fn propose_view(spec: &SceneSpec, size: Size, seed: u64) -> Result<(Tracer, View)> {
    let (scene, content_triangles) = spec.load()?;
    let tracer = Tracer::new(scene);
    let framing = Framing { width: size.width(), height: size.height(), radius: RadiusRule::ANY };
    let mut random = Random::of_frame(seed, &spec.name, 0);
    let (view, _) = Stage::new(spec, &tracer, content_triangles).view(&framing, &mut random)?;
    Ok((tracer, view))
}

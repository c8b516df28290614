//! Base colours without textures: the factor of the material times the vertex colours.

use super::accessor::Accessors;
use super::json::Primitive;
use crate::scene::DEFAULT_ALBEDO;
use aonet::{Error, Result};

/// Linear reflectance of each triangle in [0, 1]; empty if the primitive has neither material nor vertex colours.
///
/// A missing material counts as none, because a colour is no reason to refuse a file. `is_textured`: an image will
/// multiply the colour.
pub(super) fn of_triangles(
    accessors: &Accessors,
    primitive: &Primitive,
    (triangles, is_textured): (&[[u32; 3]], bool),
) -> Result<Vec<[f32; 3]>> {
    let factor = accessors.material(primitive).map(|m| m.base_color_factor.unwrap_or([1.0; 4]));
    let Some(vertices) = vertex_colours(accessors, primitive)? else {
        // glTF's default is pure white, which no surface is, and no image changes.
        let is_told = |f: &[f32; 3]| *f != [1.0; 3] || is_textured;
        let colour = factor.map(|f| [f[0], f[1], f[2]].map(in_range)).filter(is_told);
        return Ok(colour.map_or(Vec::new(), |colour| vec![colour; triangles.len()]));
    };
    let factor = factor.unwrap_or([1.0; 4]);
    let corner = |i: u32| vertices.get(i as usize).copied().unwrap_or(DEFAULT_ALBEDO);
    let colour = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        std::array::from_fn(|k| in_range(factor[k] * (a[k] + b[k] + c[k]) / 3.0))
    };
    Ok(triangles.iter().map(colour).collect())
}

/// NaN becomes 0.
fn in_range(v: f32) -> f32 {
    if v > 0.0 { v.min(1.0) } else { 0.0 }
}

/// `COLOR_0`, linear, with or without an alpha. glTF 2.0 specification §3.7.2.1.
fn vertex_colours(accessors: &Accessors, primitive: &Primitive) -> Result<Option<Vec<[f32; 3]>>> {
    let Some(&index) = primitive.attributes.get("COLOR_0") else { return Ok(None) };
    match accessors.components(index) {
        Some(3) => Ok(Some(accessors.floats::<3>(index)?)),
        Some(4) => {
            let colours = accessors.floats::<4>(index)?;
            Ok(Some(colours.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()))
        }
        _ => Err(Error::format("glTF COLOR_0", "vectors of 3 or 4 numbers", format!("accessor {index}"))),
    }
}

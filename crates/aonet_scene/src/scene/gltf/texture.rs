//! Textures of base colours: the images' files and the triangles' texture coordinates.

use super::accessor::Accessors;
use super::buffers::{data_uri, path_beside};
use super::json::{Document, Image as ImageJson, Primitive, Sampler, TextureInfo, TextureTransform, at};
use super::primitive::same_length;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::textures::{Decal, Image, ImageFile, Wrap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Most bytes of all images beside a file.
// guess: four times the images of large downloadable rooms.
const MAX_EXTERNAL_BYTES: u64 = 1 << 30;

/// The images of a document; each is looked up once, when a triangle first uses it.
pub(super) struct Images<'a> {
    document: &'a Document,
    base_dir: Option<&'a Path>,
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) read: Vec<Image>,
    /// Index in `read` of an image of the document; one index for all textures without an image.
    known: HashMap<Option<usize>, u32>,
    /// Remaining bytes for images in buffers, because overlapping views could multiply the file's size.
    embedded_bytes: usize,
    external_bytes: u64,
}

impl<'a> Images<'a> {
    pub(super) fn new(
        document: &'a Document,
        base_dir: Option<&'a Path>,
        accessors: &'a Accessors<'a>,
    ) -> Self {
        Self {
            document,
            base_dir,
            accessors,
            read: Vec::new(),
            known: HashMap::new(),
            embedded_bytes: accessors.file_bytes(),
            external_bytes: MAX_EXTERNAL_BYTES,
        }
    }

    /// The decals of a primitive's triangles; empty if its material has no texture, or it lacks the coordinates.
    ///
    /// # Errors
    /// When an index leads nowhere or the coordinates are broken.
    pub(super) fn decals(
        &mut self,
        primitive: &Primitive,
        part: &Scene,
        what: &str,
    ) -> Result<Vec<Option<Decal>>> {
        let texture = self.accessors.material(primitive).and_then(|m| m.base_color_texture.as_ref());
        let Some(texture) = texture else { return Ok(Vec::new()) };
        let (image, wrap) = self.image_of(texture)?;
        let plain = TextureTransform::default();
        let transform = texture.extensions.transform.as_ref().unwrap_or(&plain);
        let set = transform.tex_coord.unwrap_or(texture.tex_coord);
        let Some(&index) = primitive.attributes.get(&format!("TEXCOORD_{set}")) else {
            return Ok(Vec::new());
        };
        let uv = self.accessors.floats::<2>(index)?;
        same_length(part.position.len(), uv.len(), what)?;
        let corner = |i: u32| transformed(uv[i as usize], transform);
        Ok(part.triangle.iter().map(|t| Some(Decal { image, uv: t.map(corner), wrap })).collect())
    }

    /// Index of a texture's image among those read, and its wrap modes.
    fn image_of(&mut self, texture: &TextureInfo) -> Result<(u32, [Wrap; 2])> {
        let json = at(&self.document.textures, texture.index, "texture")?;
        let sampler = json.sampler.map(|i| at(&self.document.samplers, i, "sampler")).transpose()?;
        let wrap = |of: fn(&Sampler) -> Option<u32>| wrap(sampler.and_then(of));
        let wrap = [wrap(|s| s.wrap_s), wrap(|s| s.wrap_t)];
        if let Some(&index) = self.known.get(&json.source) {
            return Ok((index, wrap));
        }
        let image = match json.source {
            Some(source) => self.load(source, at(&self.document.images, source, "image")?)?,
            None => {
                let kinds: Vec<_> = json.extensions.keys().map(String::as_str).collect();
                let why = format!("no image but of {}", kinds.join(", "));
                Image { name: format!("texture {}", texture.index), file: Err(why) }
            }
        };
        let index = self.read.len() as u32;
        self.read.push(image);
        self.known.insert(json.source, index);
        Ok((index, wrap))
    }

    /// # Errors
    /// When its bytes lie outside of the buffers.
    fn load(&mut self, index: usize, json: &ImageJson) -> Result<Image> {
        let uri = json.uri.as_deref();
        let file = uri.filter(|uri| !uri.starts_with("data:"));
        let named = json.name.as_deref().or(file).filter(|name| !name.is_empty());
        let name = named.map_or(format!("image {index}"), |name| format!("image {name:?}"));
        let file = match (json.buffer_view, uri) {
            (Some(view), _) => {
                let bytes = self.accessors.view(view, &format!("glTF image {index}"))?;
                match self.embedded_bytes.checked_sub(bytes.len()) {
                    Some(left) => {
                        self.embedded_bytes = left;
                        Ok(ImageFile::Embedded(bytes.into()))
                    }
                    None => Err("images have more bytes together than the file".to_owned()),
                }
            }
            (None, Some(uri)) => match uri.strip_prefix("data:") {
                Some(data) => {
                    data_uri(data).map(|b| ImageFile::Embedded(b.into())).map_err(|e| e.to_string())
                }
                None => self.beside(uri).map(ImageFile::Beside).map_err(|e| e.to_string()),
            },
            (None, None) => Err("neither a uri nor a buffer view".to_owned()),
        };
        Ok(Image { name, file })
    }

    /// The path of a file that fits in the remaining bytes.
    fn beside(&mut self, uri: &str) -> Result<PathBuf> {
        let path = path_beside(("image", uri), self.base_dir)?;
        let bytes = std::fs::metadata(&path).map_err(Error::io(&path))?.len();
        let left = self.external_bytes.checked_sub(bytes);
        let most = self.external_bytes;
        self.external_bytes =
            left.ok_or_else(|| Error::file(&path, format!("at most {most} bytes"), bytes))?;
        Ok(path)
    }
}

/// glTF 2.0 specification §5.26: what is unknown repeats.
fn wrap(mode: Option<u32>) -> Wrap {
    match mode {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

/// `KHR_texture_transform`: scales, rotates, then translates. The specification's example fixes the direction: with (0, 1), a
/// quarter turn and halves it shows the lower left quarter of the image. A coordinate that is not finite becomes the origin.
fn transformed([u, v]: [f32; 2], by: &TextureTransform) -> [f32; 2] {
    let (sin, cos) = by.rotation.sin_cos();
    let (u, v) = (u * by.scale[0], v * by.scale[1]);
    let place = [cos * u + sin * v + by.offset[0], cos * v - sin * u + by.offset[1]];
    if place.iter().all(|c| c.is_finite()) { place } else { [0.0; 2] }
}

//! Images on triangles: their files and texture coordinates. Nothing here decodes them.

use std::path::PathBuf;
use std::sync::Arc;

/// Memory of the decoders themselves.
// guess: a hundred times their tables.
const FOR_DECODERS_BYTES: u64 = 1 << 20;

/// Memory (bytes) that a PNG or a JPEG of so many bytes may take when it is decoded. DEFLATE expands at most 1032 times, and one bit of a
/// palette becomes 32; JPEG expands less.
pub const fn most_decoded_bytes(file_bytes: usize) -> u64 {
    file_bytes as u64 * 1032 * 32 + FOR_DECODERS_BYTES
}

/// Images, and the decals of triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Textures {
    /// Images that decals refer to.
    pub image: Vec<Image>,
    /// The decal of each triangle; empty if no triangle has one.
    pub decal: Vec<Option<Decal>>,
}

/// An image, not decoded.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Its name in messages.
    pub name: String,
    /// The file (PNG, JPEG or any other kind), or why it is missing.
    pub file: Result<ImageFile, String>,
}

/// An image's file; only code that shows images reads it.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageFile {
    /// Part of the scene's file.
    Embedded(Arc<[u8]>),
    /// A file beside the scene's file.
    Beside(PathBuf),
}

impl Image {
    /// The bytes of the file.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(&self) -> Result<Arc<[u8]>, String> {
        match self.file.as_ref().map_err(String::clone)? {
            ImageFile::Embedded(bytes) => Ok(Arc::clone(bytes)),
            ImageFile::Beside(path) => std::fs::read(path).map(Into::into).map_err(|e| e.to_string()),
        }
    }
}

/// A part of an image on a triangle: it multiplies the triangle's albedo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decal {
    /// Index of the image.
    pub image: u32,
    /// Texture coordinates of the triangle's corners: (0, 0) is its upper left corner, (1, 1) its lower right one. Finite.
    pub uv: [[f32; 2]; 3],
    /// Wrap modes beyond the left and right edges, and beyond the upper and lower ones.
    pub wrap: [Wrap; 2],
}

/// Wrap mode of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Repeats the texels of the edge.
    Clamp,
    /// Repeats the image, mirrored every other time.
    Mirror,
}

impl Textures {
    /// Appends the textures of a scene with `there` triangles to those of a scene with `here`.
    pub(super) fn append(&mut self, other: &Self, (here, there): (usize, usize)) {
        if self.decal.is_empty() && other.decal.is_empty() {
            return;
        }
        let first = self.image.len() as u32;
        let moved = |decal: &Option<Decal>| decal.map(|d| Decal { image: first + d.image, ..d });
        self.decal.resize(here, None);
        self.decal.extend(other.decal.iter().map(moved));
        self.decal.resize(here + there, None);
        self.image.extend_from_slice(&other.image);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use super::*;
    use glam::Vec3;

    fn triangle(images: &[&str]) -> Scene {
        let position = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let image = |name: &&str| Image { name: (*name).into(), file: Err("none".into()) };
        let decal = Decal { image: 0, uv: [[0.0; 2], [1.0, 0.0], [0.0, 1.0]], wrap: [Wrap::Repeat; 2] };
        let decal = if images.is_empty() { vec![] } else { vec![Some(decal)] };
        let textures = Textures { image: images.iter().map(image).collect(), decal };
        Scene { position, normal: vec![Vec3::Z; 3], triangle: vec![[0, 1, 2]], textures, ..Scene::default() }
    }

    #[test]
    fn images_stay_with_their_triangles() {
        let mut scene = triangle(&[]);
        scene.append(&triangle(&[]));
        assert!(scene.textures.decal.is_empty());
        for other in [triangle(&["a"]), triangle(&[]), triangle(&["b", "c"])] {
            scene.append(&other);
        }
        let scene = scene.checked().unwrap();
        let shown =
            |decal: &Option<Decal>| decal.map(|d| scene.textures.image[d.image as usize].name.clone());
        let shown: Vec<_> = scene.textures.decal.iter().map(shown).collect();
        assert_eq!(shown, [None, None, Some("a".into()), None, Some("b".into())]);
    }

    #[test]
    fn what_cannot_be_shown_is_refused() {
        let changed = |change: fn(&mut Textures)| {
            let mut scene = triangle(&["a"]);
            change(&mut scene.textures);
            scene.checked().unwrap_err().to_string()
        };
        for message in [
            changed(|t| t.decal.push(None)),
            changed(|t| t.image.clear()),
            changed(|t| t.decal[0].as_mut().unwrap().uv[2][1] = f32::NAN),
        ] {
            assert!(message.contains("decal"), "{message}");
        }
    }
}

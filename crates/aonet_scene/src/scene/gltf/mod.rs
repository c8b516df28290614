//! glTF 2.0 files, text and binary, as one mesh in world space: every triangle of the default scene at rest
//! (node hierarchy, instances, morph targets at their default weights, skins). Of materials, only
//! the base colour and its texture are read.

mod accessor;
mod buffers;
mod colour;
mod json;
mod nodes;
mod primitive;
mod skin;
#[cfg(test)]
mod tests;
mod texture;

pub use super::normals::MissingNormals;

use super::normals;
use crate::error::{Error, Result};
use crate::scene::Scene;
use accessor::Accessors;
use buffers::Buffers;
use json::{Document, Mesh, Node, at};
use nodes::{Nodes, Pose};
use std::path::Path;
use texture::Images;

/// Loads a `.gltf` or `.glb` file; its name without extension names the scene.
///
/// Images are not decoded. One that cannot be read, or lies outside the folder of the file, is no reason to refuse
/// the file: [`Textures`](super::Textures) record why it is missing.
///
/// Degenerate triangles and unused vertices are dropped, unusable normals are replaced by those of the geometry,
/// triangles of mirrored nodes keep their front. Without a default scene the first one is used, without any
/// scene all root nodes.
///
/// # Errors
/// Names the file and what is wrong with it: unreadable, damaged, compressed, without triangles, or asking for
/// more than its length justifies. Buffers outside the folder of the file are refused.
pub fn load(path: &Path, missing: MissingNormals) -> Result<Scene> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    from_bytes(&bytes, path.parent(), &name, missing).map_err(|error| match error {
        Error::Core(source) => Error::in_file(path)(source),
        other => other,
    })
}

/// Like [`load`], from the bytes of a file. `base_dir` is the folder of its external buffers; without one, a file
/// that has any is refused.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(
    bytes: &[u8],
    base_dir: Option<&Path>,
    name: &str,
    missing: MissingNormals,
) -> Result<Scene> {
    let missing = missing.checked()?;
    let chunks = buffers::split(bytes)?;
    let document = Document::parse(chunks.json)?;
    let buffers = Buffers::load(&document, chunks.bin, base_dir)?;
    let accessors = Accessors::new(&document, buffers, bytes.len());
    let nodes = Nodes::place(&document)?;
    let mut images = Images::new(&document, base_dir, &accessors);
    let mut scene = Scene { name: name.to_owned(), ..Scene::default() };
    for &i in &nodes.shown {
        let node = &document.nodes[i];
        let Some(mesh) = node.mesh else { continue };
        let joints = node.skin.map(|skin| skin::joints(&document, skin, &nodes.world_from_node, &accessors));
        let joints = joints.transpose()?;
        let mesh = PlacedMesh { index: mesh, mesh: at(&document.meshes, mesh, "mesh")?, node, joints };
        for world_from_mesh in nodes::instances(node, nodes.world_from_node[i], &accessors)? {
            mesh.append_to(&mut scene, Pose::new(world_from_mesh), &mut images, missing)?;
        }
    }
    scene.textures.image = images.read;
    scene.checked()
}

/// A mesh with the transform of its node.
struct PlacedMesh<'a> {
    index: usize,
    mesh: &'a Mesh,
    node: &'a Node,
    /// World from mesh space, for each joint of the node's skin.
    joints: Option<Vec<glam::DAffine3>>,
}

impl PlacedMesh<'_> {
    fn append_to(
        &self,
        scene: &mut Scene,
        pose: Pose,
        images: &mut Images,
        missing: MissingNormals,
    ) -> Result<()> {
        let accessors = images.accessors;
        let weights = self.node.weights.as_ref().unwrap_or(&self.mesh.weights);
        for (i, primitive) in self.mesh.primitives.iter().enumerate() {
            let what = format!("glTF mesh {} primitive {i}", self.index);
            let Some(mut part) = primitive::read(accessors, primitive, weights, &what)? else { continue };
            // Of images that all parts share: the list is the whole scene's.
            part.textures.decal = images.decals(primitive, &part, &what)?;
            let is_textured = !part.textures.decal.is_empty();
            part.albedo = colour::of_triangles(accessors, primitive, (&part.triangle, is_textured))?;
            let influences = match &self.joints {
                Some(joints) => {
                    primitive::influences(accessors, primitive, (part.position.len(), joints.len()), &what)?
                }
                None => Vec::new(),
            };
            match &self.joints {
                Some(joints) if !influences.is_empty() => {
                    place(&mut part, |vertex| skin::blend(joints, &influences, vertex));
                }
                _ => place(&mut part, |_| pose),
            }
            normals::prune(&mut part);
            if let Some(vertex) = part.position.iter().position(|p| !p.is_finite()) {
                let found = part.position[vertex];
                return Err(aonet::Error::value(format!("{what} position"), "finite numbers", found).into());
            }
            if part.normal.is_empty() {
                normals::generate(&mut part, missing);
            } else {
                normals::repair(&mut part);
            }
            scene.append(&part);
        }
        Ok(())
    }
}

/// Moves vertices to world space and keeps each triangle's front.
fn place(part: &mut Scene, pose: impl Fn(usize) -> Pose) {
    let mut decals = part.textures.decal.iter_mut();
    for triangle in &mut part.triangle {
        let decal = decals.next().and_then(Option::as_mut);
        if pose(triangle[0] as usize).mirrors {
            triangle.swap(1, 2);
            decal.into_iter().for_each(|decal| decal.uv.swap(1, 2));
        }
    }
    for (vertex, normal) in part.normal.iter_mut().enumerate() {
        *normal = pose(vertex).direction(*normal);
    }
    for (vertex, position) in part.position.iter_mut().enumerate() {
        *position = pose(vertex).position(*position);
    }
}

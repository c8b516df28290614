//! The hierarchy as words, for shaders, which have no pointers: see `gpu/traverse.wgsl`.

use super::build::{Bvh8, LEAF, Leaf, Node};
use super::lanes::WIDTH;
use crate::error::{Error, Result};

/// Nodes that fit beside a mask of children in a word.
const MAX_NODES: usize = 1 << 24;

/// Triangles that fit beside their number in a leaf, below [`LEAF`].
const MAX_TRIANGLES: usize = 1 << 28;

/// A hierarchy, little-endian.
#[derive(Debug)]
pub(crate) struct Flat {
    /// 56 words a node: six rows of bounds as in [`Node`], then the children. A child is the index of a node, or with
    /// [`LEAF`] set, the index of its first triangle and, 28 bits up, their number less one.
    pub(crate) nodes: Vec<u8>,
    /// 12 words a triangle: a vertex, two edges and their cross product as in [`Leaf`]; each of the first three followed
    /// by a component of the last.
    pub(crate) triangles: Vec<u8>,
}

impl Flat {
    /// # Errors
    /// When there are too many nodes or triangles to count.
    pub(super) fn new(bvh: &Bvh8) -> Result<Self> {
        let count = bvh.leaves.iter().map(Leaf::len).sum();
        for (what, found, most) in
            [("nodes", bvh.nodes.len(), MAX_NODES), ("triangles", count, MAX_TRIANGLES)]
        {
            if found > most {
                return Err(Error::request("scene on a GPU", format!("at most {most} {what}"), found));
            }
        }
        let mut triangles = Vec::with_capacity(count * 12 * size_of::<f32>());
        let mut first = 0u32;
        let words = bvh.leaves.iter().map(|leaf| {
            let word = LEAF | (leaf.len() as u32).saturating_sub(1) << 28 | first;
            (0..leaf.len()).for_each(|k| leaf.put(k, &mut triangles));
            first += leaf.len() as u32;
            word
        });
        let words: Vec<u32> = words.collect();
        let mut nodes = Vec::with_capacity(bvh.nodes.len() * 56 * size_of::<u32>());
        bvh.nodes.iter().for_each(|node| node.put(&words, &mut nodes));
        Ok(Self { nodes, triangles })
    }
}

impl Node {
    fn put(&self, leaf_words: &[u32], bytes: &mut Vec<u8>) {
        // Shaders may assume finite values, but the bounds of empty children are infinite.
        let bounds = self.bounds.iter().flat_map(|row| row.0.map(|x| x.clamp(f32::MIN, f32::MAX)));
        bytes.extend(bounds.flat_map(f32::to_le_bytes));
        // No ray meets the child in an empty place.
        let leaf = |word: u32| leaf_words.get((word & !LEAF) as usize).copied().unwrap_or(LEAF);
        let words = self.child.map(|word| if word & LEAF != 0 { leaf(word) } else { word });
        bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
    }
}

impl Leaf {
    fn len(&self) -> usize {
        (0..WIDTH).filter(|&k| self.triangle[k] != u32::MAX).count()
    }

    fn put(&self, k: usize, bytes: &mut Vec<u8>) {
        for (axis, corner) in [self.v0, self.e1, self.e2].iter().enumerate() {
            let words = [corner[0].0[k], corner[1].0[k], corner[2].0[k], self.normal[axis].0[k]];
            bytes.extend(words.into_iter().flat_map(f32::to_le_bytes));
        }
    }
}

//! The hierarchy: eight children a node, eight triangles a leaf.

use super::lanes::{Row, WIDTH};
use super::sah::{Aabb, Item, halve, split};
use crate::Scene;
use std::ops::Range;

/// Marks a child as a leaf; the other bits index [`Bvh8::leaves`].
pub(super) const LEAF: u32 = 1 << 31;

/// Largest depth of the hierarchy: each level leaves at most seven children on a ray's stack.
pub(crate) const MAX_DEPTH: usize = 36;

/// Depth from which nodes are split by count, so that each level below has an eighth of the triangles.
const EVEN_DEPTH: usize = 20;

/// Words on a ray's stack.
pub(super) const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Boxes of eight children. Empty ones have a box that no ray meets.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Smallest x, largest x, smallest y, largest y, smallest z, largest z.
    pub(super) bounds: [Row; 6],
    /// Node index, or leaf index with [`LEAF`] set.
    pub(super) child: [u32; WIDTH],
}

/// Eight triangles by one vertex, two edges and their cross product. Empty lanes are NaN: nothing hits them.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaf {
    pub(super) v0: [Row; 3],
    /// v0 - v1.
    pub(super) e1: [Row; 3],
    /// v2 - v0.
    pub(super) e2: [Row; 3],
    /// e1 x e2.
    pub(super) normal: [Row; 3],
    /// Index into the scene.
    pub(super) triangle: [u32; WIDTH],
}

/// Eight-wide hierarchy; the root is node 0.
#[derive(Debug)]
pub(super) struct Bvh8 {
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
}

const EMPTY: Node = {
    let (lo, hi) = (Row([f32::INFINITY; WIDTH]), Row([f32::NEG_INFINITY; WIDTH]));
    Node { bounds: [lo, hi, lo, hi, lo, hi], child: [LEAF; WIDTH] }
};

impl Bvh8 {
    /// Builds over all triangles that have finite vertices.
    pub(super) fn new(scene: &Scene) -> Self {
        let mut items: Vec<Item> = (0u32..)
            .zip(&scene.triangle)
            .map(|(triangle, t)| Item {
                bounds: Aabb::around(t.map(|i| scene.position[i as usize])),
                triangle,
            })
            .filter(|item| item.bounds.is_finite())
            .collect();
        let mut bvh = Self { nodes: vec![EMPTY], leaves: vec![] };
        let mut todo = vec![(0..items.len(), 0usize, 1usize)];
        while let Some((range, slot, depth)) = todo.pop() {
            assert!(depth <= MAX_DEPTH, "below depth {EVEN_DEPTH}, 2^32 triangles take 11 levels");
            for (k, (child, bounds)) in open(&mut items[range.clone()], depth).into_iter().enumerate() {
                let child = range.start + child.start..range.start + child.end;
                let word = if child.len() <= WIDTH {
                    bvh.leaves.push(Leaf::new(scene, &items[child]));
                    (bvh.leaves.len() - 1) as u32 | LEAF
                } else {
                    bvh.nodes.push(EMPTY);
                    todo.push((child, bvh.nodes.len() - 1, depth + 1));
                    bvh.nodes.len() as u32 - 1
                };
                bvh.nodes[slot].set(k, bounds, word);
            }
        }
        bvh
    }
}

impl Node {
    fn set(&mut self, k: usize, bounds: Aabb, word: u32) {
        for axis in 0..3 {
            self.bounds[2 * axis].0[k] = bounds.lo[axis];
            self.bounds[2 * axis + 1].0[k] = bounds.hi[axis];
        }
        self.child[k] = word;
    }
}

/// Orders `items` into up to eight children.
fn open(items: &mut [Item], depth: usize) -> Vec<(Range<usize>, Aabb)> {
    let mut children = vec![(0..items.len(), Aabb::of(items))];
    while children.len() < WIDTH {
        let size = |(range, bounds): &(Range<usize>, Aabb)| match depth < EVEN_DEPTH {
            true => bounds.half_area(),
            false => range.len() as f32,
        };
        let splits = |k: &usize| children[*k].0.len() > WIDTH;
        let by_size = |&a: &usize, &b: &usize| size(&children[a]).total_cmp(&size(&children[b]));
        let Some(k) = (0..children.len()).filter(splits).max_by(by_size) else { break };
        let range = children[k].0.clone();
        let part = &mut items[range.clone()];
        let middle = range.start + if depth < EVEN_DEPTH { split(part) } else { halve(part) };
        children[k] = (range.start..middle, Aabb::of(&items[range.start..middle]));
        children.push((middle..range.end, Aabb::of(&items[middle..range.end])));
    }
    children
}

impl Leaf {
    /// Up to eight triangles.
    fn new(scene: &Scene, items: &[Item]) -> Self {
        let nan = [Row([f32::NAN; WIDTH]); 3];
        let mut leaf = Self { v0: nan, e1: nan, e2: nan, normal: nan, triangle: [u32::MAX; WIDTH] };
        for (k, item) in items.iter().enumerate() {
            let [a, b, c] = scene.triangle[item.triangle as usize].map(|i| scene.position[i as usize]);
            let (e1, e2) = (a - b, c - a);
            let normal = e1.cross(e2);
            for axis in 0..3 {
                leaf.v0[axis].0[k] = a[axis];
                leaf.e1[axis].0[k] = e1[axis];
                leaf.e2[axis].0[k] = e2[axis];
                leaf.normal[axis].0[k] = normal[axis];
            }
            leaf.triangle[k] = item.triangle;
        }
        leaf
    }
}

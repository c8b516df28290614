//! The hierarchy: a binary one by obvhs, collapsed to eight children a node.

use super::lanes::{Row, WIDTH};
use crate::Scene;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2, node::Bvh2Node};
use obvhs::triangle::Triangle;
use std::time::Duration;

/// Marks a child as a leaf; the other bits index [`Bvh8::leaves`].
pub(super) const LEAF: u32 = 1 << 31;

/// Deepest hierarchy that rays can walk: each level leaves at most seven children on the stack.
pub(super) const MAX_DEPTH: usize = 36;

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
    /// Builds over all triangles whose vertices are finite.
    pub(super) fn new(scene: &Scene) -> Self {
        let vertex = |i: u32| Vec3A::from(scene.position[i as usize]);
        let (ids, triangles): (Vec<u32>, Vec<Triangle>) = (0u32..)
            .zip(&scene.triangle)
            .map(|(id, t)| (id, Triangle { v0: vertex(t[0]), v1: vertex(t[1]), v2: vertex(t[2]) }))
            .filter(|(_, t)| t.v0.is_finite() && t.v1.is_finite() && t.v2.is_finite())
            .unzip();
        if triangles.is_empty() {
            return Self { nodes: vec![EMPTY], leaves: vec![] };
        }
        let scaled = to_unit_size(&triangles);
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let binary = build_bvh2(&scaled, params, &mut Duration::default());
        let wide = Collapse::run(&binary, &triangles, &ids);
        if wide.depth <= MAX_DEPTH {
            return wide.bvh;
        }
        let balanced = median_split(&scaled);
        let wide = Collapse::run(&balanced, &triangles, &ids);
        assert!(wide.depth <= MAX_DEPTH, "a balanced tree of 2^32 triangles is at most 32 deep");
        wide.bvh
    }
}

/// Scaled by a power of two, so that areas neither overflow nor vanish.
fn to_unit_size(triangles: &[Triangle]) -> Vec<Triangle> {
    let largest = triangles
        .iter()
        .flat_map(|t| [t.v0, t.v1, t.v2])
        .fold(f32::MIN_POSITIVE, |m, v| m.max(v.abs().max_element()));
    let scale = 2f32.powi(-(largest.log2().floor() as i32).clamp(-126, 126));
    triangles.iter().map(|t| Triangle { v0: t.v0 * scale, v1: t.v1 * scale, v2: t.v2 * scale }).collect()
}

/// A balanced tree, for triangles that lead the usual builder to a tree that is too deep.
fn median_split(triangles: &[Triangle]) -> Bvh2 {
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut todo = vec![(0usize, 0usize, order.len())];
    while let Some((node, begin, end)) = todo.pop() {
        if end - begin == 1 {
            nodes[node].prim_count = 1;
            nodes[node].first_index = begin as u32;
            continue;
        }
        let centre = |i: u32| triangles[i as usize].v0 + triangles[i as usize].v1 + triangles[i as usize].v2;
        let part = &mut order[begin..end];
        let (lo, hi) = part.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(lo, hi), &i| {
            (lo.min(centre(i)), hi.max(centre(i)))
        });
        let axis = (hi - lo).max_position();
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, |&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]));
        nodes[node].first_index = nodes.len() as u32;
        todo.push((nodes.len(), begin, begin + middle));
        todo.push((nodes.len() + 1, begin + middle, end));
        nodes.extend([Bvh2Node::default(); 2]);
    }
    Bvh2 { nodes, primitive_indices: order, ..Bvh2::default() }
}

/// The state of turning a binary tree into a wide one.
struct Collapse<'a> {
    binary: &'a Bvh2,
    triangles: &'a [Triangle],
    ids: &'a [u32],
    /// Box and number of triangles below each binary node.
    bounds: Vec<(Vec3, Vec3)>,
    count: Vec<u32>,
    bvh: Bvh8,
    depth: usize,
}

impl<'a> Collapse<'a> {
    fn run(binary: &'a Bvh2, triangles: &'a [Triangle], ids: &'a [u32]) -> Self {
        let n = binary.nodes.len();
        let bvh = Bvh8 { nodes: vec![EMPTY], leaves: vec![] };
        let (bounds, count) = (vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); n], vec![0; n]);
        let mut this = Self { binary, triangles, ids, bounds, count, bvh, depth: 0 };
        this.measure();
        let mut todo = vec![(0usize, 0usize, 1usize)];
        while let Some((root, slot, depth)) = todo.pop() {
            this.depth = this.depth.max(depth);
            let children = this.open(root);
            for (k, child) in children.into_iter().enumerate() {
                let (lo, hi) = this.bounds[child];
                let word = if this.count[child] as usize <= WIDTH {
                    this.leaf(child)
                } else {
                    this.bvh.nodes.push(EMPTY);
                    todo.push((child, this.bvh.nodes.len() - 1, depth + 1));
                    this.bvh.nodes.len() as u32 - 1
                };
                let node = &mut this.bvh.nodes[slot];
                for axis in 0..3 {
                    node.bounds[2 * axis].0[k] = lo[axis];
                    node.bounds[2 * axis + 1].0[k] = hi[axis];
                }
                node.child[k] = word;
            }
        }
        this
    }

    fn measure(&mut self) {
        let mut order = Vec::with_capacity(self.count.len());
        let mut todo = vec![0usize];
        while let Some(i) = todo.pop() {
            order.push(i);
            let node = &self.binary.nodes[i];
            if !node.is_leaf() {
                todo.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
        }
        for i in order.into_iter().rev() {
            let node = &self.binary.nodes[i];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let t = &self.triangles[self.binary.primitive_indices[first] as usize];
                self.bounds[i] = (t.v0.min(t.v1).min(t.v2).into(), t.v0.max(t.v1).max(t.v2).into());
                self.count[i] = 1;
            } else {
                let (a, b) = (self.bounds[first], self.bounds[first + 1]);
                self.bounds[i] = (a.0.min(b.0), a.1.max(b.1));
                self.count[i] = self.count[first] + self.count[first + 1];
            }
        }
    }

    /// Up to eight binary nodes that together cover `root`, the largest ones opened first.
    fn open(&self, root: usize) -> Vec<usize> {
        let mut children = vec![root];
        let opens = |i: usize| self.count[i] as usize > WIDTH;
        while children.len() < WIDTH {
            let largest = (0..children.len())
                .filter(|&k| opens(children[k]))
                .max_by(|&a, &b| self.half_area(children[a]).total_cmp(&self.half_area(children[b])));
            let Some(k) = largest else { break };
            let first = self.binary.nodes[children[k]].first_index as usize;
            children[k] = first;
            children.push(first + 1);
        }
        children
    }

    fn half_area(&self, i: usize) -> f32 {
        let d = self.bounds[i].1 - self.bounds[i].0;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    fn leaf(&mut self, root: usize) -> u32 {
        let nan = [Row([f32::NAN; WIDTH]); 3];
        let mut leaf = Leaf { v0: nan, e1: nan, e2: nan, normal: nan, triangle: [u32::MAX; WIDTH] };
        let mut todo = vec![root];
        let mut k = 0;
        while let Some(i) = todo.pop() {
            let node = &self.binary.nodes[i];
            let first = node.first_index as usize;
            if !node.is_leaf() {
                todo.extend([first, first + 1]);
                continue;
            }
            let id = self.binary.primitive_indices[first] as usize;
            let t = &self.triangles[id];
            let (e1, e2) = (t.v0 - t.v1, t.v2 - t.v0);
            let normal = e1.cross(e2);
            for axis in 0..3 {
                leaf.v0[axis].0[k] = t.v0[axis];
                leaf.e1[axis].0[k] = e1[axis];
                leaf.e2[axis].0[k] = e2[axis];
                leaf.normal[axis].0[k] = normal[axis];
            }
            leaf.triangle[k] = self.ids[id];
            k += 1;
        }
        self.bvh.leaves.push(leaf);
        (self.bvh.leaves.len() - 1) as u32 | LEAF
    }
}

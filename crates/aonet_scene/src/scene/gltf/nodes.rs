//! The node hierarchy: the transform of every node, and the nodes that the scene shows.

use super::accessor::Accessors;
use super::json::{Document, Node, at};
use aonet::{Error, Result};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// All nodes of a document in world space, at rest.
pub(super) struct Nodes {
    /// Node space to world space, one a node.
    pub(super) world_from_node: Vec<DAffine3>,
    /// The nodes of the default scene, parents first.
    pub(super) shown: Vec<usize>,
}

impl Nodes {
    /// Places the nodes of the default scene, else of the first scene, else of all roots.
    pub(super) fn place(document: &Document) -> Result<Self> {
        let parent = parents(&document.nodes)?;
        let all_roots: Vec<usize> = (0..parent.len()).filter(|&i| parent[i].is_none()).collect();
        let mut world_from_node = vec![DAffine3::IDENTITY; parent.len()];
        let reached = walk(&document.nodes, &all_roots, |i| {
            let above = parent[i].map_or(DAffine3::IDENTITY, |p| world_from_node[p]);
            world_from_node[i] = above * local(&document.nodes[i]);
            true
        })?;
        if reached.len() < parent.len() {
            let mut outside = vec![true; parent.len()];
            reached.iter().for_each(|&i| outside[i] = false);
            let found = outside.iter().position(|&o| o).unwrap_or_default();
            return Err(Error::format(
                "glTF nodes",
                "a hierarchy without cycles",
                format!("one with node {found}"),
            ));
        }
        let roots = match (document.scene, document.scenes.first()) {
            (Some(default), _) => &at(&document.scenes, default, "scene")?.nodes,
            (None, Some(first)) => &first.nodes,
            (None, None) => &all_roots,
        };
        let shown = walk(&document.nodes, roots, |i| is_visible(&document.nodes[i]))?;
        Ok(Self { world_from_node, shown })
    }
}

fn is_visible(node: &Node) -> bool {
    node.extensions.as_ref().and_then(|e| e.visibility.as_ref()).is_none_or(|v| v.visible)
}

fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>> {
    let mut parent = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            at(nodes, child, "child node")?;
            if let Some(other) = parent[child].replace(i) {
                let found = format!("nodes {other} and {i}");
                return Err(Error::format(format!("glTF node {child}"), "at most one parent", found));
            }
        }
    }
    Ok(parent)
}

/// Visits each node below `roots` once, parents first; `enter` returns whether to visit a node's children.
fn walk(nodes: &[Node], roots: &[usize], mut enter: impl FnMut(usize) -> bool) -> Result<Vec<usize>> {
    let mut seen = vec![false; nodes.len()];
    let mut order = Vec::new();
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(i) = open.pop() {
        let node = at(nodes, i, "scene node")?;
        if !std::mem::replace(&mut seen[i], true) && enter(i) {
            order.push(i);
            open.extend(node.children.iter().rev());
        }
    }
    Ok(order)
}

fn local(node: &Node) -> DAffine3 {
    match &node.matrix {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(matrix)),
        None => compose(
            node.translation.unwrap_or_default(),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    }
}

/// Translation x rotation x scale; a quaternion without length does not rotate.
fn compose(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
    let quaternion = DQuat::from_array(rotation);
    let turn = if quaternion.length_squared() > 0.0 { quaternion.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(DVec3::from(scale), turn, DVec3::from(translation))
}

/// World transforms of the copies of a node's mesh: one, or those of `EXT_mesh_gpu_instancing`.
pub(super) fn instances(
    node: &Node,
    world_from_node: DAffine3,
    accessors: &Accessors,
) -> Result<Vec<DAffine3>> {
    let Some(instancing) = node.extensions.as_ref().and_then(|e| e.instancing.as_ref()) else {
        return Ok(vec![world_from_node]);
    };
    let index = |name: &str| instancing.attributes.get(name).copied();
    let counts = ["TRANSLATION", "ROTATION", "SCALE"].iter().filter_map(|name| index(name));
    let counts = counts.map(|i| accessors.count(i)).collect::<Result<Vec<_>>>()?;
    let Some(&count) = counts.first() else { return Ok(vec![world_from_node]) };
    if counts.iter().any(|&c| c != count) {
        return Err(Error::format(
            "EXT_mesh_gpu_instancing",
            "attributes of one length",
            format!("{counts:?}"),
        ));
    }
    let translation = index("TRANSLATION").map(|i| accessors.floats::<3>(i)).transpose()?;
    let rotation = index("ROTATION").map(|i| accessors.floats::<4>(i)).transpose()?;
    let scale = index("SCALE").map(|i| accessors.floats::<3>(i)).transpose()?;
    let copy = |i: usize| {
        let t = translation.as_ref().map_or([0.0; 3], |t| t[i]);
        let r = rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]);
        let s = scale.as_ref().map_or([1.0; 3], |s| s[i]);
        world_from_node * compose(t.map(f64::from), r.map(f64::from), s.map(f64::from))
    };
    Ok((0..count).map(copy).collect())
}

/// Transform of a vertex to world space.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    point: DAffine3,
    normal: DMat3,
    /// Whether the transform exchanges front and back.
    pub(super) mirrors: bool,
}

impl Pose {
    pub(super) fn new(point: DAffine3) -> Self {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = point.matrix3;
        // Cofactors: the inverse transpose times the determinant, and defined for flat scales as well.
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrors = point.matrix3.determinant() < 0.0;
        Self { point, normal: if mirrors { -cofactors } else { cofactors }, mirrors }
    }

    pub(super) fn position(&self, local: glam::Vec3) -> glam::Vec3 {
        self.point.transform_point3(local.as_dvec3()).as_vec3()
    }

    /// Unit length, or zero if there is no direction.
    pub(super) fn direction(&self, local: glam::Vec3) -> glam::Vec3 {
        let direction = self.normal * local.as_dvec3();
        let largest = direction.abs().max_element();
        (direction / largest).normalize_or_zero().as_vec3()
    }
}

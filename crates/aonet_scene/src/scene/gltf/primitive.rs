//! One primitive of a mesh: its morphed vertices in mesh space and its triangles.

use super::accessor::Accessors;
use super::json::{self, Primitive};
use crate::Scene;
use aonet::{Error, Result};
use glam::Vec3;
use std::collections::BTreeMap;

/// Vertices and triangles in mesh space; no normals if the file has none. `None` for points and lines.
pub(super) fn read(
    accessors: &Accessors,
    primitive: &Primitive,
    weights: &[f32],
    what: &str,
) -> Result<Option<Scene>> {
    accessors.charge(0, what)?;
    let Some(topology) = topology(primitive.mode, what)? else { return Ok(None) };
    let Some(&position) = primitive.attributes.get("POSITION") else { return Ok(None) };
    if primitive.extensions.draco.is_some() && !accessors.is_stored(position) {
        return Err(json::draco());
    }
    let morphed = |name| morphed(accessors, primitive, (name, weights), what);
    let position = morphed("POSITION")?;
    let normal = morphed("NORMAL")?;
    let indices: Vec<u32> = match primitive.indices {
        Some(index) => accessors.integers::<1>(index)?.into_iter().map(|[i]| i).collect(),
        None => (0..position.len() as u32).collect(),
    };
    same_length(position.len(), if normal.is_empty() { position.len() } else { normal.len() }, what)?;
    if let Some(found) = indices.iter().find(|&&i| i as usize >= position.len()) {
        return Err(Error::format(format!("{what} indices"), format!("below {}", position.len()), found));
    }
    Ok(Some(Scene { position, normal, triangle: topology(&indices), ..Scene::default() }))
}

type Topology = fn(&[u32]) -> Vec<[u32; 3]>;

/// Triangles from indices. glTF 2.0 specification §3.7.2.1.
fn topology(mode: u32, what: &str) -> Result<Option<Topology>> {
    match mode {
        0..=3 => Ok(None),
        4 => Ok(Some(|i| i.as_chunks().0.to_vec())),
        5 => Ok(Some(|i| {
            let odd_reversed =
                |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
            i.windows(3).enumerate().map(odd_reversed).collect()
        })),
        6 => Ok(Some(|i| i.windows(2).skip(1).map(|w| [w[0], w[1], i[0]]).collect())),
        _ => Err(Error::format(format!("{what} mode"), "0 to 6", mode)),
    }
}

/// An attribute plus its weighted morph targets. Empty if the primitive lacks the attribute.
fn morphed(
    accessors: &Accessors,
    primitive: &Primitive,
    (name, weights): (&str, &[f32]),
    what: &str,
) -> Result<Vec<Vec3>> {
    let read = |attributes: &BTreeMap<String, usize>| {
        attributes.get(name).map(|&index| accessors.floats::<3>(index)).transpose()
    };
    let Some(base) = read(&primitive.attributes)? else { return Ok(Vec::new()) };
    let mut sum: Vec<Vec3> = base.into_iter().map(Vec3::from).collect();
    for (target, &weight) in primitive.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let Some(delta) = read(target)? else { continue };
        same_length(sum.len(), delta.len(), what)?;
        sum.iter_mut().zip(delta).for_each(|(v, d)| *v += weight * Vec3::from(d));
    }
    Ok(sum)
}

pub(super) fn same_length(expected: usize, found: usize, what: &str) -> Result<()> {
    if expected == found {
        return Ok(());
    }
    Err(Error::format(what, format!("attributes of one length ({expected})"), found))
}

/// Joints and weights of every vertex: one pair of arrays for each `JOINTS_n`. Empty where it is not skinned.
pub(super) fn influences(
    accessors: &Accessors,
    primitive: &Primitive,
    (vertices, joints): (usize, usize),
    what: &str,
) -> Result<Vec<Influences>> {
    let mut sets = Vec::new();
    for n in 0.. {
        let index = |name: &str| primitive.attributes.get(&format!("{name}_{n}")).copied();
        let Some((joint, weight)) = index("JOINTS").zip(index("WEIGHTS")) else { break };
        let set = Influences { joint: accessors.integers(joint)?, weight: accessors.floats(weight)? };
        same_length(vertices, set.joint.len(), what)?;
        same_length(vertices, set.weight.len(), what)?;
        if let Some(found) = set.joint.as_flattened().iter().find(|&&j| j as usize >= joints) {
            return Err(Error::format(format!("{what} joints"), format!("below {joints}"), found));
        }
        sets.push(set);
    }
    Ok(sets)
}

/// Four joints and their weights a vertex.
pub(super) struct Influences {
    pub(super) joint: Vec<[u32; 4]>,
    pub(super) weight: Vec<[f32; 4]>,
}

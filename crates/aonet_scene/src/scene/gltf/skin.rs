//! Skins at rest.

use super::accessor::Accessors;
use super::json::{Document, at};
use super::nodes::Pose;
use super::primitive::Influences;
use aonet::{Error, Result};
use glam::{DAffine3, DMat3, DMat4, DVec3};

/// Transforms from mesh space to world space, one a joint. The node of the mesh is ignored:
/// glTF 2.0 specification §3.7.3.3.
pub(super) fn joints(
    document: &Document,
    skin: usize,
    world_from_node: &[DAffine3],
    accessors: &Accessors,
) -> Result<Vec<DAffine3>> {
    let what = format!("glTF skin {skin}");
    let skin = at(&document.skins, skin, "skin")?;
    accessors.charge(skin.joints.len(), &what)?;
    let inverse_bind = match skin.inverse_bind_matrices {
        None => vec![DAffine3::IDENTITY; skin.joints.len()],
        Some(index) => {
            let read = accessors.floats::<16>(index)?;
            read.iter().map(|m| DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from)))).collect()
        }
    };
    if inverse_bind.len() < skin.joints.len() {
        let expected = format!("an inverse bind matrix for each of {} joints", skin.joints.len());
        return Err(Error::format(what, expected, inverse_bind.len()));
    }
    let placed = |(&joint, bind)| Ok(*at(world_from_node, joint, "joint node")? * bind);
    skin.joints.iter().zip(inverse_bind).map(placed).collect()
}

/// Weighted mean of the joints of one vertex; only its first joint if all weights are zero.
pub(super) fn blend(joints: &[DAffine3], sets: &[Influences], vertex: usize) -> Pose {
    let mut total = 0.0;
    let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
    for set in sets {
        for (joint, weight) in set.joint[vertex].into_iter().zip(set.weight[vertex].map(f64::from)) {
            if weight != 0.0 {
                let joint = joints[joint as usize];
                total += weight;
                sum.matrix3 += joint.matrix3 * weight;
                sum.translation += joint.translation * weight;
            }
        }
    }
    if total == 0.0 {
        return Pose::new(joints[sets[0].joint[vertex][0] as usize]);
    }
    Pose::new(DAffine3 { matrix3: sum.matrix3 / total, translation: sum.translation / total })
}

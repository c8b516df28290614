//! Which channel of a file is what, by its name.

use super::NormalSpace;
use crate::exr_file::Channel;
use aonet::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    Normal(usize),
    GeoNormal(usize),
    Depth,
    Ao,
    Mask,
}

/// The channels of a frame.
pub(super) struct Layout {
    pub(super) depth: Channel,
    pub(super) normal: [Channel; 3],
    pub(super) geo_normal: Option<[Channel; 3]>,
    pub(super) ao: Option<Channel>,
    pub(super) mask: Option<Channel>,
    /// Space of the normals, as far as names tell.
    pub(super) space: NormalSpace,
}

impl Layout {
    /// # Errors
    /// When depth or normals are missing; lists what is accepted and what is there.
    pub(super) fn find(channels: &[Channel]) -> Result<Self> {
        let roles: Vec<_> =
            channels.iter().filter_map(|c| role(&c.name).map(|(layer, role)| (layer, role, c))).collect();
        let layer =
            roles.iter().find(|(_, role, _)| *role == Role::Normal(0)).map(|(layer, ..)| layer.as_str());
        let in_layer = |wanted: Role| {
            let mut of_role = roles.iter().filter(|(_, role, _)| *role == wanted);
            of_role
                .clone()
                .find(|(l, ..)| Some(l.as_str()) == layer)
                .or(of_role.next())
                .map(|(.., c)| (*c).clone())
        };
        let vector =
            |role: fn(usize) -> Role| Some([in_layer(role(0))?, in_layer(role(1))?, in_layer(role(2))?]);
        let missing = |expected: &str| Error::format("channels", expected, list(channels));
        Ok(Self {
            normal: vector(Role::Normal)
                .ok_or_else(|| missing("normal.X, normal.Y and normal.Z (or N.X, LAYER.Normal.X, …)"))?,
            depth: in_layer(Role::Depth).ok_or_else(|| missing("depth (or Z, depth.Z, LAYER.Depth.Z, …)"))?,
            geo_normal: vector(Role::GeoNormal),
            ao: in_layer(Role::Ao),
            mask: in_layer(Role::Mask),
            space: if layer.is_some_and(|l| !l.is_empty()) {
                NormalSpace::BlenderWorld
            } else {
                NormalSpace::View
            },
        })
    }

    /// Depth, normal, geometric normal, AO, mask: those that are there, in this order, each with its value
    /// where the file has no pixel.
    pub(super) fn wanted(&self) -> Vec<(Channel, f32)> {
        let mut wanted = vec![(self.depth.clone(), f32::INFINITY)];
        wanted.extend(self.normal.iter().map(|c| (c.clone(), 0.0)));
        wanted.extend(self.geo_normal.iter().flatten().map(|c| (c.clone(), 0.0)));
        wanted.extend(self.ao.iter().map(|c| (c.clone(), 1.0)));
        wanted.extend(self.mask.iter().map(|c| (c.clone(), 0.0)));
        wanted
    }
}

/// The layer in front of the name, and what the rest of it means.
fn role(name: &str) -> Option<(String, Role)> {
    let name = name.to_ascii_lowercase();
    let (group, component) = name.rsplit_once('.').unwrap_or(("", &name));
    let (layer, pass) = group.rsplit_once('.').unwrap_or(("", group));
    let axis =
        || ["xr", "yg", "zb"].iter().position(|names| component.len() == 1 && names.contains(component));
    let found = match (pass, component) {
        ("normal" | "normals" | "n", _) => axis().map(Role::Normal),
        ("geo_normal", _) => axis().map(Role::GeoNormal),
        ("depth" | "z", "z" | "v" | "r" | "y" | "depth") => Some(Role::Depth),
        ("ao" | "ambient occlusion", "r" | "v" | "y" | "ao") => Some(Role::Ao),
        _ => None,
    };
    if let Some(role) = found {
        return Some((layer.into(), role));
    }
    let role = match component {
        "depth" => Role::Depth,
        "z" if group.is_empty() => Role::Depth,
        "ao" => Role::Ao,
        "mask" => Role::Mask,
        _ => return None,
    };
    Some((group.into(), role))
}

/// Names for a message: at most the first 40.
fn list(channels: &[Channel]) -> String {
    let names: Vec<&str> = channels.iter().take(40).map(|c| c.name.as_str()).collect();
    let more = if channels.len() > 40 { format!(" and {} more", channels.len() - 40) } else { String::new() };
    if names.is_empty() { "none".into() } else { format!("{}{more}", names.join(", ")) }
}

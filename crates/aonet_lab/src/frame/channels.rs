//! Finds the channels of a file by their names.

use super::NormalSpace;
use crate::exr_file::{Channel, ExrFile};
use aonet::{Error, Result, SecondLayer, Window};
use half::f16;

/// Depth from which on a pixel is background: Blender writes 1e10. For half floats, the largest value.
const FAR_AWAY: f32 = 1e9;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    Normal(usize),
    GeoNormal(usize),
    Depth,
    Ao,
    Mask,
    SecondDepth,
    SecondNormal(usize),
}

/// The channels of a frame.
pub(super) struct Layout {
    pub(super) depth: Channel,
    pub(super) normal: [Channel; 3],
    pub(super) geo_normal: Option<[Channel; 3]>,
    pub(super) ao: Option<Channel>,
    pub(super) mask: Option<Channel>,
    second_depth: Option<Channel>,
    second_normal: Option<[Channel; 3]>,
    /// Space of the normals, as far as names determine it.
    pub(super) space: NormalSpace,
}

/// Channels with the layers in front of their names and their meanings.
struct Roles<'a> {
    channels: &'a [Channel],
    found: Vec<(String, Role, &'a Channel)>,
    /// The layer of the first normal.
    layer: Option<String>,
}

impl<'a> Roles<'a> {
    fn of(channels: &'a [Channel]) -> Self {
        let found: Vec<_> =
            channels.iter().filter_map(|c| role(&c.name).map(|(layer, role)| (layer, role, c))).collect();
        let layer =
            found.iter().find(|(_, role, _)| *role == Role::Normal(0)).map(|(layer, ..)| layer.clone());
        Self { channels, found, layer }
    }

    /// The channel with a meaning, if possible in the layer of the first normal.
    fn channel(&self, wanted: Role) -> Option<Channel> {
        let mut of_role = self.found.iter().filter(|(_, role, _)| *role == wanted);
        of_role
            .clone()
            .find(|(layer, ..)| Some(layer) == self.layer.as_ref())
            .or(of_role.next())
            .map(|(.., c)| (*c).clone())
    }

    fn vector(&self, role: fn(usize) -> Role) -> Option<[Channel; 3]> {
        Some([self.channel(role(0))?, self.channel(role(1))?, self.channel(role(2))?])
    }

    /// # Errors
    /// When there is none; lists accepted and found names.
    fn depth(&self) -> Result<Channel> {
        let missing = || self.missing("depth (or Z, depth.Z, LAYER.Depth.Z, …)");
        self.channel(Role::Depth).ok_or_else(missing)
    }

    fn missing(&self, expected: &str) -> Error {
        Error::format("channels", expected, list(self.channels))
    }

    /// Space of the normals, as far as names determine it.
    fn space(&self) -> NormalSpace {
        match self.layer.as_ref().is_some_and(|layer| !layer.is_empty()) {
            true => NormalSpace::BlenderWorld,
            false => NormalSpace::View,
        }
    }
}

impl Layout {
    /// # Errors
    /// When depth or normals are missing; lists accepted and found names.
    pub(super) fn find(channels: &[Channel]) -> Result<Self> {
        let roles = Roles::of(channels);
        Ok(Self {
            normal: roles.vector(Role::Normal).ok_or_else(|| {
                roles.missing("normal.X, normal.Y and normal.Z (or N.X, LAYER.Normal.X, …)")
            })?,
            depth: roles.depth()?,
            geo_normal: roles.vector(Role::GeoNormal),
            ao: roles.channel(Role::Ao),
            mask: roles.channel(Role::Mask),
            second_depth: roles.channel(Role::SecondDepth),
            second_normal: roles.vector(Role::SecondNormal),
            space: roles.space(),
        })
    }

    /// The same without what is no G-buffer: geometric normals and AO.
    pub(super) fn of_gbuffer(self) -> Self {
        Self { geo_normal: None, ao: None, ..self }
    }

    /// Reads the pixels of these channels in a window.
    ///
    /// # Errors
    /// When they are damaged or stored in an unsupported way.
    pub(super) fn read(&self, file: ExrFile, window: Window) -> Result<Pixels> {
        let vector = |channels: &[Channel; 3]| channels.clone().map(|c| (c, 0.0));
        let mut wanted = vec![(self.depth.clone(), f32::INFINITY)];
        wanted.extend(vector(&self.normal));
        wanted.extend(self.geo_normal.iter().flat_map(vector));
        wanted.extend(self.ao.iter().map(|c| (c.clone(), 1.0)));
        wanted.extend(self.mask.iter().map(|c| (c.clone(), 0.0)));
        wanted.extend(self.second_depth.iter().map(|c| (c.clone(), f32::INFINITY)));
        wanted.extend(self.second_normal.iter().flat_map(vector));
        let mut planes = file.planes_of(window, &wanted)?.into_iter();
        let mut plane = || planes.next().expect("a plane for each wanted channel");
        Ok(Pixels {
            depth: plane(),
            normal: interleave([plane(), plane(), plane()]),
            geo_normal: self.geo_normal.as_ref().map(|_| interleave([plane(), plane(), plane()])),
            ao: self.ao.as_ref().map(|_| plane()),
            mask: self.mask.as_ref().map(|_| plane()),
            second: self.second_depth.as_ref().map(|_| SecondLayer {
                depth: plane().into(),
                normal: self.second_normal.as_ref().map(|_| interleave([plane(), plane(), plane()]).into()),
            }),
            far_away: far_away(&self.depth),
        })
    }
}

/// The channels of a file whose first layer is the second layer of a frame.
pub(super) struct SecondLayout {
    depth: Channel,
    normal: Option<[Channel; 3]>,
    mask: Option<Channel>,
    /// Space of the normals, as far as names determine it.
    pub(super) space: NormalSpace,
}

impl SecondLayout {
    /// # Errors
    /// When depth is missing; lists accepted and found names.
    pub(super) fn find(channels: &[Channel]) -> Result<Self> {
        let roles = Roles::of(channels);
        let (normal, mask) = (roles.vector(Role::Normal), roles.channel(Role::Mask));
        Ok(Self { depth: roles.depth()?, normal, mask, space: roles.space() })
    }

    /// Reads depth, infinite on the background, and normals, if there are some.
    ///
    /// # Errors
    /// When the channels are damaged or stored in an unsupported way.
    pub(super) fn read(&self, file: ExrFile, window: Window) -> Result<SecondPixels> {
        let mut wanted = vec![(self.depth.clone(), f32::INFINITY)];
        wanted.extend(self.normal.iter().flatten().map(|c| (c.clone(), 0.0)));
        wanted.extend(self.mask.iter().map(|c| (c.clone(), 0.0)));
        let mut planes = file.planes_of(window, &wanted)?.into_iter();
        let mut plane = || planes.next().expect("a plane for each wanted channel");
        let mut depth = plane();
        let normal = self.normal.as_ref().map(|_| interleave([plane(), plane(), plane()]));
        let mask = self.mask.as_ref().map(|_| plane());
        let background = Background { mask: mask.as_deref(), normal: normal.as_deref() };
        background.clear(&mut depth, far_away(&self.depth));
        Ok(SecondPixels { depth, normal })
    }
}

/// HxW values of a second layer; normals are as stored.
pub(super) struct SecondPixels {
    pub(super) depth: Vec<f32>,
    pub(super) normal: Option<Vec<[f32; 3]>>,
}

/// What a file says about the background.
struct Background<'a> {
    mask: Option<&'a [f32]>,
    normal: Option<&'a [[f32; 3]]>,
}

impl Background<'_> {
    /// Makes the depth infinite on the background, which begins at the depth `far_away`.
    fn clear(&self, depth: &mut [f32], far_away: f32) {
        for (i, depth) in depth.iter_mut().enumerate() {
            let hidden = match (self.mask, self.normal) {
                (Some(mask), _) => mask[i] < 0.5,
                (None, Some(normal)) => normal[i] == [0.0; 3],
                (None, None) => false,
            };
            if hidden || *depth >= far_away {
                *depth = f32::INFINITY;
            }
        }
    }
}

/// HxW values of a file, as stored.
pub(super) struct Pixels {
    pub(super) depth: Vec<f32>,
    pub(super) normal: Vec<[f32; 3]>,
    pub(super) geo_normal: Option<Vec<[f32; 3]>>,
    pub(super) ao: Option<Vec<f32>>,
    mask: Option<Vec<f32>>,
    pub(super) second: Option<SecondLayer<'static>>,
    /// Depth from which on a pixel is background.
    far_away: f32,
}

impl Pixels {
    /// Makes the depth infinite on the background.
    pub(super) fn find_background(&mut self) {
        let background = Background { mask: self.mask.as_deref(), normal: Some(&self.normal) };
        background.clear(&mut self.depth, self.far_away);
        if let Some(second) = &mut self.second {
            let pixels = second.depth.to_mut().iter_mut().zip(&self.depth);
            pixels.filter(|(_, first)| **first == f32::INFINITY).for_each(|(d, _)| *d = f32::INFINITY);
        }
    }
}

/// HxW vectors of three planes.
fn interleave([x, y, z]: [Vec<f32>; 3]) -> Vec<[f32; 3]> {
    x.iter().zip(&y).zip(&z).map(|((x, y), z)| [*x, *y, *z]).collect()
}

/// The channel that holds AO: by its name, or grey values without a name.
pub(crate) fn ao(channels: &[Channel]) -> Option<&Channel> {
    of_role(channels, Role::Ao)
        .or_else(|| ["Y", "V", "R"].iter().find_map(|name| channels.iter().find(|c| c.name == *name)))
}

/// The channels that hold normals in an image of nothing else: by their names, or `R`, `G`, `B` or `X`, `Y`, `Z`.
pub(crate) fn normal(channels: &[Channel]) -> Option<[Channel; 3]> {
    let by_name = [0, 1, 2].map(|c| of_role(channels, Role::Normal(c)).cloned());
    match by_name {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => only(channels, ["R", "G", "B"]).or_else(|| only(channels, ["X", "Y", "Z"])),
    }
}

/// The channel that holds depth in an image of nothing else, or three equal ones: see [`grey`].
pub(crate) fn depth(channels: &[Channel]) -> Option<Vec<Channel>> {
    grey(channels, Role::Depth)
}

/// The channel that holds AO in an image of nothing else, or three equal ones: see [`grey`].
pub(crate) fn ao_alone(channels: &[Channel]) -> Option<Vec<Channel>> {
    grey(channels, Role::Ao)
}

/// The channel of an image of one quantity: the one with its name, the only one unless it has another quantity's name, or
/// `R`, `G`, `B`. Alpha does not count.
fn grey(channels: &[Channel], wanted: Role) -> Option<Vec<Channel>> {
    // The Z of a vector is not a depth.
    if only(channels, ["X", "Y", "Z"]).is_some() {
        return None;
    }
    if let Some(named) = of_role(channels, wanted) {
        return Some(vec![named.clone()]);
    }
    let mut colours = channels.iter().filter(|c| c.name != "A");
    match (colours.next(), colours.next()) {
        (Some(alone), None) if role(&alone.name).is_none() => Some(vec![alone.clone()]),
        _ => only(channels, ["R", "G", "B"]).map(Vec::from),
    }
}

fn of_role(channels: &[Channel], wanted: Role) -> Option<&Channel> {
    channels.iter().find(|c| role(&c.name).is_some_and(|(_, role)| role == wanted))
}

/// The channels with these names, if there are no others but alpha.
fn only(channels: &[Channel], names: [&str; 3]) -> Option<[Channel; 3]> {
    let named = names.map(|name| channels.iter().find(|c| c.name == name));
    let others = channels.iter().any(|c| c.name != "A" && !names.contains(&&*c.name));
    match named {
        [Some(a), Some(b), Some(c)] if !others => Some([a.clone(), b.clone(), c.clone()]),
        _ => None,
    }
}

/// Depth from which on a pixel of `channel` is background.
pub(crate) fn far_away(channel: &Channel) -> f32 {
    if channel.is_half() { f16::MAX.to_f32() } else { FAR_AWAY }
}

/// The layer in front of the name, and the meaning of the rest.
fn role(name: &str) -> Option<(String, Role)> {
    let name = name.to_ascii_lowercase();
    match name.strip_prefix("second.") {
        Some("depth") => return Some((String::new(), Role::SecondDepth)),
        Some(rest) => {
            let axis = ["normal.x", "normal.y", "normal.z"].iter().position(|normal| *normal == rest);
            if let Some(axis) = axis {
                return Some((String::new(), Role::SecondNormal(axis)));
            }
        }
        None => {}
    }
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
pub(crate) fn list(channels: &[Channel]) -> String {
    let names: Vec<&str> = channels.iter().take(40).map(|c| c.name.as_str()).collect();
    let more = if channels.len() > 40 { format!(" and {} more", channels.len() - 40) } else { String::new() };
    if names.is_empty() { "none".into() } else { format!("{}{more}", names.join(", ")) }
}

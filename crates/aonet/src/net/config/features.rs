//! The input channels of a network.

use crate::error::{Error, Result};
use crate::search::Share;
use serde::{Deserialize, Serialize};

/// A component of a vector in view space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// To the right.
    X,
    /// Up.
    Y,
    /// Towards the viewer.
    Z,
}

impl Axis {
    /// All three in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Index of the component in an array: 0, 1 or 2.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// What one input channel holds. AO-Net §3.1 and Table 3; the projected radius and the search are ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Channel {
    /// A component of the view-space normal; 0 on the background.
    Normal(Axis),
    /// The same as n/2 + 1/2, as G-buffers store it; 0 on the background.
    NormalEncoded(Axis),
    /// A component of the view-space position (world units); 0 on the background.
    Position(Axis),
    /// Depth along -Z (world units); 0 on the background.
    Depth,
    /// Depth scaled to [0, 1] over the foreground of the frame; 1 on the background.
    DepthNormalized,
    /// (log2(AO radius in pixels) - 5) / 4; the background is infinitely far.
    ProjectedRadius,
    /// 1 minus the visibility that the network's search finds; 0 on the background.
    HorizonOcclusion,
    /// A share of light that the network's search reports; 0 on the background. The open share, the rest, is no channel.
    Light(Share),
    /// 1 everywhere if the frame has a second layer, else 0: then the search has looked behind the first layer already.
    SecondLayer,
}

impl Channel {
    /// Its name in tables and plots. In files, underscores replace the spaces.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal(axis) => ["normal x", "normal y", "normal z"][axis.index()],
            Self::NormalEncoded(axis) => {
                ["encoded normal x", "encoded normal y", "encoded normal z"][axis.index()]
            }
            Self::Position(axis) => ["position x", "position y", "position z"][axis.index()],
            Self::Depth => "depth",
            Self::DepthNormalized => "normalised depth",
            Self::ProjectedRadius => "projected radius",
            Self::HorizonOcclusion => "horizon occlusion",
            Self::Light(share) => match share {
                Share::Open => "open light",
                Share::Hit => "hit light",
                Share::HiddenClose => "close hidden light",
                Share::HiddenMiddle => "middle hidden light",
                Share::HiddenDeep => "deep hidden light",
                Share::Off => "off light",
            },
            Self::SecondLayer => "second layer",
        }
    }

    /// Every channel that there is.
    pub fn all() -> impl Iterator<Item = Self> {
        let vectors = [Self::Normal, Self::NormalEncoded, Self::Position];
        let scalars = [Self::Depth, Self::DepthNormalized, Self::ProjectedRadius, Self::HorizonOcclusion];
        let shares = Share::ALL.into_iter().skip(1).map(Self::Light);
        let all = vectors.into_iter().flat_map(|of| Axis::ALL.map(of)).chain(scalars).chain(shares);
        all.chain([Self::SecondLayer])
    }

    /// Which plane of the network's search it shows, if it shows any.
    pub const fn search_plane(self) -> Option<usize> {
        match self {
            Self::HorizonOcclusion => Some(0),
            Self::Light(share) => Some(share.search_plane()),
            Self::Normal(_)
            | Self::NormalEncoded(_)
            | Self::Position(_)
            | Self::Depth
            | Self::DepthNormalized
            | Self::ProjectedRadius
            | Self::SecondLayer => None,
        }
    }
}

impl From<Channel> for String {
    fn from(channel: Channel) -> Self {
        channel.name().replace(' ', "_")
    }
}

impl TryFrom<String> for Channel {
    type Error = Error;

    fn try_from(name: String) -> Result<Self> {
        Self::all().find(|channel| String::from(*channel) == name).ok_or_else(|| {
            let names: Vec<_> = Self::all().map(String::from).collect();
            Error::config("features", format!("channels out of {}", names.join(", ")), name)
        })
    }
}

/// The input channels of a network in order. Files hold a list of names; old files hold one name for the whole list.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(transparent)]
pub struct Features(Vec<Channel>);

/// Lists of channels that have a name of their own, which old files use.
type Named = (&'static str, fn() -> Features);

const NAMED: [Named; 7] = [
    ("normal", Features::normal),
    ("normal_encoded", Features::normal_encoded),
    ("normal_depth", Features::normal_depth),
    ("normal_depth_normalized", Features::normal_depth_normalized),
    ("normal_projected_radius", Features::normal_projected_radius),
    ("normal_radius_horizon", Features::normal_radius_horizon),
    ("normal_position", Features::normal_position),
];

impl Features {
    /// A list of channels; [`ModelConfig::checked`](super::ModelConfig::checked) says which lists a network takes.
    pub fn new(channels: Vec<Channel>) -> Self {
        Self(channels)
    }

    /// View-space normal. The paper's choice.
    pub fn normal() -> Self {
        Self(Axis::ALL.map(Channel::Normal).into())
    }

    /// The same as n/2 + 1/2.
    pub fn normal_encoded() -> Self {
        Self(Axis::ALL.map(Channel::NormalEncoded).into())
    }

    /// Normal and depth in world units.
    pub fn normal_depth() -> Self {
        Self::normal().with(Channel::Depth)
    }

    /// Normal and depth scaled to [0, 1] over the frame's foreground.
    pub fn normal_depth_normalized() -> Self {
        Self::normal().with(Channel::DepthNormalized)
    }

    /// Normal and the AO radius in pixels, log2. One network for any radius and any unit.
    pub fn normal_projected_radius() -> Self {
        Self::normal().with(Channel::ProjectedRadius)
    }

    /// The same and the result of a search.
    pub fn normal_radius_horizon() -> Self {
        Self::normal_projected_radius().with(Channel::HorizonOcclusion)
    }

    /// Normal and view-space position in world units. What Deep Shading sees.
    pub fn normal_position() -> Self {
        Axis::ALL.map(Channel::Position).into_iter().fold(Self::normal(), Self::with)
    }

    /// The same with one more channel.
    pub fn with(mut self, channel: Channel) -> Self {
        self.0.push(channel);
        self
    }

    /// The lists that old files name.
    pub fn named() -> impl Iterator<Item = Self> {
        NAMED.iter().map(|(_, features)| features())
    }

    /// The list that an old file names so.
    pub(super) fn of_old_name(name: &str) -> Result<Self> {
        let found = NAMED.iter().find(|(old, _)| *old == name);
        found.map(|(_, features)| features()).ok_or_else(|| {
            let names: Vec<_> = NAMED.iter().map(|(name, _)| *name).collect();
            Error::config("features", format!("a list of channels, or one of {}", names.join(", ")), name)
        })
    }

    /// The input channels.
    pub fn channels(&self) -> &[Channel] {
        &self.0
    }

    /// Whether the network sees this channel.
    pub fn sees(&self, channel: Channel) -> bool {
        self.0.contains(&channel)
    }

    /// The channel with the search's result, if there is one.
    pub fn horizon(&self) -> Option<usize> {
        self.0.iter().position(|c| *c == Channel::HorizonOcclusion)
    }

    /// Normal, projected radius, every share of light that connected arcs report, and whether there is a second layer.
    pub fn normal_radius_light() -> Self {
        let shares = Share::ALL.into_iter().skip(1).map(Channel::Light);
        shares.fold(Self::normal_projected_radius(), Self::with).with(Channel::SecondLayer)
    }

    /// Whether a channel shows what the search found.
    pub fn show_a_search(&self) -> bool {
        self.0.iter().any(|channel| channel.search_plane().is_some())
    }

    /// Whether the AO radius is an input, so that one network serves every radius.
    pub fn sees_radius(&self) -> bool {
        self.sees(Channel::ProjectedRadius)
    }

    /// Whether the first three channels are a normal, which kernels can weigh.
    pub(super) fn begin_with_a_normal(&self) -> bool {
        let of = |vector: fn(Axis) -> Channel| self.0.starts_with(&Axis::ALL.map(vector));
        of(Channel::Normal) || of(Channel::NormalEncoded)
    }

    /// The first channel that is in the list twice.
    pub(super) fn repeated(&self) -> Option<Channel> {
        self.0.iter().enumerate().find(|(i, c)| self.0[..*i].contains(c)).map(|(_, c)| *c)
    }

    /// The first channel of a vector whose other components do not stand beside it in order.
    pub(super) fn torn_vector(&self) -> Option<Channel> {
        self.0.iter().enumerate().find_map(|(i, channel)| {
            let (vector, axis): (fn(Axis) -> Channel, Axis) = match *channel {
                Channel::Normal(axis) => (Channel::Normal, axis),
                Channel::NormalEncoded(axis) => (Channel::NormalEncoded, axis),
                Channel::Position(axis) => (Channel::Position, axis),
                Channel::Depth
                | Channel::DepthNormalized
                | Channel::ProjectedRadius
                | Channel::HorizonOcclusion
                | Channel::Light(_)
                | Channel::SecondLayer => return None,
            };
            let whole = i.checked_sub(axis.index()).and_then(|first| self.0.get(first..first + 3));
            (whole != Some(&Axis::ALL.map(vector)[..])).then_some(*channel)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_have_names_of_their_own_and_round_trip() {
        let all: Vec<_> = Channel::all().collect();
        assert_eq!(all.len(), 19);
        assert_eq!(Features::new(all.clone()).repeated(), None);
        for channel in all {
            let json = serde_json::to_string(&channel).unwrap();
            assert_eq!(serde_json::from_str::<Channel>(&json).unwrap(), channel);
        }
        assert!(serde_json::from_str::<Channel>("\"colour\"").unwrap_err().to_string().contains("normal_x"));
    }

    #[test]
    fn vectors_stand_together() {
        assert!(Features::named().all(|f| f.torn_vector().is_none() && f.repeated().is_none()));
        let torn = Features::new(vec![Channel::Depth, Channel::Normal(Axis::X), Channel::Normal(Axis::Z)]);
        assert_eq!(torn.torn_vector(), Some(Channel::Normal(Axis::X)));
        assert_eq!(
            Features::new(vec![Channel::Normal(Axis::Y)]).torn_vector(),
            Some(Channel::Normal(Axis::Y))
        );
        assert_eq!(
            Features::normal().with(Channel::Normal(Axis::X)).repeated(),
            Some(Channel::Normal(Axis::X))
        );
    }
}

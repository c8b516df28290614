//! Methods that compute visibility.

use crate::{Error, Result};
use aonet::gpu::Layers;
use std::fmt;
use std::str::FromStr;

/// A method that runs on a graphics device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// No ambient occlusion: visibility 1.
    Off,
    /// Screen-space ambient occlusion, with the defaults of its source.
    Ssao,
    /// The same, with parameters that were found on training frames; so for the other classic methods.
    SsaoTuned,
    /// Horizon-based.
    Hbao,
    /// Horizon-based, tuned.
    HbaoTuned,
    /// Ground-truth.
    Gtao,
    /// Ground-truth, tuned.
    GtaoTuned,
    /// With a visibility bitmask.
    Vbao,
    /// With a visibility bitmask, tuned.
    VbaoTuned,
    /// Attenuated GTAO as the network sees it.
    Agtao,
    /// Attenuated GTAO, tuned: the strongest classic method of one layer.
    AgtaoTuned,
    /// Connected arcs, which read the second layer where a frame has one.
    Arcs,
    /// Connected arcs, tuned.
    ArcsTuned,
    /// The shipped network `fast`, which corrects a horizon search of few taps. All networks but the paper's serve any radius.
    Fast,
    /// The shipped network `balanced`, which corrects a horizon search and surveys what it cannot see. It and `high` read the
    /// second layer where a frame has one.
    #[default]
    Balanced,
    /// The shipped network `high`, which weighs what connected arcs find.
    High,
    /// The shipped network of the paper.
    Paper,
    /// Ray-traced: converges while camera and scene do not move.
    Reference,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 18] = [
        Self::Off,
        Self::Ssao,
        Self::SsaoTuned,
        Self::Hbao,
        Self::HbaoTuned,
        Self::Gtao,
        Self::GtaoTuned,
        Self::Vbao,
        Self::VbaoTuned,
        Self::Agtao,
        Self::AgtaoTuned,
        Self::Arcs,
        Self::ArcsTuned,
        Self::Fast,
        Self::Balanced,
        Self::High,
        Self::Paper,
        Self::Reference,
    ];

    /// Its name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Ssao => "ssao",
            Self::SsaoTuned => "ssao:tuned",
            Self::Hbao => "hbao",
            Self::HbaoTuned => "hbao:tuned",
            Self::Gtao => "gtao",
            Self::GtaoTuned => "gtao:tuned",
            Self::Vbao => "vbao",
            Self::VbaoTuned => "vbao:tuned",
            Self::Agtao => "agtao",
            Self::AgtaoTuned => "agtao:tuned",
            Self::Arcs => "arcs",
            Self::ArcsTuned => "arcs:tuned",
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::High => "high",
            Self::Paper => "paper",
            Self::Reference => "reference",
        }
    }

    /// Layers of depth that it reads of frames with these layers.
    pub(super) fn layers(self, of_frame: Layers) -> Layers {
        match self {
            Self::Arcs | Self::ArcsTuned | Self::Balanced | Self::High => of_frame,
            _ => Layers::One,
        }
    }

    /// Whether it has bent normals.
    pub fn has_bent_normals(self) -> bool {
        match self {
            Self::Gtao
            | Self::GtaoTuned
            | Self::Agtao
            | Self::AgtaoTuned
            | Self::Arcs
            | Self::ArcsTuned
            | Self::Fast
            | Self::Balanced
            | Self::High => true,
            Self::Off
            | Self::Ssao
            | Self::SsaoTuned
            | Self::Hbao
            | Self::HbaoTuned
            | Self::Vbao
            | Self::VbaoTuned
            | Self::Paper
            | Self::Reference => false,
        }
    }

    /// Its title in controls.
    pub fn title(self) -> &'static str {
        match self {
            Self::Off => "no AO",
            Self::Ssao => "SSAO",
            Self::SsaoTuned => "SSAO, tuned",
            Self::Hbao => "HBAO",
            Self::HbaoTuned => "HBAO, tuned",
            Self::Gtao => "GTAO",
            Self::GtaoTuned => "GTAO, tuned",
            Self::Vbao => "VBAO",
            Self::VbaoTuned => "VBAO, tuned",
            Self::Agtao => "attenuated GTAO",
            Self::AgtaoTuned => "attenuated GTAO, tuned",
            Self::Arcs => "connected arcs",
            Self::ArcsTuned => "connected arcs, tuned",
            Self::Fast => "network, fast",
            Self::Balanced => "network",
            Self::High => "network, high quality",
            Self::Paper => "network of the paper",
            Self::Reference => "ray-traced reference",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let names = Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| Error::request("method", format!("one of {names}"), format!("{name:?}")))
    }
}

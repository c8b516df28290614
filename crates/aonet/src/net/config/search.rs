//! The search that a network sees and corrects.

use crate::error::Result;
use crate::search::{AgtaoParams, ArcsParams, Classic, Denoise, PLANES};
use serde::{Deserialize, Serialize};

/// A classic method and its parameters, run before the network. As JSON: `{"agtao": {"slices": 3, ...}}`.
///
/// A network was trained with these parameters, so they stand in its file: another preset of the method does not change
/// the network. A method that becomes a search needs a variant here and an arm in every backend.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SearchConfig {
    /// Attenuated GTAO.
    Agtao(AgtaoParams),
    /// Connected arcs, which also report shares of light.
    Arcs(ArcsParams),
}

impl SearchConfig {
    /// The preset `agtao:tuned`: for networks that are yet to be trained. Without the pass that settles, which
    /// [`ModelConfig::smooth`](super::ModelConfig::smooth) puts at the end.
    ///
    /// # Panics
    /// Never: the preset is part of the crate.
    pub fn tuned() -> Self {
        match Classic::named("agtao:tuned") {
            Ok(Classic::Agtao(params)) => Self::Agtao(AgtaoParams { denoise_keep: 0.0, ..params }),
            found => unreachable!("a preset of this crate: {found:?}"),
        }
    }

    /// The same search as a classic method.
    pub fn method(&self) -> Classic {
        match *self {
            Self::Agtao(params) => Classic::Agtao(params),
            Self::Arcs(params) => Classic::Arcs(params),
        }
    }

    /// The filter after the search.
    pub(crate) fn filter(&self) -> Denoise {
        match self {
            Self::Agtao(params) => params.denoise(),
            Self::Arcs(params) => params.denoise(),
        }
    }

    /// Number of values that it reports for a pixel: the visibility, then each share of light.
    pub fn planes(&self) -> usize {
        match self {
            Self::Agtao(_) => 1,
            Self::Arcs(_) => PLANES,
        }
    }

    /// The search after a check of every parameter.
    ///
    /// # Errors
    /// Names the parameter, its range and what was found.
    pub fn checked(self) -> Result<Self> {
        self.method().checked().map(|_| self)
    }
}

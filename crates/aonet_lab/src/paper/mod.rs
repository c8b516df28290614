//! Every table and figure of the paper, from trained networks and test frames.
//!
//! [`measure`](measure::measure) takes the numbers; tables, claims and bars are made from these numbers only.
//! Pictures run the networks again on a few views. A row without a network is printed as `not trained`.

mod base64;
mod charts;
pub mod claims;
mod crops;
#[cfg(test)]
pub(crate) mod fixtures;
mod layers;
pub mod measure;
mod pictures;
mod report;
pub mod rows;
mod save;
mod tables;

use crate::dataset::{Manifest, Split};
use crate::picture::Caption;
use crate::timing;
use aonet_scene::error::{Error, Result};
use claims::Claim;
use image::RgbImage;
use measure::{Measurements, Needs};
use serde_json::{Value, json};

pub use report::report;
pub use rows::Models;
pub use save::save;

/// A table or a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Item {
    /// Quality and time against other methods.
    Table1,
    /// Time at three sizes.
    Table2,
    /// Input features.
    Table3,
    /// Patches and kernels.
    Table4,
    /// Variants that the paper does not test.
    Ablations,
    /// Sensitivity to each input channel.
    Fig2,
    /// Time level by level, before and after patches.
    Fig3,
    /// Pictures before and after patches.
    Fig5,
    /// Pictures without and with kernels.
    Fig6,
    /// Pictures of every method of Table 1.
    Fig7,
    /// Enlarged edges and corners.
    Fig8,
}

impl Item {
    /// All, tables first.
    pub const ALL: [Self; 11] = [
        Self::Table1,
        Self::Table2,
        Self::Table3,
        Self::Table4,
        Self::Ablations,
        Self::Fig2,
        Self::Fig3,
        Self::Fig5,
        Self::Fig6,
        Self::Fig7,
        Self::Fig8,
    ];

    /// Name of its files, without extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table1 => "table1",
            Self::Table2 => "table2",
            Self::Table3 => "table3",
            Self::Table4 => "table4",
            Self::Ablations => "ablations",
            Self::Fig2 => "fig2",
            Self::Fig3 => "fig3",
            Self::Fig5 => "fig5",
            Self::Fig6 => "fig6",
            Self::Fig7 => "fig7",
            Self::Fig8 => "fig8",
        }
    }

    /// Its title.
    pub fn title(self) -> &'static str {
        match self {
            Self::Table1 => "Table 1: quality and time of learned methods",
            Self::Table2 => "Table 2: time [ms] at three sizes",
            Self::Table3 => "Table 3: input features",
            Self::Table4 => "Table 4: patches and kernels",
            Self::Ablations => "Further ablations",
            Self::Fig2 => "Fig. 2: relative sensitivity of the input channels",
            Self::Fig3 => "Fig. 3: cost of every level before and after patches, 1280x720",
            Self::Fig5 => "Fig. 5: quality and speed before and after patches",
            Self::Fig6 => "Fig. 6: without and with kernel prediction",
            Self::Fig7 => "Fig. 7: all methods on the first test view of several scenes",
            Self::Fig8 => "Fig. 8: where the reference varies most",
        }
    }

    /// Whether it can only be made from test frames.
    pub fn needs_frames(self) -> bool {
        !matches!(self, Self::Table2 | Self::Fig3)
    }
}

/// The inputs of all items.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The dataset whose test frames are used.
    pub manifest: Option<&'a Manifest>,
    /// The networks.
    pub models: &'a Models,
    /// Threads of the networks, > 0.
    pub threads: usize,
    /// Runs of which a run-time is the median, > 0.
    pub runs: usize,
    /// The command, to be printed.
    pub command: &'a str,
}

/// The body of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Cells as text; `**` around a cell makes it bold.
    Table {
        /// Names of the columns.
        header: Vec<String>,
        /// Rows with as many cells.
        rows: Vec<Vec<String>>,
    },
    /// The text of an SVG.
    Chart(String),
    /// Pictures side by side.
    Pictures {
        /// Row by row.
        panels: Vec<(RgbImage, Caption)>,
        /// Panels per row.
        columns: usize,
    },
}

/// A finished table or figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// The item.
    pub item: Item,
    /// Its body.
    pub content: Content,
    /// The paper's claims about it.
    pub claims: Vec<Claim>,
    /// Notes on how it was made, line by line.
    pub notes: Vec<String>,
    /// Its data as JSON.
    pub json: Value,
}

/// Makes `items`. `progress` is called with the current work, the part done and the total.
///
/// # Errors
/// When an item needs test frames and there are none, a frame is broken, or a network cannot be run.
pub fn make(
    items: &[Item],
    subject: &Subject<'_>,
    progress: &dyn Fn(&str, usize, usize),
) -> Result<Vec<Section>> {
    if let Some(item) = items.iter().find(|i| i.needs_frames() && subject.manifest.is_none()) {
        return Err(Error::request(item.name(), "a dataset with test frames", "none"));
    }
    if let Some(manifest) = subject.manifest.filter(|m| m.frames(Split::Test).next().is_none()) {
        return Err(Error::file(manifest.dir(), "frames of the split `test`", "none"));
    }
    let mut needs = Needs::default();
    items.iter().for_each(|item| tables::add_needs(*item, subject, &mut needs));
    let measurements = measure::measure(&needs, subject, progress)?;
    items.iter().map(|item| section(*item, subject, &measurements, progress)).collect()
}

fn section(
    item: Item,
    subject: &Subject<'_>,
    measurements: &Measurements,
    progress: &dyn Fn(&str, usize, usize),
) -> Result<Section> {
    let mut section = match item {
        Item::Table1 | Item::Table2 | Item::Table3 | Item::Table4 | Item::Ablations => {
            tables::table(item, subject, measurements)
        }
        Item::Fig2 => charts::sensitivity(subject, progress)?,
        Item::Fig3 => charts::layers(subject)?,
        Item::Fig5 | Item::Fig6 | Item::Fig7 | Item::Fig8 => {
            pictures::figure(item, subject, measurements, progress)?
        }
    };
    section.notes.extend(conditions(item, subject));
    section.json["title"] = json!(item.title());
    section.json["claims"] = json!(section.claims);
    section.json["notes"] = json!(section.notes);
    Ok(section)
}

/// Conditions of the measurements.
fn conditions(item: Item, subject: &Subject<'_>) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(manifest) = subject.manifest.filter(|_| item.needs_frames()) {
        let frames: Vec<_> = manifest.frames(Split::Test).collect();
        let scenes: std::collections::BTreeSet<_> = frames.iter().map(|f| &f.scene).collect();
        let recipe = &manifest.plan.recipe;
        lines.push(format!(
            "Frames: {} of the split `test`, {} scenes, {}x{}, reference {} rays per pixel, radius {:?}.",
            frames.len(),
            scenes.len(),
            recipe.width,
            recipe.height,
            recipe.spp(Split::Test),
            recipe.radius,
        ));
    }
    if !matches!(item, Item::Fig2 | Item::Fig6 | Item::Fig7 | Item::Fig8) {
        lines.push(format!(
            "Time: features, network and clamping of a frame in memory, f32, {}, {} threads, median of {} runs; 1280x720 \
             unless another size is named. The paper's: NVIDIA Tesla V100.",
            timing::device(),
            subject.threads,
            subject.runs,
        ));
    }
    lines.push(format!("Made by aonet {}: `{}`", env!("CARGO_PKG_VERSION"), subject.command));
    lines
}

#[cfg(test)]
mod tests;

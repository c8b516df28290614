//! Exact shares of light in place of what a network's survey finds: for networks that tell what a better survey would be worth.

use super::config::ExactSurvey;
use crate::dataset::FrameEntry;
use crate::exact::Extent;
use crate::exr_file::ExrFile;
use crate::network_inputs::network_inputs;
use aonet::internals::graph::SURVEYED;
use aonet::internals::naive::{self, Planes};
use aonet::net::Model;
use aonet::search::Share;
use aonet::{AoImage, AoParams, GBuffer, Size};
use aonet_scene::error::{Error, Result};

impl ExactSurvey {
    /// Reads what a survey would find in a frame if it missed nothing: a cell for every patch of the picture.
    ///
    /// # Errors
    /// When the file cannot be read, lacks a share, or is of another size.
    pub(crate) fn read(&self, entry: &FrameEntry, patch: usize) -> Result<Planes> {
        let path = self.extent.file(&self.folder, entry);
        let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
        let file = ExrFile::open(&bytes).map_err(Error::in_file(&path))?;
        let cells = Size::new(entry.view.width / patch, entry.view.height / patch)?;
        if file.size() != cells {
            return Err(Error::file(&path, format!("shares of {cells} pixels"), file.size()));
        }
        let [_, found @ ..] = Share::ALL;
        let channel = |share: Share| {
            let named = file.channels().iter().find(|channel| channel.name == share.name());
            let missing = || Error::file(&path, format!("a channel {}", share.name()), "none");
            named.map(|channel| (channel.clone(), 0.0)).ok_or_else(missing)
        };
        let channels = found.into_iter().map(channel).collect::<Result<Vec<_>>>()?;
        let mut values = file.planes(&channels).map_err(Error::in_file(&path))?.concat();
        let has_second = self.extent == Extent::Whole && entry.view.separation.is_some();
        values.resize(SURVEYED * cells.pixels(), f32::from(has_second));
        Ok(Planes { channels: SURVEYED, height: cells.height(), width: cells.width(), values })
    }
}

/// The visibility of a frame's picture by a network whose survey finds this: the oracle's, without a guard band but for its search.
///
/// # Errors
/// When a value of the frame is out of range.
pub(crate) fn run(
    model: &Model,
    (gbuffer, params): (&GBuffer, AoParams),
    survey: &Planes,
) -> aonet::Result<AoImage> {
    let (margin, size) = (gbuffer.window().margin(), gbuffer.window().size());
    let picture = |planes: &Planes| {
        Planes::from_fn((planes.channels, size.height(), size.width()), |c, y, x| {
            planes.at(c, (y + margin.y) as isize, (x + margin.x) as isize)
        })
    };
    let mut inputs = network_inputs(model, gbuffer, params)?;
    inputs.features = picture(&inputs.features);
    inputs.search = inputs.search.as_ref().map(picture);
    let (step, patch) = (model.graph().alignment(), model.config().patch);
    let [height, width] = [size.height(), size.width()].map(|side| side.next_multiple_of(step) / patch);
    let cell = |c, y: usize, x: usize| survey.at(c, y as isize, x as isize);
    inputs.survey = Some(Planes::from_fn((SURVEYED, height, width), cell));
    naive::run_on(model, (&gbuffer.without_margin(), params), &inputs.padded(step))
}

//! The times of the last frames as columns.

use crate::renderer::{Method, PassTime};
use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};
use std::collections::VecDeque;

/// Number of frames shown.
const FRAMES: usize = 120;

/// Colours of steps other than methods.
const OTHERS: [(&str, Color32); 5] = [
    ("G-buffer", Color32::from_rgb(86, 136, 199)),
    ("second layer", Color32::from_rgb(120, 108, 208)),
    ("lighting", Color32::from_rgb(222, 202, 110)),
    ("presenting", Color32::from_rgb(150, 150, 150)),
    ("controls", Color32::from_rgb(205, 205, 205)),
];

/// Colours of the methods in their order; a tuned one is lighter.
const METHODS: [Color32; Method::ALL.len()] = [
    Color32::from_rgb(90, 90, 90),
    Color32::from_rgb(120, 180, 96),
    Color32::from_rgb(170, 216, 150),
    Color32::from_rgb(84, 168, 158),
    Color32::from_rgb(142, 208, 200),
    Color32::from_rgb(200, 96, 104),
    Color32::from_rgb(232, 152, 158),
    Color32::from_rgb(190, 120, 80),
    Color32::from_rgb(224, 168, 134),
    Color32::from_rgb(168, 132, 60),
    Color32::from_rgb(210, 178, 112),
    Color32::from_rgb(132, 176, 60),
    Color32::from_rgb(178, 216, 112),
    Color32::from_rgb(236, 196, 72),
    Color32::from_rgb(240, 160, 64),
    Color32::from_rgb(110, 130, 210),
    Color32::from_rgb(150, 120, 190),
    Color32::from_rgb(214, 128, 188),
];

/// The colour of a step. It does not depend on the frame's other steps, so a change of methods recolours no column.
fn colour(label: &str) -> Color32 {
    let other = OTHERS.iter().find(|(name, _)| *name == label).map(|(_, colour)| *colour);
    let method = || Method::ALL.iter().position(|method| method.title() == label).map(|i| METHODS[i]);
    other.or_else(method).unwrap_or(Color32::WHITE)
}

/// Times of the steps of the last frames.
#[derive(Debug, Default)]
pub(super) struct History {
    frames: VecDeque<Vec<PassTime>>,
}

impl History {
    /// Adds a frame; equal times mean that the frame is the same.
    pub(super) fn push(&mut self, times: &[PassTime]) {
        if times.is_empty() || self.frames.back().is_some_and(|last| last == times) {
            return;
        }
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(times.to_vec());
    }

    /// Draws the columns and their legend.
    pub(super) fn show(&self, ui: &mut Ui) {
        let Some(last) = self.frames.back() else { return };
        let whole = |frame: &Vec<PassTime>| frame.iter().map(|time| time.ms).sum::<f32>();
        let most = self.frames.iter().map(whole).fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 56.0), Sense::hover());
        ui.painter().rect_filled(rect, 2.0, Color32::from_black_alpha(96));
        let width = rect.width() / FRAMES as f32;
        for (frame, x) in self.frames.iter().zip(0..) {
            let left = rect.left() + width * x as f32;
            let mut bottom = rect.bottom();
            for time in frame {
                let top = bottom - rect.height() * time.ms / most;
                let column = Rect::from_min_max(pos2(left, top), pos2(left + width, bottom));
                ui.painter().rect_filled(column, 0.0, colour(&time.label));
                bottom = top;
            }
        }
        for time in last {
            let line = RichText::new(format!("{:7.2} ms  {}", time.ms, time.label));
            ui.label(line.monospace().color(colour(&time.label)));
        }
        let together = format!("{:7.2} ms  together, up to {most:.0}", whole(last));
        ui.label(RichText::new(together).monospace());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn frames_are_remembered_once_and_not_for_ever() {
        let mut history = History::default();
        history.push(&[]);
        assert!(history.frames.is_empty());
        for i in 0..200 {
            let times = [PassTime { label: "a".into(), ms: i as f32 }];
            history.push(&times);
            history.push(&times);
        }
        assert_eq!(history.frames.len(), FRAMES);
        assert_eq!(history.frames[0][0].ms, 80.0);
    }

    #[test]
    fn every_step_has_a_colour_of_its_own() {
        let labels = OTHERS.iter().map(|(label, _)| *label).chain(Method::ALL.map(Method::title));
        let colours: HashSet<_> = labels.clone().map(colour).collect();
        assert_eq!(colours.len(), labels.count());
        assert!(!colours.contains(&colour("another")));
    }
}

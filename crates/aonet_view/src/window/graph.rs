//! The times of the last frames as columns.

use crate::renderer::PassTime;
use egui::{Color32, Rect, Sense, Ui, pos2, vec2};
use std::collections::VecDeque;

/// Frames that are remembered.
const FRAMES: usize = 120;

/// Colours of the steps from the bottom of a column to its top.
const COLOURS: [Color32; 6] = [
    Color32::from_rgb(86, 136, 199),
    Color32::from_rgb(240, 160, 64),
    Color32::from_rgb(120, 180, 96),
    Color32::from_rgb(200, 96, 104),
    Color32::from_rgb(150, 120, 190),
    Color32::from_rgb(140, 140, 140),
];

/// Times of the steps of the last frames.
#[derive(Debug, Default)]
pub(super) struct History {
    frames: VecDeque<Vec<PassTime>>,
}

impl History {
    /// Remembers a frame; the same times again are the same frame.
    pub(super) fn push(&mut self, times: &[PassTime]) {
        if times.is_empty() || self.frames.back().is_some_and(|last| last == times) {
            return;
        }
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(times.to_vec());
    }

    /// Draws the columns and what they stand for.
    pub(super) fn show(&self, ui: &mut Ui) {
        let Some(last) = self.frames.back() else {
            ui.label("This device does not time passes.");
            return;
        };
        let whole = |frame: &Vec<PassTime>| frame.iter().map(|time| time.ms).sum::<f32>();
        let most = self.frames.iter().map(whole).fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 56.0), Sense::hover());
        ui.painter().rect_filled(rect, 2.0, Color32::from_black_alpha(96));
        let width = rect.width() / FRAMES as f32;
        for (frame, x) in self.frames.iter().zip(0..) {
            let left = rect.left() + width * x as f32;
            let mut bottom = rect.bottom();
            for (time, colour) in frame.iter().zip(COLOURS.iter().cycle()) {
                let top = bottom - rect.height() * time.ms / most;
                let column = Rect::from_min_max(pos2(left, top), pos2(left + width, bottom));
                ui.painter().rect_filled(column, 0.0, *colour);
                bottom = top;
            }
        }
        for (time, colour) in last.iter().zip(COLOURS.iter().cycle()) {
            ui.colored_label(*colour, format!("{:7.2} ms  {}", time.ms, time.label));
        }
        ui.label(format!("{:7.2} ms  together; {most:.1} ms at most", whole(last)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}

//! The axis below all plots.

use super::scale::{multiples, round_step};
use eframe::egui::{Align2, Pos2, Rangef, Rect, Sense, Stroke, TextStyle, Ui, pos2, vec2};
use egui_plot::GridMark;

/// Height of the axis, points.
pub(super) const HEIGHT: f32 = 22.0;
/// The least distance of two labels, points.
const APART: f64 = 76.0;
/// Steps of a minute and more, s: what clocks have.
const CLOCK: [f64; 9] = [60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0, 7200.0, 36_000.0];

/// Where its labels are: the multiples of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ticks {
    step: f64,
}

impl Ticks {
    /// For a window, s, that is so many points wide.
    pub(super) fn new([from, to]: [f64; 2], width: f32) -> Self {
        let least = (to - from) * APART / f64::from(width.max(1.0));
        let clock = CLOCK.into_iter().find(|&step| least > 20.0 && step >= least);
        Ticks { step: clock.unwrap_or_else(|| round_step(least)) }
    }

    pub(super) fn marks(self, window: [f64; 2]) -> Vec<GridMark> {
        multiples(self.step, window)
    }

    fn label(self, t: f64) -> String {
        let decimals = (-self.step.log10()).ceil().clamp(0.0, 3.0) as usize;
        format!("{t:.decimals$}")
    }
}

/// Draws it between `sides`, points, with the time that the values are read at, s, and whether that is under the
/// pointer.
pub(super) fn show(ui: &mut Ui, [from, to]: [f64; 2], ticks: Ticks, sides: Rangef, read: Option<f64>) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let font = TextStyle::Small.resolve(ui.style());
    let colour = ui.visuals().text_color();
    let painter = ui.painter();
    let x = |t: f64| sides.min + sides.span() * ((t - from) / (to - from)) as f32;
    let tag = read.filter(|t| (from..=to).contains(t)).map(|t| {
        let galley = painter.layout_no_wrap(format!("{t:.2} s"), font.clone(), ui.visuals().strong_text_color());
        let half = galley.size().x / 2.0 + 4.0;
        let middle = x(t).clamp(rect.left() + half, (rect.right() - half).max(rect.left() + half));
        (Rect::from_center_size(pos2(middle, rect.top() + 11.0), galley.size() + vec2(8.0, 2.0)), galley)
    });
    let write = |at: Pos2, align: Align2, text: String| {
        let galley = painter.layout_no_wrap(text, font.clone(), colour);
        let place = align.anchor_size(at, galley.size());
        if tag.as_ref().is_none_or(|(tag, _)| !tag.intersects(place)) {
            painter.galley(place.min, galley, colour);
        }
    };
    for mark in ticks.marks([from, to]) {
        let at = pos2(x(mark.value), rect.top());
        painter.vline(at.x, Rangef::new(at.y, at.y + 4.0), Stroke::new(1.0, colour));
        write(at + vec2(0.0, 5.0), Align2::CENTER_TOP, ticks.label(mark.value));
    }
    write(rect.left_top() + vec2(4.0, 5.0), Align2::LEFT_TOP, "t (s)".into());
    if let Some((place, galley)) = tag {
        painter.rect_filled(place, 3.0, ui.visuals().widgets.active.weak_bg_fill);
        painter.galley(place.min + vec2(4.0, 1.0), galley, ui.visuals().strong_text_color());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_far_enough_apart_and_there_are_always_some() {
        for length in [0.1, 0.5, 3.0, 5.0, 30.0, 60.0, 599.0, 7200.0, 1e6] {
            for width in [250.0, 800.0, 2500.0] {
                let ticks = Ticks::new([3.7, 3.7 + length], width);
                let points = ticks.step / length * f64::from(width);
                assert!((APART - 1e-6..6.0 * APART).contains(&points), "{length} s on {width}: every {points}");
            }
        }
        assert_eq!(Ticks::new([0.0, 60.0], 800.0).step, 10.0);
        assert_eq!(Ticks::new([0.0, 600.0], 800.0).step, 60.0);
    }
}

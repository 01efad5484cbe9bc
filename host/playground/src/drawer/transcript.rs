//! What was typed and what was answered, line by line.

use eframe::egui::{Label, RichText, ScrollArea, TextStyle, TextWrapMode, Ui};
use std::collections::VecDeque;

/// How many lines are kept.
const KEPT: usize = 4000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Typed,
    Said,
    Failed,
}

/// The lines so far, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Transcript {
    lines: VecDeque<(Kind, String)>,
    /// The newest line is to be seen, wherever the view stands.
    to_end: bool,
}

impl Transcript {
    pub(super) fn typed(&mut self, line: &str) {
        self.add(Kind::Typed, &format!("> {line}"));
    }

    pub(super) fn said(&mut self, text: &str) {
        self.add(Kind::Said, text);
    }

    pub(super) fn failed(&mut self, text: &str) {
        self.add(Kind::Failed, text);
    }

    pub(super) fn clear(&mut self) {
        self.lines.clear();
    }

    /// Whatever the view stands at, the newest line is seen next.
    pub(super) fn show_newest(&mut self) {
        self.to_end = true;
    }

    fn add(&mut self, kind: Kind, text: &str) {
        self.lines.extend(text.lines().map(|line| (kind, line.to_owned())));
        let too_many = self.lines.len().saturating_sub(KEPT);
        self.lines.drain(..too_many);
    }

    pub(super) fn show(&mut self, ui: &mut Ui) {
        let height = ui.text_style_height(&TextStyle::Monospace);
        let gap = 2.0;
        ui.spacing_mut().item_spacing.y = gap;
        let mut area = ScrollArea::both().auto_shrink(false).stick_to_bottom(true);
        if std::mem::take(&mut self.to_end) {
            area = area.vertical_scroll_offset((height + gap) * self.lines.len() as f32);
        }
        area.show_rows(ui, height, self.lines.len(), |ui, rows| {
            ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
            for (kind, line) in self.lines.range(rows) {
                let text = RichText::new(line).monospace();
                let text = match kind {
                    Kind::Typed => text.strong(),
                    Kind::Said => text,
                    Kind::Failed => text.color(ui.visuals().error_fg_color),
                };
                ui.add(Label::new(text).selectable(true));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_of_many_lines_is_as_many_lines_and_the_oldest_go_first() {
        let mut transcript = Transcript::default();
        transcript.typed("list");
        transcript.said("one\ntwo\n");
        let lines: Vec<&str> = transcript.lines.iter().map(|(_, line)| line.as_str()).collect();
        assert_eq!(lines, ["> list", "one", "two"]);
        for i in 0..KEPT {
            transcript.failed(&i.to_string());
        }
        assert_eq!(transcript.lines.len(), KEPT);
        assert_eq!(transcript.lines.front(), Some(&(Kind::Failed, "0".to_owned())));
    }
}

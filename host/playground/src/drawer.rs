//! The console's drawer: what was typed and what was answered, and a line to type the next.
//!
//! It is the console of `barrel console`: the same commands, completion, hints and history.

mod completion;
mod history;
mod transcript;

use crate::order::Order;
use completion::Candidates;
use eframe::egui::text::{CCursor, CCursorRange};
use eframe::egui::{
    self, Align, EventFilter, Id, Key, Layout, Modifiers, Panel, RichText, ScrollArea, TextEdit, TextStyle, Ui,
};
use history::History;
use std::path::PathBuf;
use transcript::Transcript;

/// What can be chosen from is no higher than this, points.
const CHIPS: f32 = 72.0;

/// The console's drawer.
#[derive(Debug)]
pub struct Drawer {
    transcript: Transcript,
    line: String,
    history: History,
    candidates: Option<Candidates>,
    wants_focus: bool,
}

impl Drawer {
    /// An empty drawer. `history` is the file that keeps the lines from one window to the next, the same as that of
    /// `barrel console` ([`barrel::console::history`]); without one they are forgotten.
    pub fn new(history: Option<PathBuf>) -> Self {
        Drawer {
            transcript: Transcript::default(),
            line: String::new(),
            history: History::load(history),
            candidates: None,
            wants_focus: false,
        }
    }

    /// Shows a line that was sent to the session, whoever sent it: this drawer's own too.
    pub fn typed(&mut self, line: &str) {
        self.transcript.typed(line);
    }

    /// Shows an answer, or news of the session.
    pub fn said(&mut self, text: &str) {
        self.transcript.said(text);
    }

    /// Shows what went wrong, in red.
    pub fn failed(&mut self, text: &str) {
        self.transcript.failed(text);
    }

    /// Puts the cursor into the line when the drawer is shown next.
    pub fn focus(&mut self) {
        self.wants_focus = true;
    }

    /// Shows the drawer, filling `ui`. Enter sends the line.
    pub fn show(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        Panel::bottom("console line").resizable(false).show_separator_line(false).show(ui, |ui| {
            self.chips(ui);
            self.input(ui, orders);
        });
        self.transcript.show(ui);
    }

    fn input(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let id = Id::unique("console input");
        if self.wants_focus {
            ui.memory_mut(|memory| memory.request_focus(id));
            self.wants_focus = false;
        }
        if ui.memory(|memory| memory.has_focus(id)) {
            self.keys(ui, id);
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.label(RichText::new(">").monospace().strong());
            let output = TextEdit::singleline(&mut self.line)
                .id(id)
                .font(TextStyle::Monospace)
                .desired_width(f32::INFINITY)
                .return_key(None)
                .show(ui);
            let response = output.response.response.accessible_name("Console line");
            if response.changed() {
                self.candidates = None;
            }
            if response.lost_focus() && ui.input(|input| input.key_pressed(Key::Escape)) {
                // What stops the robot does not turn the words that follow into orders of the window.
                response.request_focus();
            }
            // An empty line has nothing to complete: Tab goes on to the next widget. Said after the line has changed,
            // as the field itself would only know in the next pass.
            let filter = EventFilter {
                tab: !self.line.is_empty(),
                horizontal_arrows: true,
                vertical_arrows: true,
                escape: false,
            };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            let hint = if self.line.is_empty() {
                Some("a command, NAME = VALUE, or help; Tab completes, ↑ ↓ bring lines back".to_owned())
            } else {
                barrel::console::hint(&self.line)
            };
            if let Some(hint) = hint {
                let at = output.galley_pos + egui::vec2(output.galley.size().x, 0.0);
                let font = TextStyle::Monospace.resolve(ui.style());
                let painter = ui.painter().with_clip_rect(response.rect.shrink(2.0));
                painter.text(at, egui::Align2::LEFT_TOP, hint, font, ui.visuals().weak_text_color());
            }
            if response.has_focus() && ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter)) {
                self.enter(orders);
            }
        });
    }

    /// The keys of the line that are not the text field's own. They are taken before it sees them.
    fn keys(&mut self, ui: &Ui, id: Id) {
        let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
        let is_word = !self.line.is_empty();
        let replaced = if is_word && pressed(Modifiers::SHIFT, Key::Tab) {
            self.complete(false)
        } else if is_word && pressed(Modifiers::NONE, Key::Tab) {
            self.complete(true)
        } else if pressed(Modifiers::NONE, Key::ArrowUp) {
            self.history.older(&self.line)
        } else if pressed(Modifiers::NONE, Key::ArrowDown) {
            self.history.newer()
        } else {
            if pressed(Modifiers::COMMAND, Key::L) {
                self.transcript.clear();
            }
            None
        };
        if let Some(line) = replaced {
            self.replace(ui, id, line);
        }
    }

    /// The line as the next candidate has it; `forward` or backward.
    fn complete(&mut self, forward: bool) -> Option<String> {
        match &mut self.candidates {
            Some(candidates) => Some(candidates.next(forward)),
            None => {
                let (line, candidates) = completion::complete(&self.line)?;
                self.candidates = candidates;
                Some(line)
            }
        }
    }

    fn replace(&mut self, ui: &Ui, id: Id, line: String) {
        self.line = line;
        let mut state = TextEdit::load_state(ui.ctx(), id).unwrap_or_default();
        let end = CCursor::new(self.line.chars().count());
        state.cursor.set_char_range(Some(CCursorRange::one(end)));
        TextEdit::store_state(ui.ctx(), id, state);
    }

    fn enter(&mut self, orders: &mut Vec<Order>) {
        let line = std::mem::take(&mut self.line);
        self.candidates = None;
        if line.trim().is_empty() {
            return;
        }
        if let Some(reason) = self.history.add(&line) {
            self.failed(&reason);
        }
        self.transcript.show_newest();
        orders.push(Order::Line(line));
    }

    /// What the line can become, to be clicked.
    fn chips(&mut self, ui: &mut Ui) {
        let Some(candidates) = &self.candidates else { return };
        let mut chosen = None;
        ScrollArea::vertical().max_height(CHIPS).auto_shrink([false, true]).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                for (i, name) in candidates.names().iter().enumerate() {
                    let text = RichText::new(name).monospace();
                    if ui.selectable_label(candidates.chosen() == Some(i), text).clicked() {
                        chosen = Some(candidates.line(i));
                    }
                }
            });
        });
        if let Some(line) = chosen {
            self.replace(ui, Id::unique("console input"), line);
            self.candidates = None;
            self.wants_focus = true;
        }
    }
}

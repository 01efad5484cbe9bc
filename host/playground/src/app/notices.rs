//! Sentences that appear over the window for a while.

use eframe::egui;
use egui::{Align2, Area, Context, Frame, Label, Order, RichText, Vec2};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::{Duration, Instant};

/// How long a sentence stays.
const STAY: Duration = Duration::from_secs(12);
/// How wide it is, points.
const WIDTH: f32 = 640.0;

/// The sentences that are shown now.
pub(super) struct Notices {
    shown: Vec<Notice>,
    send: Sender<Result<String, String>>,
    arrive: Receiver<Result<String, String>>,
}

struct Notice {
    text: String,
    is_warning: bool,
    since: Instant,
}

/// Tells the window what a thread has done.
#[derive(Clone)]
pub(super) struct Teller(Sender<Result<String, String>>);

impl Teller {
    /// Says what was done, or why it was not.
    pub fn tell(&self, said: Result<String, String>) {
        // A window that is gone does not hear it.
        let _ = self.0.send(said);
    }
}

impl Default for Notices {
    fn default() -> Self {
        let (send, arrive) = mpsc::channel();
        Notices { shown: Vec::new(), send, arrive }
    }
}

impl Notices {
    /// For a thread that will have something to say.
    pub fn sender(&self) -> Teller {
        Teller(self.send.clone())
    }

    /// What a thread has said; it is shown, and returned for the console.
    pub fn arrived(&mut self) -> Option<String> {
        let said = self.arrive.try_recv().ok()?;
        let is_warning = said.is_err();
        let text = said.unwrap_or_else(|why| why);
        self.add(&text, is_warning);
        Some(text)
    }

    /// Shows what went wrong.
    pub fn warn(&mut self, text: &str) {
        self.add(text, true);
    }

    /// Shows what was done.
    pub fn tell(&mut self, text: &str) {
        self.add(text, false);
    }

    fn add(&mut self, text: &str, is_warning: bool) {
        self.shown.retain(|notice| notice.text != text);
        self.shown.push(Notice { text: text.to_owned(), is_warning, since: Instant::now() });
    }

    /// Shows them, the newest at the bottom; a click takes one away.
    pub fn show(&mut self, context: &Context) {
        self.shown.retain(|notice| notice.since.elapsed() < STAY);
        if self.shown.is_empty() {
            return;
        }
        let area = Area::new(egui::Id::unique("notices")).order(Order::Foreground);
        area.anchor(Align2::CENTER_BOTTOM, Vec2::new(0.0, -56.0)).show(context, |ui| {
            let mut gone = None;
            for (i, notice) in self.shown.iter().enumerate() {
                Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_max_width(WIDTH.min(0.8 * context.content_rect().width()));
                    let text = RichText::new(&notice.text);
                    let colour = ui.visuals().warn_fg_color;
                    ui.add(Label::new(if notice.is_warning { text.color(colour) } else { text }).wrap());
                    if ui.small_button("Dismiss").clicked() {
                        gone = Some(i);
                    }
                });
            }
            if let Some(i) = gone {
                self.shown.remove(i);
            }
        });
        context.request_repaint_after(Duration::from_millis(500));
    }
}

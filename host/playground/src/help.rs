//! The help: every key and what the mouse does, over the window.

use crate::keys::{self, Action, Group, KEYS};
use eframe::egui::{Align2, Context, Frame, Grid, Key, Margin, RichText, ScrollArea, Stroke, Ui, Vec2, Window};

/// What the mouse does in the scene: the gesture, and what comes of it.
pub const MOUSE: &[(&str, &str)] = &[
    ("drag the barrel", "push it"),
    ("Shift + drag the barrel", "twist it"),
    ("drag the floor", "walk round it"),
    ("right-drag", "shift the view"),
    ("wheel", "nearer and farther"),
    ("drag the time below", "look back; Newest returns"),
    ("Tab, arrows, Enter", "all of it by keyboard"),
    ("? above the plots", "mouse and keys on a plot"),
];

/// Shows the help while it is `open`; Esc, its button and the key of [`Action::Help`] close it. Keys still act, so that
/// they can be tried while it is read.
pub fn show(ctx: &Context, open: &mut bool) {
    if !*open {
        return;
    }
    keys::hold_escape(ctx);
    if ctx.input(|input| input.key_pressed(Key::Escape)) {
        *open = false;
        return;
    }
    let screen = ctx.content_rect();
    Window::new("Keys and mouse")
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .open(open)
        .show(ctx, |ui| {
            let height = screen.height() - 90.0;
            ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
                if screen.width() < 900.0 {
                    ui.vertical(|ui| contents(ui, &Group::ALL));
                    mouse(ui);
                } else {
                    ui.horizontal_top(|ui| {
                        ui.vertical(|ui| {
                            contents(ui, &Group::ALL[..4]);
                        });
                        ui.add_space(28.0);
                        ui.vertical(|ui| {
                            contents(ui, &Group::ALL[4..]);
                            mouse(ui);
                        });
                    });
                }
            });
        });
}

fn contents(ui: &mut Ui, groups: &[Group]) {
    for &group in groups {
        table(ui, group.name(), KEYS.iter().filter(|row| row.group == group).map(|row| (row.keys, row.what)));
    }
    let words = "While something is typed into a field, only the keys with Ctrl act. In a simulation Esc closes a \
                 dialog or leaves a field first; a real robot it stops always.";
    if groups.contains(&Group::Window) {
        ui.label(RichText::new(words).weak());
        ui.add_space(10.0);
    }
}

fn mouse(ui: &mut Ui) {
    table(ui, "Mouse, in the scene", MOUSE.iter().copied());
}

fn table<'a>(ui: &mut Ui, heading: &str, rows: impl Iterator<Item = (&'a str, &'a str)>) {
    ui.label(RichText::new(heading).strong().size(15.0));
    ui.add_space(2.0);
    Grid::new(heading).num_columns(2).min_col_width(62.0).spacing([14.0, 5.0]).show(ui, |ui| {
        for (keys, what) in rows {
            cap(ui, keys);
            ui.label(what);
            ui.end_row();
        }
    });
    ui.add_space(12.0);
}

/// A key's cap.
fn cap(ui: &mut Ui, keys: &str) {
    let visuals = ui.visuals();
    let frame = Frame::new()
        .fill(visuals.extreme_bg_color)
        .stroke(Stroke::new(1.0, visuals.widgets.noninteractive.bg_stroke.color))
        .corner_radius(4)
        .inner_margin(Margin::symmetric(6, 1));
    ui.horizontal(|ui| {
        frame.show(ui, |ui| ui.label(RichText::new(keys).monospace().strong()));
    });
}

/// The key that opens the help, for a hint in the window.
pub fn key() -> &'static str {
    KEYS.iter().find(|row| row.action == Action::Help).map_or("", |row| row.keys)
}

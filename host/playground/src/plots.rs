//! The plots: any number of them, one below the other, over one axis of time.
//!
//! The window of time, the cursors and the gestures are the stack's, not the single plot's, so that all plots move as
//! one in the same frame. Only what is in sight is drawn, and no more points than pixels show.

mod gesture;
mod ink;
mod names;
mod panel;
mod picker;
mod presets;
mod scale;
mod time_axis;
mod view;

use crate::history::History;
use eframe::egui::{self, Atom, Button, ComboBox, DragValue, Rangef, ScrollArea, Ui};
use gesture::Gesture;
use panel::{LEAST, Panel, Scene, splitter};
use scale::Scale;
use serde::{Deserialize, Serialize};
use time_axis::Ticks;
use view::{LONGEST, PRESETS, SHORTEST, View};

/// Height of what lies between two plots, points.
const BETWEEN: f32 = 7.0;
/// Room on the right for the scroll bar and for half of the last label of the axis, points.
const MARGIN: f32 = 14.0;

/// What is plotted, and how. Saved and loaded as a layout: channels by name, names that are gone are dropped.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Plots {
    panels: Vec<Panel>,
    view: View,
    /// The last key that was given to a panel.
    #[serde(skip)]
    keys: u64,
    /// Time under the pointer in the last frame, s.
    #[serde(skip)]
    hover: Option<f64>,
    /// The cursor of the last frame, s: a window that stands still goes with one that moves.
    #[serde(skip)]
    cursor: Option<f64>,
    /// Where the curves were in the last frame, left and right, points.
    #[serde(skip)]
    sides: Option<Rangef>,
    /// Height of all plots in the last frame, points.
    #[serde(skip)]
    height: f32,
}

impl Default for Plots {
    fn default() -> Self {
        Plots {
            panels: presets::DEFAULT.panels().collect(),
            view: View::default(),
            keys: 0,
            hover: None,
            cursor: None,
            sides: None,
            height: 0.0,
        }
    }
}

/// What the plots ask of their owner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlotsOutput {
    /// A time was clicked, or the cursor was moved by keys, s: the owner scrubs there.
    pub scrub: Option<f64>,
    /// The user went back to the newest row: the owner ends its scrubbing.
    pub live: bool,
}

impl Plots {
    /// No plot at all.
    pub fn empty() -> Self {
        Plots { panels: Vec::new(), ..Plots::default() }
    }

    /// Adds a plot of these channels at the end.
    pub fn add(&mut self, channels: &[crate::channel::Id]) {
        self.panels.push(Panel::new(channels, Scale::Auto));
    }

    /// The channels of each plot, from top to bottom.
    pub fn channels(&self) -> impl Iterator<Item = &[crate::channel::Id]> {
        self.panels.iter().map(|panel| panel.channels.as_slice())
    }

    /// Follows the newest row.
    pub fn follow(&mut self) {
        self.view.follow();
    }

    /// Shows all there is, as befits a recording that was just opened.
    pub fn show_all(&mut self) {
        self.view.set_length(None);
    }

    /// Whether the newest row is followed; else the window of time stands still.
    pub fn follows(&self) -> bool {
        self.view.follows()
    }

    /// The stretch of time in sight, s.
    pub fn window(&self, history: &History) -> (f64, f64) {
        self.view.window(history.span()).into()
    }

    fn act(&mut self, history: &History, gesture: Gesture, cursor: Option<f64>) -> PlotsOutput {
        let span = history.span();
        let window @ [from, to] = self.view.window(span);
        let mut output = PlotsOutput { scrub: gesture.click, live: gesture.live };
        if gesture.pan != 0.0 {
            self.view.pan(span, gesture.pan);
        }
        if let Some((factor, at)) = gesture.zoom {
            self.view.zoom(span, factor, at);
        }
        if let Some(boxed) = gesture.boxed {
            self.view.hold(boxed);
        }
        if gesture.steps != 0.0 {
            let newest = span.map_or(to, |(_, newest)| newest.min(to));
            output.scrub = Some(cursor.unwrap_or(newest) + gesture.steps * (to - from) / 100.0);
        }
        if let (Some(t), Some((oldest, newest))) = (output.scrub, span) {
            output.scrub = Some(t.clamp(oldest, newest));
            // What is looked at does not run away. All there is stays in sight anyway.
            if self.view.follows() && self.view.length().is_some() {
                self.view.hold(window);
            }
        }
        if gesture.live {
            self.view.follow();
        }
        if gesture.all {
            self.view.set_length(None);
        }
        output
    }
}

/// Shows the plots in all the room there is. `cursor` is the time that the owner has scrubbed to, s; a line marks it,
/// and the legends tell the values there, unless the pointer asks for others. A cursor that moves is kept in sight;
/// when it goes away, the newest row is followed again.
pub fn show(ui: &mut Ui, plots: &mut Plots, history: &History, cursor: Option<f64>) -> PlotsOutput {
    let mut output = PlotsOutput::default();
    match cursor {
        Some(t) if cursor != plots.cursor => plots.view.keep_in_sight(history.span(), t),
        None if plots.cursor.is_some() => plots.view.follow(),
        _ => {}
    }
    plots.cursor = cursor;
    output.live |= toolbar(ui, plots, history);
    let window = plots.view.window(history.span());
    let sides = plots.sides.unwrap_or_else(|| ui.available_rect_before_wrap().x_range());
    let hover = hovered(ui, plots, window, sides);
    let ticks = Ticks::new(window, sides.span());
    let room = (ui.available_height() - time_axis::HEIGHT - ui.spacing().item_spacing.y).max(LEAST);
    let fits = plots.height <= room + 1.0;
    let scene = Scene { history, window, ticks, read: hover.or(cursor), hover, cursor, fits };
    let mut gesture = None;
    let mut parted = Vec::new();
    plots.hover = None;
    let shown = ScrollArea::vertical().id_salt("plots").max_height(room).auto_shrink(false).show(ui, |ui| {
        ui.set_width(ui.available_width() - MARGIN);
        ui.spacing_mut().item_spacing.y = 0.0;
        let share = share(&plots.panels, room);
        plots.panels.retain_mut(|panel| {
            if panel.key == 0 {
                plots.keys += 1;
                panel.key = plots.keys;
            }
            let height = panel.height.filter(|height| height.is_finite()).map_or(share, |height| height.max(LEAST));
            let done = panel.show(ui, height, &scene);
            splitter(ui, panel, height);
            plots.sides = done.sides.or(plots.sides);
            plots.hover = plots.hover.or(done.gesture.hover);
            parted.extend(done.parted.map(|id| (panel.key, id)));
            if done.gesture != (Gesture { hover: done.gesture.hover, ..Gesture::default() }) {
                gesture = Some(done.gesture);
            }
            !done.closed
        });
        if plots.panels.is_empty() {
            ui.centered_and_justified(|ui| ui.weak("“New plot” or “Presets” above begin"));
        }
    });
    plots.height = shown.content_size.y;
    time_axis::show(ui, window, ticks, sides, scene.read);
    for (key, id) in parted {
        let below = plots.panels.iter().position(|panel| panel.key == key).map_or(plots.panels.len(), |at| at + 1);
        plots.panels.insert(below, Panel::new(&[id], Scale::Auto));
    }
    if let Some(gesture) = gesture {
        let asked = plots.act(history, gesture, cursor);
        output = PlotsOutput { scrub: asked.scrub, live: output.live || asked.live };
        ui.request_repaint();
    }
    output
}

/// The time under the pointer, s. It is read from where the pointer is now, not where it was in the last frame, and so
/// that the plots above the one it is in know of it, too.
fn hovered(ui: &Ui, plots: &Plots, [from, to]: [f64; 2], sides: Rangef) -> Option<f64> {
    plots.hover?;
    let pointer = ui.input(|input| input.pointer.hover_pos())?;
    let part = f64::from((pointer.x - sides.min) / sides.span().max(1.0));
    (0.0..=1.0).contains(&part).then_some(from + part * (to - from))
}

/// Height of each plot whose height was not set by hand, points.
fn share(panels: &[Panel], room: f32) -> f32 {
    let set: f32 = panels.iter().filter_map(|panel| panel.height).map(|height| height.max(LEAST)).sum();
    let free = panels.iter().filter(|panel| panel.height.is_none()).count().max(1);
    let left = room - set - BETWEEN * panels.len() as f32;
    (left / free as f32).max(LEAST)
}

/// What mouse and keys do on a plot, a line each.
const HELP: [&str; 9] = [
    "click: scrub to a time",
    "double click, End: back to live",
    "drag: move in time",
    "wheel, + and −: zoom in time (Ctrl + wheel where the wheel scrolls)",
    "right drag: zoom into a box",
    "left, right: move the cursor",
    "Page up, Page down: half a window back, on",
    "Home: all there is",
    "bar below a plot, up and down: its height",
];

/// The row above the plots. Returns whether the user goes back to the newest row.
fn toolbar(ui: &mut Ui, plots: &mut Plots, history: &History) -> bool {
    ui.horizontal_wrapped(|ui| {
        let follows = plots.view.follows();
        let live = ui.add(Button::selectable(follows, "Live")).on_hover_text("follow the newest row");
        if live.clicked() {
            let window = plots.view.window(history.span());
            if follows { plots.view.hold(window) } else { plots.view.follow() }
        }
        let [from, to] = plots.view.window(history.span());
        let mut length = to - from;
        let speed = 0.01 * length;
        let field = DragValue::new(&mut length).speed(speed).range(SHORTEST..=LONGEST).max_decimals(1);
        let field = ui.add(field.suffix(" s").clamp_existing_to_range(false).update_while_editing(false));
        if field.on_hover_text("length of the window of time").changed() {
            plots.view.set_length(Some(length));
        }
        let mut chosen = plots.view.length();
        let name = PRESETS.iter().find(|(_, length)| *length == chosen).map_or("window", |(name, _)| name);
        let menu = ComboBox::from_id_salt("window").selected_text(name).width(66.0).show_ui(ui, |ui| {
            for (name, length) in PRESETS {
                ui.selectable_value(&mut chosen, length, name);
            }
        });
        let menu = menu.response;
        menu.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "window of time"));
        menu.on_hover_text("window of time");
        if chosen != plots.view.length() {
            plots.view.set_length(chosen);
        }
        ui.separator();
        if ui.button("New plot").on_hover_text("an empty plot below the others").clicked() {
            plots.panels.push(Panel::opening());
        }
        ui.menu_button(("Presets", drop_down()), |ui| {
            for preset in &presets::ALL {
                if ui.button(preset.name).clicked() {
                    plots.panels.extend(preset.panels());
                }
            }
            ui.separator();
            if ui.button(presets::DEFAULT.name).on_hover_text("instead of the plots there are").clicked() {
                plots.panels = presets::DEFAULT.panels().collect();
            }
        });
        let help = ui.add(Button::new("?").small());
        help.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "mouse and keys on a plot"));
        egui::Popup::menu(&help).show(|ui| ui.label(HELP.join("\n")));
        help.on_hover_text(HELP.join("\n"));
        live.clicked() && !follows
    })
    .inner
}

/// What shows that a button opens a menu. The fonts have no such triangle.
fn drop_down<'a>() -> Atom<'a> {
    Atom::paint(egui::vec2(8.0, 6.0), |ui, args| {
        let corners = vec![args.rect.left_top(), args.rect.right_top(), args.rect.center_bottom()];
        ui.painter().add(egui::Shape::convex_polygon(corners, args.fallback_text_color, egui::Stroke::NONE));
    })
}

#[cfg(test)]
mod tests;

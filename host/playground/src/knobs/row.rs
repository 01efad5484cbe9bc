//! One knob: mark, name, slider, number, unit, reset.

use super::scale::{self, Scale};
use super::{ECHO, Held, InHand, Knobs, kept};
use crate::order::Order;
use eframe::egui::{
    self, Button, Color32, ComboBox, DragValue, FontId, Label, RichText, Sense, Slider, TextStyle, Ui, UiBuilder, Vec2,
};
use protocol::Id;

/// Widths that the rows of a group share, points.
pub(super) struct Columns {
    name: f32,
    unit: f32,
    slider: f32,
}

const MARK: f32 = 8.0;
const NUMBER: f32 = 68.0;
const RESET: f32 = 22.0;
const GAP: f32 = 6.0;
const UNIT: FontId = FontId::proportional(11.0);
/// A slider that is shorter cannot be aimed on.
const SHORTEST: f32 = 36.0;

impl Columns {
    /// As wide as the widest of these rows needs it; the slider takes what is left.
    pub(super) fn of(ui: &Ui, rows: &[Id]) -> Columns {
        let numbers = || rows.iter().filter(|id| scale::words(**id).is_none());
        let letter = width(ui, "m", TextStyle::Monospace.resolve(ui.style()));
        let name = numbers().map(|id| id.name().chars().count() as f32 * letter).fold(30.0, f32::max) + 2.0;
        let unit = numbers().map(|id| width(ui, id.parameter().unit, UNIT)).fold(0.0, f32::max).ceil();
        let slider = ui.available_width() - (MARK + name + NUMBER + unit + RESET + 5.0 * GAP);
        Columns { name, unit, slider: slider.max(SHORTEST) }
    }
}

fn width(ui: &Ui, text: &str, font: FontId) -> f32 {
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::PLACEHOLDER).size().x
}

/// Shows the row of `id`.
pub(super) fn show(ui: &mut Ui, id: Id, columns: &Columns, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    let p = id.parameter();
    let is_pending = knobs.pending_value(id).is_some();
    let is_changed = held.is_changed(id) || is_pending;
    let shown = knobs.shown(id, held);
    // By a name of its own: what comes and goes above it while it is dragged does not take it out of the hand.
    let named = UiBuilder::new().scope_id(egui::Id::unique(("knob", id.index())));
    let row = ui.scope_builder(named, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            mark(ui, is_changed);
            let name = RichText::new(p.name).monospace();
            let name = Label::new(if is_changed { name.strong() } else { name }).sense(Sense::hover());
            let mut edit = Edit::default();
            if let Some(words) = scale::words(id) {
                let label = ui.add(name).on_hover_text(help(id, held));
                edit.chosen = choice(ui, shown, words, label.id);
            } else {
                let height = ui.spacing().interact_size.y;
                let size = Vec2::new(columns.name, height);
                let layout = egui::Layout::left_to_right(egui::Align::Center);
                let label = ui.allocate_ui_with_layout(size, layout, |ui| {
                    ui.set_min_width(columns.name);
                    ui.add(name)
                });
                let label = label.inner.on_hover_text(help(id, held));
                edit = slider(ui, id, shown, columns, label.id);
                let drag = number(ui, id, shown, label.id);
                edit.chosen = edit.chosen.or(drag.chosen);
                edit.is_held |= drag.is_held;
                let unit = RichText::new(p.unit).font(UNIT).weak();
                let size = Vec2::new(columns.unit, height);
                ui.allocate_ui_with_layout(size, layout, |ui| {
                    ui.set_min_width(columns.unit);
                    if !p.unit.is_empty() {
                        ui.add(Label::new(unit));
                    }
                });
            }
            let preset = held.preset.get(id);
            if (is_changed || scale::text(id, shown) != scale::text(id, preset)) && reset(ui, id, preset) {
                edit = Edit { chosen: Some(preset), is_held: false };
            }
            edit
        })
        .inner
    });
    let Edit { chosen, is_held } = row.inner;
    let chosen = chosen.map(|value| kept(id, value)).filter(|value| *value != shown || (is_changed && !is_held));
    if is_held || chosen.is_some() {
        let until = ui.input(|input| input.time) + ECHO;
        knobs.in_hand = Some(InHand { id, value: chosen.unwrap_or(shown), until });
    }
    if let Some(value) = chosen {
        knobs.set(id, value, held, orders);
    }
}

/// What a hand did to a knob.
#[derive(Clone, Copy, Debug, Default)]
struct Edit {
    chosen: Option<f64>,
    /// The hand is still on it: it shows what it shows.
    is_held: bool,
}

/// A dot before what was changed.
fn mark(ui: &mut Ui, is_changed: bool) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(MARK, MARK), Sense::hover());
    if is_changed {
        ui.painter().circle_filled(rect.center(), 3.0, ui.visuals().warn_fg_color);
        response.on_hover_text("changed");
    }
}

fn slider(ui: &mut Ui, id: Id, shown: f64, columns: &Columns, label: egui::Id) -> Edit {
    let mut value = shown;
    ui.spacing_mut().slider_width = columns.slider;
    let (low, high) = scale::reach(id, shown);
    let mut slider = Slider::new(&mut value, low..=high).show_value(false);
    if let Scale::Decades(least) = Scale::of(id) {
        slider = slider.logarithmic(true).smallest_positive(least);
    }
    let response = ui.add(slider).labelled_by(label);
    let chosen = response.changed().then(|| scale::rounded(value));
    Edit { chosen, is_held: response.dragged() }
}

fn number(ui: &mut Ui, id: Id, shown: f64, label: egui::Id) -> Edit {
    let p = id.parameter();
    let mut value = shown;
    let written = scale::text(id, shown);
    let drag = DragValue::new(&mut value)
        .range(p.min..=p.max)
        .speed(scale::speed(id, shown))
        .custom_formatter(|value, _| scale::text(id, value))
        .custom_parser(scale::number)
        .clip_text(true)
        .update_while_editing(false);
    let response = ui.add_sized(Vec2::new(NUMBER, ui.spacing().interact_size.y), drag).labelled_by(label);
    // The field writes fewer digits than there are: to leave it untouched changes nothing.
    let chosen = (value != shown && scale::text(id, value) != written).then_some(value);
    Edit { chosen, is_held: response.dragged() || response.has_focus() }
}

fn choice(ui: &mut Ui, shown: f64, words: &[&str], label: egui::Id) -> Option<f64> {
    let mut chosen = None;
    let now = shown as usize;
    let width = (ui.available_width() - RESET - 2.0 * GAP).max(SHORTEST);
    let combo = ComboBox::from_id_salt("choice")
        .width(width)
        .truncate()
        .selected_text(words.get(now).copied().unwrap_or_default());
    let response = combo.show_ui(ui, |ui| {
        for (i, word) in words.iter().enumerate() {
            if ui.selectable_label(i == now, *word).clicked() {
                chosen = Some(i as f64);
            }
        }
    });
    response.response.labelled_by(label);
    chosen
}

fn reset(ui: &mut Ui, id: Id, preset: f64) -> bool {
    ui.add_sized(
        Vec2::new(RESET, ui.spacing().interact_size.y),
        Button::new(RichText::new("↺").monospace().size(17.0)).frame(false),
    )
    .on_hover_text(format!("Back to {}", scale::text(id, preset)))
    .accessible_name(format!("Reset {}", id.name()))
    .clicked()
}

/// What is said of a parameter: what it does, its range, its preset, when it takes effect.
fn help(id: Id, held: &Held) -> String {
    let p = id.parameter();
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    let preset = scale::text(id, held.preset.get(id));
    let when = if held.waits(id) { "\nTakes effect at the next start." } else { "" };
    let (min, max) = (scale::text(id, p.min), scale::text(id, p.max));
    let (min, max) = (min.trim_end_matches(".0000"), max.trim_end_matches(".0000"));
    format!("{}\n{min} to {max}{unit}; here {preset} by default.{when}", p.help)
}

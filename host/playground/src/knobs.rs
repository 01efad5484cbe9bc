//! The knobs: every parameter of the one table, to be found, turned, typed and set back.

mod group;
mod row;
mod scale;
mod sets;

use crate::channel::{self, Frame};
use crate::order::{Order, Start};
use eframe::egui::{self, Align, CollapsingHeader, Layout, Margin, RichText, ScrollArea, TextEdit, Ui};
use group::{Group, is_learned, is_state};
use hil_sim::run::only_at_start;
use hil_sim::schedule::Action;
use protocol::parameter::{Kind, Scope, Sign};
use protocol::{Id, Values};
use sets::Dialog;

/// What the knobs keep from one frame to the next.
#[derive(Debug, Default)]
pub struct Knobs {
    /// What is looked for: part of a name, of its meaning or of its group.
    pub search: String,
    /// What was chosen and waits for the next start, in the order of choice.
    pub pending: Vec<(Id, f64)>,
    in_hand: Option<InHand>,
    dialog: Option<Dialog>,
}

/// The knob that a hand is on, or was a moment ago.
#[derive(Clone, Copy, Debug)]
struct InHand {
    id: Id,
    value: f64,
    /// When it is taken for what the session holds, s of the window's clock.
    until: f64,
}

/// How long the session may take to take a value over, s; until then the knob stays where it was left.
const ECHO: f64 = 0.5;

/// What there is to show.
#[derive(Clone, Debug)]
pub struct Held<'a> {
    /// As they were last set, by whoever: of what is learned not as it is now, but as it was last set.
    pub values: &'a Values<f64>,
    /// As the experiment's preset has them on this body.
    pub preset: Values<f64>,
    /// The newest frame, for what is learned.
    pub live: Option<Frame>,
    /// What the session was started with; without it nothing can start again.
    pub running: Option<&'a Start>,
    /// There is a robot and no simulated body: no parameters of the plant, and no next start.
    pub robot_only: bool,
    /// Whether the knobs can be turned; not while a recording is shown.
    pub enabled: bool,
}

impl Held<'_> {
    /// A parameter as it is now: what is learned from the newest frame, the rest as it was set.
    fn now(&self, id: Id) -> f64 {
        self.live.as_ref().and_then(|frame| live(frame, id)).unwrap_or_else(|| self.values.get(id))
    }

    /// Whether a person has set it to something else than the preset has.
    fn is_changed(&self, id: Id) -> bool {
        self.values.get(id) != self.preset.get(id)
    }

    /// Whether a change of it waits for the next start.
    fn waits(&self, id: Id) -> bool {
        !self.robot_only && only_at_start(&Action::Set(id, 0.0)).is_some()
    }

    fn is_shown(&self, id: Id) -> bool {
        !self.robot_only || id.parameter().scope != Scope::Plant
    }
}

/// What is learned, as the frame has it; `None` for another parameter, or where the frame does not know it.
fn live(frame: &Frame, id: Id) -> Option<f64> {
    let number = |id| {
        let value = f64::from(frame.get(channel::Id::from_name(Id::name(id))?));
        value.is_finite().then_some(value)
    };
    match id.coupled() {
        Some([(a, _), (b, sign)]) => {
            let b = number(b)?;
            Some((number(a)? + if sign == Sign::Same { b } else { -b }) / 2.0)
        }
        None if is_state(id) => number(id),
        None => None,
    }
}

impl Knobs {
    /// The session begun anew with the knobs as they are now: what was learned is forgotten, what was set stays set,
    /// what was pending takes effect. `None` where nothing can start again.
    pub fn start_again(&self, held: &Held) -> Option<Start> {
        let running = held.running?;
        let from_start = running.sets.iter().copied().filter(|(id, _)| is_learned(*id, held.values));
        let set = Id::ALL
            .iter()
            .filter(|id| id.coupled().is_none() && !is_learned(**id, held.values) && held.is_changed(**id))
            .filter(|id| !self.pending.iter().any(|(other, _)| other == *id))
            .map(|id| (*id, held.values.get(*id)));
        let sets = from_start.chain(set).chain(self.pending.iter().copied()).collect();
        Some(Start { sets, ..running.clone() })
    }

    /// Asks for a name under which the parameters are saved.
    pub fn save_set(&mut self) {
        self.dialog = Some(Dialog::save());
    }

    /// Offers the sets that were saved.
    pub fn load_set(&mut self) {
        self.dialog = Some(Dialog::load());
    }

    /// What a knob shows.
    fn shown(&self, id: Id, held: &Held) -> f64 {
        let in_hand = self.in_hand.filter(|hand| hand.id == id).map(|hand| hand.value);
        in_hand.or_else(|| self.pending_value(id)).unwrap_or_else(|| held.now(id))
    }

    fn pending_value(&self, id: Id) -> Option<f64> {
        self.pending.iter().find(|(other, _)| *other == id).map(|(_, value)| *value)
    }

    /// Takes a value for a parameter: at once, or for the next start.
    fn set(&mut self, id: Id, value: f64, held: &Held, orders: &mut Vec<Order>) {
        if held.waits(id) {
            self.pending.retain(|(other, _)| *other != id);
            if value != held.values.get(id) {
                self.pending.push((id, value));
            }
        } else {
            orders.push(Order::Set(id, value));
        }
    }

    fn reset_all(&mut self, held: &Held, orders: &mut Vec<Order>) {
        self.pending.clear();
        self.in_hand = None;
        for &id in Id::ALL.iter().filter(|id| held.is_shown(**id) && id.coupled().is_none() && held.is_changed(**id)) {
            self.set(id, held.preset.get(id), held, orders);
        }
    }
}

/// A value that the parameter takes: within its bounds, whole where it must be.
fn kept(id: Id, value: f64) -> f64 {
    let parameter = id.parameter();
    let value = if parameter.kind == Kind::Whole { value.round() } else { value };
    value.clamp(parameter.min, parameter.max)
}

/// Shows the knobs, and adds what was asked for to `orders`.
pub fn show(ui: &mut Ui, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    knobs.pending.retain(|(id, value)| *value != held.values.get(*id));
    let now = ui.input(|input| input.time);
    // Taken over: a value that is only learned now may be on its way already.
    let is_over = |hand: &InHand| now > hand.until || (!is_state(hand.id) && held.values.get(hand.id) == hand.value);
    knobs.in_hand = knobs.in_hand.filter(|hand| !is_over(hand));
    ui.add_enabled_ui(held.enabled, |ui| {
        buttons(ui, knobs, held, orders);
        pending(ui, knobs, held, orders);
        ui.add_space(4.0);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| groups(ui, knobs, held, orders));
    });
    sets::show(ui.ctx(), knobs, held, orders);
}

fn buttons(ui: &mut Ui, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, Layout::right_to_left(Align::Center), |ui| {
        if !knobs.search.is_empty()
            && ui.button("×").on_hover_text("Show every parameter").accessible_name("Clear search").clicked()
        {
            knobs.search.clear();
        }
        let field = TextEdit::singleline(&mut knobs.search).hint_text("Search: a name, or what it does");
        ui.add(field.desired_width(f32::INFINITY)).accessible_name("Search parameters");
    });
    ui.horizontal_wrapped(|ui| {
        if ui.button("Save set…").on_hover_text("Writes every parameter, what was learned too, to a file").clicked() {
            knobs.save_set();
        }
        if ui.button("Load set…").on_hover_text("Sets the parameters of a file").clicked() {
            knobs.load_set();
        }
        let is_changed =
            !knobs.pending.is_empty() || Id::ALL.iter().any(|id| held.is_shown(*id) && held.is_changed(*id));
        let reset = ui.add_enabled(is_changed, egui::Button::new("Reset all"));
        if reset.on_hover_text("Every parameter that was changed goes back to the experiment's preset").clicked() {
            knobs.reset_all(held, orders);
        }
    });
}

/// What waits for the next start.
fn pending(ui: &mut Ui, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    let words = match knobs.pending.len() {
        0 => return,
        1 => "1 change takes effect at the next start:".to_owned(),
        n => format!("{n} changes take effect at the next start:"),
    };
    let fill = ui.visuals().selection.bg_fill.gamma_multiply(0.35);
    egui::Frame::new().fill(fill).corner_radius(4).inner_margin(Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let assignments: Vec<String> =
            knobs.pending.iter().map(|(id, value)| format!("{} = {}", id.name(), scale::text(*id, *value))).collect();
        ui.label(words).on_hover_text(assignments.join("\n"));
        ui.horizontal(|ui| {
            if ui.add_enabled(held.running.is_some(), egui::Button::new("Start again")).clicked()
                && let Some(start) = knobs.start_again(held)
            {
                orders.push(Order::Start(start));
                knobs.pending.clear();
            }
            if ui.button("Drop").on_hover_text("Forgets these changes").clicked() {
                knobs.pending.clear();
            }
        });
    });
}

fn groups(ui: &mut Ui, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    let search = knobs.search.trim().to_lowercase();
    let is_searching = !search.is_empty();
    let mut is_found = false;
    for group in Group::ALL {
        let of_group = || Id::ALL.iter().copied().filter(|id| Group::of(*id) == group && held.is_shown(*id));
        let rows: Vec<Id> = of_group().filter(|id| matches(*id, group, &search)).collect();
        if rows.is_empty() {
            continue;
        }
        is_found = true;
        let is_changed = |id: &Id| held.is_changed(*id) || knobs.pending_value(*id).is_some();
        let heading = match of_group().filter(|id| id.coupled().is_none()).filter(is_changed).count() {
            0 => group.name().to_owned(),
            n => format!("{}  ({n} changed)", group.name()),
        };
        // Apart from the search, so that a group is after it as it was before.
        CollapsingHeader::new(RichText::new(heading).strong())
            .id_salt((group.name(), is_searching))
            .default_open(is_searching || group == Group::Learning)
            .show_unindented(ui, |ui| {
                let columns = row::Columns::of(ui, &rows);
                for id in rows {
                    row::show(ui, id, &columns, knobs, held, orders);
                }
                ui.add_space(6.0);
            });
    }
    if !is_found {
        ui.label(RichText::new(format!("No parameter has to do with “{}”.", knobs.search.trim())).weak());
    }
}

/// Whether what is looked for is in its name, its meaning or its group's name; `search` is in lower case.
fn matches(id: Id, group: Group, search: &str) -> bool {
    [id.name(), id.parameter().help, group.name()].iter().any(|text| text.to_lowercase().contains(search))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bound_and_default_is_kept_and_what_lies_beyond_ends_at_the_bound() {
        for &id in Id::ALL {
            let p = id.parameter();
            for value in [p.min, p.max, p.default] {
                assert_eq!(kept(id, value), value, "{}", p.name);
            }
            assert_eq!((kept(id, -1e9), kept(id, 1e9)), (p.min, p.max));
            assert_eq!(p.check(kept(id, (p.min + p.max) / 3.1)), Ok(()), "{}", p.name);
        }
    }

    #[test]
    fn the_live_couplings_are_the_means_of_the_entries_that_they_stand_for() {
        let mut frame = Frame::at(0.0);
        assert_eq!(live(&frame, Id::Coupling1), None);
        frame.set_all(channel::Id::C11, &[1.0, 2.0, -4.0, 5.0]);
        assert_eq!(live(&frame, Id::Coupling1), Some(3.0));
        assert_eq!(live(&frame, Id::Coupling2), Some(3.0));
        assert_eq!(live(&frame, Id::C21), Some(-4.0));
        assert_eq!(live(&frame, Id::EpsA), None);
    }
}

//! The guide: the chapter's experiments, what there is to try in each, and what to watch.

mod cards;

use crate::order::{Order, Start};
use cards::{Card, Does, Try};
use eframe::egui::{self, Button, CollapsingHeader, DragValue, Frame, Margin, RichText, ScrollArea, Stroke, Ui};
use hil_sim::experiment::{EXPERIMENTS, Experiment};
use hil_sim::setup::BodyKind;
use protocol::Id;

/// What is chosen for the next start.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// The experiment whose card is open.
    pub chosen: &'static Experiment,
    /// The barrel.
    pub body: BodyKind,
    /// Seed of all randomness.
    pub seed: u64,
    /// What the experiments are for.
    pub stage: Stage,
}

/// What the experiments of the guide are for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// A simulated barrel, in which one of them runs.
    #[default]
    Simulation,
    /// A robot that can be touched: it takes an experiment's parameters, and nobody knows what it does now.
    Robot,
    /// None of them runs in what is shown: a recording, or a session that has ended.
    Idle,
}

impl Guide {
    /// What is running is chosen.
    pub fn of(running: &Start) -> Self {
        Guide { chosen: running.experiment, body: running.body, seed: running.seed, stage: Stage::default() }
    }

    /// An experiment's start on the barrel and with the seed that are chosen, with what differs from its preset.
    pub fn start(&self, experiment: &'static Experiment, sets: Vec<(Id, f64)>) -> Order {
        Order::Start(Start { experiment, body: self.body, seed: self.seed, sets })
    }

    /// Does what a button says. What belongs to another experiment than the one that runs begins that one first:
    /// parameters go with its start, lines come behind it.
    fn carry_out(&self, experiment: &'static Experiment, does: Does, running: &Start, orders: &mut Vec<Order>) {
        let is_running = running.experiment == experiment;
        match does {
            Does::Start(sets) => orders.push(self.start(experiment, sets.to_vec())),
            Does::Lines(lines) => {
                if !is_running {
                    orders.push(self.start(experiment, Vec::new()));
                }
                let body = if is_running { running.body } else { self.body };
                orders.extend(lines.iter().map(|line| Order::sized(line, body)));
            }
            Does::Set(_) | Does::C(_) | Does::A(_) => {
                let sets = does.sets();
                if is_running {
                    orders.extend(sets.into_iter().map(|(id, value)| Order::Set(id, value)));
                } else {
                    orders.push(self.start(experiment, sets));
                }
            }
        }
    }
}

/// What a barrel is called in the guide.
const fn body_name(body: BodyKind) -> &'static str {
    match body {
        BodyKind::Chapter => "the chapter's, 1 m",
        BodyKind::Tabletop => "tabletop, 30 cm",
    }
}

/// Shows the guide, and adds what was asked for to `orders`.
pub fn show(ui: &mut Ui, guide: &mut Guide, running: &Start, orders: &mut Vec<Order>) {
    start(ui, guide, running, orders);
    ui.add_space(6.0);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for experiment in EXPERIMENTS {
            card(ui, guide, experiment, running, orders);
        }
    });
}

/// The barrel, the seed, and the button that starts with them.
fn start(ui: &mut Ui, guide: &mut Guide, running: &Start, orders: &mut Vec<Order>) {
    ui.add_enabled_ui(guide.stage != Stage::Robot, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.label("Barrel:");
            for body in BodyKind::ALL {
                ui.radio_value(&mut guide.body, body, body_name(body));
            }
        })
    });
    ui.horizontal_wrapped(|ui| {
        let label = ui.label("Seed:");
        let help = "The same seed with the same settings gives the same run.";
        ui.add(DragValue::new(&mut guide.seed)).on_hover_text(help).labelled_by(label.id);
        if ui.button("Next seed").on_hover_text("Other random numbers at the next start").clicked() {
            guide.seed = guide.seed.wrapping_add(1);
        }
        let is_same = Guide { stage: guide.stage, ..Guide::of(running) } == *guide;
        let words = match guide.stage {
            Stage::Robot => "Give it to the robot",
            Stage::Simulation if is_same => "Start again",
            Stage::Simulation | Stage::Idle => "Start",
        };
        let chosen = format!("{} on {}, seed {}", guide.chosen.name, body_name(guide.body), guide.seed);
        if primary(ui, words).on_hover_text(format!("Starts {chosen}, as its preset has it")).clicked() {
            orders.push(guide.start(guide.chosen, Vec::new()));
        }
    });
}

/// The button that stands out.
fn primary(ui: &mut Ui, words: &str) -> egui::Response {
    let selection = ui.visuals().selection;
    let text = RichText::new(words).color(selection.stroke.color).strong();
    ui.add(Button::new(text).fill(selection.bg_fill))
}

fn card(ui: &mut Ui, guide: &mut Guide, experiment: &'static Experiment, running: &Start, orders: &mut Vec<Order>) {
    let Some(card) = Card::of(experiment) else { return };
    let is_chosen = guide.chosen == experiment;
    let is_running = running.experiment == experiment && guide.stage == Stage::Simulation;
    let line = ui.visuals().widgets.noninteractive.bg_stroke.color;
    let edge = if is_running { ui.visuals().selection.stroke.color } else { line };
    let frame = Frame::new().stroke(Stroke::new(1.0, edge)).corner_radius(6).inner_margin(Margin::symmetric(8, 6));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let state = if is_running { "  · running" } else { "" };
        let number = experiment.section.trim_start_matches("Experiment ").split(',').next().unwrap_or_default();
        let heading = format!("{number}  {}{state}", card.title);
        let header = CollapsingHeader::new(RichText::new(heading).strong().size(15.0))
            .id_salt(experiment.name)
            .open(Some(is_chosen))
            .show_unindented(ui, |ui| contents(ui, guide, experiment, card, running, orders));
        if header.header_response.clicked() && !is_chosen {
            guide.chosen = experiment;
        }
    });
    ui.add_space(4.0);
}

fn contents(
    ui: &mut Ui,
    guide: &Guide,
    experiment: &'static Experiment,
    card: &Card,
    running: &Start,
    orders: &mut Vec<Order>,
) {
    ui.add_space(2.0);
    ui.label(card.about);
    ui.add_space(8.0);
    for Try { name, watch, does } in card.tries {
        let is_for_hands = guide.stage == Stage::Robot && does.needs_simulation();
        let button = ui.add_enabled(!is_for_hands, Button::new(*name)).on_hover_text(does.words());
        if button.on_disabled_hover_text("only in a simulation: push a robot by hand").clicked() {
            guide.carry_out(experiment, *does, running, orders);
        }
        ui.label(*watch);
        ui.add_space(6.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable as _;
    use hil_sim::run::only_at_start;
    use hil_sim::schedule::Action;
    use hil_sim::setup::Setup;

    fn everything() -> impl Iterator<Item = (&'static Experiment, &'static Try)> {
        EXPERIMENTS
            .iter()
            .flat_map(|experiment| Card::of(experiment).unwrap().tries.iter().map(move |each| (experiment, each)))
    }

    fn running(experiment: &'static Experiment) -> Start {
        Start { experiment, body: BodyKind::Chapter, seed: 7, sets: Vec::new() }
    }

    fn asked(experiment: &'static Experiment, does: Does, running: &Start) -> Vec<Order> {
        let mut orders = Vec::new();
        Guide::of(running).carry_out(experiment, does, running, &mut orders);
        orders
    }

    #[test]
    fn every_experiment_has_a_card_and_every_card_an_experiment() {
        assert_eq!(EXPERIMENTS.len(), cards::CARDS.len());
        assert!(EXPERIMENTS.iter().all(|experiment| Card::of(experiment).is_some_and(|card| card.tries.len() >= 5)));
    }

    #[test]
    fn every_action_is_understood_by_the_console_and_within_its_range_and_at_its_time() {
        for (experiment, Try { name, does, .. }) in everything() {
            for order in asked(experiment, *does, &running(experiment)) {
                match order {
                    Order::Line(line) => assert!(barrel::console::parse(&line).is_ok(), "{name}: {line}"),
                    Order::Set(id, value) => {
                        assert_eq!(id.parameter().check(value), Ok(()), "{name}");
                        assert_eq!(only_at_start(&Action::Set(id, value)), None, "{name}");
                    }
                    Order::Start(Start { sets, .. }) => {
                        let mut setup = Setup::new(experiment, BodyKind::Chapter);
                        for (id, value) in sets {
                            assert_eq!(setup.set(id, value), Ok(()), "{name}");
                        }
                    }
                    Order::Hand(_) => panic!("{name} needs a hand"),
                }
            }
        }
    }

    #[test]
    fn no_two_actions_of_an_experiment_have_the_same_name() {
        for experiment in EXPERIMENTS {
            let mut names: Vec<_> = Card::of(experiment).unwrap().tries.iter().map(|each| each.name).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), Card::of(experiment).unwrap().tries.len(), "{}", experiment.name);
        }
    }

    #[test]
    fn an_action_of_another_experiment_starts_that_one_first() {
        let [open, closed] = ["open-loop", "closed-loop"].map(|name| Experiment::find(name).unwrap());
        let set = Does::Set(&[(Id::Period, 100.0)]);
        assert_eq!(asked(open, set, &running(open)), [Order::Set(Id::Period, 100.0)]);
        let started = Start { sets: vec![(Id::Period, 100.0)], ..running(open) };
        assert_eq!(asked(open, set, &running(closed)), [Order::Start(started)]);
        let line = Order::Line("push 20 0.5".to_owned());
        let push = Does::Lines(&["push 20 0.5"]);
        assert_eq!(asked(closed, push, &running(closed)), std::slice::from_ref(&line));
        assert_eq!(asked(closed, push, &running(open)), [Order::Start(running(closed)), line]);
    }

    #[test]
    fn a_coupling_by_an_angle_is_that_rotation() {
        let preset = |id| EXPERIMENTS[1].preset.iter().find(|(other, _)| *other == id).unwrap().1;
        for (id, value) in Does::C(0.5).sets() {
            assert!((value - preset(id)).abs() < 1e-12, "{}", id.name());
        }
        let preset = |id| EXPERIMENTS[2].preset.iter().find(|(other, _)| *other == id).unwrap().1;
        for (id, value) in Does::A(-0.3).sets() {
            assert!((value - preset(id)).abs() < 1e-12, "{}", id.name());
        }
    }

    #[test]
    fn a_card_is_opened_and_what_is_on_it_is_done_with_the_body_and_seed_that_were_chosen() {
        let closed = Experiment::find("closed-loop").unwrap();
        let start = running(closed);
        let state = (Guide::of(&start), Vec::new());
        let mut window = Harness::builder()
            .with_accessibility_check(true)
            .with_size([420.0, 1400.0])
            .build_ui_state(|ui, (guide, orders): &mut (Guide, Vec<Order>)| show(ui, guide, &start, orders), state);
        window.run();
        for name in ["tabletop, 30 cm", "Next seed", "3.1  Homeokinetic control"] {
            window.get_by_label(name).click();
            window.run();
        }
        assert!(window.query_by_label("C = U(0.9)").is_none(), "one card is open");
        for name in ["Hold it", "Start"] {
            window.get_by_label(name).click();
            window.run();
        }
        let chosen = Guide::of(&Start { body: BodyKind::Tabletop, seed: 8, ..running(&EXPERIMENTS[4]) });
        assert_eq!(window.state().0, chosen);
        let held = chosen.start(&EXPERIMENTS[4], vec![(Id::RollingResistance, 50.0)]);
        assert_eq!(window.state().1, [held, chosen.start(&EXPERIMENTS[4], Vec::new())]);
    }
}

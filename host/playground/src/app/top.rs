//! The bar at the top: menus, time, link, and what stops a robot.

use super::App;
use crate::film::Kind;
use crate::keys::{Action, speed};
use crate::order::{Order, Start};
use crate::session::LinkState;
use eframe::egui;
use egui::{Align, Button, Color32, Layout, RichText, Ui, Vec2};
use hil_sim::experiment::EXPERIMENTS;
use protocol::message::SafetyState;
use std::time::Duration;

/// A session that gives no sign of life for so long is said to lag.
const LIFELESS: Duration = Duration::from_secs(1);
/// Size of the buttons that a hand must find at once.
const BIG: Vec2 = Vec2::new(86.0, 34.0);

const RED: Color32 = Color32::from_rgb(0xc6, 0x28, 0x28);
const GREEN: Color32 = Color32::from_rgb(0x2e, 0x7d, 0x32);
const AMBER: Color32 = Color32::from_rgb(0xb2, 0x6a, 0x00);
const GREY: Color32 = Color32::from_rgb(0x61, 0x61, 0x61);

impl App {
    /// Shows the bar.
    pub(super) fn top(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        ui.add_space(3.0);
        ui.horizontal(|ui| {
            ui.set_min_height(BIG.y);
            self.menus(ui, orders);
            ui.separator();
            self.transport(ui, orders);
            ui.separator();
            self.link(ui);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| self.safety(ui, orders));
        });
        ui.add_space(3.0);
        self.banner(ui, orders);
    }

    fn menus(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let context = ui.ctx().clone();
        let mut chosen = None;
        ui.menu_button("Experiment", |ui| {
            for experiment in EXPERIMENTS {
                let is_running = self.status.start.as_ref().is_some_and(|start| start.experiment == experiment);
                let label = format!("{} ({})", experiment.name, experiment.section);
                if ui.selectable_label(is_running, label).on_hover_text(experiment.summary).clicked() {
                    orders.push(Order::Start(Start {
                        experiment,
                        body: self.guide.body,
                        seed: self.guide.seed,
                        sets: Vec::new(),
                    }));
                    ui.close();
                }
            }
        });
        ui.menu_button("File", |ui| {
            for (label, action) in [
                ("Open a recording…  Ctrl+O", Action::Open),
                ("Save parameters…  Ctrl+S", Action::SaveSet),
                ("Picture of the window  Ctrl+P", Action::Picture),
                (if self.film.is_some() { "End the film  Ctrl+R" } else { "Film the scene  Ctrl+R" }, Action::Film),
            ] {
                if ui.button(label).clicked() {
                    chosen = Some(action);
                    ui.close();
                }
            }
            ui.menu_button("Films are written as", |ui| {
                for kind in Kind::ALL {
                    ui.radio_value(&mut self.layout.film, kind, kind.name());
                }
            });
        });
        ui.menu_button("View", |ui| {
            ui.checkbox(&mut self.layout.plots_shown, "Plots  Ctrl+G");
            if ui.checkbox(&mut self.layout.console, "Console  Ctrl+K").clicked() && self.layout.console {
                self.drawer.focus();
            }
            ui.separator();
            egui::widgets::global_theme_preference_buttons(ui);
            egui::gui_zoom::zoom_menu_buttons(ui);
        });
        if ui.button("Help").on_hover_text("Keys and mouse (h)").clicked() {
            chosen = Some(Action::Help);
        }
        if let Some(action) = chosen {
            self.act(action, &context, orders);
        }
    }

    /// Pause, single step, speed.
    fn transport(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        if self.session.is_robot() && self.recording.is_none() {
            // Nobody stops a robot's time.
            return;
        }
        let going = self.is_going();
        let does = if going { "Pause" } else { "Go on" };
        if ui.add(Button::new(does).min_size(Vec2::new(56.0, 26.0))).on_hover_text("Space").clicked() {
            self.pause_or_go(orders);
        }
        if ui.add(Button::new("Step").min_size(Vec2::new(44.0, 26.0))).on_hover_text("One control step (n)").clicked() {
            self.step(orders);
        }
        if named(ui, "−", "Slower (-)") {
            self.set_speed(speed::slower(self.speed()), orders);
        }
        ui.label(speed::words(self.speed())).on_hover_text("Simulated seconds a second");
        if named(ui, "+", "Faster (+)") {
            self.set_speed(speed::faster(self.speed()), orders);
        }
    }

    /// How the robot is reached: always there, always true.
    fn link(&self, ui: &mut Ui) {
        let lifeless = self.status.beat.elapsed();
        let link = match &self.status.link {
            LinkState::Live if lifeless > LIFELESS => {
                LinkState::Lagging(format!("no sign of life for {:.0} s", lifeless.as_secs_f64()))
            }
            link => link.clone(),
        };
        let colour = match link {
            LinkState::Live => GREEN,
            LinkState::Connecting(_) | LinkState::Lagging(_) => AMBER,
            LinkState::Lost(_) | LinkState::Refused(_) => RED,
            LinkState::Over(_) => GREY,
        };
        let text = RichText::new(format!(" {} ", link.word())).color(Color32::WHITE).background_color(colour).strong();
        ui.label(text).on_hover_text(format!("Link: {}", link.sentence()));
        if !self.status.who.is_empty() {
            ui.weak(&self.status.who);
        }
        if let Some(film) = &self.film {
            let text = format!("filming {:.0} s", film.length().as_secs_f64());
            ui.label(RichText::new(text).color(ui.visuals().error_fg_color));
        }
        if self.loading.is_some() {
            ui.spinner();
        }
    }

    /// Stop, disarm and arm, from the right.
    fn safety(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let state = self.status.state;
        let mut line = |text: &str| orders.push(Order::Line(text.to_owned()));
        let big = |ui: &mut Ui, text: &str, fill: Color32, enabled: bool, help: &str| {
            let text = RichText::new(text).strong().size(15.0).color(Color32::WHITE);
            let button = Button::new(text).fill(fill).min_size(BIG);
            ui.add_enabled(enabled, button).on_hover_text(help).clicked()
        };
        // The stop can always be asked for, even of a robot whose line is lost: it is told when it is found.
        if big(ui, "STOP", RED, true, "Emergency stop (Esc): zero outputs until the fault is cleared") {
            line("stop");
        }
        let is_up = self.status.link.is_up();
        if big(ui, "Disarm", GREY, is_up && state != Some(SafetyState::Disarmed), "Holds the outputs at zero (D)") {
            line("disarm");
        }
        if big(ui, "Arm", GREEN, is_up && state == Some(SafetyState::Disarmed), "Lets the brain move the weights (A)") {
            line("arm");
        }
        let (word, colour) = match state {
            Some(SafetyState::Armed) => ("Armed", GREEN),
            Some(SafetyState::Disarmed) => ("Disarmed", GREY),
            Some(SafetyState::Fault(_)) => ("Fault", RED),
            None => ("State unknown", AMBER),
        };
        ui.label(RichText::new(format!(" {word} ")).color(Color32::WHITE).background_color(colour).strong());
        let needs_home = self.session.is_robot() && self.status.vitals.is_some_and(|vitals| !vitals.homed);
        if needs_home && ui.button("Home").on_hover_text("Finds the middle of both axes, from stop to stop").clicked() {
            line("home");
        }
    }

    /// What is wrong, and the way out of it.
    fn banner(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        if let Some(SafetyState::Fault(code)) = self.status.state {
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(format!("Fault: {code}")).color(ui.visuals().error_fg_color).strong());
                if ui.button("Clear the fault").clicked() {
                    orders.push(Order::Line("clear".to_owned()));
                }
                if !self.session.is_robot() && ui.button("Clear and arm").clicked() {
                    orders.extend(["clear", "arm"].map(|line| Order::Line(line.to_owned())));
                }
            });
        }
        if !matches!(self.status.link, LinkState::Live) {
            ui.horizontal_wrapped(|ui| {
                let colour = ui.visuals().warn_fg_color;
                ui.label(RichText::new(self.status.link.sentence()).color(colour));
                if let (LinkState::Over(_), Some(start)) = (&self.status.link, &self.status.start)
                    && !self.session.is_robot()
                    && ui.button("Start again").clicked()
                {
                    orders.push(Order::Start(start.clone()));
                }
            });
        }
        if let Some(playback) = &self.recording {
            let mut back = false;
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new("Recording").strong());
                ui.label(&playback.recording.title);
                if let Some(problem) = &playback.recording.problem {
                    ui.label(RichText::new(problem).color(ui.visuals().warn_fg_color));
                }
                back = ui.button("Back to live").clicked();
            });
            if back {
                self.back_to_live();
            }
        }
    }
}

/// A small button with a sign on it and a name.
fn named(ui: &mut Ui, sign: &str, name: &str) -> bool {
    let response = ui.add(Button::new(sign).min_size(Vec2::splat(26.0))).on_hover_text(name);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    response.clicked()
}

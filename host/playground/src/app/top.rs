//! The bar at the top: menus, time, link, and what stops a robot.

use super::App;
use crate::film::Kind;
use crate::keys::Action;
use crate::order::Order;
use crate::session::LinkState;
use eframe::egui;
use egui::{Align, Button, Color32, Id, Label, Layout, RichText, ThemePreference, Ui, UiBuilder, Vec2};
use hil_sim::experiment::EXPERIMENTS;
use protocol::message::SafetyState;
use std::path::Path;
use std::time::Duration;

/// A session that gives no sign of life for so long is said to lag.
const LIFELESS: Duration = Duration::from_secs(1);
/// Size of the buttons that a hand must find at once.
const BIG: Vec2 = Vec2::new(86.0, 34.0);
/// Egui's own buttons for them have signs that not every font has.
const THEMES: [(ThemePreference, &str); 3] = [
    (ThemePreference::System, "Light or dark as the system"),
    (ThemePreference::Dark, "Dark"),
    (ThemePreference::Light, "Light"),
];

const RED: Color32 = Color32::from_rgb(0xc6, 0x28, 0x28);
const GREEN: Color32 = Color32::from_rgb(0x2e, 0x7d, 0x32);
const AMBER: Color32 = Color32::from_rgb(0xb2, 0x6a, 0x00);
const GREY: Color32 = Color32::from_rgb(0x61, 0x61, 0x61);

impl App {
    /// Shows the bar: menus on the left, what stops a robot on the right, and between them how it is reached.
    pub(super) fn top(&mut self, ui: &mut Ui, steering: &mut Vec<Order>, orders: &mut Vec<Order>) {
        ui.add_space(3.0);
        // What stops a robot gets its room first, and the rest what is left of it.
        let row = Vec2::new(ui.available_width(), BIG.y);
        ui.allocate_ui_with_layout(row, Layout::right_to_left(Align::Center), |ui| {
            self.safety(ui, orders);
            // By a name of its own: what comes and goes beside a menu does not close it, nor take a click from it.
            let left = UiBuilder::new().scope_id(Id::unique("menus")).layout(Layout::left_to_right(Align::Center));
            ui.scope_builder(left, |ui| {
                self.menus(ui, steering);
                ui.separator();
                self.link(ui);
                // Words may be cut off.
                self.words(ui);
            });
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
                    orders.push(self.guide.start(experiment, Vec::new()));
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
            let mut theme = ui.options(|options| options.theme_preference);
            for (preference, name) in THEMES {
                ui.radio_value(&mut theme, preference, name);
            }
            ui.ctx().set_theme(theme);
            ui.separator();
            egui::gui_zoom::zoom_menu_buttons(ui);
        });
        if ui.button("Help").on_hover_text("Keys and mouse (h)").clicked() {
            chosen = Some(Action::Help);
        }
        if let Some(action) = chosen {
            self.act(action, &context, orders);
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
        if let Some(film) = &self.film {
            let text = format!("filming {:.0} s", film.length().as_secs_f64());
            ui.label(RichText::new(text).color(ui.visuals().error_fg_color));
        }
        if self.loading.is_some() {
            ui.spinner();
        }
    }

    /// What the robot is, and where the session is recorded.
    fn words(&self, ui: &mut Ui) {
        let (recorded, hover) = match &self.status.log {
            Some(log) => {
                let folder = log.parent().and_then(Path::file_name).unwrap_or(log.as_os_str()).to_string_lossy();
                (RichText::new(format!("recorded in {folder}")).weak(), log.display().to_string())
            }
            None if self.status.session > 0 && self.status.link.is_up() => {
                let warning = RichText::new("not recorded").color(ui.visuals().warn_fg_color);
                (warning, "The log could not be written; the console says why".to_owned())
            }
            None => (RichText::new(""), String::new()),
        };
        ui.add(Label::new(recorded).truncate()).on_hover_text(hover);
        ui.add(Label::new(RichText::new(&self.status.who).weak()).truncate());
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
        let may_move = is_up && state == Some(SafetyState::Disarmed);
        if big(ui, "Arm", GREEN, may_move, "Lets the brain move the weights (Shift+A)") {
            line("arm");
        }
        if self.session.is_robot() && self.status.vitals.is_some_and(|vitals| !vitals.homed) {
            let help = "Finds the middle of both axes, from stop to stop: before that the robot is not armed";
            if big(ui, "Home", AMBER, may_move, help) {
                line("home");
            }
        }
        let (word, colour) = match state {
            Some(SafetyState::Armed) if self.status.homing => ("Homing", AMBER),
            Some(SafetyState::Armed) if !is_up => ("Armed when last heard", AMBER),
            Some(SafetyState::Armed) => ("Armed", GREEN),
            Some(SafetyState::Disarmed) => ("Disarmed", GREY),
            Some(SafetyState::Fault(_)) => ("Fault", RED),
            None => ("State unknown", AMBER),
        };
        ui.label(RichText::new(format!(" {word} ")).color(Color32::WHITE).background_color(colour).strong());
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

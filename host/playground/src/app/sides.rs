//! What is shown beside the scene: experiments and parameters on the left, matrices and plots on the right.

use super::App;
use super::layout::{self, Left};
use crate::guide::{self, Stage};
use crate::knobs::{self, Held, Knobs};
use crate::order::Order;
use crate::session::LinkState;
use crate::{matrix, plots};
use eframe::egui;
use egui::Ui;

impl App {
    /// Shows the parameters.
    fn knobs(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let Some((held, knobs)) = self.held() else {
            ui.weak("The parameters are shown as soon as the robot has told them.");
            return;
        };
        knobs::show(ui, knobs, &held, orders);
    }

    /// Begins the session anew with what was set by hand.
    pub(super) fn start_again(&mut self, orders: &mut Vec<Order>) {
        let again = self.held().and_then(|(held, knobs)| knobs.start_again(&held));
        orders.extend(again.map(Order::Start));
    }

    /// What the knobs are to show, and they themselves.
    fn held(&mut self) -> Option<(Held<'_>, &mut Knobs)> {
        let start = self.status.start.as_ref()?;
        let (values, live, enabled) = match &self.recording {
            Some(playback) => (&playback.recording.values, playback.show.frame(), false),
            None => (self.status.values.as_ref()?, self.live.history.frame_at(None), self.status.link.is_up()),
        };
        let robot_only = self.session.is_robot() && self.recording.is_none();
        let held = Held { values, preset: layout::preset(start), live, running: Some(start), robot_only, enabled };
        Some((held, &mut self.knobs))
    }

    /// Experiments or parameters.
    pub(super) fn left(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        ui.horizontal(|ui| {
            for left in [Left::Guide, Left::Knobs] {
                ui.selectable_value(&mut self.layout.left, left, left.name());
            }
        });
        ui.separator();
        match self.layout.left {
            Left::Guide => {
                self.guide.stage = match (&self.recording, self.session.is_robot()) {
                    (Some(_), _) => Stage::Idle,
                    (None, true) => Stage::Robot,
                    (None, false) if matches!(self.status.link, LinkState::Over(_)) => Stage::Idle,
                    (None, false) => Stage::Simulation,
                };
                if let Some(start) = &self.status.start {
                    guide::show(ui, &mut self.guide, start, orders);
                }
            }
            Left::Knobs => self.knobs(ui, orders),
        }
    }

    /// Matrices and plots.
    pub(super) fn right(&mut self, ui: &mut Ui) {
        let frame = self.show().frame();
        // In a low window, too, there is room for plots.
        let half = 0.5 * ui.available_height();
        egui::CollapsingHeader::new("Matrices").default_open(true).show(ui, |ui| {
            let area = egui::ScrollArea::vertical().id_salt("matrices").max_height(half);
            area.show(ui, |ui| matrix::show(ui, frame.as_ref()));
        });
        let show = self.recording.as_ref().map_or(&self.live, |playback| &playback.show);
        let output = plots::show(ui, &mut self.layout.plots, &show.history, show.cursor);
        if output.live && self.recording.is_none() {
            self.live.cursor = None;
        }
        if let Some(t) = output.scrub {
            self.scrub(t);
        }
    }
}

//! Leaving: a robot that is Armed is not left behind unseen.

use super::App;
use crate::order::Order;
use eframe::egui;
use egui::{Context, Id, Modal, ViewportCommand};
use protocol::message::SafetyState;
use std::sync::atomic::Ordering;

impl App {
    /// Asks what shall become of a robot that is Armed, when the window is to be closed.
    pub(super) fn farewell(&mut self, context: &Context, orders: &mut Vec<Order>) {
        if self.interrupted.load(Ordering::Relaxed) {
            // Who ends it in the terminal is asked nothing; a robot goes on as it is.
            context.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        let is_armed = self.session.is_robot() && self.status.state == Some(SafetyState::Armed);
        if context.input(|input| input.viewport().close_requested()) && is_armed && !self.leaving {
            context.send_viewport_cmd(ViewportCommand::CancelClose);
            self.leaving = true;
        }
        if !self.leaving {
            return;
        }
        if matches!(self.status.state, Some(SafetyState::Fault(_))) {
            // Somebody pressed Esc, or it has stopped by itself: that is to be seen.
            self.leaving = false;
            return;
        }
        if !is_armed {
            context.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        let mut stays = false;
        Modal::new(Id::unique("farewell")).show(context, |ui| {
            ui.heading("The robot is Armed");
            ui.label("It is autonomous: left so, it goes on without this window. Esc stops it, and the window stays.");
            ui.horizontal(|ui| {
                if ui.button("Disarm and close").clicked() {
                    orders.push(Order::Line("disarm".to_owned()));
                }
                if ui.button("Close and leave it Armed").clicked() {
                    context.send_viewport_cmd(ViewportCommand::Close);
                }
                stays = ui.button("Stay here").clicked();
            });
        });
        self.leaving = !stays;
    }
}

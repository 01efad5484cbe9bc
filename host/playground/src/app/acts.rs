//! What keys and buttons do.

use super::App;
use super::layout::Left;
use crate::film::Film;
use crate::keys::{Action, speed};
use crate::order::Order;
use crate::picture;
use crate::scene::Mode;
use barrel::session::Pace;
use eframe::egui;
use egui::Context;

impl App {
    /// Goes back from a recording to the session.
    pub(super) fn back_to_live(&mut self) {
        self.recording = None;
        self.layout.plots.follow();
        self.layout.view.recentre();
    }

    pub(super) fn end_film(&mut self) {
        if let Some(film) = self.film.take() {
            let sender = self.notices.sender();
            self.films.retain(|film| !film.is_finished());
            self.films.push(film.finish(move |said| sender.tell(said)));
        }
    }

    /// Does what was asked for by a key or a button.
    pub(super) fn act(&mut self, action: Action, context: &Context, orders: &mut Vec<Order>) {
        match action {
            Action::Lines(["step"]) => self.step(orders),
            Action::Lines(lines) => {
                let body = self.status.start.as_ref().map_or(self.guide.body, |start| start.body);
                orders.extend(lines.iter().map(|line| Order::sized(line, body)));
            }
            Action::PauseOrGo => self.pause_or_go(orders),
            Action::Faster => self.set_speed(speed::faster(self.speed()), orders),
            Action::Slower => self.set_speed(speed::slower(self.speed()), orders),
            Action::StartAgain => self.start_again(orders),
            Action::Follow => {
                let mode = &mut self.layout.view.mode;
                *mode = if *mode == Mode::Follow { Mode::Orbit } else { Mode::Follow };
            }
            Action::Help => self.help = !self.help,
            Action::Plots => self.layout.plots_shown = !self.layout.plots_shown,
            Action::Console => {
                self.layout.console = !self.layout.console;
                if self.layout.console {
                    self.drawer.focus();
                }
            }
            Action::Open => self.files.choose(),
            Action::SaveSet => {
                self.layout.left = Left::Knobs;
                self.knobs.save_set();
            }
            Action::Picture => {
                let (place, sender) = (self.folder(), self.notices.sender());
                picture::take(context, place, move |said| sender.tell(said));
            }
            Action::Film => match self.film {
                Some(_) => self.end_film(),
                None => match Film::begin(&self.folder(), self.layout.film) {
                    Ok(film) => self.film = Some(film),
                    Err(why) => self.notices.warn(&why),
                },
            },
        }
    }

    /// Passes on what steers the session. While a recording hides it, it is only stopped, or begun anew and shown.
    pub(super) fn steer(&mut self, steering: Vec<Order>, orders: &mut Vec<Order>) {
        for order in steering {
            let is_start = matches!(order, Order::Start(_));
            let is_safe = matches!(&order, Order::Line(line) if line == "stop" || line == "disarm");
            if self.recording.is_some() && is_start {
                self.back_to_live();
            }
            if self.recording.is_none() || is_safe {
                orders.push(order);
            } else {
                self.notices.warn("A recording is shown: go back to live first.");
            }
        }
    }

    pub(super) fn speed(&self) -> f64 {
        self.recording.as_ref().map_or(self.status.speed, |playback| playback.speed)
    }

    pub(super) fn set_speed(&mut self, speed: f64, orders: &mut Vec<Order>) {
        match &mut self.recording {
            // Nothing is to be computed: there is no such thing as "as fast as it goes".
            Some(playback) => playback.speed = if speed.is_finite() { speed } else { playback.speed },
            None if speed.is_finite() => orders.push(Order::Line(format!("speed {speed}"))),
            None => orders.push(Order::Line("speed max".to_owned())),
        }
    }

    pub(super) fn is_going(&self) -> bool {
        match &self.recording {
            Some(playback) => playback.playing,
            None => self.status.link.is_up() && self.status.pace != Pace::Paused,
        }
    }

    pub(super) fn pause_or_go(&mut self, orders: &mut Vec<Order>) {
        match &mut self.recording {
            Some(playback) => playback.toggle(),
            None => {
                self.live.cursor = None;
                let line = if self.status.pace == Pace::Paused { "go" } else { "pause" };
                orders.push(Order::Line(line.to_owned()));
            }
        }
    }

    pub(super) fn step(&mut self, orders: &mut Vec<Order>) {
        match &mut self.recording {
            Some(playback) => playback.step(1),
            None => orders.push(Order::Line("step".to_owned())),
        }
    }
}

//! The scene and, below it, the time: what is shown of a barrel, and which instant of it.

use super::{App, Playback, Show};
use crate::channel::{Frame, Id as Channel};
use crate::history::History;
use crate::keys::{self, speed};
use crate::order::Order;
use crate::scene::{self, Pose, Scene, Shape};
use crate::session::LinkState;
use eframe::egui;
use egui::{Align, Button, Label, Sense, Slider, Ui, Vec2};
use hil_sim::plant::Load;

/// A control step, s.
const STEP: f64 = 0.02;
/// The trail is so long, s, and drawn with so many points at most.
const TRAIL: f64 = 60.0;
const POINTS: usize = 600;
/// The scene of a live barrel is never further behind its newest step than this, s at real time.
const BEHIND: f64 = 0.08;

impl Show {
    pub(super) fn new(history: History, shape: Shape) -> Self {
        Show { history, shape, cursor: None, clock: 0.0 }
    }

    /// A new session: time begins anew.
    pub(super) fn begin(&mut self) {
        self.history.clear();
        self.cursor = None;
        self.clock = 0.0;
    }

    /// Looks at this instant, s.
    pub(super) fn look_at(&mut self, t: f64) {
        let Some((begin, end)) = self.history.span() else { return };
        self.cursor = Some(t.clamp(begin, end));
        self.clock = t.clamp(begin, end);
    }

    /// The control step that is looked at.
    pub(super) fn frame(&self) -> Option<Frame> {
        self.history.frame_at(self.cursor)
    }

    /// Lets the scene run on by `dt`, s of the clock on the wall.
    pub(super) fn advance(&mut self, dt: f64, speed: f64, going: bool) {
        let Some((begin, end)) = self.history.span() else { return };
        if let Some(cursor) = self.cursor {
            self.clock = cursor;
            return;
        }
        if !going || !speed.is_finite() {
            self.clock = end;
            return;
        }
        let next = self.clock + dt * speed;
        self.clock = if next < end - (BEHIND * speed).max(2.0 * STEP) { end - STEP } else { next.min(end) }.max(begin);
    }

    /// The barrel as it stands at the scene's instant, between two control steps.
    fn pose(&self) -> Option<Pose> {
        let row = self.history.at_or_before(self.clock)?;
        let frame = self.history.frame(row)?;
        let pose = Pose::of(&frame, &self.shape)?;
        let Some(next) = self.history.frame(row + 1).filter(|next| next.t > frame.t && next.t - frame.t < 0.5) else {
            return Some(pose);
        };
        let part = ((self.clock - frame.t) / (next.t - frame.t)).clamp(0.0, 1.0);
        Some(Pose::of(&next, &self.shape).map_or_else(|| pose, |next| Pose::between(&pose, &next, part as f32)))
    }

    /// Where the barrel has been, until the scene's instant.
    fn trail(&self) -> Vec<[f32; 2]> {
        let (Some(from), Some(to)) =
            (self.history.at_or_before(self.clock - TRAIL).or(Some(0)), self.history.at_or_before(self.clock))
        else {
            return Vec::new();
        };
        let stride = (to.saturating_sub(from) / POINTS).max(1);
        // From the same rows in every frame: a trail does not shimmer.
        (from.next_multiple_of(stride)..=to)
            .step_by(stride)
            .filter_map(|row| {
                let frame = self.history.frame(row)?;
                let point = [frame.get(Channel::Px), frame.get(Channel::Py)];
                point.iter().all(|p| p.is_finite()).then_some(point)
            })
            .collect()
    }
}

impl Playback {
    /// Plays, or stops.
    pub(super) fn toggle(&mut self) {
        let at_end = self.show.history.span().is_some_and(|(_, end)| self.show.cursor.is_none_or(|t| t >= end));
        if !self.playing
            && at_end
            && let Some((begin, _)) = self.show.history.span()
        {
            self.show.look_at(begin);
        }
        self.playing = !self.playing;
    }

    /// Goes so many control steps on, or back.
    pub(super) fn step(&mut self, steps: i32) {
        self.playing = false;
        if let Some(cursor) = self.show.cursor {
            self.show.look_at(cursor + f64::from(steps) * STEP);
        }
    }

    /// Plays on by `dt`, s of the clock on the wall.
    pub(super) fn advance(&mut self, dt: f64) {
        let (Some(cursor), Some((_, end))) = (self.show.cursor, self.show.history.span()) else { return };
        if self.playing {
            self.show.look_at(cursor + dt * self.speed);
            self.playing = cursor < end;
        } else {
            self.show.clock = cursor;
        }
    }
}

impl App {
    /// Shows the scene.
    pub(super) fn stage(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let is_live = self.recording.is_none();
        let is_simulated = !self.session.is_robot();
        let show = self.show();
        let pose = show.pose();
        let trail = show.trail();
        let scene = Scene {
            shape: &show.shape.clone(),
            pose: pose.as_ref(),
            trail: &trail,
            grabbable: is_live && is_simulated && self.status.link.is_up() && self.live.cursor.is_none(),
            bare: self.film.is_some(),
            stale: is_live
                && matches!(self.status.link, LinkState::Lost(_) | LinkState::Refused(_) | LinkState::Over(_)),
        };
        let output = scene::show(ui, &mut self.layout.view, &scene);
        if output.response.has_focus() {
            keys::leave_space(ui.ctx());
        }
        self.scene = output.response.rect;
        match (output.load, self.hand) {
            (Some(load), _) => orders.push(Order::Hand(load)),
            (None, true) => orders.push(Order::Hand(Load::default())),
            (None, false) => {}
        }
        self.hand = output.load.is_some();
    }

    /// Looks at an instant that was chosen, s; a recording stops there.
    pub(super) fn scrub(&mut self, t: f64) {
        self.show_mut().look_at(t);
        if let Some(playback) = &mut self.recording {
            playback.playing = false;
        }
    }

    /// Pause, single step, speed; which instant is looked at, and a slider to choose another.
    pub(super) fn timeline(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        ui.horizontal(|ui| {
            self.transport(ui, orders);
            let Some((begin, end)) = self.show().history.span() else {
                ui.weak("No control step yet.");
                return;
            };
            let is_live = self.recording.is_none();
            let at = self.show().cursor.unwrap_or(end);
            // The slider knows control steps only, and would take what lies between two of them for a change.
            let shown = (at / STEP).round() * STEP;
            let mut t = shown;
            ui.monospace(format!("{at:9.2} s"));
            let label = ui.label("Time");
            let live = if is_live { 70.0 } else { 0.0 };
            ui.spacing_mut().slider_width = (ui.available_width() - live - 12.0).max(80.0);
            let slider = Slider::new(&mut t, begin..=end.max(begin + STEP)).step_by(STEP).smart_aim(false);
            let slider = ui.add(slider.show_value(false)).labelled_by(label.id);
            self.marks(ui, slider.rect, begin, end);
            if slider.drag_started() || slider.clicked() {
                slider.request_focus();
            }
            if slider.has_focus() {
                keys::leave_space(ui.ctx());
            }
            if slider.changed() && (t - shown).abs() > 0.5 * STEP {
                self.scrub(t);
            }
            if is_live {
                let is_newest = self.live.cursor.is_none();
                let button = Button::selectable(is_newest, "Newest");
                if ui.add(button).on_hover_text("Back to the newest instant").clicked() {
                    self.live.cursor = None;
                }
            }
        });
    }

    fn transport(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        if self.session.is_robot() && self.recording.is_none() {
            // Nobody stops a robot's time.
            return;
        }
        let does = if self.is_going() { "Pause" } else { "Go on" };
        if ui.add(Button::new(does).min_size(Vec2::new(56.0, 24.0))).on_hover_text("Space").clicked() {
            self.pause_or_go(orders);
        }
        if ui.add(Button::new("Step").min_size(Vec2::new(44.0, 24.0))).on_hover_text("One control step (n)").clicked() {
            self.step(orders);
        }
        if named(ui, "−", "Slower (-)") {
            self.set_speed(speed::slower(self.speed()), orders);
        }
        // As wide as the longest: the buttons stay where they are.
        let words = speed::words(self.speed());
        let label = Label::new(words).halign(Align::Center).selectable(false);
        ui.add_sized([124.0, 24.0], label).on_hover_text("Simulated seconds a second");
        if named(ui, "+", "Faster (+)") {
            self.set_speed(speed::faster(self.speed()), orders);
        }
        ui.separator();
    }

    /// Marks what happened in a recording.
    fn marks(&self, ui: &mut Ui, rect: egui::Rect, begin: f64, end: f64) {
        let Some(playback) = &self.recording else { return };
        let colour = ui.visuals().warn_fg_color;
        for (i, event) in playback.recording.events.iter().enumerate().take(500) {
            let part = ((event.t - begin) / (end - begin).max(STEP)).clamp(0.0, 1.0) as f32;
            let x = egui::lerp(rect.left() + 6.0..=rect.right() - 6.0, part);
            let mark = egui::Rect::from_center_size(egui::pos2(x, rect.top() - 1.0), Vec2::new(5.0, 6.0));
            ui.painter().rect_filled(mark, 1.0, colour);
            ui.interact(mark, ui.scope_id().with(("event", i)), Sense::hover())
                .on_hover_text(format!("{:.2} s, {}: {}", event.t, event.kind, event.text));
        }
    }
}

/// A small button with a sign on it and a name.
fn named(ui: &mut Ui, sign: &str, name: &str) -> bool {
    let response = ui.add(Button::new(sign).min_size(Vec2::splat(24.0))).on_hover_text(name);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    response.clicked()
}

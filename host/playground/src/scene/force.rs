//! What pushes the barrel: arrows for what comes from elsewhere, a line to the mouse for the hand.

use super::barrel::Placed;
use super::canvas::Canvas;
use super::hand::Pull;
use super::paint::{Paint, Palette};
use eframe::egui::{FontId, Painter, Pos2, Rect, Vec2, vec2};
use hil_sim::plant::Load;
use nalgebra::Vector3;

/// Pushes below this part of weight, or weight times radius, are not drawn.
const LEAST: f32 = 1e-3;
/// Size of the head of an arrow, points.
const HEAD: f32 = 13.0;

/// A number that stands beside a place in the window, in this direction from it.
pub(super) type Label = (Beside, String);

/// A place in the window and a direction, unit.
pub(super) type Beside = (Pos2, Vec2);

/// Draws a load as arrows: a force on the middle, a torque around the cylinder axis.
pub(super) fn arrows(canvas: &mut Canvas, palette: &Palette, barrel: &Placed, load: &Load) -> Vec<Label> {
    let (weight, radius) = (barrel.shape.weight, barrel.shape.radius);
    let mut labels = Vec::new();
    let force = Vector3::from(load.force_world).cast::<f32>();
    let size = force.norm();
    if size > LEAST * weight {
        let length = radius * (1.1 + 0.8 * (size / weight).min(1.5));
        let points = [0.0, 1.0].map(|part| barrel.middle + force / size * (length * part));
        labels.extend(arrow(canvas, palette.force, &points).map(|at| (at, number(size, "N"))));
    }
    let torque = load.axis_torque as f32 + barrel.axis().dot(&Vector3::from(load.torque_world).cast::<f32>());
    labels.extend(turn(canvas, palette, barrel, torque).map(|at| (at, number(torque.abs(), "N·m"))));
    labels
}

/// Draws a torque about the cylinder axis as an arrow around the shell, if it is large enough to be seen; where it ends.
pub(super) fn turn(canvas: &mut Canvas, palette: &Palette, barrel: &Placed, torque: f32) -> Option<Beside> {
    let (weight, radius) = (barrel.shape.weight, barrel.shape.radius);
    let part = torque.abs() / (weight * radius);
    if part <= LEAST {
        return None;
    }
    let sweep = 0.5 + 2.6 * part.min(1.0);
    // About Y a positive turn goes from Z to X, against the angle from X to Z; the arrow's middle is on the side that is seen.
    let to_eye = barrel.in_body(canvas.lens.eye);
    let towards = f32::atan2(to_eye.z, to_eye.x);
    let points: Vec<Vector3<f32>> = (0..=36)
        .map(|i| towards - torque.signum() * sweep * (i as f32 / 36.0 - 0.5))
        .map(|angle| barrel.middle + barrel.outward(angle) * (1.12 * radius))
        .collect();
    arrow(canvas, palette.force, &points)
}

/// A line with a head at its last point; where that is in the window.
fn arrow(canvas: &mut Canvas, paint: Paint, points: &[Vector3<f32>]) -> Option<Beside> {
    let [.., before, last] = points else { return None };
    let tip = canvas.lens.project(*last)?;
    let from = canvas.lens.project(*before)?;
    canvas.stroke(points.iter().map(|&point| (point, paint)), 3.5);
    let along = (tip - from).normalized();
    let across = vec2(-along.y, along.x) * (0.5 * HEAD);
    let point = tip + along * HEAD;
    canvas.flat([tip + across, point, tip - across, tip + along].map(|corner| (corner, paint)));
    Some((point, along))
}

/// Draws what a hand does: a dot where it holds, a line to the mouse, and how hard.
pub(super) fn hand(painter: &Painter, palette: &Palette, holds: Option<Pos2>, mouse: Pos2, pull: &Pull) {
    let color = palette.force.color();
    if let Some(holds) = holds {
        painter.line_segment([holds, mouse], (2.5, color));
        painter.circle(holds, 5.0, color, (1.5, palette.plate.color()));
    }
    painter.circle_stroke(mouse, 7.0, (2.0, color));
    let unit = if pull.twists { "N·m" } else { "N" };
    label(painter, palette, &((mouse, vec2(0.8, -0.6)), number(pull.size, unit)));
}

/// Writes a number on a plate, within the window.
pub(super) fn label(painter: &Painter, palette: &Palette, ((at, along), text): &Label) {
    let galley = painter.layout_no_wrap(text.clone(), FontId::proportional(14.0), palette.force.color());
    let size = galley.size() + vec2(12.0, 6.0);
    let window = painter.clip_rect().shrink(4.0);
    let far = 0.5 * (size.x * along.x.abs() + size.y * along.y.abs()) + 8.0;
    let low = window.min.max((*at + *along * far - 0.5 * size).min(window.max - size));
    painter.rect_filled(Rect::from_min_size(low, size), 5.0, palette.plate.color());
    painter.galley(low + vec2(6.0, 3.0), galley, palette.force.color());
}

/// A number with about three digits.
fn number(value: f32, unit: &str) -> String {
    let digits = if value < 1.0 { 3 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
}

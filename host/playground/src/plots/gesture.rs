//! What mouse and keys do on a plot.

use crate::keys;
use eframe::egui::{EventFilter, Key, Modifiers, PointerButton, Pos2, Rect, Response, Ui};
use egui_plot::PlotTransform;

/// What was asked for in a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Gesture {
    /// Time under the pointer, s.
    pub(super) hover: Option<f64>,
    /// A time was clicked, s.
    pub(super) click: Option<f64>,
    /// Back to the newest row.
    pub(super) live: bool,
    /// All there is.
    pub(super) all: bool,
    /// What is in sight moves by a time, s.
    pub(super) pan: f64,
    /// So many times less is in sight, around a time, s.
    pub(super) zoom: Option<(f64, f64)>,
    /// A box was drawn: from when to when, s.
    pub(super) boxed: Option<[f64; 2]>,
    /// And from which height to which, unless it is flat.
    pub(super) boxed_heights: Option<[f64; 2]>,
    /// The cursor moves by so many steps of a hundredth of what is in sight.
    pub(super) steps: f64,
}

/// A box that is lower than this takes the whole height, points.
const FLAT: f32 = 12.0;
/// Points of the wheel in which the zoom grows by e.
const WHEEL: f64 = 250.0;

/// The box between two corners, as high as the frame if it is flat.
pub(super) fn area(corner: Pos2, pointer: Pos2, frame: Rect) -> Rect {
    let area = Rect::from_two_pos(corner, pointer).intersect(frame);
    if area.height() < FLAT { Rect::from_x_y_ranges(area.x_range(), frame.y_range()) } else { area }
}

/// Reads them; `corner` is where the box began that is being drawn, `fits` whether all plots can be seen at once.
pub(super) fn of(
    ui: &Ui,
    response: &Response,
    transform: &PlotTransform,
    corner: &mut Option<Pos2>,
    fits: bool,
) -> Gesture {
    let frame = *transform.frame();
    let time = |at: Pos2| transform.value_from_position(at).x;
    let [from, to] = [transform.bounds().min()[0], transform.bounds().max()[0]];
    let mut gesture = Gesture { hover: response.hover_pos().map(time), ..Gesture::default() };
    gesture.live = response.double_clicked();
    if response.clicked_by(PointerButton::Primary) && !gesture.live {
        gesture.click = response.interact_pointer_pos().map(time);
    }
    if response.dragged_by(PointerButton::Primary) {
        gesture.pan = -f64::from(response.drag_delta().x) * (to - from) / f64::from(frame.width().max(1.0));
    }
    if response.drag_started_by(PointerButton::Secondary) {
        *corner = ui.input(|input| input.pointer.press_origin());
    }
    if response.drag_stopped()
        && let (Some(start), Some(end)) = (corner.take(), response.interact_pointer_pos())
    {
        let area = area(start, end, frame);
        if area.width() > 3.0 {
            gesture.boxed = Some([time(area.left_top()), time(area.right_top())]);
            let height = |at: Pos2| transform.value_from_position(at).y;
            gesture.boxed_heights =
                (area.height() < frame.height()).then(|| [height(area.left_bottom()), height(area.left_top())]);
        }
    }
    if response.contains_pointer() {
        wheel(ui, &mut gesture, to - from, frame.width(), fits);
    }
    if response.has_focus() {
        keys::leave_space(&response.ctx);
        keys::hold_zoom(&response.ctx);
        keys(ui, response, &mut gesture, [from, to]);
    }
    gesture
}

/// The wheel zooms, sideways it pans. What it did here it does not do to what the plot is in; where there are more plots than can
/// be seen at once, it is left to them, and with Ctrl it zooms.
fn wheel(ui: &Ui, gesture: &mut Gesture, length: f64, width: f32, fits: bool) {
    let (mut scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta, input.zoom_delta()));
    if !fits {
        scroll.y = 0.0;
    }
    let factor = f64::from(pinch) * (f64::from(scroll.y) / WHEEL).exp();
    if let Some(at) = gesture.hover
        && factor != 1.0
    {
        gesture.zoom = Some((factor, at));
    }
    gesture.pan -= f64::from(scroll.x) * length / f64::from(width.max(1.0));
    if scroll.x != 0.0 || scroll.y != 0.0 {
        ui.input_mut(|input| input.smooth_scroll_delta = Default::default());
    }
}

fn keys(ui: &Ui, response: &Response, gesture: &mut Gesture, [from, to]: [f64; 2]) {
    let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let presses = |key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key)) as f64;
    gesture.steps = presses(Key::ArrowRight) - presses(Key::ArrowLeft);
    gesture.pan += (presses(Key::PageDown) - presses(Key::PageUp)) * (to - from) / 2.0;
    let zoom = presses(Key::Plus) + presses(Key::Equals) - presses(Key::Minus);
    if zoom != 0.0 {
        gesture.zoom = Some((1.5_f64.powf(zoom), (from + to) / 2.0));
    }
    gesture.live |= presses(Key::End) > 0.0;
    gesture.all = presses(Key::Home) > 0.0;
}

//! The scene: the barrel in three dimensions, on a floor, seen by a camera that the mouse moves; the mouse takes hold of the
//! barrel too.
//!
//! Everything is transformed, lit and sorted here and drawn as one mesh of egui, so it needs no graphics code of its own and
//! looks the same wherever egui runs.

mod barrel;
mod canvas;
mod floor;
mod force;
mod hand;
mod lens;
mod paint;
mod pose;
mod view;

pub use pose::{Pose, Shape};
pub use view::{Mode, View};

use barrel::Placed;
use canvas::Canvas;
use eframe::egui::accesskit::Role;
use eframe::egui::{Align2, CursorIcon, EventFilter, FontId, Key, Modifiers, PointerButton, Pos2, Rect, Sense};
use eframe::egui::{Frame, Painter, Response, Stroke, StrokeKind, Ui, UiBuilder, WidgetInfo, pos2, vec2};
use floor::Floor;
use hand::{Hand, Pull};
use hil_sim::plant::Load;
use lens::Lens;
use nalgebra::Vector3;
use paint::Palette;

/// Turn of the camera for a point of the mouse and for a key, rad.
const DRAG_TURN: f32 = 0.008;
const KEY_TURN: f32 = 0.07;
/// Zoom for a point of the wheel, and for a key.
const WHEEL_ZOOM: f32 = 0.0025;
const KEY_ZOOM: f32 = 1.12;
/// Shift of the scene for a key, points.
const KEY_PAN: f32 = 30.0;
/// After a hand let go its push may still be in the frames for this time, s; it is not drawn as a kick.
const ECHO: f32 = 0.3;

/// What is shown.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// How large the barrel is.
    pub shape: &'a Shape,
    /// Where it is; `None` draws the floor alone.
    pub pose: Option<&'a Pose>,
    /// Where its middle has been over the ground, world X and Y, m, the newest point last. Points that are not finite are left
    /// out.
    pub trail: &'a [[f32; 2]],
    /// Whether the mouse may pull the barrel.
    pub grabbable: bool,
    /// Whether the barrel is not heard of any more: it is drawn grey.
    pub stale: bool,
    /// Whether nothing is shown but floor and barrel, as for a film: no buttons, no words.
    pub bare: bool,
}

/// What came of showing it.
#[derive(Debug)]
pub struct Output {
    /// The whole scene; its `rect` is where it was drawn.
    pub response: Response,
    /// What the hand on the barrel does; `None` if there is no hand.
    pub load: Option<Load>,
}

/// Shows the scene in all the space that is left, and lets mouse and keys move the camera and pull the barrel.
///
/// Dragging beside the barrel orbits, with the right or middle button it pans, the wheel zooms, a double click resets. Dragging
/// the barrel pulls it, with Shift it twists it. With the focus, arrows orbit, with Shift they pan, Page Up and Down zoom, Home
/// resets.
pub fn show(ui: &mut Ui, view: &mut View, scene: &Scene) -> Output {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    let rect = response.rect;
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), "Scene"));
    let dt = ui.input(|input| input.stable_dt).clamp(0.0, 0.1);
    let pose = scene.pose.filter(|pose| pose.is_finite());

    let radius = scene.shape.radius.max(1e-3);
    let barrel = pose.map_or([0.0, 0.0, radius], |pose| pose.position).map(f64::from);
    let origin = [barrel[0], barrel[1]];
    let middle = Vector3::new(0.0, 0.0, barrel[2] as f32);
    if view.advance(barrel, radius, dt) {
        ui.ctx().request_repaint();
    }
    let before = view.lens(rect, origin);
    let hovered = pose.filter(|_| scene.grabbable).is_some_and(|pose| {
        let over = response.hover_pos();
        over.is_some_and(|at| hand::hit(scene.shape, pose, middle, before.eye, before.ray(at)).is_some())
    });
    let pull = grip(ui, view, scene, pose, middle, &before, &response, dt);
    steer(ui, view, &before, &response, hovered);

    let lens = view.lens(rect, origin);
    let floor = Floor { origin, middle: lens.target().xy(), distance: lens.distance };
    let palette = Palette::of(ui.visuals());
    let painter = ui.painter_at(rect);
    // What comes from elsewhere is drawn as it is told; the hand's own push is told too, later.
    view.let_go = if pull.is_some() { 0.0 } else { (view.let_go + dt).min(1e3) };
    let told = pose.map(|pose| pose.load).filter(|_| view.let_go > ECHO).unwrap_or_default();
    let load = match &pull {
        Some((pull, _)) if pull.twists => pull.load,
        _ => told,
    };
    let pixel = 1.0 / ui.pixels_per_point();
    let mut canvas = Canvas::new(lens, pixel);
    let labels = draw(&mut canvas, &palette, &floor, rect, view, &Scene { pose, ..*scene }, middle, &load);
    painter.add(canvas.finish());
    if let Some((pull, mouse)) = &pull {
        force::hand(&painter, &palette, lens.project(pull.point), *mouse, pull);
        ui.ctx().request_repaint();
    } else {
        labels.iter().for_each(|label| force::label(&painter, &palette, label));
    }
    if !scene.bare {
        scale(&painter, ui, rect, floor.cell());
    }
    if (hovered || pull.is_some()) && !scene.bare {
        let icon = if pull.is_some() { CursorIcon::Grabbing } else { CursorIcon::Grab };
        ui.ctx().set_cursor_icon(icon);
        let text = if view.twist { "drag: twist" } else { "drag: pull · Shift: twist" };
        let at = rect.right_bottom() - vec2(10.0, 8.0);
        painter.text(at, Align2::RIGHT_BOTTOM, text, FontId::proportional(12.0), ui.visuals().weak_text_color());
    }
    if response.has_focus() && !scene.bare {
        let stroke = Stroke::new(1.5, ui.visuals().selection.stroke.color.gamma_multiply(0.7));
        painter.rect_stroke(rect, 0.0, stroke, StrokeKind::Inside);
    }
    if !scene.bare {
        buttons(ui, view, rect);
    }
    Output { response, load: pull.map(|(pull, _)| pull.load) }
}

/// Takes hold of the barrel, pulls it, or lets go: what the hand does, and where the mouse is.
#[expect(clippy::too_many_arguments)]
fn grip(
    ui: &Ui,
    view: &mut View,
    scene: &Scene,
    pose: Option<&Pose>,
    middle: Vector3<f32>,
    lens: &Lens,
    response: &Response,
    dt: f32,
) -> Option<(Pull, Pos2)> {
    let (pressed, down, shift, escape, focused) = ui.input(|input| {
        let pointer = &input.pointer;
        let escape = input.key_pressed(Key::Escape);
        (pointer.primary_pressed(), pointer.primary_down(), input.modifiers.shift, escape, input.focused)
    });
    let held = pose.filter(|_| scene.grabbable && down && !escape && focused && response.is_pointer_button_down_on());
    let (Some(pose), Some(at)) = (held, response.interact_pointer_pos()) else {
        view.hand = None;
        return None;
    };
    if pressed {
        view.hand = Hand::take(scene.shape, pose, middle, lens, at, view.twist || shift);
    }
    let pull = view.hand.as_mut()?.pull(scene.shape, pose, middle, lens, at, dt);
    Some((pull, at))
}

/// Moves the camera as mouse and keys say.
fn steer(ui: &Ui, view: &mut View, lens: &Lens, response: &Response, on_barrel: bool) {
    let drag = response.drag_delta();
    if response.dragged_by(PointerButton::Secondary) || response.dragged_by(PointerButton::Middle) {
        view.pan(drag, lens);
    } else if response.dragged_by(PointerButton::Primary) && view.hand.is_none() {
        view.orbit(-drag.x * DRAG_TURN, drag.y * DRAG_TURN);
    }
    if response.double_clicked() && !on_barrel {
        view.reset();
    }
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    if response.contains_pointer() {
        let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
        if wheel != 0.0 || pinch != 1.0 {
            view.zoom((-wheel * WHEEL_ZOOM).exp() / pinch.max(0.01));
        }
    }
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let presses =
            |modifiers: Modifiers, key: Key| ui.input_mut(|input| input.count_and_consume_key(modifiers, key)) as f32;
        let arrows = |modifiers: Modifiers| {
            let [left, right, up, down] =
                [Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown].map(|key| presses(modifiers, key));
            vec2(right - left, down - up)
        };
        // With Shift first: a key without modifiers matches with Shift, too.
        let shifted = arrows(Modifiers::SHIFT);
        if shifted != vec2(0.0, 0.0) {
            view.pan(shifted * KEY_PAN, lens);
        }
        let turned = arrows(Modifiers::NONE) * KEY_TURN;
        if turned != vec2(0.0, 0.0) {
            view.orbit(turned.x, -turned.y);
        }
        let zoomed = presses(Modifiers::NONE, Key::PageDown) - presses(Modifiers::NONE, Key::PageUp);
        if zoomed != 0.0 {
            view.zoom(KEY_ZOOM.powf(zoomed));
        }
        if presses(Modifiers::NONE, Key::Home) > 0.0 {
            view.reset();
        }
    }
}

/// Draws floor and barrel; what is to be written.
#[expect(clippy::too_many_arguments)]
fn draw(
    canvas: &mut Canvas,
    palette: &Palette,
    floor: &Floor,
    rect: Rect,
    view: &View,
    scene: &Scene,
    middle: Vector3<f32>,
    load: &Load,
) -> Vec<force::Label> {
    floor.ground(canvas, palette, [rect.min, rect.max]);
    floor.grid(canvas, palette);
    canvas.grey(scene.stale);
    floor.trail(canvas, palette, scene.trail, scene.shape.radius);
    let Some(pose) = scene.pose else { return Vec::new() };
    let barrel = Placed::new(scene.shape, pose, middle);
    floor.shadow(canvas, palette, &barrel);
    floor.contact(canvas, palette, &barrel);
    barrel.draw(canvas, palette, view.targets);
    force::arrows(canvas, palette, &barrel, load)
}

/// Says how long the sides of the grid's cells are.
fn scale(painter: &Painter, ui: &Ui, rect: Rect, cell: f32) {
    let text = if cell < 0.009 {
        format!("grid {:.0} mm", cell * 1e3)
    } else if cell < 0.9 {
        format!("grid {:.0} cm", cell * 1e2)
    } else {
        format!("grid {cell:.0} m")
    };
    let at = rect.left_bottom() + vec2(10.0, -8.0);
    painter.text(at, Align2::LEFT_BOTTOM, text, FontId::proportional(12.0), ui.visuals().weak_text_color());
}

/// The row of buttons at the top right.
fn buttons(ui: &mut Ui, view: &mut View, rect: Rect) {
    let width = view.bar_width.min(rect.width() - 16.0);
    let place = Rect::from_min_max(pos2(rect.right() - 8.0 - width, rect.top() + 8.0), rect.max);
    let mut child = ui.new_child(UiBuilder::new().max_rect(place));
    child.set_clip_rect(rect.intersect(ui.clip_rect()));
    let plate = Palette::of(ui.visuals()).plate.color();
    let frame = Frame::new().fill(plate).corner_radius(7).inner_margin(3);
    // A row, as high as its buttons, whatever space there is.
    let row = |ui: &mut Ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for (mode, name, help) in [
            (Mode::Orbit, "Orbit", "The camera stands and looks at one point"),
            (Mode::Follow, "Follow", "The camera goes with the barrel"),
            (Mode::Fixed, "Fixed", "The camera stands and turns to look at the barrel"),
        ] {
            ui.selectable_value(&mut view.mode, mode, name).on_hover_text(help);
        }
        ui.separator();
        if ui.selectable_label(false, "Reset").on_hover_text("Back to the first view (double click)").clicked() {
            view.reset();
        }
        ui.separator();
        ui.toggle_value(&mut view.twist, "Twist")
            .on_hover_text("The mouse twists the barrel (Shift) instead of pulling it");
        ui.toggle_value(&mut view.targets, "Targets").on_hover_text("Rings where the servo wants the weights");
    };
    let bar = frame.show(&mut child, |ui| ui.horizontal(row));
    let width = bar.response.rect.width();
    if (width - view.bar_width).abs() > 0.5 {
        view.bar_width = width;
        ui.ctx().request_discard("the row of buttons found its width");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::epaint::Mesh;
    use eframe::egui::{Event, Theme, Visuals};
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;
    use hil_sim::plant::Body;

    const UPRIGHT: [f32; 4] = [core::f32::consts::FRAC_1_SQRT_2, core::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0];

    fn lying(shape: &Shape) -> Pose {
        Pose {
            position: [0.0, 0.0, shape.radius],
            orientation: [1.0, 0.0, 0.0, 0.0],
            weights: [0.0; 2],
            targets: Some([shape.range, -shape.range]),
            load: Load { axis_torque: 5.0, force_world: [10.0, 0.0, 5.0], torque_world: [0.0; 3] },
        }
    }

    /// The scene's mesh as `show` draws it, in a window of 800 × 600 points.
    fn mesh(view: &View, shape: &Shape, pose: &Pose) -> Mesh {
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0));
        let mut view = view.clone();
        let at = pose.position.map(f64::from);
        view.advance(at, shape.radius, 0.02);
        let origin = [at[0], at[1]];
        let lens = view.lens(rect, origin);
        let floor = Floor { origin, middle: lens.target().xy(), distance: lens.distance };
        let trail: Vec<[f32; 2]> =
            (0..5000).map(|i| [pose.position[0] - 0.1 * i as f32, (0.1 * i as f32).sin()]).collect();
        let scene = Scene { shape, pose: Some(pose), trail: &trail, grabbable: true, stale: false, bare: false };
        let mut canvas = Canvas::new(lens, 1.0);
        let middle = Vector3::new(0.0, 0.0, pose.position[2]);
        draw(&mut canvas, &Palette::of(&Visuals::dark()), &floor, rect, &view, &scene, middle, &pose.load);
        canvas.finish()
    }

    fn shapes() -> [Shape; 4] {
        let [chapter, tabletop] = [Body::chapter(), Body::tabletop()].map(|body| Shape::from(&body));
        let tiny =
            Shape { radius: 0.01, length: 0.01, range: 0.001, axes_shift: 0.0, weight_radius: 0.0, weight: 0.001 };
        let disc = Shape { radius: 10.0, length: 0.01, range: 5.0, axes_shift: 0.01, weight_radius: 10.0, weight: 1e5 };
        [chapter, tabletop, tiny, disc]
    }

    #[test]
    fn the_mesh_is_finite_and_bounded_for_every_barrel_place_and_camera() {
        for shape in shapes() {
            let lies = lying(&shape);
            let stands = Pose { position: [0.0, 0.0, 0.5 * shape.length], orientation: UPRIGHT, ..lies };
            let far = Pose { position: [10_000.0, -20_000.0, shape.radius], ..lies };
            for pose in [lies, stands, far] {
                for distance in [0.3, 1.0, 6.5, 50.0] {
                    for (azimuth, elevation) in [(-1.1, 0.36), (1.571, 0.0), (0.0, 1.55), (-1.571, 0.0)] {
                        let mut view = View::default();
                        (view.distance, view.azimuth, view.elevation) = (distance, azimuth, elevation);
                        let mesh = mesh(&view, &shape, &pose);
                        assert!(mesh.is_valid());
                        assert!(mesh.vertices.iter().all(|vertex| vertex.pos.is_finite()));
                        assert!(mesh.vertices.len() < 20_000, "{}", mesh.vertices.len());
                        assert!(mesh.vertices.len() > 1000, "{}", mesh.vertices.len());
                    }
                }
            }
        }
    }

    #[test]
    fn ten_kilometres_away_the_barrel_looks_the_same() {
        let shape = shapes()[0];
        let here = lying(&shape);
        // Whole hundreds of metres: the grid is the same, too.
        let there = Pose { position: [10_000.0, -300.0, shape.radius], ..here };
        let [here, there] = [here, there].map(|pose| mesh(&View::default(), &shape, &pose));
        // The trail begins elsewhere, so that only what comes after it is compared, from the end.
        let pairs = here.vertices.iter().rev().zip(there.vertices.iter().rev()).take(5000);
        for (a, b) in pairs {
            assert!((a.pos - b.pos).length() < 0.05, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_load_that_is_not_finite_and_a_lost_pose_leave_the_floor() {
        let shape = shapes()[0];
        let broken = Pose { position: [f32::NAN; 3], ..lying(&shape) };
        let mut view = View::default();
        let mut harness = Harness::new_ui(move |ui| {
            for pose in [Some(&broken), None] {
                let scene =
                    Scene { shape: &shape, pose, trail: &[[f32::NAN; 2]], grabbable: true, stale: true, bare: false };
                assert_eq!(show(ui, &mut view, &scene).load, None);
            }
        });
        harness.run_steps(2);
    }

    struct Held {
        view: View,
        load: Option<Load>,
        grabbable: bool,
    }

    fn window(theme: Theme, grabbable: bool) -> Harness<'static, Held> {
        let shape = shapes()[0];
        let pose = Pose { load: Load::default(), ..lying(&shape) };
        let app = move |ui: &mut Ui, held: &mut Held| {
            ui.set_width(800.0);
            ui.set_height(600.0);
            let grabbable = held.grabbable;
            let scene = Scene { shape: &shape, pose: Some(&pose), trail: &[], grabbable, stale: false, bare: false };
            held.load = show(ui, &mut held.view, &scene).load;
        };
        let state = Held { view: View::default(), load: None, grabbable };
        let mut harness = Harness::builder().with_size(vec2(800.0, 600.0)).with_theme(theme).build_ui_state(app, state);
        harness.run_steps(3);
        harness
    }

    fn middle(harness: &Harness<Held>) -> Pos2 {
        harness.get_by_label("Scene").rect().center()
    }

    #[test]
    fn a_hand_pulls_while_the_button_is_down_on_the_barrel_and_no_longer() {
        for theme in [Theme::Dark, Theme::Light] {
            let mut harness = window(theme, true);
            let at = middle(&harness);
            harness.hover_at(at);
            harness.step();
            assert_eq!(harness.state().load, None);
            harness.drag_at(at);
            harness.step();
            assert!(harness.state().load.is_some());
            harness.hover_at(at + vec2(150.0, 0.0));
            harness.run_steps(60);
            let load = harness.state().load.expect("the button is down");
            assert!(load.force_world[0] > 10.0, "{load:?}");
            assert_eq!(harness.state().view.azimuth, View::default().azimuth);
            harness.drop_at(at + vec2(150.0, 0.0));
            harness.step();
            assert_eq!(harness.state().load, None);
        }
    }

    #[test]
    fn a_barrel_that_cannot_be_grabbed_and_the_floor_orbit() {
        for (grabbable, beside) in [(false, vec2(0.0, 0.0)), (true, vec2(-330.0, 220.0))] {
            let mut harness = window(Theme::Dark, grabbable);
            let at = middle(&harness) + beside;
            harness.hover_at(at);
            harness.step();
            harness.drag_at(at);
            harness.step();
            harness.hover_at(at + vec2(50.0, 0.0));
            harness.run_steps(3);
            assert_eq!(harness.state().load, None);
            let turned = harness.state().view.azimuth - View::default().azimuth;
            assert!(turned.rem_euclid(core::f32::consts::TAU) > 5.0, "{turned}");
        }
    }

    #[test]
    fn the_buttons_switch_the_camera_and_the_keys_turn_it() {
        let mut harness = window(Theme::Dark, true);
        for (name, mode) in [("Orbit", Mode::Orbit), ("Fixed", Mode::Fixed), ("Follow", Mode::Follow)] {
            harness.get_by_label(name).click();
            harness.run_steps(2);
            assert_eq!(harness.state().view.mode, mode);
        }
        harness.get_by_label("Twist").click();
        harness.run_steps(2);
        assert!(harness.state().view.twist);
        harness.get_by_label("Scene").focus();
        harness.run_steps(2);
        let before = harness.state().view.clone();
        for (key, modifiers) in [
            (Key::ArrowUp, Modifiers::NONE),
            (Key::ArrowRight, Modifiers::NONE),
            (Key::PageUp, Modifiers::NONE),
            (Key::ArrowLeft, Modifiers::SHIFT),
        ] {
            harness.event(Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
            harness.run_steps(2);
        }
        let after = &harness.state().view;
        assert!(after.elevation > before.elevation);
        assert!((after.azimuth - before.azimuth).abs() > 0.05);
        assert!(after.distance < before.distance);
        assert!(harness.get_by_label("Scene").is_focused());
        harness.get_by_label("Reset").click();
        harness.run_steps(2);
        assert_eq!(harness.state().view.distance, View::default().distance);
    }
}

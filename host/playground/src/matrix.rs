//! The two matrices of the brain as they stand: their numbers, the rotation in each of them, and what they do as a
//! loop.

use crate::channel::{Frame, Id};
use eframe::egui::{
    self, Align2, Color32, Pos2, Rangef, Rect, Response, RichText, Sense, Stroke, StrokeKind, TextStyle, Ui, Vec2,
};
use eframe::egui::{lerp, pos2, vec2};
use std::f32::consts::TAU;

/// A 2×2 matrix, by row.
type Matrix = [[f32; 2]; 2];

/// Where both matrices stand side by side, points.
const WIDE: f32 = 470.0;
/// Height of a cell, points.
const CELL: f32 = 30.0;
/// Width of the column of the row's names, points.
const NAMES: f32 = 24.0;
/// Side of a dial, points.
const DIAL: f32 = 86.0;
/// The unit circle's part of a dial's half side; longer arrows end at its edge.
const UNIT: f32 = 0.56;
/// Where a cell's colour is half as strong as it can be: C and A of a rolling barrel are around 1.
const HALF: f32 = 1.0;

/// Four numbers of a frame, by row.
fn matrix(frame: &Frame, [m11, m12, m21, m22]: [Id; 4]) -> Matrix {
    [[frame.get(m11), frame.get(m12)], [frame.get(m21), frame.get(m22)]]
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

/// A matrix taken apart: M = c U(φ) + rest, where U(φ) = [[cos φ, −sin φ], [sin φ, cos φ]] and the rest, a stretched
/// reflection, is as small as it can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// c: the length of the rotating part, not negative.
    pub length: f32,
    /// φ, rad, −π to π.
    pub angle: f32,
    /// Part of the matrix that is no rotation: ‖rest‖ / ‖M‖, Frobenius, 0 to 1.
    pub rest: f32,
    /// det M.
    pub determinant: f32,
}

impl Rotation {
    /// Of a matrix by row; `None` if a number of it is unknown.
    pub fn of([[m11, m12], [m21, m22]]: [[f32; 2]; 2]) -> Option<Self> {
        let (cosine, sine) = ((m11 + m22) / 2.0, (m21 - m12) / 2.0);
        let length = cosine.hypot(sine);
        // The reflecting part; it and the rotating one are orthogonal, and each has √2 of its length as its norm.
        let reflection = ((m11 - m22) / 2.0).hypot((m12 + m21) / 2.0);
        let whole = length.hypot(reflection);
        let rest = if whole > 0.0 { reflection / whole } else { 0.0 };
        let rotation = Rotation { length, angle: sine.atan2(cosine), rest, determinant: m11 * m22 - m12 * m21 };
        [length, rest, rotation.determinant].iter().all(|number| number.is_finite()).then_some(rotation)
    }
}

/// What a loop does in a step: its fastest growth in the long run and at once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gain {
    /// The largest magnitude of an eigenvalue.
    eigenvalue: f32,
    /// That eigenvalue's angle, rad; 0 to π.
    angle: f32,
    /// The larger singular value.
    singular: f32,
}

impl Gain {
    fn of(m: Matrix) -> Option<Self> {
        let Rotation { length, determinant, .. } = Rotation::of(m)?;
        let [[m11, m12], [m21, m22]] = m;
        let half = (m11 + m22) / 2.0;
        let discriminant = half * half - determinant;
        let (eigenvalue, angle) = if discriminant < 0.0 {
            (determinant.sqrt(), (-discriminant).sqrt().atan2(half))
        } else {
            (half.abs() + discriminant.sqrt(), if half < 0.0 { TAU / 2.0 } else { 0.0 })
        };
        let singular = length + ((m11 - m22) / 2.0).hypot((m12 + m21) / 2.0);
        Some(Gain { eigenvalue, angle, singular })
    }
}

/// One matrix with its bias, and what is said about them.
struct Block {
    heading: &'static str,
    help: &'static str,
    /// Names of its rows and columns, the bias last.
    rows: [&'static str; 2],
    columns: [&'static str; 3],
    matrix: [Id; 4],
    bias: [Id; 2],
}

const CONTROLLER: Block = Block {
    heading: "Controller C, h",
    help: "y = tanh(C x + h): what the inclinations do to the motors",
    rows: ["y1", "y2"],
    columns: ["x1", "x2", "h"],
    matrix: [Id::C11, Id::C12, Id::C21, Id::C22],
    bias: [Id::H1, Id::H2],
};

const MODEL: Block = Block {
    heading: "Self-model A, b",
    help: "x' = A y + b: what the robot believes that the motors do to the inclinations",
    rows: ["x1", "x2"],
    columns: ["y1", "y2", "b"],
    matrix: [Id::A11, Id::A12, Id::A21, Id::A22],
    bias: [Id::B1, Id::B2],
};

/// Shows C with h and A with b, the rotation in each, and the loop that they make. `None` is before the first row.
/// Needs 220 points of width; with 470 and more the two stand side by side.
pub fn show(ui: &mut Ui, frame: Option<&Frame>) {
    let unknown = Frame::at(0.0);
    let frame = frame.unwrap_or(&unknown);
    if ui.available_width() < WIDE {
        block(ui, frame, &CONTROLLER);
        ui.add_space(8.0);
        block(ui, frame, &MODEL);
    } else {
        ui.columns_const(|[left, right]| {
            block(left, frame, &CONTROLLER);
            block(right, frame, &MODEL);
        });
    }
    ui.add_space(8.0);
    feedback(ui, frame);
}

fn block(ui: &mut Ui, frame: &Frame, block: &Block) {
    ui.strong(block.heading).on_hover_text(block.help);
    let [m11, m12, m21, m22] = block.matrix;
    let [bias1, bias2] = block.bias;
    let width = ((ui.available_width() - NAMES) / 3.0).clamp(40.0, 92.0);
    let (rect, _) = ui.allocate_exact_size(vec2(NAMES + 3.0 * width, 16.0 + 2.0 * CELL), Sense::hover());
    let colour = ui.visuals().text_color();
    let mut small = TextStyle::Body.resolve(ui.style());
    small.size *= 0.85;
    let left = rect.left() + NAMES;
    for (column, name) in block.columns.into_iter().enumerate() {
        let middle = pos2(left + (column as f32 + 0.5) * width, rect.top() + 7.0);
        ui.painter().text(middle, Align2::CENTER_CENTER, name, small.clone(), colour);
    }
    for (row, ids) in [[m11, m12, bias1], [m21, m22, bias2]].into_iter().enumerate() {
        let top = rect.top() + 16.0 + row as f32 * CELL;
        let middle = pos2(rect.left() + NAMES / 2.0, top + CELL / 2.0);
        ui.painter().text(middle, Align2::CENTER_CENTER, block.rows[row], small.clone(), colour);
        for (column, id) in ids.into_iter().enumerate() {
            let place = Rect::from_min_size(pos2(left + column as f32 * width, top), vec2(width, CELL)).shrink(1.0);
            // The bias stands a little apart.
            let place = if column == 2 { place.with_min_x(place.left() + 5.0) } else { place };
            cell(ui, place, id, frame.get(id));
        }
    }
    ui.add_space(2.0);
    let rotation = Rotation::of(matrix(frame, block.matrix));
    ui.horizontal_top(|ui| {
        let name = block.heading.split([' ', ',']).find(|word| word.len() == 1).unwrap_or_default();
        dial(ui, name, rotation);
        let say = |number: Option<f32>, unit: &str| match number {
            Some(number) => format!("{number:.3}{unit}"),
            None => "–".into(),
        };
        let share = rotation.map_or("–".into(), |rotation| format!("{:.1} %", 100.0 * rotation.rest));
        egui::Grid::new(block.heading).num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
            fact(ui, "c", say(rotation.map(|r| r.length), ""), "length of the rotation in it: c U(φ)");
            fact(
                ui,
                "φ",
                say(rotation.map(|r| r.angle), " rad"),
                "angle of the rotation in it; positive turns x1 to x2",
            );
            fact(ui, "rest", share, "part of it that is no rotation (Frobenius norm)");
            fact(ui, "det", say(rotation.map(|r| r.determinant), ""), "its determinant; negative for a reflection");
        });
    });
}

fn fact(ui: &mut Ui, name: &str, value: String, help: &str) {
    ui.label(name).on_hover_text(help);
    ui.label(RichText::new(value).monospace().strong()).on_hover_text(help);
    ui.end_row();
}

/// A number on its colour: blue below 0, red above, stronger the larger it is.
fn cell(ui: &mut Ui, place: Rect, id: Id, number: f32) -> Response {
    let response = ui.interact(place, ui.scope_id().with(id), Sense::hover());
    let name = id.channel().name;
    let text = if number.is_nan() { "–".into() } else { format!("{number:.3}") };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Cell, true, format!("{name} = {text}")));
    let (fill, ink) = colours(number, ui.visuals().dark_mode);
    ui.painter().rect(place, 3.0, fill, ui.visuals().widgets.noninteractive.bg_stroke, StrokeKind::Inside);
    let mut font = TextStyle::Monospace.resolve(ui.style());
    if text.chars().count() > 7 {
        font.size *= 0.85;
    }
    ui.painter().text(place.center(), Align2::CENTER_CENTER, text, font, ink);
    response.on_hover_text(format!("{name}: {}", id.channel().help))
}

/// Background and text of a cell. The scale is the same for all cells, symmetric about 0, and has no end.
fn colours(number: f32, dark: bool) -> (Color32, Color32) {
    let neutral = if dark { Color32::from_gray(38) } else { Color32::from_gray(246) };
    let strongest = match (number >= 0.0, dark) {
        (true, true) => Color32::from_rgb(196, 72, 8),
        (false, true) => Color32::from_rgb(20, 108, 190),
        (true, false) => Color32::from_rgb(255, 138, 76),
        (false, false) => Color32::from_rgb(92, 172, 255),
    };
    let strength = if number.is_finite() { number.abs() / (number.abs() + HALF) } else { 0.0 };
    (neutral.lerp_to_gamma(strongest, strength), if dark { Color32::WHITE } else { Color32::BLACK })
}

/// A rotation as an arrow: its direction is φ, counted from the right and to the left, its length c; the circle is c
/// = 1.
fn dial(ui: &mut Ui, name: &str, rotation: Option<Rotation>) {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(DIAL), Sense::hover());
    let said = rotation.map_or("unknown".into(), |r| format!("length {:.3}, angle {:.3} rad", r.length, r.angle));
    let said = format!("rotation in {name}: {said}");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &said));
    let visuals = ui.visuals();
    let painter = ui.painter();
    let (centre, half) = (rect.center(), DIAL / 2.0 - 1.0);
    let unit = UNIT * half;
    let thin = |strength: f32| Stroke::new(1.0, visuals.weak_text_color().gamma_multiply(strength));
    painter.circle(centre, half, visuals.extreme_bg_color, visuals.widgets.noninteractive.bg_stroke);
    painter.hline(Rangef::new(centre.x - half, centre.x + half), centre.y, thin(0.4));
    painter.vline(centre.x, Rangef::new(centre.y - half, centre.y + half), thin(0.4));
    painter.circle_stroke(centre, unit, thin(0.8));
    if let Some(rotation) = rotation {
        let direction = vec2(rotation.angle.cos(), -rotation.angle.sin());
        let length = rotation.length * unit;
        let colour = visuals.selection.stroke.color;
        let arc = (0..=24).map(|part| lerp(0.0..=rotation.angle, part as f32 / 24.0));
        let arc: Vec<Pos2> = arc.map(|angle| centre + 0.4 * unit * vec2(angle.cos(), -angle.sin())).collect();
        painter.line(arc, Stroke::new(1.5, colour.gamma_multiply(0.7)));
        let tip = centre + direction * length.min(half);
        painter.arrow(centre, tip - centre, Stroke::new(2.0, colour));
        if length > half {
            // The tip is outside: a bar at the edge says so.
            let across = direction.rot90() * 7.0;
            painter.line_segment([tip - across, tip + across], Stroke::new(2.0, colour));
        }
    }
    response.on_hover_text(format!("{said}\nthe inner circle is length 1"));
}

/// The loop through controller and self-model: without saturation, R = A C, and as it stands, L = A G' C.
fn feedback(ui: &mut Ui, frame: &Frame) {
    let c = matrix(frame, CONTROLLER.matrix);
    let a = matrix(frame, MODEL.matrix);
    let slopes = [Id::Y1, Id::Y2].map(|y| 1.0 - frame.get(y) * frame.get(y));
    let saturated = [c[0].map(|number| slopes[0] * number), c[1].map(|number| slopes[1] * number)];
    ui.strong("Loop").on_hover_text("x' as a function of x, as the robot believes it to be, linearised");
    egui::Grid::new("loop").num_columns(4).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, help) in [
            ("", ""),
            ("|λ|", "largest magnitude of an eigenvalue: above 1 the loop grows"),
            ("arg λ", "angle of that eigenvalue, rad per control step"),
            ("σ", "larger singular value: the strongest growth in one step"),
        ] {
            ui.label(name).on_hover_text(help);
        }
        ui.end_row();
        for (name, loop_matrix, help) in [
            (
                "R = A C",
                product(a, c),
                "the loop at y = 0, where no motor is saturated; rest is unstable where |λ| > 1",
            ),
            ("L = A G' C", product(a, saturated), "the loop with the slopes G' = 1 − y² of the motors as they are"),
        ] {
            ui.label(name).on_hover_text(help);
            let gain = Gain::of(loop_matrix);
            for number in [gain.map(|g| g.eigenvalue), gain.map(|g| g.angle), gain.map(|g| g.singular)] {
                let text = number.map_or("–".into(), |number| format!("{number:.3}"));
                ui.label(RichText::new(text).monospace().strong()).on_hover_text(help);
            }
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable as _;

    fn turn(length: f32, angle: f32) -> Matrix {
        let (sine, cosine) = angle.sin_cos();
        [[length * cosine, -length * sine], [length * sine, length * cosine]]
    }

    fn near(a: f32, b: f32) -> bool {
        (a - b).abs() < 1e-5
    }

    #[test]
    fn a_rotation_is_found_whole() {
        for (length, angle) in [(1.0, 0.5), (1.3, -2.9), (0.2, 1.6), (7.0, 3.1)] {
            let rotation = Rotation::of(turn(length, angle)).expect("numbers");
            assert!(
                (rotation.length - length).abs() < 1e-5 * length && near(rotation.angle, angle) && rotation.rest < 1e-6
            );
            assert!((rotation.determinant - length * length).abs() < 1e-4);
        }
    }

    #[test]
    fn the_angle_is_that_of_the_closed_loop_experiment() {
        let experiment = hil_sim::experiment::Experiment::find("closed-loop").expect("it exists");
        let value = |id| experiment.preset.iter().find(|(other, _)| *other == id).map(|&(_, value)| value as f32);
        let (c1, c2) = (value(protocol::Id::Coupling1), value(protocol::Id::Coupling2));
        let (c1, c2) = (c1.expect("it is set"), c2.expect("it is set"));
        let rotation = Rotation::of([[c1, c2], [-c2, c1]]).expect("numbers");
        assert!(near(rotation.angle, 0.5) && near(rotation.length, 1.0));
    }

    #[test]
    fn the_rest_is_what_the_nearest_rotation_leaves() {
        let m: Matrix = [[1.2, -0.3], [0.9, 0.4]];
        let rotation = Rotation::of(m).expect("numbers");
        let distance = |length: f32, angle: f32| {
            let turn = turn(length, angle);
            let squares = (0..4).map(|at| (m[at / 2][at % 2] - turn[at / 2][at % 2]).powi(2));
            squares.sum::<f32>().sqrt()
        };
        let norm = m.iter().flatten().map(|number| number * number).sum::<f32>().sqrt();
        let least = distance(rotation.length, rotation.angle);
        assert!(near(least / norm, rotation.rest));
        for (length, angle) in [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)] {
            assert!(distance(rotation.length + length, rotation.angle + angle) > least);
        }
        assert!(
            near(Rotation::of([[1.0, 0.0], [0.0, -1.0]]).expect("numbers").rest, 1.0),
            "a reflection has no rotation"
        );
    }

    #[test]
    fn nothing_is_said_of_a_matrix_that_is_not_known() {
        assert_eq!(Rotation::of([[1.0, f32::NAN], [0.0, 1.0]]), None);
        assert_eq!(Gain::of([[f32::INFINITY, 0.0], [0.0, 1.0]]), None);
        assert_eq!(Rotation::of([[0.0; 2]; 2]).map(|rotation| (rotation.length, rotation.rest)), Some((0.0, 0.0)));
    }

    #[test]
    fn the_gain_of_a_loop_is_what_it_tends_to() {
        for m in [turn(1.1, 0.3), [[0.5, 0.2], [0.1, -0.9]], [[1.2, 0.7], [-0.1, 0.4]], [[-0.8, 0.0], [0.0, 0.3]]] {
            let gain = Gain::of(m).expect("numbers");
            // ‖Mⁿ‖^(1/n) tends to the largest magnitude of an eigenvalue.
            let (mut power, mut log) = ([[1.0, 0.0], [0.0, 1.0]], 0.0);
            for _ in 0..2000 {
                power = product(m, power);
                let norm = power.iter().flatten().map(|number: &f32| number * number).sum::<f32>().sqrt();
                power = power.map(|row| row.map(|number| number / norm));
                log += f64::from(norm.ln());
            }
            assert!(((log / 2000.0).exp() as f32 - gain.eigenvalue).abs() < 2e-3, "{m:?}: {gain:?}");
            assert!(gain.singular >= gain.eigenvalue - 1e-5);
        }
        assert!(near(Gain::of(turn(1.1, 0.3)).expect("numbers").angle, 0.3));
    }

    #[test]
    fn every_number_has_a_name_and_fits_the_narrowest_panel() {
        let mut frame = Frame::at(0.0);
        frame.set_all(Id::C11, &[1.0, -20.5, 0.25, -123.456]);
        for frame in [Some(frame), None] {
            let show = move |ui: &mut Ui| show(ui, frame.as_ref());
            let mut harness = Harness::builder().with_size([220.0, 600.0]).build_ui(show);
            harness.run();
            let cells = if frame.is_some() {
                ["C12 = -20.500", "h2 = –", "A21 = –"]
            } else {
                ["C12 = –", "h2 = –", "b2 = –"]
            };
            for cell in cells {
                let rect = harness.get_by_label(cell).rect();
                assert!(rect.left() >= 0.0 && rect.right() <= 220.0, "{cell}: {rect}");
            }
            harness.get_by_label_contains("rotation in C");
        }
    }

    #[test]
    fn numbers_are_readable_on_every_cell() {
        let light = |colour: Color32| {
            let [r, g, b, _] = egui::Rgba::from(colour).to_array();
            0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
        };
        for dark in [false, true] {
            for step in -200..=200 {
                let (fill, ink) = colours(step as f32 / 4.0, dark);
                let (a, b) = (light(fill), light(ink));
                assert!(a.max(b) / a.min(b) > 4.5, "{step} {dark}: {}", a.max(b) / a.min(b));
            }
        }
    }
}

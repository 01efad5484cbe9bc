use super::*;
use crate::channel::{Frame, Id};
use eframe::Storage;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use std::collections::HashMap;

/// What eframe keeps between windows, in memory.
#[derive(Default)]
struct Kept(HashMap<String, String>);

impl Storage for Kept {
    fn get_string(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.0.insert(key.into(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.0.remove(key);
    }

    fn flush(&mut self) {}
}

/// A session of so many seconds in which the brain is known and the load is not.
fn history(seconds: u32) -> History {
    let mut history = History::default();
    for row in 0..seconds * 50 {
        let t = f64::from(row) * 0.02;
        let mut frame = Frame::at(t);
        frame.set_all(Id::X1, &[t.sin() as f32, t.cos() as f32, 0.5, -0.5]);
        frame.set(Id::Omega, t as f32);
        history.push(&frame);
    }
    history
}

struct Scrubbed {
    plots: Plots,
    history: History,
    cursor: Option<f64>,
    output: PlotsOutput,
}

fn harness(plots: Plots, history: History) -> Harness<'static, Scrubbed> {
    let state = Scrubbed { plots, history, cursor: None, output: PlotsOutput::default() };
    let mut harness =
        Harness::builder().with_size([900.0, 700.0]).with_max_steps(60).with_step_dt(0.05).build_ui_state(
            |ui, state: &mut Scrubbed| {
                let output = show(ui, &mut state.plots, &state.history, state.cursor);
                state.cursor = if output.live { None } else { output.scrub.or(state.cursor) };
                if output != PlotsOutput::default() {
                    state.output = output;
                }
            },
            state,
        );
    harness.run();
    harness
}

fn channels(harness: &Harness<'_, Scrubbed>) -> Vec<Vec<Id>> {
    harness.state().plots.channels().map(<[Id]>::to_vec).collect()
}

fn one(channels: &[Id]) -> Plots {
    let mut plots = Plots::empty();
    plots.add(channels);
    plots
}

#[test]
fn a_layout_is_kept_by_the_names_of_its_channels() {
    let mut plots = Plots::default();
    plots.add(&[Id::Tilt, Id::Battery]);
    plots.panels[1].scale = Scale::Fixed { min: -1.0, max: 2.0 };
    plots.panels[2].height = Some(222.0);
    plots.view.set_length(Some(60.0));
    let mut kept = Kept::default();
    eframe::set_value(&mut kept, "plots", &plots);
    let text = &kept.0["plots"];
    assert!(text.contains("\"tilt\"") && text.contains("\"E_tle\""), "{text}");
    let back: Plots = eframe::get_value(&kept, "plots").expect("it can be read");
    assert!(back.channels().eq(plots.channels()));
    assert_eq!(back.panels[1].scale, plots.panels[1].scale);
    assert_eq!((back.panels[2].height, back.view), (Some(222.0), plots.view));
}

#[test]
fn a_layout_with_names_that_are_gone_loads_without_them() {
    let mut kept = Kept::default();
    kept.set_string("plots", r#"(panels:[(channels:["x1","flux","omega"],colour:"red"),(channels:["flux"])])"#.into());
    let back: Plots = eframe::get_value(&kept, "plots").expect("it can be read");
    let none: &[Id] = &[];
    assert!(back.channels().eq([&[Id::X1, Id::Omega][..], none]));
}

#[test]
fn a_channel_is_added_and_taken_out_in_the_tree() {
    let mut harness = harness(one(&[Id::X1]), history(10));
    harness.get_by_label("channels of x1").click();
    harness.run();
    let search = harness.get_by_role(egui::Role::TextInput);
    assert!(search.is_focused(), "what is typed goes into the search field");
    search.type_text("omega");
    harness.run();
    harness.get_by_label("omega").click();
    harness.run();
    assert_eq!(channels(&harness), [[Id::X1, Id::Omega]]);
    harness.get_by_label("omega").click();
    harness.run();
    assert_eq!(channels(&harness), [[Id::X1]]);
}

#[test]
fn what_the_history_does_not_know_is_grey_and_a_group_comes_by_one_click() {
    let mut harness = harness(one(&[Id::Omega]), history(10));
    harness.get_by_label("channels of omega (rad/s)").click();
    harness.run();
    assert!(harness.get_by_label("add all of Load").accesskit_node().is_disabled());
    assert!(harness.get_by_label("tilt").accesskit_node().is_disabled());
    harness.get_by_label("add all of Motors y").click();
    harness.run();
    assert_eq!(channels(&harness), [[Id::Omega, Id::Y1, Id::Y2]]);
}

#[test]
fn plots_are_made_filled_parted_and_closed() {
    let mut harness = harness(one(&[Id::X1, Id::X2]), history(10));
    harness.get_by_label("New plot").click();
    harness.run();
    harness.get_by_label("add all of Motors y").click();
    harness.run();
    assert_eq!(channels(&harness), [[Id::X1, Id::X2], [Id::Y1, Id::Y2]]);
    harness.key_press(egui::Key::Escape);
    harness.run();
    harness.get_by_label_contains("x2 ").click();
    harness.run();
    harness.get_by_label("Move x2 to a plot of its own").click();
    harness.run();
    assert_eq!(channels(&harness), [vec![Id::X1], vec![Id::X2], vec![Id::Y1, Id::Y2]]);
    harness.get_by_label("close x1").click();
    harness.run();
    assert_eq!(channels(&harness), [vec![Id::X2], vec![Id::Y1, Id::Y2]]);
    harness.get_by_label("Presets").click();
    harness.run();
    harness.get_by_label("Load").click();
    harness.run();
    assert_eq!(channels(&harness).len(), 4);
}

#[test]
fn a_click_scrubs_to_the_time_under_it_and_the_window_stands_still() {
    let mut harness = harness(one(&[Id::X1]), history(60));
    let plot = harness.get_by_label("Plot of x1").rect();
    harness.get_by_label("Plot of x1").click();
    harness.run();
    let (from, to) = harness.state().plots.window(&harness.state().history);
    let expected = (from + to) / 2.0;
    let scrub = harness.state().output.scrub.expect("it was clicked");
    assert!((scrub - expected).abs() < 2.0 * (to - from) / f64::from(plot.width()), "{scrub} for {expected}");
    assert!(!harness.state().plots.follows());
}

#[test]
fn keys_move_the_cursor_zoom_and_go_back_to_live() {
    let mut harness = harness(one(&[Id::X1]), history(60));
    harness.get_by_label("Plot of x1").focus();
    harness.run();
    harness.key_press(egui::Key::ArrowLeft);
    harness.run();
    let cursor = harness.state().cursor.expect("it moved");
    assert!((cursor - (59.98 - 0.3)).abs() < 1e-6, "{cursor}");
    let length = |harness: &Harness<'_, Scrubbed>| {
        let (from, to) = harness.state().plots.window(&harness.state().history);
        to - from
    };
    let before = length(&harness);
    harness.key_press(egui::Key::Plus);
    harness.run();
    assert!((length(&harness) - before / 1.5).abs() < 1e-6);
    harness.key_press(egui::Key::End);
    harness.run();
    assert!(harness.state().plots.follows() && harness.state().cursor.is_none());
    harness.key_press(egui::Key::Home);
    harness.run();
    assert!((length(&harness) - 59.98).abs() < 1e-6);
}

#[test]
fn the_wheel_zooms_and_a_drag_moves_in_time() {
    let mut harness = harness(one(&[Id::X1]), history(60));
    let centre = harness.get_by_label("Plot of x1").rect().center();
    let window = |harness: &Harness<'_, Scrubbed>| harness.state().plots.window(&harness.state().history);
    let (from, to) = window(&harness);
    harness.hover_at(centre);
    harness.run();
    harness.event(egui::Event::MouseWheel {
        source: egui::MouseWheelSource::Unknown,
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 100.0),
        phase: egui::TouchPhase::Move,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run();
    let (near, newest) = window(&harness);
    assert!(near > from && newest == to, "it follows the newest row and shows less");
    harness.drag_at(centre);
    harness.run();
    harness.hover_at(centre + egui::vec2(200.0, 0.0));
    harness.run();
    harness.drop_at(centre + egui::vec2(200.0, 0.0));
    harness.run();
    let (earlier, end) = window(&harness);
    assert!(earlier < near && (end - earlier - (newest - near)).abs() < 1e-6, "{earlier} to {end}");
    assert!(!harness.state().plots.follows());
}

#[test]
fn a_box_is_zoomed_into_and_a_double_click_takes_it_back() {
    let mut harness = harness(one(&[Id::X1]), history(60));
    let plot = harness.get_by_label("Plot of x1").rect();
    let (from, to) = harness.state().plots.window(&harness.state().history);
    let at = |x: f32, y: f32| plot.lerp_inside(egui::vec2(x, y));
    let button =
        |pos, button, pressed| egui::Event::PointerButton { pos, button, pressed, modifiers: egui::Modifiers::NONE };
    harness.hover_at(at(0.25, 0.25));
    harness.event(button(at(0.25, 0.25), egui::PointerButton::Secondary, true));
    harness.run();
    harness.hover_at(at(0.75, 0.5));
    harness.run();
    harness.event(button(at(0.75, 0.5), egui::PointerButton::Secondary, false));
    harness.run();
    let (left, right) = harness.state().plots.window(&harness.state().history);
    let pixel = (to - from) / f64::from(plot.width());
    assert!((left - (from + (to - from) / 4.0)).abs() < 3.0 * pixel, "{left}");
    assert!((right - (to - (to - from) / 4.0)).abs() < 3.0 * pixel, "{right}");
    let Scale::Fixed { min, max } = harness.state().plots.panels[0].scale else { panic!("the scale is not the box's") };
    assert!(min.abs() < 0.05 && max > 0.5 && max < 0.7, "{min} to {max}");
    for _ in 0..2 {
        for pressed in [true, false] {
            harness.event(button(at(0.5, 0.5), egui::PointerButton::Primary, pressed));
        }
    }
    harness.run();
    assert_eq!((harness.state().plots.panels[0].scale, harness.state().plots.follows()), (Scale::Auto, true));
}

#[test]
fn a_height_is_set_by_keys() {
    let mut plots = one(&[Id::X1]);
    plots.add(&[Id::X2]);
    let mut harness = harness(plots, history(10));
    let height = |harness: &Harness<'_, Scrubbed>| harness.get_by_label("Plot of x1").rect().height();
    let before = height(&harness);
    harness.get_by_label("height of x1").focus();
    harness.run();
    harness.key_press(egui::Key::ArrowUp);
    harness.run();
    assert!((height(&harness) - (before - 10.0)).abs() < 1.0, "{before} to {}", height(&harness));
}

#[test]
fn a_cursor_that_is_given_is_in_sight_and_when_it_goes_the_newest_row_is() {
    let mut harness = harness(one(&[Id::X1]), history(100));
    harness.state_mut().cursor = Some(12.0);
    harness.run();
    let (from, to) = harness.state().plots.window(&harness.state().history);
    assert!((from..to).contains(&12.0));
    harness.state_mut().cursor = None;
    harness.run();
    assert!(harness.state().plots.follows());
}

#[test]
fn the_legend_reads_the_values_at_the_cursor() {
    let mut harness = harness(one(&[Id::Omega]), history(60));
    let reads = |harness: &Harness<'_, Scrubbed>, text: &str| harness.query_by_label_contains(text).is_some();
    assert!(reads(&harness, "59.98"));
    harness.state_mut().cursor = Some(42.0);
    harness.run();
    assert!(reads(&harness, "42.00"));
}

#[test]
fn more_plots_than_fit_keep_their_least_height() {
    let mut plots = Plots::empty();
    for _ in 0..9 {
        plots.add(&[Id::X1]);
    }
    assert_eq!(share(&plots.panels, 600.0), LEAST);
    plots.panels.truncate(2);
    plots.panels[0].height = Some(200.0);
    assert_eq!(share(&plots.panels, 600.0), 400.0 - 2.0 * BETWEEN);
}

#[test]
fn an_empty_history_and_an_empty_stack_are_shown() {
    harness(Plots::default(), History::default()).get_by_label("Plot of x");
    harness(Plots::empty(), history(1)).get_by_label_contains("begin");
}
